//! A mode of vibration.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// A mode of vibration: poles at `−ζω₀ ± jω₀ √(1 − ζ²)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Natural angular frequency `ω₀` in rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio `ζ`.
    pub damping_ratio: f64,
}

impl Mode {
    /// From the decay rate `σ = ζω₀` in 1/s and the damped angular frequency `ω_d` in rad/s:
    /// `ω₀ = √(σ² + ω_d²)`, (C12) to (C20).
    ///
    /// ```
    /// let mode = torqcomp_model::Mode::ringing(3.0, 4.0);
    /// assert_eq!((mode.omega_rad_s, mode.damping_ratio), (5.0, 0.6));
    /// ```
    #[must_use]
    pub fn ringing(decay_rate_per_s: f64, damped_omega_rad_s: f64) -> Self {
        let omega_rad_s = decay_rate_per_s.hypot(damped_omega_rad_s);
        Self {
            omega_rad_s,
            damping_ratio: decay_rate_per_s / omega_rad_s,
        }
    }

    /// Natural frequency in Hz.
    #[must_use]
    pub fn natural_frequency_hz(&self) -> f64 {
        self.omega_rad_s / TAU
    }

    /// Decay rate in 1/s.
    #[must_use]
    pub fn decay_rate_per_s(&self) -> f64 {
        self.damping_ratio * self.omega_rad_s
    }

    /// `1 − (ω/ω₀)² + 2jζ ω/ω₀`: applied per recorded quantity, normalised to its static value.
    ///
    /// ```
    /// let mode = torqcomp_model::Mode { omega_rad_s: 5.0, damping_ratio: 0.6 };
    /// assert!((mode.inverse(5.0).im - 1.2).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn inverse(&self, omega_rad_s: f64) -> Complex64 {
        let w = omega_rad_s / self.omega_rad_s;
        Complex64::new(1.0 - w * w, 2.0 * self.damping_ratio * w)
    }

    /// The response `ω₀²/(s² + 2ζω₀ s + ω₀²)` at `s = jω`.
    #[must_use]
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        self.inverse(omega_rad_s).inv()
    }
}
