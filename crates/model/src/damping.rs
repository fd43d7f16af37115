//! Viscous coefficient from a friction test, and stand constants from a free decay.

use std::f64::consts::TAU;

use crate::check::{finite, non_negative, positive};
use crate::error::ModelError;
use crate::response::SecondOrder;

/// Viscous friction coefficient f = (ΔF/Δω) r in N m s/rad, (18).
///
/// `slope_n_s_per_rad` is the slope ΔF/Δω of friction force against angular speed in N s/rad,
/// `radius_m` the radius r in m at which the force was read. Covers only the friction between rotor
/// and stator: the measured damping of the stand is several orders of magnitude higher, because the
/// beam itself absorbs energy.
///
/// # Errors
/// [`ModelError`] if the slope is not finite or negative, or the radius is not greater than 0.
///
/// ```
/// // 3 N s/rad at 0.5 m: 1.5 N m s/rad.
/// assert_eq!(torqcomp_model::damping::viscous_from_friction_slope_n_m_s_per_rad(3.0, 0.5)?, 1.5);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn viscous_from_friction_slope_n_m_s_per_rad(
    slope_n_s_per_rad: f64,
    radius_m: f64,
) -> Result<f64, ModelError> {
    let slope = non_negative("slope of friction force", "N s/rad", slope_n_s_per_rad)?;
    Ok(slope * positive("radius of the machine", "m", radius_m)?)
}

/// Decay rate σ = ln(a₁/a₂)/Δt in 1/s, (C8).
///
/// `first` and `second` are the amplitudes a₁ and a₂ in the same unit, with the offset removed;
/// `elapsed_s` is Δt in s between them. Valid for viscous damping; only then is the decay
/// exponential.
///
/// # Errors
/// [`ModelError`] if the amplitudes do not share a sign or do not fall, or Δt is not greater
/// than 0.
///
/// ```
/// // From 2.0 to 0.5 in 2 s: ln 4/2 = 0.693147 1/s.
/// let rate = torqcomp_model::damping::decay_rate_per_s(2.0, 0.5, 2.0)?;
/// assert!((rate - 0.693147).abs() < 1e-6);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn decay_rate_per_s(first: f64, second: f64, elapsed_s: f64) -> Result<f64, ModelError> {
    let first = finite("first amplitude", "(any)", first)?;
    let second = finite("second amplitude", "(any)", second)?;
    let elapsed = positive("time between the amplitudes", "s", elapsed_s)?;
    let one_sign = (first > 0.0 && second > 0.0) || (first < 0.0 && second < 0.0);
    if !one_sign || second.abs() >= first.abs() {
        return Err(ModelError::NotDecaying { first, second });
    }
    Ok((first / second).ln() / elapsed)
}

/// Angular frequency ω = 2π/T in rad/s of a cycle that lasts T, (C7).
///
/// `period_s` is T in s.
///
/// # Errors
/// [`ModelError`] if the period is not finite or not greater than 0.
///
/// ```
/// // One cycle in 2 s: π rad/s.
/// let speed = torqcomp_model::damping::angular_frequency_rad_per_s(2.0)?;
/// assert!((speed - 3.141593).abs() < 1e-6);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn angular_frequency_rad_per_s(period_s: f64) -> Result<f64, ModelError> {
    Ok(TAU / positive("period", "s", period_s)?)
}

/// Stand constants from a free decay a e^{−σt} cos(ω_d t + φ) (Appendix C, II and III).
///
/// Valid for one under-damped mode with viscous damping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeDecay {
    decay_rate_per_s: f64,
    damped_angular_frequency_rad_per_s: f64,
}

impl FreeDecay {
    /// From the decay rate σ in 1/s and the damped angular frequency ω_d in rad/s.
    ///
    /// # Errors
    /// [`ModelError`] if σ is negative, ω_d is not greater than 0, or one is not finite.
    ///
    /// ```
    /// let decay = torqcomp_model::FreeDecay::new(3.0, 4.0)?;
    /// assert_eq!(decay.decay_rate_per_s(), 3.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn new(
        decay_rate_per_s: f64,
        damped_angular_frequency_rad_per_s: f64,
    ) -> Result<Self, ModelError> {
        Ok(Self {
            decay_rate_per_s: non_negative("decay rate", "1/s", decay_rate_per_s)?,
            damped_angular_frequency_rad_per_s: positive(
                "damped angular frequency",
                "rad/s",
                damped_angular_frequency_rad_per_s,
            )?,
        })
    }

    /// Decay rate σ in 1/s.
    pub fn decay_rate_per_s(&self) -> f64 {
        self.decay_rate_per_s
    }

    /// Damped angular frequency ω_d in rad/s.
    pub fn damped_angular_frequency_rad_per_s(&self) -> f64 {
        self.damped_angular_frequency_rad_per_s
    }

    /// Natural angular frequency ω_n = √(ω_d² + σ²) in rad/s, from (C10) and (C11).
    ///
    /// ```
    /// // σ = 3, ω_d = 4: ω_n = 5 rad/s.
    /// let decay = torqcomp_model::FreeDecay::new(3.0, 4.0)?;
    /// assert_eq!(decay.natural_angular_frequency_rad_per_s(), 5.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn natural_angular_frequency_rad_per_s(&self) -> f64 {
        self.damped_angular_frequency_rad_per_s
            .hypot(self.decay_rate_per_s)
    }

    /// Natural frequency f_n = ω_n/2π in Hz, (C14).
    ///
    /// ```
    /// // ω_n = 5 rad/s: 0.795775 Hz.
    /// let decay = torqcomp_model::FreeDecay::new(3.0, 4.0)?;
    /// assert!((decay.natural_frequency_hz() - 0.795775).abs() < 1e-6);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn natural_frequency_hz(&self) -> f64 {
        self.natural_angular_frequency_rad_per_s() / TAU
    }

    /// Damping ratio ζ = σ/√(ω_d² + σ²), (C12) solved for ζ.
    ///
    /// ```
    /// // σ = 3, ω_d = 4: ζ = 3/5.
    /// let decay = torqcomp_model::FreeDecay::new(3.0, 4.0)?;
    /// assert_eq!(decay.damping_ratio(), 0.6);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn damping_ratio(&self) -> f64 {
        self.decay_rate_per_s / self.natural_angular_frequency_rad_per_s()
    }

    /// Viscous coefficient f = 2 σ J in N m s/rad, (C18).
    ///
    /// `inertia_kg_m2` is J in kg m². The source derives it from σ = −f/2J, (C17), where its σ is
    /// the real part of the root and so negative; here σ is the rate itself, positive.
    ///
    /// # Errors
    /// [`ModelError`] if J is not finite or not greater than 0.
    ///
    /// ```
    /// // σ = 3 1/s, J = 2 kg m²: 12 N m s/rad.
    /// let decay = torqcomp_model::FreeDecay::new(3.0, 4.0)?;
    /// assert_eq!(decay.damping_n_m_s_per_rad(2.0)?, 12.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn damping_n_m_s_per_rad(&self, inertia_kg_m2: f64) -> Result<f64, ModelError> {
        Ok(2.0 * self.decay_rate_per_s * positive("inertia", "kg m^2", inertia_kg_m2)?)
    }

    /// Torsional-spring constant K = J (ω_d² + σ²) in N m/rad, (C20).
    ///
    /// `inertia_kg_m2` is J in kg m². (C20) is printed as K = (4J²ω_d² + f²)/(4J); with f = 2σJ
    /// from (C18) both are the same: (4J²ω_d² + 4σ²J²)/(4J) = J(ω_d² + σ²). (C19), from which it is
    /// derived, is right with the root over the numerator only: ω_d = √(4JK − f²)/(2J).
    ///
    /// # Errors
    /// [`ModelError`] if J is not finite or not greater than 0.
    ///
    /// ```
    /// // σ = 3 1/s, ω_d = 4 rad/s, J = 2 kg m²: 2·25 = 50 N m/rad.
    /// let decay = torqcomp_model::FreeDecay::new(3.0, 4.0)?;
    /// assert_eq!(decay.stiffness_n_m_per_rad(2.0)?, 50.0);
    /// // As printed, with f = 12: (4·4·16 + 144)/(4·2) = 400/8 = 50.
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn stiffness_n_m_per_rad(&self, inertia_kg_m2: f64) -> Result<f64, ModelError> {
        let inertia = positive("inertia", "kg m^2", inertia_kg_m2)?;
        Ok(inertia * self.natural_angular_frequency_rad_per_s().powi(2))
    }

    /// The stand that decays like this, given its inertia J in kg m².
    ///
    /// # Errors
    /// [`ModelError`] if J is not finite or not greater than 0.
    ///
    /// ```
    /// let stand = torqcomp_model::FreeDecay::new(3.0, 4.0)?.stand(2.0)?;
    /// assert_eq!(stand.stiffness_n_m_per_rad(), 50.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn stand(&self, inertia_kg_m2: f64) -> Result<SecondOrder, ModelError> {
        SecondOrder::new(
            inertia_kg_m2,
            self.damping_n_m_s_per_rad(inertia_kg_m2)?,
            self.stiffness_n_m_per_rad(inertia_kg_m2)?,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amplitudes_must_fall_on_one_side() {
        for (first, second) in [(1.0, 1.0), (1.0, 2.0), (1.0, -0.5), (1.0, 0.0), (0.0, 0.0)] {
            let got = decay_rate_per_s(first, second, 1.0);
            assert!(
                matches!(got, Err(ModelError::NotDecaying { .. })),
                "{first}, {second}"
            );
        }
        assert_eq!(
            decay_rate_per_s(-2.0, -0.5, 1.0),
            decay_rate_per_s(2.0, 0.5, 1.0)
        );
    }

    #[test]
    fn tiny_amplitudes_are_amplitudes() {
        // Their product underflows; their ratio does not.
        let rate = decay_rate_per_s(2e-200, 0.5e-200, 1.0).unwrap();
        assert!((rate - 4.0_f64.ln()).abs() < 1e-12, "{rate}");
    }

    #[test]
    fn impossible_decays_are_refused() {
        assert!(matches!(
            decay_rate_per_s(2.0, 1.0, 0.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            decay_rate_per_s(f64::NAN, 1.0, 1.0),
            Err(ModelError::NotFinite { .. })
        ));
        assert!(matches!(
            FreeDecay::new(-1.0, 1.0),
            Err(ModelError::Negative { .. })
        ));
        assert!(matches!(
            FreeDecay::new(1.0, 0.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            angular_frequency_rad_per_s(-1.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            viscous_from_friction_slope_n_m_s_per_rad(-1.0, 1.0),
            Err(ModelError::Negative { .. })
        ));
        let decay = FreeDecay::new(1.0, 1.0).unwrap();
        assert!(matches!(
            decay.stand(0.0),
            Err(ModelError::NotPositive { .. })
        ));
    }

    #[test]
    fn printed_form_of_c20_is_the_same() {
        let (sigma, omega, inertia) = (262.0, 3700.0, 5.85e-3);
        let decay = FreeDecay::new(sigma, omega).unwrap();
        let damping = decay.damping_n_m_s_per_rad(inertia).unwrap();
        let printed =
            (4.0 * inertia * inertia * omega * omega + damping * damping) / (4.0 * inertia);
        let got = decay.stiffness_n_m_per_rad(inertia).unwrap();
        assert!(
            (got / printed - 1.0).abs() < 1e-14,
            "{got} against {printed}"
        );
    }
}
