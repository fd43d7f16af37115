//! A unit: factor to SI and dimension.

use super::dimension::Dimension;
use super::error::QuantityError;
use super::grammar;
use super::symbols::Symbol;

/// A unit of measure, read from text.
///
/// The grammar is that of the module [`quantity`](crate::quantity). A number in this unit times
/// [`Unit::factor`] is the number in kg, m, s, A, K and rad. One hertz counts as one cycle of
/// 2π rad per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    factor: f64,
    dimension: Dimension,
    /// Kelvin at zero of the scale, not 0 only for a lone °C or °F.
    zero: f64,
    has_bare_pound: bool,
}

impl Unit {
    /// The unit of pure numbers.
    pub(super) const ONE: Self = Self {
        factor: 1.0,
        dimension: Dimension::NONE,
        zero: 0.0,
        has_bare_pound: false,
    };

    /// Reads a unit. Empty text and `1` are the unit of pure numbers.
    ///
    /// # Errors
    /// [`QuantityError`] if a symbol is unknown or the text does not follow the grammar.
    ///
    /// ```
    /// use torqcomp_model::Unit;
    /// // 1 ft lbf = 0.3048·4.4482216152605 N m.
    /// let unit = Unit::parse("ft-lbf/rad")?;
    /// assert!((unit.factor() - 1.355817948).abs() < 1e-9);
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, QuantityError> {
        grammar::read(text)
    }

    /// SI units per unit. For °C and °F this is the size of the degree.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Exponents of the base units.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Temperature in K at the zero of the scale, for a lone °C or °F; 0 otherwise.
    pub(super) fn zero(&self) -> f64 {
        self.zero
    }

    /// True if `lb` appears in the unit, which could be a mass or a force.
    pub(super) fn has_bare_pound(&self) -> bool {
        self.has_bare_pound
    }

    /// The unit of a symbol that stands alone, with the zero of its scale.
    pub(super) fn of_scale(symbol: &Symbol) -> Self {
        Self {
            zero: symbol.zero,
            ..Self::of_factor(symbol)
        }
    }

    /// The unit of a symbol inside a product: a degree is a difference there.
    pub(super) fn of_factor(symbol: &Symbol) -> Self {
        Self {
            factor: symbol.factor,
            dimension: symbol.dimension,
            zero: 0.0,
            has_bare_pound: symbol.is_bare_pound(),
        }
    }

    pub(super) fn times(self, other: Self) -> Self {
        Self {
            factor: self.factor * other.factor,
            dimension: self.dimension.times(other.dimension),
            zero: 0.0,
            has_bare_pound: self.has_bare_pound || other.has_bare_pound,
        }
    }

    pub(super) fn power(self, exponent: i32) -> Self {
        Self {
            factor: self.factor.powi(exponent),
            dimension: self.dimension.power(exponent),
            zero: 0.0,
            has_bare_pound: self.has_bare_pound,
        }
    }
}
