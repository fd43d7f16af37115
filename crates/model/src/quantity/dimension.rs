//! Dimensions as exponents of the base units.

use std::fmt;

/// Symbols of the base units, in the order of the exponents.
const BASE: [&str; 6] = ["kg", "m", "s", "A", "K", "rad"];

/// Exponents of kg, m, s, A, K and rad.
///
/// The radian counts as a base unit although SI calls it dimensionless, so that angles and cycles
/// are not confused.
///
/// ```
/// use torqcomp_model::Unit;
/// let stiffness = Unit::parse("N m/rad")?.dimension();
/// assert_eq!(stiffness.to_string(), "kg m^2 s^-2 rad^-1");
/// # Ok::<(), torqcomp_model::QuantityError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dimension([i32; 6]);

impl Dimension {
    /// No dimension: a pure number.
    pub const NONE: Self = Self([0; 6]);
    /// Mass.
    pub const MASS: Self = Self([1, 0, 0, 0, 0, 0]);
    /// Time.
    pub const TIME: Self = Self([0, 0, 1, 0, 0, 0]);
    /// Force.
    pub const FORCE: Self = Self([1, 1, -2, 0, 0, 0]);
    /// Torque.
    pub const TORQUE: Self = Self([1, 2, -2, 0, 0, 0]);
    /// Electric current.
    pub const CURRENT: Self = Self([0, 0, 0, 1, 0, 0]);
    /// Voltage.
    pub const VOLTAGE: Self = Self([1, 2, -3, -1, 0, 0]);

    /// From the exponents of kg, m, s, A, K and rad, in this order.
    ///
    /// ```
    /// use torqcomp_model::Dimension;
    /// assert_eq!(Dimension::new([1, 1, -2, 0, 0, 0]).to_string(), "kg m s^-2");
    /// ```
    pub const fn new(exponents: [i32; 6]) -> Self {
        Self(exponents)
    }

    /// Dimension of a product: adds the exponents.
    pub(super) fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    /// Dimension of a power: multiplies the exponents.
    pub(super) fn power(self, exponent: i32) -> Self {
        Self(self.0.map(|e| e * exponent))
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Self::NONE {
            return f.write_str("1");
        }
        let mut gap = "";
        for (symbol, exponent) in BASE.iter().zip(self.0) {
            match exponent {
                0 => continue,
                1 => write!(f, "{gap}{symbol}")?,
                _ => write!(f, "{gap}{symbol}^{exponent}")?,
            }
            gap = " ";
        }
        Ok(())
    }
}
