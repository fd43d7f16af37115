//! Result of a fit.

use super::Undetermined;
use crate::quantity::{Covariance, Estimates};

/// Why a fit stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The residuals are orthogonal to every direction in which the model can move.
    Gradient,
    /// The sum of squares fell, and would fall, by less than the tolerance.
    Reduction,
    /// The parameters moved by less than the tolerance.
    Step,
    /// The residuals are zero.
    Exact,
    /// No step lowers the sum of squares any more: limited by rounding.
    NoProgress,
    /// The maximum number of evaluations was reached before a minimum.
    Evaluations,
}

impl StopReason {
    /// Whether a minimum was reached.
    #[must_use]
    pub fn converged(self) -> bool {
        self != Self::Evaluations
    }
}

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Parameter values, in the order given.
    pub values: Vec<f64>,
    /// Standard uncertainties; `None` for a parameter that is fixed, at a bound, or undetermined.
    pub std: Vec<Option<f64>>,
    /// Covariance of those that have one.
    pub covariance: Covariance,
    /// Combinations of parameters that the data do not determine.
    pub undetermined: Vec<Undetermined>,
    /// Whether a parameter ended at one of its bounds.
    pub at_bound: Vec<bool>,
    /// Residuals, weighted if weights were given.
    pub residuals: Vec<f64>,
    /// Root of the mean square of the residuals.
    pub rms: f64,
    /// Sum of their squares.
    pub sum_of_squares: f64,
    /// Residuals less parameters found.
    pub degrees_of_freedom: usize,
    /// Why it stopped.
    pub stop: StopReason,
    /// Evaluations of the residuals.
    pub evaluations: usize,
}

impl Fit {
    /// Residual standard deviation s = √(sum of squares / degrees of freedom); `None` without
    /// freedom.
    #[must_use]
    pub fn residual_std(&self) -> Option<f64> {
        (self.degrees_of_freedom > 0)
            .then(|| (self.sum_of_squares / self.degrees_of_freedom as f64).sqrt())
    }

    /// The parameters with their covariance, for numbers that follow from them.
    #[must_use]
    pub fn estimates(&self) -> Estimates {
        Estimates::new(self.values.clone(), self.covariance.clone())
    }

    /// Correlation coefficient of two parameters.
    #[must_use]
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        self.covariance.correlation(i, j)
    }
}
