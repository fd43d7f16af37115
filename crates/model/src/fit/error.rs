//! Errors of a fit.

use thiserror::Error;

/// Why a fit failed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// Invalid start, bounds or scale of a parameter.
    #[error("parameter {name}: {problem}")]
    Parameter {
        /// Name of the parameter.
        name: String,
        /// The problem, and what was expected.
        problem: String,
    },
    /// No parameter is free.
    #[error("every parameter is fixed; free at least one")]
    NothingFree,
    /// Fewer residuals than free parameters.
    #[error(
        "{residuals} residuals cannot determine {free} parameters; record more, or fix some of them"
    )]
    TooFewResiduals {
        /// Number of residuals.
        residuals: usize,
        /// Number of free parameters.
        free: usize,
    },
    /// The number of residuals differs from that of the first evaluation, or of the weights.
    #[error("{got} residuals where {expected} were expected; their number must not change")]
    Length {
        /// Number expected.
        expected: usize,
        /// Actual number.
        got: usize,
    },
    /// A residual or derivative is not a finite number.
    #[error("residual {index} is {value}, not a finite number; start elsewhere or check the data")]
    NotFinite {
        /// Index of the residual.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The model cannot be evaluated at these parameters.
    #[error("the model cannot be evaluated: {0}")]
    Model(String),
}
