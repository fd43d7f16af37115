//! A mode of vibration.

use std::f64::consts::TAU;

use nalgebra::Matrix4;
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

    /// The modes of a stand with this mode to which an inertia, `μ` times its own, is coupled by a spring and a damper,
    /// alone with the frequency and damping ratio `other`: the roots of
    /// `(s² + 2ζ₁ω₁ s + ω₁²)(s² + 2ζ₂ω₂ s + ω₂²) + μ s² (2ζ₂ω₂ s + ω₂²)`.
    ///
    /// ```
    /// let one = torqcomp_model::Mode { omega_rad_s: 10.0, damping_ratio: 0.0 };
    /// // With S = s²/100: S² + 2.5 S + 1 = 0, S = −0.5 and −2.
    /// let mut omegas = one.coupled_to(&one, 0.5).into_iter().map(|mode| mode.omega_rad_s);
    /// let [first, second] = std::array::from_fn(|_| omegas.next().unwrap());
    /// assert!((first - 50_f64.sqrt()).abs() < 1e-12 && (second - 200_f64.sqrt()).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn coupled_to(&self, other: &Self, inertia_ratio: f64) -> Vec<Self> {
        // In units of this mode's frequency.
        let [c1, w2] = [
            2.0 * self.damping_ratio,
            other.omega_rad_s / self.omega_rad_s,
        ];
        let [c2, k2] = [2.0 * other.damping_ratio * w2, w2 * w2];
        let mu = inertia_ratio;
        let powers = [
            k2,
            c1 * k2 + c2,
            1.0 + c1 * c2 + (1.0 + mu) * k2,
            c1 + (1.0 + mu) * c2,
        ];
        // The search for eigenvalues would not end.
        if !powers.iter().all(|power| power.is_finite()) {
            return Vec::new();
        }
        let mut companion = Matrix4::zeros();
        for (k, power) in powers.into_iter().enumerate() {
            companion[(k, 3)] = -power;
            if k > 0 {
                companion[(k, k - 1)] = 1.0;
            }
        }
        let roots = companion.complex_eigenvalues();
        let swinging = roots.iter().filter(|root| root.im > 0.0);
        let mut modes: Vec<Self> = swinging
            .map(|root| Self::ringing(-root.re * self.omega_rad_s, root.im * self.omega_rad_s))
            .collect();
        let mut creeping: Vec<f64> = roots
            .iter()
            .filter(|r| r.im == 0.0)
            .map(|r| -r.re)
            .collect();
        creeping.sort_by(f64::total_cmp);
        modes.extend(creeping.chunks_exact(2).map(|pair| {
            let omega = (pair[0] * pair[1]).sqrt();
            Self {
                omega_rad_s: omega * self.omega_rad_s,
                damping_ratio: 0.5 * (pair[0] + pair[1]) / omega,
            }
        }));
        modes.sort_by(|a, b| a.omega_rad_s.total_cmp(&b.omega_rad_s));
        modes
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
