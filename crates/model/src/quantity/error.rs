//! Errors of numbers with units.

use thiserror::Error;

use super::dimension::Dimension;

/// An error in a number, its unit or its uncertainty.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// The text is empty.
    #[error("the text is empty; expected {expected}, for example \"{example}\"")]
    Empty {
        /// Name of the kind expected.
        expected: &'static str,
        /// A valid text.
        example: &'static str,
    },
    /// The text does not start with a number.
    #[error(
        "\"{text}\" does not start with a number; write the number with a decimal point and \
         without thousands marks, for example \"{example}\""
    )]
    NotANumber {
        /// The text.
        text: String,
        /// A valid text.
        example: &'static str,
    },
    /// The number, or the number in SI units, is not finite.
    #[error("\"{text}\" is not a finite number; check the input")]
    NotFinite {
        /// The text.
        text: String,
    },
    /// A number without its unit.
    #[error("\"{text}\" has no unit; expected {expected} with its unit, for example \"{example}\"")]
    MissingUnit {
        /// The text.
        text: String,
        /// Name of the kind expected.
        expected: &'static str,
        /// A valid text.
        example: &'static str,
    },
    /// A symbol is not a known unit.
    #[error("unknown unit \"{symbol}\" in \"{unit}\"{}", hint(*.nearest))]
    UnknownUnit {
        /// The symbol.
        symbol: String,
        /// Unit text that contains it.
        unit: String,
        /// Known unit with the most similar spelling, if one is close.
        nearest: Option<&'static str>,
    },
    /// A syntax error in the unit text.
    #[error("the unit \"{unit}\" cannot be read: {problem}")]
    UnitSyntax {
        /// The unit text.
        unit: String,
        /// The error and its correction.
        problem: &'static str,
    },
    /// `lb` or `oz` that could be a mass or a force.
    #[error(
        "\"{unit}\" can be read with a force or with a mass; write \"{force}\" for the force, or \
         \"{mass}\" if the mass is meant"
    )]
    AmbiguousWeight {
        /// The unit text.
        unit: String,
        /// The unit text read as a force.
        force: String,
        /// The unit text read as a mass.
        mass: String,
    },
    /// The reciprocal of a suitable unit.
    #[error("\"{text}\" is the inverse of a {expected}; write \"{right}\"")]
    Inverted {
        /// The text.
        text: String,
        /// Name of the kind expected.
        expected: &'static str,
        /// The corrected text.
        right: String,
    },
    /// A ratio of another kind.
    #[error("\"{unit}\" is not {expected}; write it as in \"{example}\"")]
    WrongRatio {
        /// The unit text.
        unit: String,
        /// Name of the kind expected.
        expected: &'static str,
        /// A valid text.
        example: &'static str,
    },
    /// A unit of another kind of quantity.
    #[error(
        "the unit \"{unit}\" has the dimension {got}; expected {expected} ({wanted}), for example \
         \"{example}\""
    )]
    WrongDimension {
        /// The unit text.
        unit: String,
        /// Its dimension.
        got: Dimension,
        /// Name of the kind expected.
        expected: &'static str,
        /// Dimension of its SI unit.
        wanted: Dimension,
        /// A valid text.
        example: &'static str,
    },
    /// A temperature lies below absolute zero.
    #[error("\"{text}\" is {kelvin} K, below absolute zero; check the number and its unit")]
    BelowAbsoluteZero {
        /// The text.
        text: String,
        /// The temperature in kelvin.
        kelvin: f64,
    },
    /// A standard uncertainty is negative.
    #[error("a standard uncertainty must be 0 or greater, but {got} was given; drop the sign")]
    NegativeUncertainty {
        /// The text, or the number in SI units.
        got: String,
    },
    /// A standard uncertainty of a ratio in percent, which is ambiguous.
    #[error(
        "\"{text}\" can be read as percent of {of} or as the ratio itself; write \"{relative}\" for the first, or \
         \"{absolute}\" for the second"
    )]
    AmbiguousPercent {
        /// The text.
        text: String,
        /// The value it belongs to.
        of: String,
        /// The standard uncertainty as a percentage of the value.
        relative: f64,
        /// The standard uncertainty as a ratio.
        absolute: f64,
    },
    /// The value or uncertainty of an estimate is not finite.
    #[error("the {part} of the {kind} from {origin} is {value}; check the numbers it comes from")]
    EstimateNotFinite {
        /// `value` or `standard uncertainty`.
        part: &'static str,
        /// Name of the kind, or the unit.
        kind: String,
        /// Where the estimate comes from.
        origin: String,
        /// The number in SI units.
        value: f64,
    },
}

/// End of the message about an unknown unit.
fn hint(nearest: Option<&'static str>) -> String {
    match nearest {
        Some(unit) => format!("; did you mean \"{unit}\"?"),
        None => "; docs/stand-file.md lists the known units".to_owned(),
    }
}
