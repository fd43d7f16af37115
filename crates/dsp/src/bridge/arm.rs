//! Resistance change of one active arm against strain.

use super::BridgeError;
use crate::gage::BondedGage;

/// Relative change of an active arm, `δ(ε) = a + b ε + c ε²`.
///
/// `a` (-) is the change at no load, `b` (-) the gage factor referred to the unstrained arm, `c`
/// (-) the curvature; ε (m/m) the strain from the bonded state. Covers a foil gage (a = c = 0) and,
/// exactly, the bonded semiconductor gage of thesis Appendix B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmLaw {
    offset: f64,
    linear: f64,
    quadratic: f64,
}

impl ArmLaw {
    /// The law from its coefficients `a`, `b`, `c`.
    ///
    /// # Errors
    /// [`BridgeError::InvalidParameter`] when a coefficient is not finite, the
    /// offset is not above -1 (no resistance left) or the linear one is zero.
    pub fn new(offset: f64, linear: f64, quadratic: f64) -> Result<Self, BridgeError> {
        let check = |what, expected, got: f64, good: bool| match got.is_finite() && good {
            true => Ok(()),
            false => Err(BridgeError::InvalidParameter {
                what,
                expected,
                got,
            }),
        };
        check("arm offset", "finite and above -1", offset, offset > -1.0)?;
        check(
            "arm gage factor",
            "finite and not zero",
            linear,
            linear != 0.0,
        )?;
        check(
            "arm quadratic coefficient",
            "a finite number",
            quadratic,
            true,
        )?;
        Ok(Self {
            offset,
            linear,
            quadratic,
        })
    }

    /// A gage of constant gage factor, `δ = GF ε`.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn foil(gage_factor: f64) -> Result<Self, BridgeError> {
        Self::new(0.0, gage_factor, 0.0)
    }

    /// A bonded gage at a temperature (K), with the fractional drift of its unbonded resistance
    /// since bonding; relative to its bonded resistance.
    ///
    /// # Errors
    /// [`BridgeError::Gage`] for an impossible state of the gage; as for [`new`](Self::new).
    pub fn from_gage(
        gage: &BondedGage,
        temperature_k: f64,
        resistance_drift: f64,
    ) -> Result<Self, BridgeError> {
        let [offset, linear, quadratic] =
            gage.change_polynomial(temperature_k, resistance_drift)?;
        Self::new(offset, linear, quadratic)
    }

    /// Change at no load `a`, -.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Relative change `δ(ε)`, -.
    ///
    /// ```
    /// use torqcomp_dsp::bridge::ArmLaw;
    /// // 0.01 + 100 * 2e-3 + 2500 * 4e-6 = 0.22.
    /// let law = ArmLaw::new(0.01, 100.0, 2500.0)?;
    /// assert!((law.change(2e-3) - 0.22).abs() < 1e-15);
    /// # Ok::<(), torqcomp_dsp::bridge::BridgeError>(())
    /// ```
    pub fn change(&self, strain: f64) -> f64 {
        self.offset + self.change_from_zero(strain)
    }

    /// Change from the unstrained state `b ε + c ε²`, -.
    pub fn change_from_zero(&self, strain: f64) -> f64 {
        strain * (self.linear + self.quadratic * strain)
    }

    /// Local gage factor `dδ/dε = b + 2 c ε`, -.
    pub fn slope(&self, strain: f64) -> f64 {
        self.linear + 2.0 * self.quadratic * strain
    }

    /// Range of strain, within ±1, with positive resistance and before the vertex of the parabola,
    /// so that the voltage determines the strain.
    ///
    /// ```
    /// use torqcomp_dsp::bridge::ArmLaw;
    /// // A foil gage of factor 2 has no resistance left at -0.5.
    /// assert_eq!(ArmLaw::foil(2.0)?.strain_range(), (-0.5, 1.0));
    /// # Ok::<(), torqcomp_dsp::bridge::BridgeError>(())
    /// ```
    pub fn strain_range(&self) -> (f64, f64) {
        // In x = sgn(b) ε the resistance A + |b| x + c x² rises through x = 0.
        let (rest, rise, bend) = (1.0 + self.offset, self.linear.abs(), self.quadratic);
        let discriminant = rise * rise - 4.0 * rest * bend;
        let low = if discriminant > 0.0 {
            -2.0 * rest / (rise + discriminant.sqrt())
        } else {
            -rise / (2.0 * bend)
        };
        let high = if bend < 0.0 {
            -rise / (2.0 * bend)
        } else {
            1.0
        };
        let (low, high) = (low.max(-1.0), high.min(1.0));
        if self.linear > 0.0 {
            (low, high)
        } else {
            (-high, -low)
        }
    }
}
