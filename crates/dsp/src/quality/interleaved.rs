//! Samples of two signals in turn, as of two sources that write into one record.

/// Minimum number of samples.
const FEWEST: usize = 100;
/// Least ratio of the mean difference of the signals to its standard deviation, and to the rms change of each signal from
/// one of its samples to the next.
const APART: f64 = 3.0;

/// Mean of the samples with an even index minus that of the others, if these are two smooth signals at different levels.
///
/// With `d = (−1)^i (xᵢ − (xᵢ₋₁ + xᵢ₊₁)/2)`, the mean of `d` is at least three times its standard deviation, and three
/// times the rms of `xᵢ₊₁ − xᵢ₋₁`, which is not zero: two constant levels are a state. In noise, and at a line below half
/// the sampling rate, the mean of `d` vanishes.
///
/// ```
/// use torqcomp_dsp::quality::interleaved::interleaved;
/// let one = |i: u32| (0.05 * f64::from(i)).sin();
/// let two: Vec<f64> = (0..400).map(|i| if i % 2 == 0 { one(i) } else { 6.0 + 0.5 * one(i) }).collect();
/// assert!((interleaved(&two).unwrap() + 6.0).abs() < 0.1);
/// assert_eq!(interleaved(&(0..400).map(one).collect::<Vec<_>>()), None);
/// ```
#[must_use]
pub fn interleaved(samples: &[f64]) -> Option<f64> {
    let count = samples
        .len()
        .checked_sub(2)
        .filter(|count| *count >= FEWEST)? as f64;
    let mut sums = [0.0; 3];
    for (i, w) in samples.windows(3).enumerate() {
        let bend = w[1] - 0.5 * (w[0] + w[2]);
        let difference = if i % 2 == 0 { -bend } else { bend };
        sums[0] += difference;
        sums[1] += difference * difference;
        sums[2] += (w[2] - w[0]).powi(2);
    }
    let [mean, square, change] = sums.map(|sum| sum / count);
    let variance = (square - mean * mean).max(change);
    (change > 0.0 && mean * mean > APART * APART * variance).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, sine};
    use super::*;

    #[test]
    fn one_signal_is_not_two() {
        let toggle: Vec<f64> = (0..1000).map(|i| f64::from(i % 2)).collect();
        let missing = vec![f64::NAN; 1000];
        for record in [
            toggle,
            missing,
            noise(1, 1000),
            sine(3.0, 2.01, 1000),
            vec![1.0; 1000],
        ] {
            assert_eq!(interleaved(&record), None);
        }
    }
}
