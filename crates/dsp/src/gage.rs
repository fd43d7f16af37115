//! Semiconductor and foil strain gages: resistance from strain and back.
//!
//! A semiconductor gage is nonlinear, and its sensitivity falls with rising absolute temperature.
//! [`Gage`] is the free gage with the law of its data sheet; [`Gage::bond`] gives a [`BondedGage`],
//! which includes the strain locked in by the glue and refers to the bonded resistance, the one a
//! bridge sees.
//!
//! Source: T. P. Hertel's thesis, Appendix B (data reduction after the
//! Baldwin-Lima-Hamilton *Semiconductor Strain Gage Handbook*, section 2).

/// An error in a gage or in a value given to it.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GageError {
    /// Invalid parameter.
    #[error("{what} must be {expected}, got {got}; correct the gage's data")]
    InvalidParameter {
        /// Name of the parameter.
        what: &'static str,
        /// The accepted range.
        expected: &'static str,
        /// The value.
        got: f64,
    },
    /// The strain lies beyond the validity of the law.
    #[error(
        "strain must keep the gage on the rising side of its parabola, below {limit} at {temperature_k} K, got {got}; \
         check the strain's unit (m/m, not microstrain)"
    )]
    StrainOutOfRange {
        /// Strain at the vertex of the parabola.
        limit: f64,
        /// Temperature, K.
        temperature_k: f64,
        /// The strain.
        got: f64,
    },
    /// No strain gives the resistance change, or no resistance remains.
    #[error(
        "resistance change must stay short of {limit}, got {got}; \
         check that it is a fraction of the unbonded resistance"
    )]
    ResistanceChangeOutOfRange {
        /// -1, or the change at the vertex of the parabola if that is nearer.
        limit: f64,
        /// The resistance change.
        got: f64,
    },
}

/// The change, if some resistance remains.
fn above_minus_one(got: f64) -> Result<f64, GageError> {
    match got > -1.0 {
        true => Ok(got),
        false => Err(GageError::ResistanceChangeOutOfRange { limit: -1.0, got }),
    }
}

fn finite(what: &'static str, got: f64) -> Result<f64, GageError> {
    let expected = "a finite number";
    match got.is_finite() {
        true => Ok(got),
        false => Err(GageError::InvalidParameter {
            what,
            expected,
            got,
        }),
    }
}

fn positive(what: &'static str, got: f64) -> Result<f64, GageError> {
    let expected = "finite and above zero";
    match got.is_finite() && got > 0.0 {
        true => Ok(got),
        false => Err(GageError::InvalidParameter {
            what,
            expected,
            got,
        }),
    }
}

/// Absolute temperature in kelvin from degrees Fahrenheit, `T = (F + 459.67) / 1.8`.
///
/// ```
/// use torqcomp_dsp::gage::kelvin_from_fahrenheit;
/// // 77 °F, the reference of the BLH table, is 25 °C.
/// assert!((kelvin_from_fahrenheit(77.0) - 298.15).abs() < 1e-12);
/// ```
pub fn kelvin_from_fahrenheit(temperature_f: f64) -> f64 {
    (temperature_f + 459.67) / 1.8
}

/// Apparent strain of a gage on a part that expands more than the gage,
/// `ε_a = Δα ΔT`.
///
/// `expansion_difference_per_k` is the part's linear expansion minus the gage's (1/K);
/// `temperature_change_k` the temperature rise since zeroing (K). Thesis Appendix B, temperature
/// correction (2), where the gage's own expansion is neglected. Valid while both coefficients are
/// constant.
///
/// ```
/// use torqcomp_dsp::gage::apparent_strain;
/// // Steel, 6.5 ppm/°F = 11.7 ppm/K, warmed by 10 °F = 10/1.8 K: 65 microstrain.
/// assert!((apparent_strain(11.7e-6, 10.0 / 1.8) - 65e-6).abs() < 1e-18);
/// ```
pub fn apparent_strain(expansion_difference_per_k: f64, temperature_change_k: f64) -> f64 {
    expansion_difference_per_k * temperature_change_k
}

/// Resistance after a fractional drift with temperature, `R = R₁ (1 + τ)`, ohm.
///
/// `resistance_ohm` is R₁; `resistance_drift` τ is read from the maker's curve
/// of R₀ against temperature (thesis Appendix B, temperature correction (1),
/// figure 8).
///
/// ```
/// use torqcomp_dsp::gage::drifted_resistance_ohm;
/// // 2 percent of 5900 ohm is 118 ohm.
/// assert!((drifted_resistance_ohm(5900.0, 0.02) - 6018.0).abs() < 1e-9);
/// ```
pub fn drifted_resistance_ohm(resistance_ohm: f64, resistance_drift: f64) -> f64 {
    resistance_ohm * (1.0 + resistance_drift)
}

/// The free gage: law of resistance against strain and temperature.
///
/// `ΔR/R₀ = GF (T₀/T) ε + C₂ (T₀/T)² ε²`
///
/// with the gage factor GF (-), the quadratic coefficient C₂ (-), the absolute
/// reference temperature T₀ (K), the unbonded resistance R₀ (ohm), the
/// temperature T (K) and the strain ε (m/m) from the unstressed state.
/// Thesis Appendix B, strain sensitivity table. GF is negative for N-type
/// silicon; C₂ = 0 makes the law a straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gage {
    gage_factor: f64,
    quadratic_coefficient: f64,
    reference_temperature_k: f64,
    unbonded_resistance_ohm: f64,
}

impl Gage {
    /// A gage from its data sheet; symbols as in [`Gage`].
    ///
    /// # Errors
    /// [`GageError::InvalidParameter`] when GF is zero, a value is not finite,
    /// or the temperature or the resistance is not above zero.
    pub fn new(
        gage_factor: f64,
        quadratic_coefficient: f64,
        reference_temperature_k: f64,
        unbonded_resistance_ohm: f64,
    ) -> Result<Self, GageError> {
        finite("gage factor", gage_factor)?;
        if gage_factor == 0.0 {
            return Err(GageError::InvalidParameter {
                what: "gage factor",
                expected: "other than zero",
                got: gage_factor,
            });
        }
        Ok(Self {
            gage_factor,
            quadratic_coefficient: finite("quadratic coefficient", quadratic_coefficient)?,
            reference_temperature_k: positive("reference temperature", reference_temperature_k)?,
            unbonded_resistance_ohm: positive("unbonded resistance", unbonded_resistance_ohm)?,
        })
    }

    /// Gage factor at the reference temperature, -.
    pub fn gage_factor(&self) -> f64 {
        self.gage_factor
    }

    /// Quadratic coefficient C₂ at the reference temperature, -.
    pub fn quadratic_coefficient(&self) -> f64 {
        self.quadratic_coefficient
    }

    /// Reference temperature T₀, K.
    pub fn reference_temperature_k(&self) -> f64 {
        self.reference_temperature_k
    }

    /// Resistance R₀ before bonding, unstressed, ohm.
    pub fn unbonded_resistance_ohm(&self) -> f64 {
        self.unbonded_resistance_ohm
    }

    /// Linear and quadratic coefficients at a temperature,
    /// `GF' = GF T₀/T` and `C₂' = C₂ (T₀/T)²` (Appendix B, eq. B2).
    ///
    /// # Errors
    /// [`GageError::InvalidParameter`] when the temperature is not above zero.
    ///
    /// ```
    /// use torqcomp_dsp::gage::Gage;
    /// let gage = Gage::new(150.0, 2000.0, 300.0, 5000.0)?;
    /// // Twice as hot: half the slope, a quarter of the curvature.
    /// assert_eq!(gage.coefficients(600.0)?, (75.0, 500.0));
    /// # Ok::<(), torqcomp_dsp::gage::GageError>(())
    /// ```
    pub fn coefficients(&self, temperature_k: f64) -> Result<(f64, f64), GageError> {
        let ratio = self.reference_temperature_k / positive("temperature", temperature_k)?;
        Ok((
            self.gage_factor * ratio,
            self.quadratic_coefficient * ratio * ratio,
        ))
    }

    /// Fractional resistance change `ΔR/R₀ = GF' ε + C₂' ε²` (Appendix B, table).
    ///
    /// # Errors
    /// [`GageError::InvalidParameter`] for an invalid strain or temperature;
    /// [`GageError::StrainOutOfRange`] at or past the vertex `ε = -GF'/(2 C₂')`, where the parabola
    /// turns back, unlike any gage; [`GageError::ResistanceChangeOutOfRange`] when the resistance
    /// vanishes.
    ///
    /// ```
    /// use torqcomp_dsp::gage::{Gage, kelvin_from_fahrenheit};
    /// let t0 = kelvin_from_fahrenheit(77.0);
    /// let gage = Gage::new(156.3, 2800.0, t0, 5900.0)?;
    /// // At T0: 156.3 * 1e-3 + 2800 * 1e-6 = 0.1591.
    /// assert!((gage.resistance_change(1e-3, t0)? - 0.1591).abs() < 1e-15);
    /// # Ok::<(), torqcomp_dsp::gage::GageError>(())
    /// ```
    pub fn resistance_change(&self, strain: f64, temperature_k: f64) -> Result<f64, GageError> {
        finite("strain", strain)?;
        let (linear, quadratic) = self.coefficients(temperature_k)?;
        if (linear + 2.0 * quadratic * strain) * linear <= 0.0 {
            let limit = -linear / (2.0 * quadratic);
            return Err(GageError::StrainOutOfRange {
                limit,
                temperature_k,
                got: strain,
            });
        }
        above_minus_one(strain * (linear + quadratic * strain))
    }

    /// Strain from a fractional resistance change, the inverse of
    /// [`resistance_change`](Self::resistance_change).
    ///
    /// `ε = 2ρ / (GF' + sgn(GF') √(GF'² + 4 C₂' ρ))` for `ρ = ΔR/R₀`: the root of the quadratic on
    /// the branch through the unstressed state, in the form without cancellation near zero.
    ///
    /// # Errors
    /// [`GageError::ResistanceChangeOutOfRange`] when no strain gives ρ or ρ ≤ -1;
    /// [`GageError::InvalidParameter`] for invalid values.
    ///
    /// ```
    /// use torqcomp_dsp::gage::Gage;
    /// let gage = Gage::new(150.0, 2500.0, 300.0, 5000.0)?;
    /// // 150 * 0.002 + 2500 * 4e-6 = 0.31.
    /// assert!((gage.strain(0.31, 300.0)? - 0.002).abs() < 1e-17);
    /// # Ok::<(), torqcomp_dsp::gage::GageError>(())
    /// ```
    pub fn strain(&self, resistance_change: f64, temperature_k: f64) -> Result<f64, GageError> {
        above_minus_one(finite("resistance change", resistance_change)?)?;
        let (linear, quadratic) = self.coefficients(temperature_k)?;
        let discriminant = linear * linear + 4.0 * quadratic * resistance_change;
        if discriminant < 0.0 {
            let limit = -linear * linear / (4.0 * quadratic);
            return Err(GageError::ResistanceChangeOutOfRange {
                limit,
                got: resistance_change,
            });
        }
        Ok(2.0 * resistance_change / (linear + linear.signum() * discriminant.sqrt()))
    }

    /// Strain ε_p locked in by bonding: [`strain`](Self::strain) of
    /// `(R_B - R₀)/R₀` (Appendix B, eq. B1).
    ///
    /// `bonded_resistance_ohm` R_B and the unbonded resistance are both taken
    /// at `temperature_k`, with no load on the part.
    ///
    /// # Errors
    /// As for [`strain`](Self::strain); [`GageError::InvalidParameter`] when R_B is not above zero.
    ///
    /// ```
    /// use torqcomp_dsp::gage::Gage;
    /// let gage = Gage::new(100.0, 0.0, 300.0, 5000.0)?;
    /// // (4950 - 5000) / 5000 = -0.01; over a gage factor of 100: -100 microstrain.
    /// assert!((gage.prestrain(4950.0, 300.0)? + 1e-4).abs() < 1e-18);
    /// # Ok::<(), torqcomp_dsp::gage::GageError>(())
    /// ```
    pub fn prestrain(
        &self,
        bonded_resistance_ohm: f64,
        temperature_k: f64,
    ) -> Result<f64, GageError> {
        let bonded = positive("bonded resistance", bonded_resistance_ohm)?;
        let free = self.unbonded_resistance_ohm;
        self.strain((bonded - free) / free, temperature_k)
    }

    /// The gage bonded to the part, with resistance R_B at the temperature at which it was measured
    /// after curing.
    ///
    /// # Errors
    /// As for [`prestrain`](Self::prestrain).
    pub fn bond(
        self,
        bonded_resistance_ohm: f64,
        bonding_temperature_k: f64,
    ) -> Result<BondedGage, GageError> {
        let prestrain = self.prestrain(bonded_resistance_ohm, bonding_temperature_k)?;
        Ok(BondedGage {
            gage: self,
            bonded_resistance_ohm,
            bonding_temperature_k,
            prestrain,
        })
    }
}

/// A gage bonded to the part; strains ε_x are relative to the bonded state.
///
/// The prestrain ε_p is computed once, at the bonding temperature T_B, and kept: temperature then
/// acts through the law's coefficients, through the drift of R₀ and through [`apparent_strain`],
/// which the caller adds to ε_x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BondedGage {
    gage: Gage,
    bonded_resistance_ohm: f64,
    bonding_temperature_k: f64,
    prestrain: f64,
}

impl BondedGage {
    /// The free gage.
    pub fn gage(&self) -> &Gage {
        &self.gage
    }

    /// Resistance R_B of the bonded gage with no load, ohm.
    pub fn bonded_resistance_ohm(&self) -> f64 {
        self.bonded_resistance_ohm
    }

    /// Temperature T_B at which R₀ and R_B were measured, K.
    pub fn bonding_temperature_k(&self) -> f64 {
        self.bonding_temperature_k
    }

    /// Strain ε_p locked in by bonding, m/m (Appendix B, eq. B1).
    pub fn prestrain(&self) -> f64 {
        self.prestrain
    }

    /// Gage factor in a constant-current circuit, referred to R_B
    /// (Appendix B, eq. B2).
    ///
    /// `GF_cc = (GF' + C₂' (2 ε_p + ε_x)) R₀/R_B`, the chord of the parabola
    /// from ε_p to ε_p + ε_x: `R_B GF_cc ε_x` is exactly the resistance step.
    ///
    /// # Errors
    /// As for [`Gage::resistance_change`] at ε_p + ε_x.
    ///
    /// ```
    /// use torqcomp_dsp::gage::Gage;
    /// let gage = Gage::new(100.0, 1000.0, 300.0, 1000.0)?.bond(1000.0, 300.0)?;
    /// // No prestrain: 100 + 1000 * 1e-3 = 101.
    /// assert!((gage.gage_factor_constant_current(1e-3, 300.0)? - 101.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_dsp::gage::GageError>(())
    /// ```
    pub fn gage_factor_constant_current(
        &self,
        strain: f64,
        temperature_k: f64,
    ) -> Result<f64, GageError> {
        self.gage
            .resistance_change(self.prestrain + strain, temperature_k)?;
        let (linear, quadratic) = self.gage.coefficients(temperature_k)?;
        let chord = linear + quadratic * (2.0 * self.prestrain + strain);
        Ok(chord * self.gage.unbonded_resistance_ohm / self.bonded_resistance_ohm)
    }

    /// Gage factor in a constant-voltage circuit (Appendix B, eqs. B3 and B4).
    ///
    /// `GF_cv = 2ΔR / ((2R_B + ΔR) ε_x)` with `ΔR = R_B ε_x GF_cc`, evaluated as the equivalent
    /// `2 GF_cc / (2 + ε_x GF_cc)`, which has the limit GF_cc at ε_x = 0. For an active arm facing
    /// a fixed equal resistor.
    ///
    /// # Errors
    /// As for [`gage_factor_constant_current`](Self::gage_factor_constant_current).
    ///
    /// ```
    /// use torqcomp_dsp::gage::Gage;
    /// let gage = Gage::new(100.0, 0.0, 300.0, 1000.0)?.bond(1000.0, 300.0)?;
    /// // 200 / (2 + 100 * 5e-3) = 80.
    /// assert!((gage.gage_factor_constant_voltage(5e-3, 300.0)? - 80.0).abs() < 1e-12);
    /// assert_eq!(gage.gage_factor_constant_voltage(0.0, 300.0)?, 100.0);
    /// # Ok::<(), torqcomp_dsp::gage::GageError>(())
    /// ```
    pub fn gage_factor_constant_voltage(
        &self,
        strain: f64,
        temperature_k: f64,
    ) -> Result<f64, GageError> {
        let current = self.gage_factor_constant_current(strain, temperature_k)?;
        Ok(2.0 * current / (2.0 + strain * current))
    }

    /// Coefficients `[a, b, c]` of the change seen by a bridge,
    /// `(R - R_B)/R_B = a + b ε_x + c ε_x²`.
    ///
    /// Expands [`resistance_ohm`](Self::resistance_ohm) about ε_p. `a` is the
    /// drift at no load and is exactly zero at T_B without drift.
    ///
    /// # Errors
    /// [`GageError::InvalidParameter`] for a temperature not above zero or a
    /// drift not above -1; [`GageError::StrainOutOfRange`] when the prestrain
    /// is past the vertex at this temperature.
    pub fn change_polynomial(
        &self,
        temperature_k: f64,
        resistance_drift: f64,
    ) -> Result<[f64; 3], GageError> {
        let drift = positive("one plus the resistance drift", 1.0 + resistance_drift)?;
        let (linear, quadratic) = self.gage.coefficients(temperature_k)?;
        let now = self.gage.resistance_change(self.prestrain, temperature_k)?;
        let at_bonding = self
            .gage
            .resistance_change(self.prestrain, self.bonding_temperature_k)?;
        let ratio = self.gage.unbonded_resistance_ohm / self.bonded_resistance_ohm;
        Ok([
            // Differences first, to cancel the 1 in 1 + ρ exactly.
            ratio * (resistance_drift * (1.0 + now) + (now - at_bonding)),
            ratio * drift * (linear + 2.0 * quadratic * self.prestrain),
            ratio * drift * quadratic,
        ])
    }

    /// Fractional change `ΔR/R_B` at strain ε_x and temperature T, without drift of R₀, as seen by
    /// the bridge.
    ///
    /// `ΔR/R_B = (R₀/R_B) (ρ(ε_p + ε_x, T) - ρ(ε_p, T_B))` with ρ of
    /// [`Gage::resistance_change`].
    ///
    /// # Errors
    /// As for [`Gage::resistance_change`] at ε_p + ε_x.
    ///
    /// ```
    /// use torqcomp_dsp::gage::Gage;
    /// let gage = Gage::new(100.0, 0.0, 300.0, 1000.0)?.bond(800.0, 300.0)?;
    /// // 100 * 1e-3 of 1000 ohm is 100 ohm, an eighth of 800 ohm.
    /// assert!((gage.active_change(1e-3, 300.0)? - 0.125).abs() < 1e-15);
    /// # Ok::<(), torqcomp_dsp::gage::GageError>(())
    /// ```
    pub fn active_change(&self, strain: f64, temperature_k: f64) -> Result<f64, GageError> {
        self.gage
            .resistance_change(self.prestrain + strain, temperature_k)?;
        let [offset, linear, quadratic] = self.change_polynomial(temperature_k, 0.0)?;
        Ok(offset + strain * (linear + quadratic * strain))
    }

    /// Resistance `R = R₀ (1 + τ) (1 + ρ(ε_p + ε_x, T))`, ohm.
    ///
    /// τ (`resistance_drift`) is the fractional change of R₀ between T_B and T from the maker's
    /// curve (thesis figure 8). At ε_x = 0, T = T_B, τ = 0 this is R_B.
    ///
    /// # Errors
    /// As for [`Gage::resistance_change`]; [`GageError::InvalidParameter`] for a drift that is not
    /// finite.
    ///
    /// ```
    /// use torqcomp_dsp::gage::Gage;
    /// let gage = Gage::new(100.0, 0.0, 300.0, 1000.0)?.bond(800.0, 300.0)?;
    /// // (800 + 100) ohm, 2 percent up: 918 ohm.
    /// assert!((gage.resistance_ohm(1e-3, 300.0, 0.02)? - 918.0).abs() < 1e-9);
    /// # Ok::<(), torqcomp_dsp::gage::GageError>(())
    /// ```
    pub fn resistance_ohm(
        &self,
        strain: f64,
        temperature_k: f64,
        resistance_drift: f64,
    ) -> Result<f64, GageError> {
        let free = drifted_resistance_ohm(
            self.gage.unbonded_resistance_ohm,
            finite("resistance drift", resistance_drift)?,
        );
        let change = self
            .gage
            .resistance_change(self.prestrain + strain, temperature_k)?;
        Ok(free * (1.0 + change))
    }
}
