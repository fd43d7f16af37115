//! A unit: factor to SI and dimension.

use super::dimension::Dimension;
use super::error::QuantityError;
use super::grammar;
use super::kind::number_length;
use super::symbols::Symbol;

/// A unit of measure, read from text.
///
/// For the grammar see the module [`quantity`](crate::quantity). A number in this unit times
/// [`Unit::factor`] is the number in kg, m, s, A, K and rad. One hertz is one cycle of 2π rad per
/// second.
#[derive(Debug, Clone, Copy)]
pub struct Unit {
    factor: f64,
    dimension: Dimension,
    /// Kelvin at zero of the scale, nonzero only for °C or °F alone.
    zero: f64,
    parts: UnitParts,
}

/// Properties of a unit not visible in its dimension.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct UnitParts {
    bare_weight: bool,
    voltage: bool,
    strain: bool,
    hertz: bool,
}

impl UnitParts {
    fn and(self, other: Self) -> Self {
        Self {
            bare_weight: self.bare_weight || other.bare_weight,
            voltage: self.voltage || other.voltage,
            strain: self.strain || other.strain,
            hertz: self.hertz || other.hertz,
        }
    }
}

/// By meaning: `Nm` is `N m`, of whose parts one could be that of a strain.
impl PartialEq for Unit {
    fn eq(&self, other: &Self) -> bool {
        let meaning = |unit: &Self| (unit.dimension, unit.ratio_of(), unit.is_hertz());
        self.factor == other.factor
            && self.zero == other.zero
            && self.parts.bare_weight == other.parts.bare_weight
            && meaning(self) == meaning(other)
    }
}

/// Kind of ratio expressed by a dimensionless unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RatioOf {
    /// Output of a bridge over its excitation: `mV/V`, `uV/V`, `% V/V`.
    Voltages,
    /// Lengths: `ustrain`, `µm/m`, `in/in`, `% strain`.
    Lengths,
    /// Anything: `%`, `ppm`, counts, divisions.
    Anything,
}

impl Unit {
    /// The unit of pure numbers.
    pub(super) const ONE: Self = Self {
        factor: 1.0,
        dimension: Dimension::NONE,
        zero: 0.0,
        parts: UnitParts {
            bare_weight: false,
            voltage: false,
            strain: false,
            hertz: false,
        },
    };

    /// Parses a unit. Empty text and `1` are the unit of pure numbers.
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

    /// The unit of a quantity such as `2.0012 mV/V`.
    ///
    /// # Errors
    /// As for [`Unit::parse`].
    ///
    /// ```
    /// use torqcomp_model::{RatioOf, Unit};
    /// let unit = Unit::of_quantity("-2.0012 mV/V")?;
    /// assert_eq!((unit.factor(), unit.ratio_of()), (1e-3, Some(RatioOf::Voltages)));
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn of_quantity(text: &str) -> Result<Self, QuantityError> {
        let text = text.trim();
        Self::parse(&text[number_length(text)..])
    }

    /// A unit text with its masses read as forces, and as unambiguous masses; `None` without a
    /// mass.
    ///
    /// ```
    /// use torqcomp_model::Unit;
    /// let [force, mass] = Unit::readings_of_weight("in-lb").unwrap();
    /// assert_eq!((force.as_str(), mass.as_str()), ("in-lbf", "in-lbm"));
    /// ```
    #[must_use]
    pub fn readings_of_weight(text: &str) -> Option<[String; 2]> {
        grammar::readings_of_weight(text)
    }

    /// SI units per unit. For °C and °F this is the size of the degree.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Exponents of the base units.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Temperature in K at the zero of the scale, for °C or °F alone; 0 otherwise.
    pub(super) fn zero(&self) -> f64 {
        self.zero
    }

    /// Whether the unit contains `lb` or `oz`, which could be a mass or a force.
    pub fn has_bare_weight(&self) -> bool {
        self.parts.bare_weight
    }

    /// Whether the unit contains volts, even where they cancel.
    pub(super) fn has_voltage(&self) -> bool {
        self.parts.voltage
    }

    /// Whether it is a frequency in hertz rather than a speed in rpm or rad/s.
    pub fn is_hertz(&self) -> bool {
        self.parts.hertz && self.dimension == Dimension::new([0, 0, -1, 0, 0, 1])
    }

    /// Kind of ratio expressed by a dimensionless unit; `None` for a unit with a dimension.
    ///
    /// ```
    /// use torqcomp_model::{RatioOf, Unit};
    /// let of = |text| Unit::parse(text).unwrap().ratio_of();
    /// assert_eq!(of("mV/V"), Some(RatioOf::Voltages));
    /// assert_eq!(of("um/m"), Some(RatioOf::Lengths));
    /// // Percent of what?
    /// assert_eq!(of("%"), Some(RatioOf::Anything));
    /// assert_eq!(of("V"), None);
    /// ```
    pub fn ratio_of(&self) -> Option<RatioOf> {
        if self.dimension != Dimension::NONE {
            return None;
        }
        Some(match self.parts {
            UnitParts { voltage: true, .. } => RatioOf::Voltages,
            UnitParts { strain: true, .. } => RatioOf::Lengths,
            _ => RatioOf::Anything,
        })
    }

    /// The unit of a single symbol, with the zero of its scale.
    pub(super) fn of_scale(symbol: &Symbol) -> Self {
        Self {
            zero: symbol.zero,
            ..Self::of_factor(symbol)
        }
    }

    /// The unit of a symbol inside a product, where a degree is a difference.
    pub(super) fn of_factor(symbol: &Symbol) -> Self {
        Self {
            factor: symbol.factor,
            dimension: symbol.dimension,
            zero: 0.0,
            parts: UnitParts {
                bare_weight: symbol.is_bare_weight(),
                voltage: symbol.is_voltage(),
                strain: symbol.is_of_strain(),
                hertz: symbol.is_hertz(),
            },
        }
    }

    pub(super) fn times(self, other: Self) -> Self {
        Self {
            factor: self.factor * other.factor,
            dimension: self.dimension.times(other.dimension),
            zero: 0.0,
            parts: self.parts.and(other.parts),
        }
    }

    pub(super) fn power(self, exponent: i32) -> Self {
        Self {
            factor: self.factor.powi(exponent),
            dimension: self.dimension.power(exponent),
            zero: 0.0,
            parts: self.parts,
        }
    }
}
