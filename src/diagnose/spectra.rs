//! Spectra of residuals: level of the noise, lines, what follows from the input.

use num_complex::Complex64;
use realfft::RealFftPlanner;

/// Half-overlapping pieces of a record, transformed with a Hann window.
pub struct Pieces {
    /// Spectra, one a piece.
    pub spectra: Vec<Vec<Complex64>>,
    /// Samples a piece.
    pub length: usize,
}

/// Transforms pieces of a record; mean and trend of each piece are taken off.
#[must_use]
pub fn pieces(samples: &[f64], length: usize) -> Pieces {
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let window: Vec<f64> = (0..length)
        .map(|i| 0.5 - 0.5 * (std::f64::consts::TAU * i as f64 / length as f64).cos())
        .collect();
    let mut spectra = Vec::new();
    let mut from = 0;
    while from + length <= samples.len() {
        let piece = &samples[from..from + length];
        let mean = piece.iter().sum::<f64>() / length as f64;
        let mut windowed: Vec<f64> = piece
            .iter()
            .zip(&window)
            .map(|(x, w)| (x - mean) * w)
            .collect();
        let mut spectrum = plan.make_output_vec();
        let _ = plan.process(&mut windowed, &mut spectrum);
        spectra.push(spectrum);
        from += length / 2;
    }
    Pieces { spectra, length }
}

impl Pieces {
    /// Power at each frequency such that the sum over frequencies is the mean square.
    #[must_use]
    pub fn power(&self) -> Vec<f64> {
        let count = self.spectra.len().max(1) as f64;
        // Sum of the squared window is 3/8 of the length; both signs of frequency.
        let scale = 2.0 / (0.375 * self.length as f64 * self.length as f64 * count);
        let lines = self.spectra.first().map_or(0, Vec::len);
        (0..lines)
            .map(|k| scale * self.spectra.iter().map(|s| s[k].norm_sqr()).sum::<f64>())
            .collect()
    }
}

/// Share of the power of `output` that follows linearly from `input`, and how many standard deviations it lies
/// above none. Pieces are only compared with other pieces, so that noise adds nothing on average.
#[must_use]
pub fn coherent_share(input: &[f64], output: &[f64], length: usize) -> (f64, f64) {
    let (u, y) = (pieces(input, length), pieces(output, length));
    let lines = u.spectra.first().map_or(0, Vec::len);
    let (mut explained, mut total, mut variance) = (0.0, 0.0, 0.0);
    for k in 0..lines {
        let cross: Vec<Complex64> = u
            .spectra
            .iter()
            .zip(&y.spectra)
            .map(|(u, y)| y[k] * u[k].conj())
            .collect();
        let uu: f64 = u.spectra.iter().map(|u| u[k].norm_sqr()).sum();
        let yy: f64 = y.spectra.iter().map(|y| y[k].norm_sqr()).sum();
        total += yy;
        if uu <= 0.0 {
            continue;
        }
        // Neighbours overlap and share noise: they are left out as a piece itself is.
        let sum: Complex64 = cross.iter().sum();
        let mut pairs = sum.norm_sqr();
        for (i, c) in cross.iter().enumerate() {
            pairs -= c.norm_sqr();
            if let Some(next) = cross.get(i + 1) {
                pairs -= 2.0 * (c * next.conj()).re;
            }
        }
        let own: f64 = cross.iter().map(|c| c.norm_sqr()).sum();
        explained += pairs / uu;
        variance += (own / uu).powi(2);
    }
    if total <= 0.0 || variance <= 0.0 {
        return (0.0, 0.0);
    }
    (explained / total, explained / (2.0 * variance).sqrt())
}

/// A line in a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Its frequency.
    pub frequency_hz: f64,
    /// Its amplitude.
    pub amplitude: f64,
    /// Its power over the median power around it.
    pub prominence: f64,
}

/// Highest lines of records, each record's power added, on a grid four times as fine as the records resolve.
#[must_use]
pub fn lines(records: &[(&[f64], f64)], from_hz: f64, to_hz: f64, count: usize) -> Vec<Peak> {
    let Some(longest) = records.iter().map(|(r, _)| r.len()).max() else {
        return Vec::new();
    };
    let rate_hz = records[0].1;
    let total = (4 * longest).next_power_of_two();
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(total);
    let mut power = vec![0.0; total / 2 + 1];
    for (samples, _) in records {
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let mut padded = plan.make_input_vec();
        for (i, (p, x)) in padded.iter_mut().zip(samples.iter()).enumerate() {
            let window = 1.0 - (std::f64::consts::TAU * (i as f64 + 0.5) / n).cos();
            *p = (x - mean) * window;
        }
        let mut spectrum = plan.make_output_vec();
        let _ = plan.process(&mut padded, &mut spectrum);
        for (p, s) in power.iter_mut().zip(&spectrum) {
            *p += s.norm_sqr() * (2.0 / n).powi(2) / records.len() as f64;
        }
    }
    let step = rate_hz / total as f64;
    let (first, last) = ((from_hz / step).ceil() as usize, (to_hz / step) as usize);
    let last = last.min(power.len().saturating_sub(2));
    let mut peaks: Vec<Peak> = (first.max(1)..last)
        .filter(|k| power[*k] > power[k - 1] && power[*k] >= power[k + 1])
        .map(|k| {
            let reach = 200.min(k);
            let mut around = power[k - reach..(k + 200).min(power.len())].to_vec();
            let middle = around.len() / 2;
            let (_, median, _) = around.select_nth_unstable_by(middle, f64::total_cmp);
            let (a, b, c) = (power[k - 1].sqrt(), power[k].sqrt(), power[k + 1].sqrt());
            let shift = 0.5 * (a - c) / (a - 2.0 * b + c).min(-1e-300);
            Peak {
                frequency_hz: (k as f64 + shift.clamp(-0.5, 0.5)) * step,
                amplitude: power[k].sqrt(),
                prominence: power[k] / median.max(1e-300),
            }
        })
        .collect();
    peaks.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    peaks.truncate(count);
    peaks
}
