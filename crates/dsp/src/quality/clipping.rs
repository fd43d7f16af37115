//! Clipping: a signal truncated at its highest or lowest value.

use super::pile_up::pile_up;
use super::quantisation::quantisation;
use super::runs::Lengths;
use super::{Run, range, runs};

/// Minimum number of equal samples of a clipped peak.
const SHORTEST: usize = 3;
/// Minimum length of a clipped peak, relative to the 95th percentile of the other runs.
const LONGER: usize = 2;
/// Largest error of a parabola through three rounded samples, in resolution steps: (3 + 3 + 1)/2 of
/// its own and a half of the extreme one.
pub(super) const ROUNDING: f64 = 4.0;
/// Assumed resolution, relative to the range, where it cannot be determined.
const FINE: f64 = 1e-3;
/// Minimum fraction of the runs at the extreme value that must be abrupt rather than smooth.
const PART: f64 = 1.0 / 3.0;
/// Fraction of all samples at both extremes above which a signal is a switching one.
const SWITCHING: f64 = 0.85;

/// Clipping of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipping {
    /// At its lowest value.
    pub low: Option<Rail>,
    /// At its highest value.
    pub high: Option<Rail>,
}

/// A clipping level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rail {
    /// The value.
    pub value: f64,
    /// Width of the range that contains the clipped samples; 0 if all are equal to `value`.
    pub spread: f64,
    /// Number of samples at this value, or within that range.
    pub samples: usize,
    /// Number of runs of them that are longer than anywhere else.
    pub runs: usize,
    /// The longest of these.
    pub longest: usize,
    /// Index of the first sample of the first of these.
    pub first: usize,
}

impl Clipping {
    /// Clipping at one value ([`clipping`]), or at a level with noise added to it ([`pile_up`]).
    #[must_use]
    pub fn of(samples: &[f64]) -> Option<Self> {
        clipping(samples).or_else(|| pile_up(samples))
    }

    /// Number of samples at either rail.
    #[must_use]
    pub fn samples(&self) -> usize {
        let count = |rail: Option<Rail>| rail.map_or(0, |rail| rail.samples);
        count(self.low) + count(self.high)
    }

    /// Whether a sample is clipped.
    ///
    /// ```
    /// use torqcomp_dsp::quality::clipping::clipping;
    /// let cut: Vec<f64> = (0..1000).map(|i| (0.05 * f64::from(i)).sin().min(0.9)).collect();
    /// let found = clipping(&cut).unwrap();
    /// assert!(found.holds(0.9) && !found.holds(0.89) && !found.holds(-1.0));
    /// ```
    #[must_use]
    pub fn holds(&self, sample: f64) -> bool {
        let at = |rail: Rail| (sample - rail.value).abs() <= rail.spread;
        self.low.is_some_and(at) || self.high.is_some_and(at)
    }
}

/// Detects clipping of a signal at its extreme values.
///
/// A run of samples at exactly the extreme value `E` is a clipped peak if
/// 1. it has at least 3 samples and more than twice as many as 95 % of the runs elsewhere (slow,
///    quantised or held signals repeat values everywhere), and
/// 2. the signal was heading beyond `E`: the parabola `3y₁ − 3y₂ + y₃` through samples at distances 0,
///    s and 2s before the run (or after it, backwards in time) exceeds `E` by more than 4 steps of the
///    resolution, for some `s` up to half the length of the run.
///
/// One in three runs must be like that. A quantised but complete peak stays within 4 steps, since
/// three rounded samples move the parabola by at most 3.5; a signal that settles smoothly (position,
/// temperature) bends towards `E` and never exceeds it; noise in fine resolution hits the same value
/// three times in a row with a probability below `(step/σ)²` per sample. A signal with more than 85 %
/// of its samples at its two extremes is a switching one and is not judged. A genuine plateau of the
/// signal, entered with a kink, remains possible: a limited command looks the same as a limited
/// amplifier. Zero is such a plateau of everything at rest, so an extreme of exactly 0 is never called
/// clipped.
///
/// ```
/// use torqcomp_dsp::quality::clipping::clipping;
/// let sine = |i: i32| (0.05 * f64::from(i)).sin();
/// let whole: Vec<f64> = (0..1000).map(sine).collect();
/// assert_eq!(clipping(&whole), None);
/// let cut: Vec<f64> = whole.iter().map(|x| x.min(0.9)).collect();
/// let found = clipping(&cut).unwrap();
/// assert_eq!((found.low, found.high.unwrap().value), (None, 0.9));
/// ```
#[must_use]
pub fn clipping(samples: &[f64]) -> Option<Clipping> {
    let (low, high) = range(samples).filter(|(low, high)| low < high)?;
    let at_ends = samples.iter().filter(|x| **x == low || **x == high).count();
    if at_ends as f64 > SWITCHING * samples.len() as f64 {
        return None;
    }
    let elsewhere = Lengths::of(runs(samples).filter(|r| r.value != low && r.value != high));
    let usual = elsewhere.quantile(0.95)?;
    let shortest = SHORTEST.max(LONGER * usual + 1);
    let at = |extreme: f64| -> Vec<Run> {
        runs(samples)
            .filter(|r| r.value == extreme && extreme != 0.0 && r.length >= shortest)
            .collect()
    };
    let (lows, highs) = (at(low), at(high));
    if lows.is_empty() && highs.is_empty() {
        return None;
    }
    let step = quantisation(samples).map_or(0.0, |q| q.step);
    let found = Clipping {
        low: rail(
            samples,
            &lows,
            -1.0,
            step.max(nearest(samples, low, high - low)),
        ),
        high: rail(
            samples,
            &highs,
            1.0,
            step.max(nearest(samples, high, high - low)),
        ),
    };
    (found.low.is_some() || found.high.is_some()).then_some(found)
}

/// Distance of an extreme value from the nearest other one, as far as that can be the resolution.
fn nearest(samples: &[f64], extreme: f64, range: f64) -> f64 {
    let others = samples.iter().filter(|x| x.is_finite() && **x != extreme);
    others.fold(FINE * range, |least, x| least.min((x - extreme).abs()))
}

/// The rail at which the runs lie, if enough of them are clipped peaks. `sign` is 1 for the highest
/// value, −1 for the lowest.
fn rail(samples: &[f64], at: &[Run], sign: f64, step: f64) -> Option<Rail> {
    let first = at.first()?;
    let tolerance = ROUNDING * step;
    let cut = at
        .iter()
        .filter(|run| is_cut(samples, run, sign, tolerance))
        .count();
    (cut as f64 >= PART * at.len() as f64).then(|| Rail {
        value: first.value,
        spread: 0.0,
        samples: samples.iter().filter(|x| **x == first.value).count(),
        runs: at.len(),
        longest: at.iter().map(|r| r.length).max().unwrap_or(0),
        first: first.start,
    })
}

/// Whether the signal was heading beyond the run's value, before it or (backwards) after it.
fn is_cut(samples: &[f64], run: &Run, sign: f64, tolerance: f64) -> bool {
    let beyond = goes_beyond(samples, run, sign, run.value * sign + tolerance);
    beyond.contains(&true)
}

/// Whether the signal was heading beyond a bound (times `sign`) before a run, and backwards after it.
pub(super) fn goes_beyond(samples: &[f64], run: &Run, sign: f64, bound: f64) -> [bool; 2] {
    let before = |distance: usize| run.start.checked_sub(1 + distance).map(|i| samples[i]);
    let after = |distance: usize| samples.get(run.end() + distance).copied();
    let passes = |at: &dyn Fn(usize) -> Option<f64>, s: usize| {
        let (Some(y1), Some(y2), Some(y3)) = (at(0), at(s), at(2 * s)) else {
            return false;
        };
        // False for NaN.
        sign * (3.0 * y1 - 3.0 * y2 + y3) > bound
    };
    let distances = || {
        let doubled = std::iter::successors(Some(1), |s| Some(2 * s));
        doubled.take_while(|s| 2 * s <= run.length)
    };
    [
        distances().any(|s| passes(&before, s)),
        distances().any(|s| passes(&after, s)),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, rounded, sine, sum};
    use super::*;

    fn cut(values: &[f64], low: f64, high: f64) -> Vec<f64> {
        values.iter().map(|x| x.clamp(low, high)).collect()
    }

    #[test]
    fn complete_signals_are_not_clipped() {
        for period in [7.0, 41.3, 100.0, 1000.0, 9000.0] {
            let whole = sine(1.0, period, 20_000);
            assert_eq!(clipping(&whole), None, "period {period}");
            for bits in [4, 6, 8, 12] {
                let step = 2.0 / f64::from(1 << bits);
                let coarse = rounded(&whole, step);
                assert_eq!(clipping(&coarse), None, "period {period}, {bits} bits");
                let noisy = sum(&whole, &noise(bits as u64, 20_000));
                let noisy = rounded(&noisy, step);
                assert_eq!(
                    clipping(&noisy),
                    None,
                    "noisy, period {period}, {bits} bits"
                );
            }
        }
    }

    #[test]
    fn cut_sines_are_clipped() {
        for period in [23.7, 100.0, 1000.0] {
            for level in [0.5, 0.8, 0.95] {
                for step in [1e-6, 1.0 / 2048.0, 1.0 / 128.0] {
                    let whole = sine(1.0, period, 20_000);
                    let record = rounded(&cut(&whole, -level, level), step);
                    let found = clipping(&record);
                    let rails = found.map(|c| (c.low.is_some(), c.high.is_some()));
                    let what = format!("period {period}, level {level}, step {step}");
                    // A peak of less than three samples or seven codes is not detected.
                    let samples = (2.0 * (1.0_f64 - level)).sqrt() * period / std::f64::consts::PI;
                    if samples > 4.0 && 1.0 - level > 7.0 * step {
                        assert_eq!(rails, Some((true, true)), "{what}");
                    }
                }
            }
        }
    }

    #[test]
    fn clipped_noise_is_clipped_on_the_side_it_was() {
        let record = cut(
            &sum(&noise(1, 50_000), &sine(2.0, 500.0, 50_000)),
            -10.0,
            2.0,
        );
        let record = rounded(&record, 0.001);
        let found = clipping(&record).unwrap();
        let high = found.high.unwrap();
        assert_eq!((found.low, high.value), (None, 2.0));
        let at_rail = record.iter().filter(|x| **x == 2.0).count();
        assert_eq!(found.samples(), at_rail);
        assert!(high.samples > 5000 && high.first < 500, "{high:?}");
    }

    #[test]
    fn rests_holds_and_switches_are_not_clipping() {
        // A motion with limited acceleration from 0 to 1 and back, resting at both.
        let ramp = |u: f64| u * u * (3.0 - 2.0 * u);
        let motion: Vec<f64> = (0..4000)
            .map(|i| f64::from(i % 2000) / 500.0)
            .map(|u| match u {
                u if u < 1.0 => ramp(u),
                u if u < 2.0 => 1.0,
                u if u < 3.0 => ramp(3.0 - u),
                _ => 0.0,
            })
            .collect();
        assert_eq!(clipping(&motion), None);
        let square: Vec<f64> = (0..2000)
            .map(|i| if i % 100 < 50 { 1.0 } else { 0.0 })
            .collect();
        assert_eq!(clipping(&square), None);
        // A drive that starts from rest with a kink.
        let start: Vec<f64> = (0..900).map(|i| f64::from((i - 300).max(0))).collect();
        assert_eq!(clipping(&start), None);
        let held: Vec<f64> = noise(2, 2000).iter().flat_map(|x| [*x; 5]).collect();
        assert_eq!(clipping(&held), None);
    }
}
