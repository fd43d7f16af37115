//! A sampled input, continued beyond its ends and refined between its samples.

use std::sync::Arc;

use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// A record of the applied quantity, prepared for simulation.
///
/// Beyond its ends the record is continued by point reflection that fades out, so that the transform,
/// which takes it for periodic, meets no step. What that makes up differs from what was there before the
/// record by an initial state of the stand.
pub struct Input {
    samples: Vec<f64>,
    rate_hz: f64,
    start_s: f64,
    lead: usize,
    total: usize,
    spectrum: Vec<Complex64>,
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
    substeps: usize,
    fine: Vec<f64>,
}

impl Input {
    /// Prepares a record, with that many steps from sample to sample for integration in time.
    #[must_use]
    pub fn new(samples: Vec<f64>, rate_hz: f64, start_s: f64, substeps: usize) -> Self {
        let count = samples.len();
        let lead = (count / 16).clamp(16, 2048).min(count.saturating_sub(1));
        let total = quick_length(count + 2 * lead);
        let mut planner = RealFftPlanner::new();
        let forward = planner.plan_fft_forward(total);
        let backward = planner.plan_fft_inverse(total);
        let mut input = Self {
            samples,
            rate_hz,
            start_s,
            lead,
            total,
            spectrum: Vec::new(),
            forward,
            backward,
            substeps,
            fine: Vec::new(),
        };
        input.spectrum = input.transform(&input.samples);
        input.fine = input.refine(substeps);
        input
    }

    /// The same record with another number of steps.
    #[must_use]
    pub fn with_substeps(&self, substeps: usize) -> Self {
        Self::new(self.samples.clone(), self.rate_hz, self.start_s, substeps)
    }

    /// The samples.
    #[must_use]
    pub fn samples(&self) -> &[f64] {
        &self.samples
    }

    /// Samples a second.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Time of the first sample.
    #[must_use]
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Steps of integration from sample to sample.
    #[must_use]
    pub fn substeps(&self) -> usize {
        self.substeps
    }

    /// Spectrum of the samples.
    #[must_use]
    pub fn spectrum(&self) -> &[Complex64] {
        &self.spectrum
    }

    /// Angular frequency of a line of the spectrum, in rad/s.
    #[must_use]
    pub fn omega_rad_s(&self, line: usize) -> f64 {
        std::f64::consts::TAU * line as f64 * self.rate_hz / self.total as f64
    }

    /// Input at the steps of integration, from one step before the first sample to two after the last.
    pub(super) fn fine(&self) -> &[f64] {
        &self.fine
    }

    /// Spectrum of a record of the same length.
    #[must_use]
    pub fn transform(&self, samples: &[f64]) -> Vec<Complex64> {
        let mut extended = extend(samples, self.lead, self.total);
        let mut spectrum = self.forward.make_output_vec();
        // The lengths are those that the plan was made for.
        let _ = self.forward.process(&mut extended, &mut spectrum);
        spectrum
    }

    /// The record of a spectrum.
    #[must_use]
    pub fn samples_of(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        let mut extended = self.backward.make_output_vec();
        spectrum[0].im = 0.0;
        if self.total.is_multiple_of(2)
            && let Some(last) = spectrum.last_mut()
        {
            last.im = 0.0;
        }
        let _ = self.backward.process(&mut spectrum, &mut extended);
        let scale = 1.0 / self.total as f64;
        extended[self.lead..self.lead + self.samples.len()]
            .iter()
            .map(|x| x * scale)
            .collect()
    }

    /// Band-limited interpolation: the spectrum, padded with zeros.
    fn refine(&self, substeps: usize) -> Vec<f64> {
        let long = self.total * substeps;
        let plan = RealFftPlanner::new().plan_fft_inverse(long);
        let mut spectrum = plan.make_input_vec();
        spectrum[..self.spectrum.len()].copy_from_slice(&self.spectrum);
        if substeps > 1 && self.total.is_multiple_of(2) {
            // The line at half the sampling rate stands for both signs of frequency.
            spectrum[self.spectrum.len() - 1] *= 0.5;
        }
        spectrum[0].im = 0.0;
        let mut fine = plan.make_output_vec();
        let _ = plan.process(&mut spectrum, &mut fine);
        let scale = 1.0 / self.total as f64;
        let first = self.lead * substeps - 1;
        let count = (self.samples.len() - 1) * substeps + 4;
        fine[first..first + count]
            .iter()
            .map(|x| x * scale)
            .collect()
    }
}

/// Continues a record by point reflection at its ends, fading to zero over `lead` samples.
fn extend(samples: &[f64], lead: usize, total: usize) -> Vec<f64> {
    let mut extended = vec![0.0; total];
    let count = samples.len();
    extended[lead..lead + count].copy_from_slice(samples);
    let (first, last) = (samples[0], samples[count - 1]);
    for k in 1..=lead.min(count - 1) {
        let fade = 0.5 + 0.5 * (std::f64::consts::PI * k as f64 / (lead + 1) as f64).cos();
        extended[lead - k] = fade * (2.0 * first - samples[k]);
        extended[lead + count - 1 + k] = fade * (2.0 * last - samples[count - 1 - k]);
    }
    extended
}

/// The least even length from `least` on that is a product of 2, 3 and 5.
fn quick_length(least: usize) -> usize {
    let mut length = least + least % 2;
    loop {
        let mut rest = length;
        for prime in [2, 3, 5] {
            while rest.is_multiple_of(prime) {
                rest /= prime;
            }
        }
        if rest == 1 {
            return length;
        }
        length += 2;
    }
}
