//! Transform of a whole record with its extension, to the frequency domain and back.

use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_fourier::{ComplexToReal, RealToComplex};

use super::continued;
use super::whole::fast_length;

/// Transforms for records of one length, each extended beyond both ends by point reflection that fades
/// out over the outer half of the extension.
///
/// The mean is handled separately: it remains constant, whatever the extension.
#[derive(Clone)]
pub struct Extension {
    count: usize,
    lead: usize,
    total: usize,
    rate_hz: f64,
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
}

/// Spectrum of a record: its mean, and the lines of the remainder.
#[derive(Debug, Clone)]
pub struct Spectrum {
    mean: f64,
    lines: Vec<Complex64>,
}

impl Extension {
    /// Plans the transforms for records of `count` samples, extended by `lead` samples at both ends.
    #[must_use]
    pub fn new(count: usize, rate_hz: f64, lead: usize) -> Self {
        let total = fast_length(count + 2 * lead);
        Self {
            count,
            lead,
            total,
            rate_hz,
            forward: torqcomp_fourier::forward(total),
            backward: torqcomp_fourier::inverse(total),
        }
    }

    /// Spectrum of a record.
    ///
    /// # Panics
    /// If the length of the record is not the planned one.
    #[must_use]
    pub fn spectrum(&self, samples: &[f64]) -> Spectrum {
        assert_eq!(samples.len(), self.count, "planned for another length");
        let mean = samples.iter().sum::<f64>() / self.count as f64;
        let mut padded = vec![0.0; self.total];
        for (to, sample) in padded.iter_mut().zip(samples) {
            *to = sample - mean;
        }
        for k in 1..=self.lead {
            let fade = fade(k, self.lead);
            let after = self.count - 1 + k;
            padded[after] = fade * (continued(samples, after as isize) - mean);
            padded[self.total - k] = fade * (continued(samples, -(k as isize)) - mean);
        }
        let mut lines = self.forward.make_output_vec();
        self.forward
            .process(&mut padded, &mut lines)
            .expect("buffers were made for this length");
        Spectrum { mean, lines }
    }

    /// The record with this spectrum.
    #[must_use]
    pub fn samples(&self, spectrum: &Spectrum) -> Vec<f64> {
        let mut lines = spectrum.lines.clone();
        // The DC and Nyquist lines of a real record are real.
        lines[0].im = 0.0;
        if self.total.is_multiple_of(2)
            && let Some(last) = lines.last_mut()
        {
            last.im = 0.0;
        }
        let mut padded = self.backward.make_output_vec();
        self.backward
            .process(&mut lines, &mut padded)
            .expect("buffers were made for this length and the ends are real");
        padded.truncate(self.count);
        let scale = 1.0 / self.total as f64;
        padded
            .iter_mut()
            .for_each(|sample| *sample = *sample * scale + spectrum.mean);
        padded
    }

    /// Multiplies a spectrum by a response; a mean at which the response is not finite is lost.
    #[must_use]
    pub fn times(&self, mut spectrum: Spectrum, response: impl Fn(f64) -> Complex64) -> Spectrum {
        let step_hz = self.rate_hz / self.total as f64;
        for (k, line) in spectrum.lines.iter_mut().enumerate() {
            let factor = response(k as f64 * step_hz);
            *line = if factor.is_finite() {
                *line * factor
            } else {
                Complex64::ZERO
            };
        }
        let at_rest = response(0.0).re;
        spectrum.mean = if at_rest.is_finite() {
            spectrum.mean * at_rest
        } else {
            0.0
        };
        spectrum
    }

    /// Passes a record through a response.
    ///
    /// ```
    /// use num_complex::Complex64;
    /// use torqcomp_dsp::compensate::Extension;
    /// // A delay of two samples at 10 Hz, taken back: e^{+jω 0.2}.
    /// let record: Vec<f64> = (0..400).map(|i| (0.2 * i as f64).sin() + 3.0).collect();
    /// let extension = Extension::new(400, 10.0, 200);
    /// let ahead = |f: f64| Complex64::from_polar(1.0, std::f64::consts::TAU * f * 0.2);
    /// let found = extension.filter(&record, ahead);
    /// assert!((found[100] - record[102]).abs() < 1e-3);
    /// ```
    #[must_use]
    pub fn filter(&self, samples: &[f64], response: impl Fn(f64) -> Complex64) -> Vec<f64> {
        self.samples(&self.times(self.spectrum(samples), response))
    }
}

impl std::ops::Add for Spectrum {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self.mean += other.mean;
        for (line, more) in self.lines.iter_mut().zip(&other.lines) {
            *line += more;
        }
        self
    }
}

/// 1 over the inner half of an extension, then a cosine fade to 0.
fn fade(k: usize, lead: usize) -> f64 {
    let part = (2.0 * k as f64 / (lead + 1) as f64 - 1.0).max(0.0);
    0.5 + 0.5 * (std::f64::consts::PI * part).cos()
}
