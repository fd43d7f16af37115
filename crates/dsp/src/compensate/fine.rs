//! Interpolation of a band-limited signal between its samples, window by window.

use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_fourier::{ComplexToReal, RealToComplex};

/// Converts between a window of samples and the same window at an integer multiple of the rate.
///
/// A window is faded in and out over a quarter of its margin at either side; the results there are
/// invalid.
pub struct Fine {
    length: usize,
    factor: usize,
    margin: usize,
    rate_hz: f64,
    coarse: Pair,
    fine: Pair,
}

struct Pair {
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
}

impl Pair {
    fn new(length: usize) -> Self {
        Self {
            forward: torqcomp_fourier::forward(length),
            backward: torqcomp_fourier::inverse(length),
        }
    }
}

impl Fine {
    /// Windows of `length` samples, including a `margin` at either side, upsampled `factor` times.
    #[must_use]
    pub fn new(length: usize, margin: usize, factor: usize, rate_hz: f64) -> Self {
        Self {
            length,
            factor,
            margin,
            rate_hz,
            coarse: Pair::new(length),
            fine: Pair::new(length * factor),
        }
    }

    /// Spectrum of a window of samples, scaled for [`Fine::refined`].
    #[must_use]
    pub fn spectrum(&self, window: &[f64]) -> Vec<Complex64> {
        let mut faded = self.faded(window, self.margin);
        let mut lines = self.coarse.forward.make_output_vec();
        self.coarse
            .forward
            .process(&mut faded, &mut lines)
            .expect("buffers were made for this length");
        let scale = 1.0 / self.length as f64;
        lines.iter_mut().for_each(|line| *line *= scale);
        lines
    }

    /// Spectrum of a window at the higher rate, up to the Nyquist frequency of the lower rate.
    #[must_use]
    pub fn spectrum_of_fine(&self, window: &[f64]) -> Vec<Complex64> {
        let mut faded = self.faded(window, self.margin * self.factor);
        let mut lines = self.fine.forward.make_output_vec();
        self.fine
            .forward
            .process(&mut faded, &mut lines)
            .expect("buffers were made for this length");
        lines.truncate(self.length / 2 + 1);
        let scale = 1.0 / (self.length * self.factor) as f64;
        lines.iter_mut().for_each(|line| *line *= scale);
        lines
    }

    /// The window at the higher rate, passed through a response, which is a function of frequency
    /// in Hz.
    #[must_use]
    pub fn refined(&self, lines: &[Complex64], response: impl Fn(f64) -> Complex64) -> Vec<f64> {
        let mut padded = self.fine.backward.make_input_vec();
        let step_hz = self.rate_hz / self.length as f64;
        for (k, (to, line)) in padded.iter_mut().zip(lines).enumerate() {
            *to = line * response(k as f64 * step_hz);
        }
        if self.factor > 1 {
            // The Nyquist line represents both signs of frequency.
            padded[self.length / 2] *= 0.5;
        }
        back(self.fine.backward.as_ref(), padded)
    }

    /// The window at the lower rate.
    #[must_use]
    pub fn samples(&self, lines: &[Complex64]) -> Vec<f64> {
        back(self.coarse.backward.as_ref(), lines.to_vec())
    }

    fn faded(&self, window: &[f64], margin: usize) -> Vec<f64> {
        let mut faded = window.to_vec();
        let ramp = margin / 4;
        let last = faded.len() - 1;
        for k in 0..ramp {
            let weight = 0.5 - 0.5 * (std::f64::consts::PI * (k as f64 + 0.5) / ramp as f64).cos();
            faded[k] *= weight;
            faded[last - k] *= weight;
        }
        faded
    }
}

fn back(plan: &dyn ComplexToReal<f64>, mut lines: Vec<Complex64>) -> Vec<f64> {
    lines[0].im = 0.0;
    if plan.len().is_multiple_of(2)
        && let Some(last) = lines.last_mut()
    {
        last.im = 0.0;
    }
    let mut samples = plan.make_output_vec();
    plan.process(&mut lines, &mut samples)
        .expect("buffers were made for this length and the ends are real");
    samples
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_is_the_same_between_its_samples_and_back() {
        let (length, margin, factor, rate_hz) = (4096, 1024, 4, 1000.0);
        let fine = Fine::new(length, margin, factor, rate_hz);
        let at = |time_s: f64| (std::f64::consts::TAU * 331.7 * time_s).sin();
        let window: Vec<f64> = (0..length).map(|i| at(i as f64 / rate_hz)).collect();
        let lines = fine.spectrum(&window);
        let refined = fine.refined(&lines, |_| Complex64::ONE);
        let speed = fine.refined(&lines, |f| Complex64::new(0.0, std::f64::consts::TAU * f));
        let again = fine.samples(&fine.spectrum_of_fine(&refined));
        let omega = std::f64::consts::TAU * 331.7;
        for i in margin * factor..(length - margin) * factor {
            let time_s = i as f64 / (rate_hz * factor as f64);
            assert!((refined[i] - at(time_s)).abs() < 1e-6, "{i}");
            assert!(
                (speed[i] / omega - (omega * time_s).cos()).abs() < 1e-5,
                "{i}"
            );
        }
        for i in margin..length - margin {
            assert!((again[i] - window[i]).abs() < 1e-6, "{i}");
        }
    }
}
