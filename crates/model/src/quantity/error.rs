//! Errors of numbers with units.

use thiserror::Error;

use super::dimension::Dimension;

/// What can be wrong with a number, its unit or its uncertainty.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// The text is empty.
    #[error("the text is empty; expected {expected}, for example \"{example}\"")]
    Empty {
        /// Name of the kind expected.
        expected: &'static str,
        /// A text that would do.
        example: &'static str,
    },
    /// The text does not start with a number.
    #[error(
        "\"{text}\" does not start with a number; write the number with a decimal point and \
         without thousands marks, for example \"{example}\""
    )]
    NotANumber {
        /// Text got.
        text: String,
        /// A text that would do.
        example: &'static str,
    },
    /// The number, or the number in SI units, is not finite.
    #[error("\"{text}\" is not a finite number; check the input")]
    NotFinite {
        /// Text got.
        text: String,
    },
    /// A number stands without its unit.
    #[error("\"{text}\" has no unit; expected {expected} with its unit, for example \"{example}\"")]
    MissingUnit {
        /// Text got.
        text: String,
        /// Name of the kind expected.
        expected: &'static str,
        /// A text that would do.
        example: &'static str,
    },
    /// A symbol is not a known unit.
    #[error("unknown unit \"{symbol}\" in \"{unit}\"{}", hint(*.nearest))]
    UnknownUnit {
        /// Symbol got.
        symbol: String,
        /// Unit text it stands in.
        unit: String,
        /// Known unit of the most similar spelling, if one is close.
        nearest: Option<&'static str>,
    },
    /// The unit text does not follow the grammar.
    #[error("the unit \"{unit}\" cannot be read: {problem}")]
    UnitSyntax {
        /// Unit text got.
        unit: String,
        /// What is wrong with it and what to write.
        problem: &'static str,
    },
    /// `lb` or `oz` is used where it could be a mass or a force.
    #[error(
        "\"{unit}\" can be read with a force or with a mass; write \"{force}\" for the force, or \
         \"{mass}\" if the mass is meant"
    )]
    AmbiguousWeight {
        /// Unit text got.
        unit: String,
        /// The same with a force.
        force: String,
        /// The same with a mass.
        mass: String,
    },
    /// The unit is the inverse of one that fits.
    #[error("\"{text}\" is the inverse of a {expected}; write \"{right}\"")]
    Inverted {
        /// Text got.
        text: String,
        /// Name of the kind expected.
        expected: &'static str,
        /// The text that is right.
        right: String,
    },
    /// A ratio of another kind.
    #[error("\"{unit}\" is not {expected}; write it as in \"{example}\"")]
    WrongRatio {
        /// Unit text got.
        unit: String,
        /// Name of the kind expected.
        expected: &'static str,
        /// A text that would do.
        example: &'static str,
    },
    /// The unit does not fit the kind of quantity.
    #[error(
        "the unit \"{unit}\" has the dimension {got}; expected {expected} ({wanted}), for example \
         \"{example}\""
    )]
    WrongDimension {
        /// Unit text got.
        unit: String,
        /// Its dimension.
        got: Dimension,
        /// Name of the kind expected.
        expected: &'static str,
        /// Dimension of its SI unit.
        wanted: Dimension,
        /// A text that would do.
        example: &'static str,
    },
    /// A temperature lies below absolute zero.
    #[error("\"{text}\" is {kelvin} K, below absolute zero; check the number and its unit")]
    BelowAbsoluteZero {
        /// Text got.
        text: String,
        /// The temperature in kelvin.
        kelvin: f64,
    },
    /// A standard uncertainty is negative.
    #[error("a standard uncertainty must be 0 or greater, but {got} was given; drop the sign")]
    NegativeUncertainty {
        /// What was given: a text, or a number in SI units.
        got: String,
    },
    /// A standard uncertainty of a ratio in percent.
    #[error(
        "\"{text}\" can be read as percent of {of} or as the ratio itself; write \"{relative}\" for the first, or \
         \"{absolute}\" for the second"
    )]
    AmbiguousPercent {
        /// Text got.
        text: String,
        /// The value that it belongs to.
        of: String,
        /// The standard uncertainty, if percent of the value are meant.
        relative: f64,
        /// The same otherwise.
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
        /// Number got, in SI units.
        value: f64,
    },
}

/// Tail of the message about an unknown unit.
fn hint(nearest: Option<&'static str>) -> String {
    match nearest {
        Some(unit) => format!("; did you mean \"{unit}\"?"),
        None => "; docs/stand-file.md lists the known units".to_owned(),
    }
}
