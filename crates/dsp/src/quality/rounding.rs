//! Time stamps that are uniform but for being rounded.

/// A uniform time axis whose stamps are rounded to a coarse step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounded {
    /// Step of the samples: slope of the straight line through the stamps.
    pub step_s: f64,
    /// What the stamps are multiples of.
    pub quantum_s: f64,
}

/// Fewest stamps that a line is laid through.
const FEWEST: usize = 8;
/// Least quantum, as a part of the step, that is worth saying: below it, steps stay within 1 %.
const COARSE: f64 = 0.01;
/// Largest distance of a stamp from the line, in quanta: half, and as much as the line can be off.
const HALF: f64 = 0.6;

/// Tells whether stamps (in s, rising or repeated) are a straight line rounded to multiples of a
/// quantum `q`: `|tᵢ − (a + b i)| ≤ 0.6 q` for all of them, with `a`, `b` by least squares.
///
/// Rounding or truncation of a uniform axis leaves at most `q/2` on either side of the line. `q` is
/// the power of ten that all stamps are multiples of, since stamps are rounded when they are
/// written as text. Jitter below `q/2` cannot be told from rounding; it is then just as harmless.
/// Stamps that fall are none of a rounded axis. Random jitter passes only if it stays within the quantum everywhere, so a clock that wanders by
/// more than the last digit it is written with is never taken for rounded.
///
/// ```
/// use torqcomp_dsp::quality::rounding::rounded;
/// // 1.5 kHz, written in whole milliseconds.
/// let stamps: Vec<f64> = (0..300).map(|i| (i as f64 / 1.5).round() * 1e-3).collect();
/// let found = rounded(&stamps).unwrap();
/// assert!((found.quantum_s - 1e-3).abs() < 1e-12 && (found.step_s * 1500.0 - 1.0).abs() < 1e-4);
/// ```
#[must_use]
pub fn rounded(stamps_s: &[f64]) -> Option<Rounded> {
    let count = stamps_s.len();
    let falls = stamps_s.windows(2).any(|pair| pair[1] < pair[0]);
    if count < FEWEST || falls || stamps_s.iter().any(|t| !t.is_finite()) {
        return None;
    }
    let mean_i = 0.5 * (count - 1) as f64;
    let mean_t = stamps_s.iter().sum::<f64>() / count as f64;
    let deviations = stamps_s.iter().enumerate();
    let (sum_it, sum_ii) = deviations.fold((0.0, 0.0), |(it, ii), (i, t)| {
        let i = i as f64 - mean_i;
        (it + i * (t - mean_t), ii + i * i)
    });
    let step_s = sum_it / sum_ii;
    let quantum_s = quantum(stamps_s).filter(|q| *q > COARSE * step_s)?;
    let line = |i: usize| mean_t + step_s * (i as f64 - mean_i);
    let farthest = stamps_s.iter().enumerate();
    let farthest = farthest.fold(0.0, |most: f64, (i, t)| most.max((t - line(i)).abs()));
    // An axis that needs no excuse is not given one.
    (farthest > 0.5 * COARSE * step_s && farthest <= HALF * quantum_s)
        .then_some(Rounded { step_s, quantum_s })
}

/// The largest power of ten that all stamps are multiples of, from 1 s to 1 ns.
fn quantum(stamps_s: &[f64]) -> Option<f64> {
    (0..10).map(|power| 10_f64.powi(-power)).find(|q| {
        stamps_s.iter().all(|t| {
            let multiple = t / q;
            // Stamps in other units than seconds bring the rounding of a product.
            (multiple - multiple.round()).abs() < 1e-6 + 4.0 * f64::EPSILON * multiple.abs()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::noise;
    use super::*;

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
        // A time that begins anew with each block of two.
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
}
