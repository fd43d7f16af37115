//! Plot series of the fit to the held-out records: residuals over time, frequency and motion.

use std::ops::Range;

use num_complex::Complex64;

use super::fit::RecordResidual;
use super::residual_tests::{autocorrelations, differences, without_mean};
use super::spectra::spectra;
use torqcomp_dsp::rms;

impl RecordResidual {
    /// Time of each sample of the range.
    pub fn times_s(&self) -> Vec<f64> {
        let rate_hz = self.record.rate_hz();
        let start_s = self.start_s();
        (0..self.samples.len())
            .map(|i| start_s + i as f64 / rate_hz)
            .collect()
    }

    /// Time of the first sample of the range.
    pub fn start_s(&self) -> f64 {
        let record = &self.record;
        record.input.start_s() + record.range.start as f64 / record.rate_hz()
    }

    /// The modelled record, including nuisance terms.
    pub fn prediction(&self) -> Vec<f64> {
        let measured = self.record.measured_in_range().iter();
        measured.zip(&self.samples).map(|(y, r)| y - r).collect()
    }

    pub fn rms(&self) -> f64 {
        rms(&self.samples)
    }

    /// Range of `count` samples around the largest part of the residual.
    pub fn around_largest(&self, count: usize) -> Range<usize> {
        let all = self.samples.len();
        let count = count.min(all);
        // The largest RMS over a window a quarter as long, so that a single bad sample does not decide.
        let window = (count / 4).max(1);
        let mut sum: f64 = self.samples[..window].iter().map(|r| r * r).sum();
        let (mut largest, mut place) = (sum, 0);
        for i in window..all {
            sum += self.samples[i].powi(2) - self.samples[i - window].powi(2);
            if sum > largest {
                (largest, place) = (sum, i + 1 - window);
            }
        }
        let from = (place + window / 2)
            .saturating_sub(count / 2)
            .min(all - count);
        from..from + count
    }

    /// Displacement or speed of each sample in the model.
    fn motion(&self, axis: MotionAxis) -> Vec<f64> {
        let x = without_mean(&self.prediction());
        match axis {
            MotionAxis::Displacement => x,
            MotionAxis::Speed => {
                let rate_hz = self.record.rate_hz();
                let mut speed: Vec<f64> =
                    differences(&x).iter().map(|d| 0.5 * d * rate_hz).collect();
                // One-sided differences at the ends.
                if let [first, .., last] = &mut speed[..] {
                    *first *= 2.0;
                    *last *= 2.0;
                }
                speed
            }
        }
    }
}

/// Segment length for the shortest of the records.
fn segment_length(residuals: &[RecordResidual]) -> usize {
    let shortest = residuals.iter().map(|r| r.samples.len()).min();
    let shortest = shortest.unwrap_or(0);
    ((shortest / 6).next_power_of_two())
        .clamp(64, 4096)
        .min(shortest.max(2))
}

/// Frequency step and lowest frequency.
fn frequency_step(residuals: &[RecordResidual], length: usize) -> f64 {
    residuals.first().map_or(1.0, |r| r.record.rate_hz()) / length as f64
}

/// Amplitude spectral density of the residuals, averaged over all records: frequencies, and `√S(f)` in the unit of the
/// record per `√Hz`.
pub fn density(residuals: &[RecordResidual]) -> (Vec<f64>, Vec<f64>) {
    let length = segment_length(residuals);
    let mut power: Vec<f64> = Vec::new();
    for residual in residuals {
        let own = spectra(&residual.samples, length).power();
        power.resize(own.len(), 0.0);
        for (sum, p) in power.iter_mut().zip(own) {
            *sum += p / residuals.len() as f64;
        }
    }
    let step = frequency_step(residuals, length);
    (1..power.len())
        .map(|k| (k as f64 * step, (power[k] / step).sqrt()))
        .unzip()
}

/// Minimum power of the input at a frequency, relative to the strongest, for a response estimate.
const ENOUGH_INPUT: f64 = 1e-2;

/// Magnitude of the response of a series to the applied quantity, `|Σ Y U*| / Σ |U|²` over the segments of all records,
/// where the input has power. Estimates for measured and modelled records are comparable, as both have the errors of
/// the estimator.
pub fn response(
    residuals: &[RecordResidual],
    of: impl Fn(&RecordResidual) -> Vec<f64>,
) -> (Vec<f64>, Vec<f64>) {
    let length = segment_length(residuals);
    let both = residuals.iter().flat_map(|r| {
        let applied = spectra(r.record.applied_in_range(), length).segments;
        applied.into_iter().zip(spectra(&of(r), length).segments)
    });
    let both: Vec<(Vec<Complex64>, Vec<Complex64>)> = both.collect();
    let lines = both.first().map_or(0, |(u, _)| u.len());
    let sums: Vec<(Complex64, f64)> = (0..lines)
        .map(|k| {
            let cross = both.iter().map(|(u, y)| y[k] * u[k].conj()).sum();
            (cross, both.iter().map(|(u, _)| u[k].norm_sqr()).sum())
        })
        .collect();
    let strongest = sums.iter().map(|(_, own)| *own).fold(0.0, f64::max);
    let step = frequency_step(residuals, length);
    let lines = sums.iter().enumerate().skip(1);
    lines
        .filter(|(_, (_, own))| *own > ENOUGH_INPUT * strongest)
        .map(|(k, (cross, own))| (k as f64 * step, cross.norm() / own))
        .unzip()
}

/// Autocorrelation of the residuals at lags from 0, over all records, and its 99 % bound for white noise.
pub fn autocorrelation(residuals: &[RecordResidual], lags: usize) -> (Vec<f64>, f64) {
    let counts = residuals.iter().map(|r| r.samples.len());
    let lags = lags.min(counts.clone().min().unwrap_or(0).saturating_sub(1));
    let samples: Vec<&[f64]> = residuals.iter().map(|r| &r.samples[..]).collect();
    let sums = autocorrelations(&samples, lags);
    let whole = sums[0].max(f64::MIN_POSITIVE);
    let shares = sums.iter().map(|s| s / whole).collect();
    let total: usize = counts.sum();
    (shares, 2.576 / (total.max(1) as f64).sqrt())
}

/// Abscissa of a residual plot over the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionAxis {
    /// The modelled record about its mean.
    Displacement,
    /// Its time derivative.
    Speed,
}

/// Mean residual over a range of displacement or speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionBin {
    /// Centre of the range.
    pub motion: f64,
    pub mean: f64,
    /// Standard error of the mean.
    pub std: f64,
}

/// Number of bins over the motion.
const BINS: usize = 40;
/// Minimum number of samples of a displayed bin.
const FEWEST: usize = 12;

/// Mean residuals over the displacement or speed of a model.
pub fn binned(
    residuals: &[RecordResidual],
    model: &[RecordResidual],
    axis: MotionAxis,
) -> Vec<MotionBin> {
    let pairs: Vec<(f64, f64)> = residuals
        .iter()
        .zip(model)
        .flat_map(|(r, model)| {
            model
                .motion(axis)
                .into_iter()
                .zip(r.samples.iter().copied())
        })
        .collect();
    let limits = |(low, high): (f64, f64), (x, _): &(f64, f64)| (low.min(*x), high.max(*x));
    let (low, high) = pairs
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), limits);
    let width = (high - low) / BINS as f64;
    if width.is_nan() || width <= 0.0 {
        return Vec::new();
    }
    let mut bins = vec![(0.0, 0.0, 0_usize); BINS];
    for (x, r) in &pairs {
        let bin = &mut bins[(((x - low) / width) as usize).min(BINS - 1)];
        *bin = (bin.0 + r, bin.1 + r * r, bin.2 + 1);
    }
    let shown = bins.iter().enumerate().filter(|(_, bin)| bin.2 >= FEWEST);
    shown
        .map(|(k, (sum, squares, count))| {
            let n = *count as f64;
            let mean = sum / n;
            let variance = (squares / n - mean * mean).max(0.0);
            MotionBin {
                motion: low + (k as f64 + 0.5) * width,
                mean,
                std: (variance / n).sqrt(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residual of a record at 1 kHz, three times the applied quantity.
    fn residual(samples: Vec<f64>) -> RecordResidual {
        let applied = (0..samples.len()).map(|i| (0.013 * (i * i) as f64).sin());
        let applied: Vec<f64> = applied.collect();
        let measured: Vec<f64> = applied.iter().map(|u| 3.0 * u).collect();
        RecordResidual::made(applied, measured, samples)
    }

    fn samples(count: usize, sample: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..count).map(sample).collect()
    }

    #[test]
    fn a_gain_of_three_is_a_response_of_three() {
        let one = [residual(vec![0.0; 8000])];
        let (lines_hz, magnitude) = response(&one, |r| r.record.measured.to_vec());
        assert!(lines_hz.len() > 100);
        assert!(magnitude.iter().all(|h| (h - 3.0).abs() < 1e-9));
    }

    #[test]
    fn a_density_integrates_to_the_mean_square() {
        // A sine of amplitude 2 has a mean square of 2.
        let one = [residual(samples(8192, |i| 2.0 * (0.7 * i as f64).sin()))];
        let (lines_hz, density) = density(&one);
        let step = lines_hz[1] - lines_hz[0];
        let square: f64 = density.iter().map(|d| d * d * step).sum();
        assert!((square - 2.0).abs() < 0.01, "{square}");
    }

    #[test]
    fn the_picture_is_taken_where_the_residual_is() {
        let one = residual(samples(5000, |i| {
            f64::from(u8::from((3000..3100).contains(&i)))
        }));
        let range = one.around_largest(400);
        assert!(range.contains(&3000) && range.contains(&3099) && range.len() == 400);
        assert_eq!(one.around_largest(9000), 0..5000);
    }

    #[test]
    fn bins_show_what_a_residual_follows_from() {
        // Whole periods, so that the mean is zero.
        let turn = std::f64::consts::TAU * 6.0 / 4000.0;
        let y = samples(4000, |i| (turn * i as f64).sin());
        let before = y.iter().map(|y| y * y * y).collect();
        let measured: Vec<f64> = y.iter().map(|y| 1.0 + y).collect();
        let [before, after] = [before, vec![0.0; 4000]]
            .map(|r| [RecordResidual::made(y.clone(), measured.clone(), r)]);
        let bins = binned(&before, &after, MotionAxis::Displacement);
        assert!(bins.len() > 30);
        for MotionBin { motion, mean, .. } in bins {
            assert!((mean - motion.powi(3)).abs() < 0.04, "{motion}: {mean}");
        }
    }

    #[test]
    fn autocorrelation_of_a_sine_is_a_cosine() {
        let one = [residual(samples(20_000, |i| (0.3 * i as f64).sin()))];
        let (shares, bound) = autocorrelation(&one, 40);
        assert!((bound - 2.576 / 20_000_f64.sqrt()).abs() < 1e-12);
        for (lag, share) in shares.iter().enumerate() {
            assert!((share - (0.3 * lag as f64).cos()).abs() < 0.01, "{lag}");
        }
    }
}
