//! Uniform time stamps that are rounded.

use std::ops::RangeInclusive;

/// A uniform time axis with coarsely rounded stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounded {
    /// Time step: among those that explain all stamps, one near the middle with the fewest digits, as
    /// a step or as a rate.
    pub step_s: f64,
    /// Smallest and largest step that explain all stamps; both are the slope of the fitted line if
    /// none explains them exactly.
    pub steps_s: [f64; 2],
    /// Quantum of the stamps: all are multiples of it.
    pub quantum_s: f64,
    /// Largest distance of a stamp from the line.
    pub farthest_s: f64,
}

impl Rounded {
    /// Smallest and largest step in s allowed by the stamps over a span in s: `b (1 ± q/span)` where no two steps
    /// bound them.
    ///
    /// ```
    /// use torqcomp_dsp::quality::rounding::rounded;
    /// // 10 Hz for two seconds, in whole seconds: 0 ten times, then 1 ten times; any step up to 2 s/19 fits.
    /// let stamps: Vec<f64> = (0..20).map(|i| f64::from(i / 10)).collect();
    /// let [least, largest] = rounded(&stamps).unwrap().steps_over(1.0);
    /// assert!(least <= 0.0 && largest > 2.0 / 20.0);
    /// ```
    #[must_use]
    pub fn steps_over(&self, span_s: f64) -> [f64; 2] {
        let [low, high] = self.steps_s;
        if low < high {
            return [low, high];
        }
        let part = self.quantum_s / span_s;
        [self.step_s * (1.0 - part), self.step_s * (1.0 + part)]
    }
}

/// Minimum number of stamps for a line.
pub(super) const FEWEST: usize = 8;
/// Minimum quantum relative to the step; below it, steps stay within 1 %.
const COARSE: f64 = 0.01;
/// Largest distance of a stamp from the line, in quanta, at which the stamps are exact.
const EXACT: f64 = 0.05;
/// Largest distance of a stamp from the line, in quanta: half, plus the uncertainty of the line.
const HALF: f64 = 0.6;

/// Tests whether stamps (in s, non-decreasing) are a straight line rounded to multiples of a quantum `q`:
/// `|tᵢ − (a + b i)| ≤ 0.6 q` for all of them, with `a`, `b` by least squares.
///
/// Rounding or truncation of a uniform axis leaves at most `q/2` on either side of the line. `q` is the power of ten of
/// which all stamps are multiples, since stamps are rounded when written as text. Jitter below `q/2` cannot be
/// distinguished from rounding, but is equally harmless. Decreasing stamps are not a rounded axis. Random jitter passes
/// only if it stays within the quantum everywhere, so a clock that drifts by more than its last written digit is never
/// accepted as rounded.
///
/// The slope of the least-squares line is too flat, through `n` steps of a staircase by the factor `1 − 1/n²`. So the
/// step is taken from all lines `a + b i` that stay within one quantum above each stamp, `tᵢ ≤ a + b i ≤ tᵢ + q`
/// (rounding instead of truncation only changes `a`): these are the `b` with
/// `(tⱼ − tᵢ − q)/(j − i) ≤ b ≤ (tⱼ − tᵢ + q)/(j − i)` for all `i < j`.
///
/// ```
/// use torqcomp_dsp::quality::rounding::rounded;
/// // 1.5 kHz, written in whole milliseconds.
/// let stamps: Vec<f64> = (0..300).map(|i| (i as f64 / 1.5).round() * 1e-3).collect();
/// let found = rounded(&stamps).unwrap();
/// assert!((found.quantum_s - 1e-3).abs() < 1e-12 && (found.step_s * 1500.0 - 1.0).abs() < 1e-12);
/// // 10 Hz for ten seconds, in whole seconds: 99 steps are less than 10 s, 81 are more than 8 s.
/// let stamps: Vec<f64> = (0..100).map(|i| f64::from(i / 10)).collect();
/// let found = rounded(&stamps).unwrap();
/// assert!((found.steps_s[0] - 8.0 / 81.0).abs() < 1e-12);
/// assert!((found.steps_s[1] - 10.0 / 99.0).abs() < 1e-12 && (found.step_s - 0.1).abs() < 1e-12);
/// ```
#[must_use]
pub fn rounded(stamps_s: &[f64]) -> Option<Rounded> {
    let line = uniform_line(stamps_s.iter().copied().enumerate(), 0.0)?;
    // A uniform axis does not need rounding as an explanation.
    let needs_it =
        line.quantum_s > COARSE * line.step_s && line.farthest_s > 0.5 * COARSE * line.step_s;
    needs_it.then_some(line)
}

/// The straight line through stamps (each with its index, both non-decreasing), if these deviate from a line by no more
/// than their rounding: `|tᵢ − (a + b i)| ≤ 0.6 q`, `q` being the power of ten up to 1 of which all stamps are
/// multiples, or the last and longest of them are, or `resolution_s`, the last bit of a clock, or a power of ten above
/// 1.
///
/// The step of stamps exactly on the line is that of the line; otherwise it is chosen as in [`rounded`].
///
/// ```
/// use torqcomp_dsp::quality::rounding::uniform_line;
/// // 51.2 kHz for a second, written in microseconds: 1/51200 s = 19.53125 µs.
/// let stamp = |i: usize| (i, (i as f64 * 19.53125).round() * 1e-6);
/// let line = uniform_line((0..51_200).map(stamp), 0.0).unwrap();
/// assert!((line.step_s * 51_200.0 - 1.0).abs() < 1e-12);
/// // Known at a few places only, it is the same.
/// let line = uniform_line((0..100).chain([1000, 51_199]).map(stamp), 0.0).unwrap();
/// assert!((line.step_s * 51_200.0 - 1.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn uniform_line(
    stamps: impl Iterator<Item = (usize, f64)> + Clone,
    resolution_s: f64,
) -> Option<Rounded> {
    let (count, last) = stamps
        .clone()
        .fold((0, f64::NAN), |(n, _), (_, t)| (n + 1, t));
    let first = stamps.clone().next()?;
    let rises = |pair: [(usize, f64); 2]| pair[1].0 > pair[0].0 && pair[1].1 >= pair[0].1;
    let follow = stamps.clone().zip(stamps.clone().skip(1));
    let good = follow.clone().all(|(a, b)| rises([a, b])) && last.is_finite() && last > first.1;
    if count < FEWEST || !good {
        return None;
    }
    let (slope_s, farthest_s) = fitted(stamps.clone(), count as f64, first.1);
    let (times, span_s) = (stamps.clone().map(|(_, t)| t), last - first.1);
    let longest = times.clone().skip(count.saturating_sub(FEWEST));
    let quantum_s = [
        quantum(FINE, span_s, times.clone()),
        quantum(FINE, span_s, longest),
        Some(resolution_s),
        quantum(COARSEST, span_s, times),
    ]
    .into_iter()
    .flatten()
    .find(|q| farthest_s <= HALF * q)?;
    let on_line = |step_s: f64| Rounded {
        step_s,
        steps_s: [step_s; 2],
        quantum_s,
        farthest_s,
    };
    if farthest_s <= EXACT * quantum_s {
        let last_i = stamps.last().map_or(0, |(i, _)| i);
        return Some(on_line((last - first.1) / (last_i - first.0) as f64));
    }
    let in_quanta = stamps.map(|(i, t)| ((i - first.0) as f64, whole((t - first.1) / quantum_s)));
    Some(match explaining(&in_quanta.collect::<Vec<_>>()) {
        Some(quanta) => {
            let steps_s = quanta.map(|step| step * quantum_s);
            Rounded {
                step_s: simplest(steps_s),
                steps_s,
                ..on_line(slope_s)
            }
        }
        None => on_line(slope_s),
    })
}

/// Least-squares slope of the line through stamps, and the largest distance of a stamp from it.
fn fitted(
    stamps: impl Iterator<Item = (usize, f64)> + Clone,
    count: f64,
    first_s: f64,
) -> (f64, f64) {
    let sums = |(si, st), (i, t): (usize, f64)| (si + i as f64, st + (t - first_s));
    let (sum_i, sum_t) = stamps.clone().fold((0.0, 0.0), sums);
    let (mean_i, mean_t) = (sum_i / count, sum_t / count);
    let (sum_it, sum_ii) = stamps.clone().fold((0.0, 0.0), |(it, ii), (i, t)| {
        let i = i as f64 - mean_i;
        (it + i * (t - first_s - mean_t), ii + i * i)
    });
    let slope_s = sum_it / sum_ii;
    let off = |(i, t): (usize, f64)| (t - first_s - mean_t - slope_s * (i as f64 - mean_i)).abs();
    (
        slope_s,
        stamps.fold(0.0, |most: f64, point| most.max(off(point))),
    )
}

/// A multiple, corrected for the rounding error of a quotient.
fn whole(multiple: f64) -> f64 {
    let whole = multiple.round();
    if (multiple - whole).abs() < 1e-3 {
        whole
    } else {
        multiple
    }
}

/// Smallest and largest step of the lines that stay within one above each stamp (index and stamp, relative to the
/// first), if there are any and all of them rise.
fn explaining(points: &[(f64, f64)]) -> Option<[f64; 2]> {
    slopes(points, [f64::NEG_INFINITY, f64::INFINITY])
        .filter(|[low, high]| *low > 0.0 && low < high)
}

/// Smallest and largest slope within a range of the lines that stay within one above each of several
/// points.
pub(super) fn slopes(points: &[(f64, f64)], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let (first, last) = (points.first()?, points.last()?);
    let steps = last.0 - first.0;
    // Bounds from the first and the last point.
    let outermost = [-1.0, 1.0].map(|one| (last.1 - first.1 + one) / steps);
    let found = [
        bound(points, low.max(outermost[0]), 1.0)?,
        bound(points, high.min(outermost[1]), -1.0)?,
    ];
    (found[0] <= high && found[1] >= low).then_some(found)
}

/// The bound of the feasible slopes, starting from a slope below (`side` 1) or above it (−1), or on it. For the slope
/// `b` the worst pair is the stamp that lies highest over `b i` and the upper end of the one that lies lowest; the next
/// slope brings these two together, until no pair violates the bound. The function is convex and piecewise linear, so
/// this ends after few steps; if it turns back, no slope is feasible.
fn bound(points: &[(f64, f64)], mut slope: f64, side: f64) -> Option<f64> {
    for _ in 0..100 {
        let (mut highest, mut lowest) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
        for (place, (i, stamp)) in points.iter().enumerate() {
            let over = stamp - slope * i;
            if over > highest.0 {
                highest = (over, place);
            }
            if over < lowest.0 {
                lowest = (over, place);
            }
        }
        let apart = highest.0 - lowest.0 - 1.0;
        if apart <= 1e-6 {
            return Some(slope);
        }
        let (above, below) = (points[highest.1], points[lowest.1]);
        let next = (above.1 - below.1 - 1.0) / (above.0 - below.0);
        if !next.is_finite() || (next - slope) * side <= 0.0 {
            return None;
        }
        slope = next;
    }
    None
}

/// Minimum saving in digits for a step near the ends of a range to be preferred over one in its middle
/// half.
const DIGITS_LESS: usize = 2;

/// The step in the middle half of a range with the fewest digits, itself or as a rate; any step of the range, if it has
/// clearly fewer.
pub(super) fn simplest([low_s, high_s]: [f64; 2]) -> f64 {
    let quarter = 0.25 * (high_s - low_s);
    let middle = 0.5 * (low_s + high_s);
    let digits =
        |value: f64, count: usize| -> f64 { format!("{value:.count$e}").parse().unwrap_or(value) };
    let within = |margin: f64| {
        let fits = |step: &f64| (low_s + margin..=high_s - margin).contains(step);
        (0..16).find_map(|count| {
            let ways = [1.0 / digits(1.0 / middle, count), digits(middle, count)];
            ways.into_iter().find(fits).map(|step| (count, step))
        })
    };
    match (within(quarter), within(0.0)) {
        (Some((inner, _)), Some((all, step))) if all + DIGITS_LESS <= inner => step,
        (Some((_, step)), _) => step,
        _ => middle,
    }
}

/// Exponents k of the quanta 10⁻ᵏ tried for stamps: from 1 down, and those above 1, as for nanoseconds of a clock that
/// counts milliseconds.
pub(super) const FINE: RangeInclusive<i32> = 0..=18;
const COARSEST: RangeInclusive<i32> = -9..=-1;

/// The largest of some powers 10⁻ᵏ of which all stamps are multiples and which does not exceed their time
/// span; `None` if even these are too large.
pub(super) fn quantum(
    powers: RangeInclusive<i32>,
    span_s: f64,
    stamps_s: impl Iterator<Item = f64> + Clone,
) -> Option<f64> {
    let powers = powers.map(|power| 10_f64.powi(-power));
    powers.filter(|q| *q <= 1.1 * span_s).find(|q| {
        stamps_s.clone().all(|t| {
            let multiple = t / q;
            // Stamps in units other than seconds have the rounding error of a product.
            (multiple - multiple.round()).abs() < 1e-6 + 4.0 * f64::EPSILON * multiple.abs()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::noise;
    use super::*;

    #[test]
    fn the_quantum_does_not_depend_on_the_unit() {
        // 3 kHz in whole milliseconds, written in s, ms and ns.
        for (unit, stamps) in [(1e-3, 3000), (1.0, 3000), (1e6, 9)] {
            let stamps: Vec<f64> = (0..stamps).map(|i| f64::from(i / 3) * unit).collect();
            let found = rounded(&stamps).unwrap();
            assert!((found.quantum_s / unit - 1.0).abs() < 1e-12, "{found:?}");
        }
        // 1 GHz for 50 ns has no whole seconds to be rounded to.
        let short: Vec<f64> = (0..50).map(|i| 1e-9 * f64::from(i)).collect();
        assert_eq!(rounded(&short), None);
    }

    #[test]
    fn exact_and_jittering_axes_are_not_rounded() {
        let exact: Vec<f64> = (0..1000).map(|i| 1e-3 * f64::from(i)).collect();
        assert_eq!(rounded(&exact), None, "nothing to explain");
        // Jitter of 20 % of a step, written to the microsecond.
        let jitter: Vec<f64> = noise(1, 1000)
            .iter()
            .enumerate()
            .map(|(i, n)| ((1e-3 * i as f64 + 2e-4 * n) * 1e6).round() * 1e-6)
            .collect();
        assert_eq!(rounded(&jitter), None);
        // A time axis that restarts with each block of two.
        let anew: Vec<f64> = (0..100).map(|i| 1e-5 * f64::from(i % 2)).collect();
        assert_eq!(rounded(&anew), None);
    }

    #[test]
    fn truncated_stamps_are_found_and_a_gap_is_not_rounding() {
        let stamp = |i: usize| (i as f64 * 0.016 * 100.0).floor() / 100.0;
        let mut stamps: Vec<f64> = (0..500).map(stamp).collect();
        let found = rounded(&stamps).unwrap();
        assert!((found.step_s - 0.016).abs() < 1e-6, "{found:?}");
        stamps.iter_mut().skip(250).for_each(|t| *t += 0.1);
        assert_eq!(rounded(&stamps), None);
    }

    #[test]
    fn the_rate_of_truncated_stamps_is_not_biased() {
        for rate_hz in [
            3.0, 7.0, 10.0, 20.0, 62.5, 100.0, 101.37, 1200.0, 1500.0, 4000.0,
        ] {
            for decimals in [0, 1, 2, 3] {
                for count in [60, 100, 400, 999, 6000] {
                    let scale = 10_f64.powi(decimals);
                    let stamps: Vec<f64> = (0..count)
                        .map(|i| (f64::from(i) / rate_hz * scale + 1e-9).floor() / scale)
                        .collect();
                    let Some(found) = rounded(&stamps) else {
                        continue;
                    };
                    let [low, high] = found.steps_s;
                    let (step, slack) = (1.0 / rate_hz, 1e-9 / rate_hz);
                    let name = format!("{rate_hz} Hz, {decimals} decimals, {count}: {found:?}");
                    if low == high {
                        // No second step of the staircase.
                        assert!(f64::from(count) / rate_hz * scale < 3.0, "{name}");
                        continue;
                    }
                    assert!(low - slack <= step && step <= high + slack, "{name}");
                    assert!((found.step_s - step).abs() <= 0.75 * (high - low), "{name}");
                    // Rates of few digits are exact from a few seconds on.
                    if rate_hz.fract() == 0.0 && (high - low) < 0.02 * step {
                        assert!((found.step_s / step - 1.0).abs() < 1e-9, "{name}");
                    }
                }
            }
        }
    }
}
