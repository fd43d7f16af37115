//! Result of a fit.

use super::Undetermined;
use crate::quantity::{Covariance, Estimates};

/// Why a fit stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The residuals are orthogonal to every direction in parameter space.
    Gradient,
    /// Actual and predicted reduction of the sum of squares are below the tolerance.
    Reduction,
    /// The step of the parameters is below the tolerance.
    Step,
    /// The residuals are zero.
    Exact,
    /// No step reduces the sum of squares further: limited by rounding.
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

/// Result of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Parameter values, in the order given.
    pub values: Vec<f64>,
    /// Standard uncertainties; `None` for a parameter that is fixed, at a bound, or undetermined.
    pub std: Vec<Option<f64>>,
    /// Covariance of the parameters that have an uncertainty.
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
    /// The same at the start values.
    pub sum_at_start: f64,
    /// Number of residuals minus number of parameters determined.
    pub degrees_of_freedom: usize,
    /// Reason for stopping.
    pub stop: StopReason,
    /// Evaluations of the residuals.
    pub evaluations: usize,
}

impl Fit {
    /// The parameters with their covariance, for error propagation.
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
