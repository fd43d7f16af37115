//! A number with its standard uncertainty and its origin.

use std::fmt;

use super::error::QuantityError;
use super::kind::{Kind, UnitSystem};

/// Relative step of the central differences: the cube root of the spacing of floats, where the
/// errors of truncation and rounding are about equal.
const STEP: f64 = 6.055_454_452_393_343e-6;

/// An estimate of a quantity, in the SI unit of its kind.
///
/// The uncertainty is a standard uncertainty (one standard deviation). `None` means that none is
/// known; it is never written as 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    kind: Kind,
    value: f64,
    std_uncertainty: Option<f64>,
    source: String,
}

impl Estimate {
    /// An estimate from its value and standard uncertainty, both in the SI unit of `kind`, and
    /// from its origin, such as `drawing` or `fitted: decay.csv`.
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
        kind: Kind,
        value: f64,
        std_uncertainty: Option<f64>,
        source: impl Into<String>,
    ) -> Result<Self, QuantityError> {
        let source = source.into();
        let named = [
            ("value", Some(value)),
            ("standard uncertainty", std_uncertainty),
        ];
        for (part, number) in named {
            if let Some(value) = number.filter(|number| !number.is_finite()) {
                let (kind, origin) = (kind.name(), source);
                return Err(QuantityError::EstimateNotFinite {
                    part,
                    kind,
                    origin,
                    value,
                });
            }
        }
        if let Some(std) = std_uncertainty.filter(|std| *std < 0.0) {
            return Err(QuantityError::NegativeUncertainty {
                got: std.to_string(),
            });
        }
        Ok(Self {
            kind,
            value,
            std_uncertainty,
            source,
        })
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
        source: impl Into<String>,
    ) -> Result<Self, QuantityError> {
        let std_uncertainty = std_uncertainty
            .map(|text| kind.parse_std(text))
            .transpose()?;
        Self::new(kind, kind.parse(value)?, std_uncertainty, source)
    }

    /// An estimate of `kind` computed from others: y = f(x₁ … x_n).
    ///
    /// The standard uncertainty follows from the law of propagation, first order and for inputs
    /// that are not correlated (JCGM 100:2008, clause 5.1.2, equation 10):
    ///
    /// u²(y) = Σ (∂f/∂x_i)² u²(x_i)
    ///
    /// with central differences for ∂f/∂x_i. **An input without an uncertainty counts as exact.**
    /// The result has an uncertainty if at least one input has one. `f` gets the values of
    /// `inputs` in their order, in SI units, and returns y in the SI unit of `kind`. Valid while
    /// f is nearly linear over x_i ± u(x_i).
    ///
    /// # Errors
    /// [`QuantityError::EstimateNotFinite`] if `f` gives no finite number at or beside the inputs.
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
        source: impl Into<String>,
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

    /// Kind of the quantity.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Value in the SI unit of the kind.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Standard uncertainty in the SI unit of the kind, if known.
    pub fn std_uncertainty(&self) -> Option<f64> {
        self.std_uncertainty
    }

    /// Where the estimate comes from.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Value, uncertainty and unit for a reader, without the source.
    ///
    /// The uncertainty has two significant digits and the value ends where it does; without an
    /// uncertainty the value has six.
    ///
    /// ```
    /// use torqcomp_model::{Estimate, Kind, UnitSystem};
    /// let length = Estimate::new(Kind::Length, 0.0381, Some(0.000254), "drawing")?;
    /// assert_eq!(length.text(UnitSystem::Us), "(1.500 ± 0.010) in");
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn text(&self, system: UnitSystem) -> String {
        let value = self.kind.to(system, self.value);
        let unit = match self.kind.unit(system) {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        match self
            .std_uncertainty
            .map(|std| self.kind.difference_to(system, std))
        {
            None => format!("{}{unit}", significant(value, 6)),
            Some(0.0) => format!("({} ± 0){unit}", significant(value, 6)),
            Some(std) => format!("{}{unit}", with_uncertainty(value, std)),
        }
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} [{}]", self.text(UnitSystem::Si), self.source)
    }
}

/// ∂f/∂x_i by central differences; leaves `x` as it was.
fn slope(f: impl Fn(&[f64]) -> f64, x: &mut [f64], i: usize, std: f64) -> f64 {
    let centre = x[i];
    let step = STEP * centre.abs().max(std);
    x[i] = centre + step;
    let (upper, above) = (x[i], f(x));
    x[i] = centre - step;
    let (lower, below) = (x[i], f(x));
    x[i] = centre;
    // The steps as the floats took them, not as asked.
    (above - below) / (upper - lower)
}

/// Decimal exponent of a number after rounding to `digits` significant digits.
fn exponent(value: f64, digits: usize) -> i32 {
    let text = format!("{value:.*e}", digits - 1);
    text.split_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok())
        .unwrap_or(0)
}

/// True if a number of this size reads well without a power of ten.
fn is_plain(exponent: i32) -> bool {
    (-4..6).contains(&exponent)
}

/// A number with so many significant digits, without trailing zeros.
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

/// value/10^size with so many decimals; in two steps, as 10^size alone may leave the range.
fn scaled(value: f64, size: i32, decimals: usize) -> String {
    let half = size / 2;
    let number = value / 10_f64.powi(half) / 10_f64.powi(size - half);
    format!("{number:.decimals$}")
}

/// `(value ± std)` with two digits of `std`, both at the same decimal place.
fn with_uncertainty(value: f64, std: f64) -> String {
    let last = exponent(std, 2) - 1;
    let size = match value == 0.0 {
        true => last + 1,
        false => exponent(value, 6).max(last + 1),
    };
    // Rounds at a place left of the point, where formatting alone would not.
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
