//! Samples of two signals in turn, as of two sources that write into one record.

/// Minimum number of samples.
const FEWEST: usize = 100;
/// Least ratio of the difference of the signals to its standard deviation, or to the rms change from one sample to the
/// next of the same signal.
const APART: f64 = 3.0;
/// Least rms of the mean of both signals about its own mean, relative to that of half their difference; without any, the
/// record is a line close to half the sampling rate.
const COMMON: f64 = 0.2;

/// Rms of the difference of neighbouring samples, if those with an even index and the others are two smooth signals.
///
/// With `d = (−1)^i (xᵢ − (xᵢ₋₁ + xᵢ₊₁)/2)`, the rms of `d` is at least three times that of `xᵢ₊₁ − xᵢ₋₁`, which is not
/// zero: two constant levels are a state. Furthermore, either the mean of `d` is at least three times its standard
/// deviation, or the mean of both signals, `(xᵢ₋₁ + 2 xᵢ + xᵢ₊₁)/4`, changes as well, which it hardly does at a line
/// below half the sampling rate.
///
/// ```
/// use torqcomp_dsp::quality::interleaved::interleaved;
/// let one = |i: u32| (0.05 * f64::from(i)).sin();
/// let two: Vec<f64> = (0..400).map(|i| if i % 2 == 0 { one(i) } else { 6.0 + 0.5 * one(i) }).collect();
/// assert!((interleaved(&two).unwrap() - 6.0).abs() < 0.1);
/// let same_level: Vec<f64> = (0..400).map(|i| if i % 2 == 0 { one(i) } else { one(2 * i) }).collect();
/// assert!((interleaved(&same_level).unwrap() - 1.0).abs() < 0.1);
/// assert_eq!(interleaved(&(0..400).map(one).collect::<Vec<_>>()), None);
/// ```
#[must_use]
pub fn interleaved(samples: &[f64]) -> Option<f64> {
    let count = samples
        .len()
        .checked_sub(2)
        .filter(|count| *count >= FEWEST)? as f64;
    let mut sums = [0.0; 5];
    for (i, w) in samples.windows(3).enumerate() {
        let bend = w[1] - 0.5 * (w[0] + w[2]);
        let difference = if i % 2 == 0 { -bend } else { bend };
        sums[0] += difference;
        sums[1] += difference * difference;
        sums[2] += (w[2] - w[0]).powi(2);
        let both = 0.25 * (w[0] + 2.0 * w[1] + w[2]);
        sums[3] += both;
        sums[4] += both * both;
    }
    let [mean, square, change, both, of_both] = sums.map(|sum| sum / count);
    let are_apart = mean * mean > APART * APART * (square - mean * mean);
    let is_common = of_both - both * both > 0.25 * COMMON * COMMON * square;
    let alternates = change > 0.0 && square > APART * APART * change;
    (alternates && (are_apart || is_common)).then(|| square.sqrt())
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
