//! Spectra of residuals: power, coherence with an input, lines.

use std::f64::consts::TAU;
use torqcomp_dsp::sort_by_number;

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::Serialize;

use super::fit::RecordResidual;

/// Spectra of half-overlapping segments of a record, with a Hann window.
pub struct SegmentSpectra {
    pub segments: Vec<Vec<Complex64>>,
    /// Segment length in samples.
    pub length: usize,
}

/// Transforms segments of a record; the mean of each is removed.
pub fn spectra(samples: &[f64], length: usize) -> SegmentSpectra {
    let plan = torqcomp_fourier::forward(length);
    let window: Vec<f64> = (0..length)
        .map(|i| 0.5 - 0.5 * (TAU * i as f64 / length as f64).cos())
        .collect();
    let mut segments = Vec::new();
    let mut from = 0;
    while from + length <= samples.len() {
        let segment = &samples[from..from + length];
        let mean = segment.iter().sum::<f64>() / length as f64;
        let windowed = segment.iter().zip(&window).map(|(x, w)| (x - mean) * w);
        let mut spectrum = plan.make_output_vec();
        // Cannot fail: the lengths match the plan.
        let _ = plan.process(&mut windowed.collect::<Vec<f64>>(), &mut spectrum);
        segments.push(spectrum);
        from += length / 2;
    }
    SegmentSpectra { segments, length }
}

impl SegmentSpectra {
    /// Number of frequencies, from 0 to the Nyquist frequency.
    pub fn frequencies(&self) -> usize {
        self.segments.first().map_or(0, Vec::len)
    }

    /// Power at each frequency, normalised so that the sum is the mean square.
    pub fn power(&self) -> Vec<f64> {
        let count = self.segments.len().max(1) as f64;
        // The sum of the squared window is 3/8 of the length; both signs of frequency.
        let scale = 2.0 / (0.375 * self.length as f64 * self.length as f64 * count);
        let power = |k: usize| scale * self.segments.iter().map(|s| s[k].norm_sqr()).sum::<f64>();
        (0..self.frequencies()).map(power).collect()
    }
}

/// Energy of samples at each frequency from 0 to the Nyquist frequency, normalised so that the sum equals that over the
/// samples; averaged over `to_each_side` frequencies on each side.
pub fn energy_spectrum(samples: &[f64], to_each_side: usize) -> Vec<f64> {
    let length = samples.len().next_power_of_two();
    let plan = torqcomp_fourier::forward(length);
    let mut padded = Vec::with_capacity(length);
    padded.extend_from_slice(samples);
    padded.resize(length, 0.0);
    let mut spectrum = plan.make_output_vec();
    // Cannot fail: the length matches the plan.
    let _ = plan.process(&mut padded, &mut spectrum);
    drop(padded);
    let last = spectrum.len() - 1;
    let sides = |k: usize| if k == 0 || k == last { 1.0 } else { 2.0 };
    let energy = |(k, s): (usize, &Complex64)| sides(k) * s.norm_sqr() / length as f64;
    let energies: Vec<f64> = spectrum.iter().enumerate().map(energy).collect();
    drop(spectrum);
    if to_each_side == 0 || samples.is_empty() {
        return energies;
    }
    let reach = to_each_side * length / samples.len();
    let mut before = vec![0.0];
    before.extend(energies.iter().scan(0.0, |sum, e| {
        *sum += e;
        Some(*sum)
    }));
    let around = |k: usize| {
        let (from, to) = (k.saturating_sub(reach), (k + reach).min(last) + 1);
        (before[to] - before[from]) / (to - from) as f64
    };
    (0..=last).map(around).collect()
}

/// Power of an input at a frequency, relative to its mean over all, below which it may be noise: 1 % noise has 1e-4 of
/// the power. A stand also responds to noise on the input, and that response is coherent with it.
pub const ONLY_NOISE: f64 = 2.5e-4;

/// Share of the power of `output` linear in `input`, at frequencies where that is more than noise, and its distance
/// from zero in standard deviations. Segments are only compared with other segments, beyond the correlation time of the
/// noise on the output (which may ring with the stand), so that noise adds nothing on average.
pub fn coherent_share(
    input: &[f64],
    output: &[f64],
    length: usize,
    memory_samples: f64,
) -> (f64, f64) {
    let (u, y) = (spectra(input, length), spectra(output, length));
    let (mut explained, mut total, mut variance) = (0.0, 0.0, 0.0);
    let power = u.power();
    let least = ONLY_NOISE * power.iter().sum::<f64>() / power.len().max(1) as f64;
    // A trial model may have no damping at all.
    let memory = (memory_samples / (0.5 * length as f64)).min(u.segments.len() as f64);
    let apart = 1 + (1.5 * memory) as usize;
    for k in 0..u.frequencies() {
        let pairs = u.segments.iter().zip(&y.segments);
        let cross: Vec<Complex64> = pairs.map(|(u, y)| y[k] * u[k].conj()).collect();
        let uu: f64 = u.segments.iter().map(|u| u[k].norm_sqr()).sum();
        let yy: f64 = y.segments.iter().map(|y| y[k].norm_sqr()).sum();
        total += yy;
        if uu <= 0.0 || power[k] < least {
            continue;
        }
        // Neighbours overlap and share noise, so they are excluded like a segment's product with
        // itself.
        let sum: Complex64 = cross.iter().sum();
        let mut pairs = sum.norm_sqr();
        for (i, c) in cross.iter().enumerate() {
            pairs -= c.norm_sqr();
            let near: Complex64 = cross.iter().skip(i + 1).take(apart).sum();
            pairs -= 2.0 * (c * near.conj()).re;
        }
        let own: f64 = cross.iter().map(|c| c.norm_sqr()).sum();
        explained += pairs / uu;
        variance += (own / uu).powi(2);
    }
    if total <= 0.0 || variance <= 0.0 {
        return (0.0, 0.0);
    }
    // This many consecutive segments share the same noise.
    let std = (2.0 * variance).sqrt() * memory.max(1.0);
    (explained / total, explained / std)
}

/// A line in a spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SpectralLine {
    /// Frequency, in Hz.
    pub frequency_hz: f64,
    /// Amplitude, in the unit of `error`.
    pub amplitude: f64,
    /// Its power over the median power around it.
    #[serde(skip)]
    pub prominence: f64,
}

impl SpectralLine {
    /// The same line with its amplitude in another unit.
    pub fn over(self, unit: f64) -> Self {
        let amplitude = self.amplitude / unit;
        Self { amplitude, ..self }
    }
}

/// Frequency oversampling by zero-padding.
const FINER: usize = 4;
/// Number of frequencies on either side of a line that its power is compared with.
const AROUND: usize = 200;
/// Lowest line, in resolved frequencies.
const LOWEST: f64 = 3.0;

/// Strongest lines in residuals up to a frequency, with the power averaged over all records.
pub fn lines_of(residuals: &[RecordResidual], to_hz: f64, count: usize) -> Vec<SpectralLine> {
    let Some(longest) = residuals.iter().map(|r| r.samples.len()).max() else {
        return Vec::new();
    };
    let rate_hz = residuals[0].record.rate_hz();
    let from_hz = LOWEST * rate_hz / longest as f64;
    let total = (FINER * longest).next_power_of_two();
    let power = padded_power(residuals, total);
    let step = rate_hz / total as f64;
    let (first, last) = ((from_hz / step).ceil() as usize, (to_hz / step) as usize);
    let last = last.min(power.len().saturating_sub(2));
    let is_peak = |k: &usize| power[*k] > power[k - 1] && power[*k] >= power[k + 1];
    let mut lines: Vec<SpectralLine> = (first.max(1)..last)
        .filter(is_peak)
        .map(|k| line_at(&power, k, step))
        .collect();
    sort_by_number(&mut lines, |line| -line.amplitude);
    lines.truncate(count);
    lines
}

/// Mean squared amplitude of residuals at each frequency, with a Hann window, zero-padded to `total` samples.
fn padded_power(residuals: &[RecordResidual], total: usize) -> Vec<f64> {
    let plan = torqcomp_fourier::forward(total);
    let mut power = vec![0.0; total / 2 + 1];
    for residual in residuals {
        let samples = &residual.samples;
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let mut padded = plan.make_input_vec();
        for (i, (p, x)) in padded.iter_mut().zip(samples).enumerate() {
            let window = 1.0 - (TAU * (i as f64 + 0.5) / n).cos();
            *p = (x - mean) * window;
        }
        let mut spectrum = plan.make_output_vec();
        let _ = plan.process(&mut padded, &mut spectrum);
        for (p, s) in power.iter_mut().zip(&spectrum) {
            *p += s.norm_sqr() * (2.0 / n).powi(2) / residuals.len() as f64;
        }
    }
    power
}

/// The line whose peak is nearest to a frequency, refined by parabolic interpolation of three amplitudes.
fn line_at(power: &[f64], k: usize, step: f64) -> SpectralLine {
    let mut around = power[k - AROUND.min(k)..(k + AROUND).min(power.len())].to_vec();
    let middle = around.len() / 2;
    let (_, median, _) = around.select_nth_unstable_by(middle, f64::total_cmp);
    let [a, b, c] = [k - 1, k, k + 1].map(|k| power[k].sqrt());
    let shift = 0.5 * (a - c) / (a - 2.0 * b + c).min(-1e-300);
    SpectralLine {
        frequency_hz: (k as f64 + shift.clamp(-0.5, 0.5)) * step,
        amplitude: b,
        prominence: power[k] / median.max(1e-300),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_noise::noise;

    /// A low-frequency input with 0.5 % white noise, and a response to that noise alone.
    #[test]
    fn what_answers_noise_on_the_input_does_not_follow_from_it() {
        let mut random = noise(2);
        let line = |i: usize, k: usize| (0.004 * (k * i) as f64 + (k * k) as f64).sin();
        let noise: Vec<f64> = (0..40_000)
            .map(|_| 0.005 * 12_f64.sqrt() * random())
            .collect();
        let input = |(i, n): (usize, &f64)| n + (1..20).map(|k| line(i, k)).sum::<f64>() / 3.0;
        let input: Vec<f64> = noise.iter().enumerate().map(input).collect();
        let (share, significance) = coherent_share(&input, &noise, 1024, 0.0);
        assert!(share < 0.04, "{share}, {significance}");
        // A response to the input itself still does.
        let (share, _) = coherent_share(&input, &input, 1024, 0.0);
        assert!(share > 0.9, "{share}");
        // A model that never settles has no segments to compare.
        assert!(coherent_share(&input, &input, 1024, f64::INFINITY).0.abs() < 1e-12);
    }
}
