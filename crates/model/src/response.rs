//! Transfer function of the stand and its inverse.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::check::{non_negative, positive};
use crate::error::ModelError;

/// A stand with one mode: J θ'' + f θ' + K θ = T, (2).
///
/// The gage shows T_o = K θ, (4), so the static gain is 1. Valid for small angles, viscous
/// damping, a linear beam without play, and frequencies well below the next mode of the stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder {
    inertia_kg_m2: f64,
    damping_n_m_s_per_rad: f64,
    stiffness_n_m_per_rad: f64,
}

impl SecondOrder {
    /// From inertia J in kg m², viscous coefficient f in N m s/rad and stiffness K in N m/rad.
    ///
    /// Any other consistent set of units gives the same response.
    ///
    /// # Errors
    /// [`ModelError`] if J or K is not greater than 0, f is negative, or one is not finite.
    ///
    /// ```
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// assert_eq!(stand.inertia_kg_m2(), 2.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn new(
        inertia_kg_m2: f64,
        damping_n_m_s_per_rad: f64,
        stiffness_n_m_per_rad: f64,
    ) -> Result<Self, ModelError> {
        Ok(Self {
            inertia_kg_m2: positive("inertia", "kg m^2", inertia_kg_m2)?,
            damping_n_m_s_per_rad: non_negative("damping", "N m s/rad", damping_n_m_s_per_rad)?,
            stiffness_n_m_per_rad: positive("stiffness", "N m/rad", stiffness_n_m_per_rad)?,
        })
    }

    /// From natural frequency f_n in Hz and damping ratio ζ, normalised to K = 1 N m/rad.
    ///
    /// J = K/ω_n² and f = 2 ζ K/ω_n with ω_n = 2π f_n. The response does not depend on the K
    /// chosen; inertia, damping and stiffness of the result are per N m/rad of stiffness.
    ///
    /// # Errors
    /// [`ModelError`] if f_n is not greater than 0, ζ is negative, or one is not finite.
    ///
    /// ```
    /// // At f_n the inverse is j2ζ.
    /// let stand = torqcomp_model::SecondOrder::from_natural_frequency(590.0, 0.07)?;
    /// assert!((stand.inverse(590.0).im - 0.14).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn from_natural_frequency(
        natural_frequency_hz: f64,
        damping_ratio: f64,
    ) -> Result<Self, ModelError> {
        let omega = TAU * positive("natural frequency", "Hz", natural_frequency_hz)?;
        let ratio = non_negative("damping ratio", "(ratio)", damping_ratio)?;
        Self::new(omega.powi(-2), 2.0 * ratio / omega, 1.0)
    }

    /// Inertia J in kg m².
    pub fn inertia_kg_m2(&self) -> f64 {
        self.inertia_kg_m2
    }

    /// Viscous coefficient f in N m s/rad.
    pub fn damping_n_m_s_per_rad(&self) -> f64 {
        self.damping_n_m_s_per_rad
    }

    /// Stiffness K in N m/rad.
    pub fn stiffness_n_m_per_rad(&self) -> f64 {
        self.stiffness_n_m_per_rad
    }

    /// Natural frequency f_n = √(K/J)/2π in Hz, from (21).
    ///
    /// ```
    /// // K = 50, J = 2: 5 rad/s = 0.795775 Hz.
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// assert!((stand.natural_frequency_hz() - 0.795775).abs() < 1e-6);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn natural_frequency_hz(&self) -> f64 {
        (self.stiffness_n_m_per_rad / self.inertia_kg_m2).sqrt() / TAU
    }

    /// Damping ratio ζ = (f/2) √(1/(K J)), (22).
    ///
    /// ```
    /// // f = 12, K J = 100: 6/10.
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// assert!((stand.damping_ratio() - 0.6).abs() < 1e-15);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn damping_ratio(&self) -> f64 {
        // The product of the two could overflow or underflow; two square roots do not.
        let critical = self.stiffness_n_m_per_rad.sqrt() * self.inertia_kg_m2.sqrt();
        self.damping_n_m_s_per_rad / (2.0 * critical)
    }

    /// Damped frequency f_d = √(1 − ζ²) f_n in Hz, (23); `None` for ζ ≥ 1, where the stand does not
    /// ring.
    ///
    /// ```
    /// // ζ = 0.6, ω_n = 5 rad/s: ω_d = 4 rad/s = 0.636620 Hz.
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// assert!((stand.damped_frequency_hz().unwrap() - 0.636620).abs() < 1e-6);
    /// assert_eq!(torqcomp_model::SecondOrder::new(2.0, 24.0, 50.0)?.damped_frequency_hz(), None);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn damped_frequency_hz(&self) -> Option<f64> {
        let ratio = self.damping_ratio();
        (ratio < 1.0).then(|| ((1.0 - ratio) * (1.0 + ratio)).sqrt() * self.natural_frequency_hz())
    }

    /// Decay rate σ = f/(2 J) in 1/s, (C17), positive for a decay.
    ///
    /// For ζ ≥ 1 the stand does not ring and this is the mean of its two rates.
    ///
    /// ```
    /// // f = 12, J = 2: 3 1/s.
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// assert_eq!(stand.decay_rate_per_s(), 3.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn decay_rate_per_s(&self) -> f64 {
        self.damping_n_m_s_per_rad / (2.0 * self.inertia_kg_m2)
    }

    /// Transfer function T_o/T = K/(K − J ω² + jω f), (20) at s = jω, a ratio.
    ///
    /// `frequency_hz` is ω/2π in Hz; time factor e^{+jωt}. Not finite for an undamped stand
    /// exactly at its natural frequency.
    ///
    /// ```
    /// // J = 2, f = 12, K = 50 at ω = 5 rad/s: 50/(j60) = −j0.833333.
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// let response = stand.forward(5.0 / std::f64::consts::TAU);
    /// assert!(response.re.abs() < 1e-12 && (response.im + 0.833333).abs() < 1e-6);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn forward(&self, frequency_hz: f64) -> Complex64 {
        self.inverse(frequency_hz).inv()
    }

    /// Inverse transfer function T/T_o = (K − J ω² + jω f)/K, (32), a ratio.
    ///
    /// `frequency_hz` is ω/2π in Hz; time factor e^{+jωt}. The magnitude grows as ω² above the
    /// natural frequency, and amplifies noise accordingly: limit the band.
    ///
    /// ```
    /// // J = 2, f = 12, K = 50 at ω = 5 rad/s: (50 − 50 + j60)/50 = j1.2.
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// let factor = stand.inverse(5.0 / std::f64::consts::TAU);
    /// assert!(factor.re.abs() < 1e-12 && (factor.im - 1.2).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn inverse(&self, frequency_hz: f64) -> Complex64 {
        self.dynamic_stiffness(frequency_hz) / self.stiffness_n_m_per_rad
    }

    /// Dynamic stiffness T/θ = K − J ω² + jω f in N m/rad, (6).
    ///
    /// `frequency_hz` is ω/2π in Hz; time factor e^{+jωt}.
    ///
    /// ```
    /// // J = 2, f = 12, K = 50 at ω = 5 rad/s: j60 N m/rad.
    /// let stand = torqcomp_model::SecondOrder::new(2.0, 12.0, 50.0)?;
    /// let stiffness = stand.dynamic_stiffness(5.0 / std::f64::consts::TAU);
    /// assert!(stiffness.re.abs() < 1e-12 && (stiffness.im - 60.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn dynamic_stiffness(&self, frequency_hz: f64) -> Complex64 {
        let omega = TAU * frequency_hz;
        Complex64::new(
            self.stiffness_n_m_per_rad - self.inertia_kg_m2 * omega * omega,
            self.damping_n_m_s_per_rad * omega,
        )
    }
}
