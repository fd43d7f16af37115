//! Uncertainty of the inverse transfer function.
//!
//! First-order propagation (JCGM 100:2008, clause 5.1.2, equation 10) with analytic gradients.
//! With N = K − Jω² + jωf and G = N/K, ln G = ln N − ln K, so
//!
//! ```text
//! ∂ln G/∂J = −ω²/N     ∂ln G/∂f = jω/N     ∂ln G/∂K = 1/N − 1/K
//! ```
//!
//! The real part is the relative change of the magnitude, the imaginary part the change of the
//! phase in rad.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::check::non_negative;
use crate::error::ModelError;
use crate::response::SecondOrder;

/// Standard uncertainties of the constants of a stand; a constant with `None` counts as exact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ParameterStd {
    /// Of the inertia, in kg m².
    pub inertia_kg_m2: Option<f64>,
    /// Of the damping, in N m s/rad.
    pub damping_n_m_s_per_rad: Option<f64>,
    /// Of the stiffness, in N m/rad.
    pub stiffness_n_m_per_rad: Option<f64>,
    /// Of the static gain (torque per volt), as a fraction of it.
    pub static_gain_relative: Option<f64>,
    /// Correlation coefficients of inertia and damping, inertia and stiffness, damping and stiffness, −1 to 1.
    pub correlations: [f64; 3],
}

impl ParameterStd {
    /// Rejects negative and non-finite uncertainties.
    fn check(&self) -> Result<(), ModelError> {
        let named = [
            (
                "standard uncertainty of inertia",
                "kg m^2",
                self.inertia_kg_m2,
            ),
            (
                "standard uncertainty of damping",
                "N m s/rad",
                self.damping_n_m_s_per_rad,
            ),
            (
                "standard uncertainty of stiffness",
                "N m/rad",
                self.stiffness_n_m_per_rad,
            ),
            (
                "standard uncertainty of static gain",
                "(ratio)",
                self.static_gain_relative,
            ),
        ];
        for (name, unit, value) in named {
            if let Some(value) = value {
                non_negative(name, unit, value)?;
            }
        }
        for value in self.correlations {
            non_negative("1 − |correlation|", "(ratio)", 1.0 - value.abs())?;
        }
        Ok(())
    }

    fn is_empty(&self) -> bool {
        let exact = Self {
            correlations: self.correlations,
            ..Self::default()
        };
        *self == exact
    }
}

/// Standard uncertainty of the inverse transfer function at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseUncertainty {
    /// Of the magnitude, as a fraction of it, to first order.
    pub magnitude_relative: f64,
    /// Of the phase, in rad.
    pub phase_rad: f64,
    /// Of the magnitude by the second order of changes that turn the phase, as a fraction of it: 0 for a delay.
    pub second_order: f64,
}

impl InverseUncertainty {
    /// Of the complex inverse `G`, as a fraction of its magnitude: `√(u²(ln|G|) + u²(φ))`. To first order it is the rms
    /// error of the samples of a compensated sine, relative to their rms.
    ///
    /// ```
    /// // Magnitude 3 % and phase 0.04 rad: 5 %.
    /// let std = torqcomp_model::InverseUncertainty { magnitude_relative: 0.03, phase_rad: 0.04, second_order: 0.0 };
    /// assert!((std.complex_relative() - 0.05).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn complex_relative(&self) -> f64 {
        self.magnitude_relative.hypot(self.phase_rad)
    }

    /// To second order, from the relative standard uncertainty of magnitude and phase to first order. At the resonance the
    /// relative change `jb` of `G` is imaginary, and its magnitude changes by `√(1 + b²) − 1`; the rms of that over a
    /// normally distributed b is, by Gauss–Hermite quadrature with three nodes, `√((√(1 + 3u²(φ)) − 1)²/3)`.
    ///
    /// ```
    /// use torqcomp_model::InverseUncertainty;
    /// // The phase is uncertain by 1.5 rad: the magnitude may be twice as large.
    /// assert!((InverseUncertainty::of_sum(0.0, 1.5).magnitude() - 1.029).abs() < 1e-3);
    /// // For small changes, √3/2 times the square of the phase.
    /// assert!((InverseUncertainty::of_sum(0.0, 0.1).magnitude() - 0.0086).abs() < 1e-4);
    /// ```
    #[must_use]
    pub fn of_sum(magnitude_relative: f64, phase_rad: f64) -> Self {
        let outer = (3.0 * phase_rad.powi(2)).sqrt().hypot(1.0) - 1.0;
        Self {
            magnitude_relative,
            phase_rad,
            second_order: outer / 3.0_f64.sqrt(),
        }
    }

    /// Of the magnitude to second order, as a fraction of it.
    #[must_use]
    pub fn magnitude(&self) -> f64 {
        self.magnitude_relative.hypot(self.second_order)
    }

    /// Both together, independent of each other.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        Self {
            magnitude_relative: self.magnitude_relative.hypot(other.magnitude_relative),
            phase_rad: self.phase_rad.hypot(other.phase_rad),
            second_order: self.second_order.hypot(other.second_order),
        }
    }
}

/// Gradient of ln|G| and of the phase of G with respect to J, f and K, in this order.
///
/// With a covariance matrix C of J, f and K (from a fit, whose estimates are correlated) the
/// variance of ln|G| is gᵀ C g with g = `ln_magnitude`, and likewise for the phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseGradient {
    /// ∂ln|G|/∂J in 1/(kg m²), ∂ln|G|/∂f in rad/(N m s), ∂ln|G|/∂K in rad/(N m).
    pub ln_magnitude: [f64; 3],
    /// ∂φ/∂J, ∂φ/∂f and ∂φ/∂K, in rad per the same units.
    pub phase_rad: [f64; 3],
}

impl SecondOrder {
    /// Gradient of the inverse transfer function, see [`InverseGradient`] and the module's
    /// documentation.
    ///
    /// `frequency_hz` is ω/2π in Hz.
    ///
    /// # Errors
    /// [`ModelError::UndampedResonance`] where the inverse is zero: an undamped stand exactly at
    /// its natural frequency.
    ///
    /// ```
    /// // J = 2, f = 12, K = 50 at ω = 5: N = j60, so −ω²/N = −25/(j60) = j0.416667.
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// let gradient = stand.inverse_gradient(5.0 / std::f64::consts::TAU)?;
    /// assert!(gradient.ln_magnitude[0].abs() < 1e-12);
    /// assert!((gradient.phase_rad[0] - 0.416667).abs() < 1e-6);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn inverse_gradient(&self, frequency_hz: f64) -> Result<InverseGradient, ModelError> {
        let omega = TAU * frequency_hz;
        let stiffness = self.dynamic_stiffness(frequency_hz);
        if stiffness == Complex64::ZERO {
            return Err(ModelError::UndampedResonance { frequency_hz });
        }
        let compliance = stiffness.inv();
        let terms = [
            -omega * omega * compliance,
            Complex64::I * omega * compliance,
            compliance - 1.0 / self.stiffness_n_m_per_rad(),
        ];
        Ok(InverseGradient {
            ln_magnitude: terms.map(|term| term.re),
            phase_rad: terms.map(|term| term.im),
        })
    }

    /// Standard uncertainty of the inverse transfer function at `frequency_hz` (ω/2π in Hz).
    ///
    /// u²(ln|G|) = Σ Σ ∂ln|G|/∂p ∂ln|G|/∂q u(p) u(q) r(p, q) over p, q = J, f, K with their correlations r,
    /// plus the relative u² of the static gain; u²(φ) likewise without the gain (JCGM 100:2008, clause 5.2.2,
    /// equation 16). `None` if no uncertainty is known at all. Valid while the changes are small compared with
    /// |G|: close to the natural frequency of a lightly damped stand u(K)/K and u(J)/J must be well below 2ζ.
    ///
    /// # Errors
    /// [`ModelError`] if an uncertainty is negative or not finite, or the inverse is zero.
    ///
    /// ```
    /// use torqcomp_model::{ParameterStd, SecondOrder};
    /// // At ω_n only f moves the magnitude: u(f)/f = 0.6/12 = 5 %.
    /// let stand = SecondOrder::new(2.0, 12.0, 50.0)?;
    /// let std = ParameterStd { damping_n_m_s_per_rad: Some(0.6), ..ParameterStd::default() };
    /// let got = stand.inverse_uncertainty(5.0 / std::f64::consts::TAU, &std)?.unwrap();
    /// assert!((got.magnitude_relative - 0.05).abs() < 1e-12);
    /// // J, f and K of one relative error: a common factor, which the ratio of them does not show.
    /// let common = ParameterStd {
    ///     inertia_kg_m2: Some(0.02),
    ///     damping_n_m_s_per_rad: Some(0.12),
    ///     stiffness_n_m_per_rad: Some(0.5),
    ///     correlations: [1.0; 3],
    ///     ..ParameterStd::default()
    /// };
    /// let got = stand.inverse_uncertainty(1.0, &common)?.unwrap();
    /// assert!(got.magnitude_relative < 1e-9 && got.phase_rad < 1e-9);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn inverse_uncertainty(
        &self,
        frequency_hz: f64,
        std: &ParameterStd,
    ) -> Result<Option<InverseUncertainty>, ModelError> {
        std.check()?;
        if std.is_empty() {
            return Ok(None);
        }
        let gradient = self.inverse_gradient(frequency_hz)?;
        let parameters = [
            std.inertia_kg_m2,
            std.damping_n_m_s_per_rad,
            std.stiffness_n_m_per_rad,
        ];
        // The static gain scales the torque without changing its phase.
        let stds = parameters.map(|std| std.unwrap_or(0.0));
        let [jf, jk, fk] = std.correlations;
        let spread = |gradient: [f64; 3]| {
            let part = |i: usize| gradient[i] * stds[i];
            let own = (0..3).map(|i| part(i) * part(i)).sum::<f64>();
            let mixed = jf * part(0) * part(1) + jk * part(0) * part(2) + fk * part(1) * part(2);
            // Rounded correlations may make it slightly negative.
            (own + 2.0 * mixed).max(0.0).sqrt()
        };
        let of_gain = std.static_gain_relative.unwrap_or(0.0);
        let first_order = [gradient.ln_magnitude, gradient.phase_rad].map(spread);
        Ok(Some(InverseUncertainty::of_sum(
            first_order[0].hypot(of_gain),
            first_order[1],
        )))
    }
}
