//! Detection of channels that are copies or multiples of each other.

use super::quantisation::quantisation;
use super::{is_straight, range, runs};

/// Largest deviation from a multiple, relative to the range, whatever the resolution.
const FINE: f64 = 1e-5;
/// Minimum number of changes of value for agreement with a channel to be meaningful.
const FEWEST_CHANGES: usize = 10;
/// Minimum number of resolution steps within the range, for the same reason.
const FEWEST_LEVELS: f64 = 8.0;
/// Number of samples for a quick test of a pair.
const PROBES: usize = 64;
/// Maximum number of significant digits in a text that counts as rounded.
const MOST_DIGITS: i32 = 8;

/// Relation between two channels: `y = factor · x + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relation {
    /// Factor.
    pub factor: f64,
    /// Offset, in the unit of `y`.
    pub offset: f64,
    /// Whether all samples are bitwise identical.
    pub identical: bool,
}

/// Properties of a channel, computed before comparing it with others.
#[derive(Debug, Clone)]
pub struct Portrait<'a> {
    samples: &'a [f64],
    low: f64,
    high: f64,
    /// Indices of the lowest and the highest sample.
    ends: (usize, usize),
    /// Resolution; 0 if too fine to determine.
    step: f64,
    /// Number of significant digits of its values, if small.
    digits: Option<i32>,
    /// Whether it is a straight line over its index, such as a counter or time axis.
    is_straight: bool,
}

impl<'a> Portrait<'a> {
    /// Analyses a channel; `None` if it is unsuitable for comparison: fewer than ten changes of
    /// value, or non-finite samples.
    #[must_use]
    pub fn of(samples: &'a [f64]) -> Option<Self> {
        let (low, high) = range(samples)?;
        if !samples.iter().all(|x| x.is_finite()) || runs(samples).nth(FEWEST_CHANGES).is_none() {
            return None;
        }
        let place = |value: f64| samples.iter().position(|x| *x == value).unwrap_or(0);
        Some(Self {
            samples,
            low,
            high,
            ends: (place(low), place(high)),
            step: quantisation(samples).map_or(0.0, |q| q.step),
            digits: significant_digits(samples),
            is_straight: is_straight(samples),
        })
    }

    /// Largest rounding error of a value as written.
    fn rounding(&self, value: f64) -> f64 {
        let of_digits = self.digits.filter(|_| value != 0.0).map_or(0.0, |digits| {
            10_f64.powi(value.abs().log10().floor() as i32 + 1 - digits)
        });
        // Slightly over one half, as the line is fitted to rounded samples.
        0.51 * self.step.max(of_digits)
    }
}

/// How `y` follows from `x`, if it does: `|y − (a x + b)| ≤ δ_y + |a| δ_x` at every sample, `δ` being
/// half a step of each channel's resolution (or half a unit of its last written digit), or 10⁻⁵ of the
/// range of `y` if that is larger. `a` and `b` come from the extreme samples of `x` and are then fitted
/// by least squares.
///
/// Two unrelated channels agree by chance at one sample with a probability of at most 1/4 (with at
/// least 8 resolution steps in the range), so ten changes of value bring it to 10⁻⁶. Measured channels
/// of the same quantity differ by their noise and are not reported. Straight lines (time axes,
/// counters) are multiples of each other by nature, so only identical ones count.
///
/// ```
/// use torqcomp_dsp::quality::copies::{Portrait, relation};
/// let volts: Vec<f64> = (0..100).map(|i| f64::from(i * i % 97)).collect();
/// let torque: Vec<f64> = volts.iter().map(|v| -2.5 * v + 1.0).collect();
/// let found = relation(&Portrait::of(&volts).unwrap(), &Portrait::of(&torque).unwrap()).unwrap();
/// assert!((found.factor + 2.5).abs() < 1e-9 && (found.offset - 1.0).abs() < 1e-9);
/// assert!(!found.identical);
/// ```
#[must_use]
pub fn relation(x: &Portrait, y: &Portrait) -> Option<Relation> {
    if x.samples.len() != y.samples.len() {
        return None;
    }
    if x.samples == y.samples {
        return Some(Relation {
            factor: 1.0,
            offset: 0.0,
            identical: true,
        });
    }
    let levels = |p: &Portrait| (p.high - p.low) / p.step;
    if x.is_straight || y.is_straight || levels(x) < FEWEST_LEVELS || levels(y) < FEWEST_LEVELS {
        return None;
    }
    let (low, high) = x.ends;
    let factor = (y.samples[high] - y.samples[low]) / (x.high - x.low);
    let first = Relation {
        factor,
        offset: y.samples[low] - factor * x.low,
        identical: false,
    };
    // Two rounded samples determine the line to twice the rounding error of a sample.
    let stride = (x.samples.len() / PROBES).max(1);
    let near = agrees(x, y, &first, 3.0, stride);
    let fitted = near.then(|| fit(x.samples, y.samples))?;
    agrees(x, y, &fitted, 1.0, 1).then_some(fitted)
}

fn agrees(x: &Portrait, y: &Portrait, line: &Relation, times: f64, stride: usize) -> bool {
    let fine = FINE * (y.high - y.low);
    let pairs = x.samples.iter().zip(y.samples).step_by(stride);
    pairs.into_iter().all(|(&a, &b)| {
        let rounding = y.rounding(b) + line.factor.abs() * x.rounding(a);
        (b - line.factor * a - line.offset).abs() <= times * fine.max(rounding)
    })
}

/// Least-squares fit.
fn fit(x: &[f64], y: &[f64]) -> Relation {
    let count = x.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / count;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let (sum_xy, sum_xx) = x.iter().zip(y).fold((0.0, 0.0), |(xy, xx), (a, b)| {
        let a = a - mean_x;
        (xy + a * (b - mean_y), xx + a * a)
    });
    let factor = sum_xy / sum_xx;
    Relation {
        factor,
        offset: mean_y - factor * mean_x,
        identical: false,
    }
}

/// Number of significant digits needed by a sample of the values, if small.
fn significant_digits(samples: &[f64]) -> Option<i32> {
    let stride = (samples.len() / PROBES).max(1);
    let most = samples
        .iter()
        .step_by(stride)
        .map(|value| {
            let text = format!("{value:e}");
            let mantissa = text.split('e').next().unwrap_or_default();
            mantissa.bytes().filter(u8::is_ascii_digit).count() as i32
        })
        .max()?;
    (most <= MOST_DIGITS).then_some(most)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, rounded, sine, sum};
    use super::*;

    fn related(x: &[f64], y: &[f64]) -> Option<Relation> {
        relation(&Portrait::of(x)?, &Portrait::of(y)?)
    }

    #[test]
    fn scaled_copies_are_found_through_rounding() {
        let x = rounded(&noise(1, 5000), 0.01);
        for digits in [3, 4, 6] {
            let text = |v: f64| format!("{v:.digits$e}").parse::<f64>().unwrap();
            let y: Vec<f64> = x.iter().map(|v| text(135.58 * v - 3.0)).collect();
            let found = related(&x, &y).unwrap();
            assert!((found.factor / 135.58 - 1.0).abs() < 1e-3, "{found:?}");
            assert!((found.offset + 3.0).abs() < 0.05, "{found:?}");
            assert!(related(&y, &x).is_some());
        }
        assert!(related(&x, &x).unwrap().identical);
    }

    #[test]
    fn channels_that_differ_by_more_than_rounding_are_not_copies() {
        let truth = sine(10.0, 200.0, 5000);
        let seen = |seed: u64| -> Vec<f64> {
            let small: Vec<f64> = noise(seed, 5000).iter().map(|n| 0.02 * n).collect();
            rounded(&sum(&truth, &small), 0.01)
        };
        assert_eq!(related(&seen(1), &seen(2)), None);
        let mut one_off = seen(1);
        one_off[2500] += 0.02;
        assert_eq!(related(&seen(1), &one_off), None);
        for seed in 0..30 {
            let coarse = |s: u64| rounded(&noise(s, 200), 1.0);
            assert_eq!(related(&coarse(seed), &coarse(seed + 100)), None);
        }
    }

    #[test]
    fn counters_and_states_are_left_alone() {
        let ramp: Vec<f64> = (0..1000).map(f64::from).collect();
        let time: Vec<f64> = ramp.iter().map(|i| 0.001 * i).collect();
        assert_eq!(related(&ramp, &time), None);
        assert!(related(&time, &time).unwrap().identical);
        let state: Vec<f64> = (0..1000).map(|i| f64::from(i / 300 % 2)).collect();
        assert!(Portrait::of(&state).is_none());
        let flips: Vec<f64> = (0..1000).map(|i| f64::from(i / 10 % 2)).collect();
        let fives: Vec<f64> = flips.iter().map(|x| 5.0 * x).collect();
        assert_eq!(related(&flips, &fives), None);
    }
}
