//! A number with its standard uncertainty and its origin.

use std::borrow::Cow;
use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use super::error::QuantityError;
use super::estimates::slope;
use super::kind::{Kind, UnitSystem};

/// Unit of a number.
#[derive(Debug, Clone, PartialEq)]
pub enum Measure {
    /// A kind of quantity, in its SI unit.
    Kind(Kind),
    /// A unit as text, such as `1/s^2`; empty for a ratio.
    Unit(Cow<'static, str>),
}

impl From<Kind> for Measure {
    fn from(kind: Kind) -> Self {
        Self::Kind(kind)
    }
}

impl From<&'static str> for Measure {
    fn from(unit: &'static str) -> Self {
        Self::Unit(unit.into())
    }
}

impl From<String> for Measure {
    fn from(unit: String) -> Self {
        Self::Unit(unit.into())
    }
}

/// An estimate of a quantity, in the SI unit of its kind or in a unit given as text.
///
/// The uncertainty is a standard uncertainty (one standard deviation). `None` means that none is
/// known; it is never written as 0. Serialised as `value`, `std` and `unit`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(into = "StatedEstimate")]
#[schemars(from = "StatedEstimate")]
pub struct Estimate {
    measure: Measure,
    value: f64,
    std_uncertainty: Option<f64>,
    source: Cow<'static, str>,
}

impl Estimate {
    /// An estimate from its value and standard uncertainty, both in the SI unit of the kind or in the
    /// given unit, and its origin, such as `drawing` or `fitted: decay.csv`.
    ///
    /// # Errors
    /// [`QuantityError`] if a number is not finite or the uncertainty is negative.
    ///
    /// ```
    /// use torqcomp_model::{Estimate, Kind};
    /// let stiffness = Estimate::new(Kind::AngularStiffness, 1.1e5, Some(2.7e3), "drawing")?;
    /// assert_eq!(stiffness.to_string(), "(110000 ± 2700) N m/rad [drawing]");
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn new(
        measure: impl Into<Measure>,
        value: f64,
        std_uncertainty: Option<f64>,
        source: impl Into<Cow<'static, str>>,
    ) -> Result<Self, QuantityError> {
        let estimate = Self::of(measure, value, std_uncertainty).with_source(source);
        let named = [
            ("value", Some(value)),
            ("standard uncertainty", std_uncertainty),
        ];
        for (part, number) in named {
            if let Some(value) = number.filter(|number| !number.is_finite()) {
                return Err(QuantityError::EstimateNotFinite {
                    part,
                    kind: estimate.name().to_owned(),
                    origin: estimate.source.into_owned(),
                    value,
                });
            }
        }
        if let Some(std) = std_uncertainty.filter(|std| *std < 0.0) {
            return Err(QuantityError::NegativeUncertainty {
                got: std.to_string(),
            });
        }
        Ok(estimate)
    }

    /// An unchecked estimate of computed numbers, without a source; a non-finite value means unknown.
    ///
    /// ```
    /// let ratio = torqcomp_model::Estimate::of("1/s^2", 25.0, Some(0.5));
    /// assert_eq!((ratio.value(), ratio.unit()), (25.0, "1/s^2"));
    /// ```
    #[must_use]
    pub fn of(measure: impl Into<Measure>, value: f64, std_uncertainty: Option<f64>) -> Self {
        Self {
            measure: measure.into(),
            value,
            std_uncertainty,
            source: Cow::Borrowed(""),
        }
    }

    /// Sets the source.
    #[must_use]
    pub fn with_source(self, source: impl Into<Cow<'static, str>>) -> Self {
        Self {
            source: source.into(),
            ..self
        }
    }

    /// An estimate from text: its value and, if known, its standard uncertainty, each with a unit.
    ///
    /// # Errors
    /// [`QuantityError`] if a text cannot be read as `kind`, see [`Kind::parse`] and
    /// [`Kind::parse_std`].
    ///
    /// ```
    /// use torqcomp_model::{Estimate, Kind};
    /// let radius = Estimate::parse(Kind::Length, "2 in", Some("0.1 in"), "drawing")?;
    /// assert_eq!(radius.value(), 0.0508);
    /// assert!((radius.std_uncertainty().unwrap() - 0.00254).abs() < 1e-15);
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn parse(
        kind: Kind,
        value: &str,
        std_uncertainty: Option<&str>,
        source: impl Into<Cow<'static, str>>,
    ) -> Result<Self, QuantityError> {
        let std_uncertainty = std_uncertainty
            .map(|text| kind.parse_std(text, value))
            .transpose()?;
        Self::new(kind, kind.parse(value)?, std_uncertainty, source)
    }

    /// An estimate of `kind` computed from others: y = f(x₁ … x_n).
    ///
    /// The standard uncertainty follows from the law of propagation, first order and for
    /// uncorrelated inputs (JCGM 100:2008, clause 5.1.2, equation 10):
    ///
    /// u²(y) = Σ (∂f/∂x_i)² u²(x_i)
    ///
    /// with central differences for ∂f/∂x_i. **An input without an uncertainty counts as exact.**
    /// The result has an uncertainty if at least one input has one. `f` gets the values of `inputs`
    /// in their order, in SI units, and returns y in the SI unit of `kind`. Valid while f is nearly
    /// linear over x_i ± u(x_i).
    ///
    /// # Errors
    /// [`QuantityError::EstimateNotFinite`] if `f` is not finite at or near the inputs.
    ///
    /// ```
    /// use torqcomp_model::{Estimate, Kind};
    /// // T = r F = 2·3 = 6; u² = (3·0.1)² + (2·0.2)² = 0.09 + 0.16, u = 0.5.
    /// let radius = Estimate::new(Kind::Length, 2.0, Some(0.1), "drawing")?;
    /// let force = Estimate::new(Kind::Force, 3.0, Some(0.2), "scale")?;
    /// let torque = Estimate::derive(Kind::Torque, "r F", &[&radius, &force], |x| x[0] * x[1])?;
    /// assert!((torque.std_uncertainty().unwrap() - 0.5).abs() < 1e-9);
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn derive(
        kind: Kind,
        source: impl Into<Cow<'static, str>>,
        inputs: &[&Self],
        f: impl Fn(&[f64]) -> f64,
    ) -> Result<Self, QuantityError> {
        let mut x: Vec<f64> = inputs.iter().map(|input| input.value).collect();
        let value = f(&x);
        let mut std_uncertainty = None;
        for (i, input) in inputs.iter().enumerate() {
            let Some(std) = input.std_uncertainty else {
                continue;
            };
            let term = if std > 0.0 {
                std * slope(&f, &mut x, i, std)
            } else {
                0.0
            };
            std_uncertainty = Some(term.hypot(std_uncertainty.unwrap_or(0.0)));
        }
        Self::new(kind, value, std_uncertainty, source)
    }

    /// Unit of value and uncertainty; empty for a ratio.
    #[must_use]
    pub fn unit(&self) -> &str {
        match &self.measure {
            Measure::Kind(kind) => match kind.unit(UnitSystem::Si) {
                "1" => "",
                unit => unit,
            },
            Measure::Unit(unit) => unit,
        }
    }

    /// Name of the kind, or the unit.
    fn name(&self) -> &str {
        match &self.measure {
            Measure::Kind(kind) => kind.name(),
            Measure::Unit(unit) => unit,
        }
    }

    /// Value in the SI unit of the kind, or in the given unit.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Standard uncertainty in the same unit, if known.
    pub fn std_uncertainty(&self) -> Option<f64> {
        self.std_uncertainty
    }

    /// Standard uncertainty over the magnitude of the value, if known.
    #[must_use]
    pub fn relative_std(&self) -> Option<f64> {
        Some(self.std_uncertainty? / self.value.abs())
    }

    /// Origin of the estimate.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Value, uncertainty and unit as text, without the source.
    ///
    /// The uncertainty has two significant digits and the value the same number of decimals;
    /// without an uncertainty the value has six significant digits.
    ///
    /// ```
    /// use torqcomp_model::{Estimate, Kind, UnitSystem};
    /// let length = Estimate::new(Kind::Length, 0.0381, Some(0.000254), "drawing")?;
    /// assert_eq!(length.text(UnitSystem::Us), "(1.500 ± 0.010) in");
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn text(&self, system: UnitSystem) -> String {
        let (value, std, unit) = match &self.measure {
            Measure::Kind(kind) => (
                kind.to(system, self.value),
                self.std_uncertainty
                    .map(|std| kind.difference_to(system, std)),
                kind.unit(system),
            ),
            Measure::Unit(unit) => (self.value, self.std_uncertainty, unit.as_ref()),
        };
        let unit = match unit {
            "1" | "" => String::new(),
            unit => format!(" {unit}"),
        };
        match std {
            None => format!("{}{unit}", significant(value, 6)),
            Some(0.0) => format!("({} ± 0){unit}", significant(value, 6)),
            Some(std) => format!("{}{unit}", with_uncertainty(value, std)),
        }
    }
}

/// An estimate in a document.
#[derive(Serialize, JsonSchema)]
struct StatedEstimate {
    /// Value, in `unit`; `null` if infinite.
    #[schemars(with = "Option<f64>")]
    value: f64,
    /// Standard uncertainty of the value, in `unit`; `null` if unknown.
    std: Option<f64>,
    /// Unit of value and uncertainty; 1 for a plain number.
    unit: String,
}

impl From<Estimate> for StatedEstimate {
    fn from(estimate: Estimate) -> Self {
        Self {
            value: estimate.value,
            std: estimate.std_uncertainty,
            unit: estimate.unit().to_owned(),
        }
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} [{}]", self.text(UnitSystem::Si), self.source)
    }
}

/// Decimal exponent of a number after rounding to `digits` significant digits.
fn exponent(value: f64, digits: usize) -> i32 {
    let text = format!("{value:.*e}", digits - 1);
    text.split_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok())
        .unwrap_or(0)
}

/// Whether a number of this size is readable without a power of ten.
fn is_plain(exponent: i32) -> bool {
    (-4..6).contains(&exponent)
}

/// A number with this many significant digits, without trailing zeros.
fn significant(value: f64, digits: usize) -> String {
    let size = exponent(value, digits);
    let trim = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    if value == 0.0 || is_plain(size) {
        let decimals = (digits as i32 - 1 - size).max(0) as usize;
        return trim(&format!("{value:.decimals$}"));
    }
    format!("{}e{size}", trim(&scaled(value, size, digits - 1)))
}

/// value/10^size with this many decimals; in two steps, as 10^size alone may overflow or underflow.
fn scaled(value: f64, size: i32, decimals: usize) -> String {
    let half = size / 2;
    let number = value / 10_f64.powi(half) / 10_f64.powi(size - half);
    format!("{number:.decimals$}")
}

/// `(value ± std)` with two digits of `std`, both to the same decimal place.
fn with_uncertainty(value: f64, std: f64) -> String {
    let last = exponent(std, 2) - 1;
    let size = match value == 0.0 {
        true => last + 1,
        false => exponent(value, 6).max(last + 1),
    };
    // Rounds left of the decimal point, which formatting alone would not.
    let round = |number: f64| match last > 0 {
        true => (number / 10_f64.powi(last)).round() * 10_f64.powi(last),
        false => number,
    };
    if is_plain(size) && is_plain(last) {
        let decimals = (-last).max(0) as usize;
        return format!("({:.decimals$} ± {:.decimals$})", round(value), round(std));
    }
    let decimals = (size - last).max(0) as usize;
    format!(
        "({} ± {})e{size}",
        scaled(value, size, decimals),
        scaled(std, size, decimals)
    )
}
