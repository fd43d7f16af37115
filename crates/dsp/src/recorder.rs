//! The recorder between bridge and file: gain, low-pass, delay.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::Error;

/// Response of a recorder to its input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recorder {
    gain: f64,
    low_pass: Option<LowPass>,
    delay_s: f64,
}

/// A Butterworth low-pass; order 1 is a plain RC low-pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass {
    /// Frequency at which the gain is `1/√2`, in Hz.
    pub cutoff_hz: f64,
    /// Number of poles.
    pub order: u32,
}

impl Recorder {
    /// A recorder with a gain (output volts per input volt), a low-pass and a delay.
    ///
    /// # Errors
    /// [`Error::NotPositive`] for a gain of zero (an amplifier may invert), a cutoff that is not
    /// positive, an order of 0 or above
    /// 16, or a delay that is not finite.
    pub fn new(gain: f64, low_pass: Option<LowPass>, delay_s: f64) -> Result<Self, Error> {
        let check = |name, value: f64, good: bool| {
            if good && value.is_finite() {
                Ok(())
            } else {
                Err(Error::NotPositive { name, value })
            }
        };
        check("recorder gain", gain.abs(), gain != 0.0)?;
        check("recorder delay", delay_s, delay_s >= 0.0)?;
        if let Some(filter) = low_pass {
            check("low-pass cutoff", filter.cutoff_hz, filter.cutoff_hz > 0.0)?;
            let order = f64::from(filter.order);
            check(
                "low-pass order (1 to 16)",
                order,
                (1.0..=16.0).contains(&order),
            )?;
        }
        Ok(Self {
            gain,
            low_pass,
            delay_s,
        })
    }

    /// Delay in s.
    #[must_use]
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Whether it has a low-pass.
    #[must_use]
    pub fn has_low_pass(&self) -> bool {
        self.low_pass.is_some()
    }

    /// Static gain, output per input.
    #[must_use]
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Whether it has only a gain, without low-pass or delay.
    #[must_use]
    pub fn is_ideal(&self) -> bool {
        self.low_pass.is_none() && self.delay_s == 0.0
    }

    /// Response normalised by the static gain: `L(f) e^{−j2πfτ}`, with `L(0) = 1`.
    ///
    /// ```
    /// use torqcomp_dsp::recorder::{LowPass, Recorder};
    /// let low_pass = LowPass { cutoff_hz: 1000.0, order: 1 };
    /// let recorder = Recorder::new(1.0, Some(low_pass), 0.25e-3)?;
    /// let h = recorder.response(1000.0);
    /// assert!((h.norm() - 0.5_f64.sqrt()).abs() < 1e-12);
    /// // 45 degrees of the RC low-pass and a quarter turn of the delay.
    /// assert!((h.arg().to_degrees() + 45.0 + 90.0).abs() < 1e-9);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    #[must_use]
    pub fn response(&self, frequency_hz: f64) -> Complex64 {
        self.transfer(Complex64::new(0.0, TAU * frequency_hz))
    }

    /// The same for any s in 1/s, such as on the line that an exponential window moves the response to.
    #[must_use]
    pub fn transfer(&self, s: Complex64) -> Complex64 {
        let low_pass = self.low_pass.map_or(Complex64::ONE, |filter| {
            filter.factors(s / (TAU * filter.cutoff_hz)).product()
        });
        low_pass * (-s * self.delay_s).exp()
    }

    /// Unwrapped phase of [`Recorder::response`] in rad, 0 at DC.
    ///
    /// ```
    /// use torqcomp_dsp::recorder::Recorder;
    /// // A delay of 1 ms turns 1500 Hz by one and a half periods.
    /// let recorder = Recorder::new(1.0, None, 1e-3)?;
    /// assert!((recorder.phase_rad(1500.0).to_degrees() + 540.0).abs() < 1e-9);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    #[must_use]
    pub fn phase_rad(&self, frequency_hz: f64) -> f64 {
        let low_pass = self.low_pass.map_or(0.0, |filter| {
            filter
                .factors(filter.at(frequency_hz))
                .map(|h| h.arg())
                .sum()
        });
        low_pass - TAU * frequency_hz * self.delay_s
    }
}

impl LowPass {
    /// `L(f) = Π 1/(1 − (jf/f_c)/p_k)` over the Butterworth poles
    /// `p_k = e^{jπ(2k+n−1)/2n}`, `k = 1…n` (S. Butterworth, Exp. Wireless 7 (1930), 536).
    ///
    /// ```
    /// use torqcomp_dsp::recorder::LowPass;
    /// // |L|² = 1/(1 + (f/fc)^2n): an octave above the cutoff, order 2 leaves 1/√17.
    /// let filter = LowPass { cutoff_hz: 500.0, order: 2 };
    /// assert!((filter.response(1000.0).norm() - 1.0 / 17.0_f64.sqrt()).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn response(&self, frequency_hz: f64) -> Complex64 {
        self.factors(self.at(frequency_hz)).product()
    }

    /// s over the cutoff at a frequency.
    fn at(&self, frequency_hz: f64) -> Complex64 {
        Complex64::new(0.0, frequency_hz / self.cutoff_hz)
    }

    /// The response of each pole, for s over the cutoff; on the imaginary axis none crosses the negative real axis.
    fn factors(&self, s: Complex64) -> impl Iterator<Item = Complex64> {
        let order = f64::from(self.order);
        (1..=self.order).map(move |k| {
            let angle = std::f64::consts::PI * (2.0 * f64::from(k) + order - 1.0) / (2.0 * order);
            let pole = Complex64::from_polar(1.0, angle);
            -pole / (s - pole)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn butterworth_magnitude_and_symmetry() {
        for order in 1..=16 {
            let filter = LowPass {
                cutoff_hz: 300.0,
                order,
            };
            assert!((filter.response(0.0) - 1.0).norm() < 1e-12);
            for f in [10.0, 299.0, 300.0, 900.0] {
                let h = filter.response(f);
                let expected = 1.0 / (1.0 + (f / 300.0_f64).powi(2 * order as i32)).sqrt();
                assert!(
                    (h.norm() / expected - 1.0).abs() < 1e-12,
                    "order {order} at {f}"
                );
                assert!((filter.response(-f) - h.conj()).norm() < 1e-12);
            }
        }
        // Second order in closed form: 1/(1 + √2 s + s²).
        let s = Complex64::new(0.0, 0.7);
        let closed = 1.0 / (1.0 + 2.0_f64.sqrt() * s + s * s);
        let filter = LowPass {
            cutoff_hz: 100.0,
            order: 2,
        };
        assert!((filter.response(70.0) - closed).norm() < 1e-14);
    }

    #[test]
    fn impossible_recorders_are_refused() {
        assert!(Recorder::new(0.0, None, 0.0).is_err());
        assert!(Recorder::new(1.0, None, -1e-6).is_err());
        assert!(
            Recorder::new(
                1.0,
                Some(LowPass {
                    cutoff_hz: -1.0,
                    order: 1
                }),
                0.0
            )
            .is_err()
        );
        assert!(
            Recorder::new(
                1.0,
                Some(LowPass {
                    cutoff_hz: 1.0,
                    order: 0
                }),
                0.0
            )
            .is_err()
        );
    }
}
