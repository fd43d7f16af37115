//! What can keep a fit from being made.

use thiserror::Error;

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// A parameter's start, bounds or scale cannot be.
    #[error("parameter {name}: {problem}")]
    Parameter {
        /// Its name.
        name: String,
        /// What is wrong, what was expected.
        problem: String,
    },
    /// Nothing is left to be found.
    #[error("every parameter is fixed; free at least one")]
    NothingFree,
    /// There are fewer residuals than parameters to find.
    #[error(
        "{residuals} residuals cannot determine {free} parameters; record more, or fix some of them"
    )]
    TooFewResiduals {
        /// Residuals there are.
        residuals: usize,
        /// Parameters to be found.
        free: usize,
    },
    /// The number of residuals is not that of the first evaluation, or of the weights.
    #[error("{got} residuals where {expected} were expected; their number must not change")]
    Length {
        /// Number expected.
        expected: usize,
        /// Number got.
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
    /// The model cannot be evaluated there.
    #[error("the model cannot be evaluated: {0}")]
    Model(String),
}
