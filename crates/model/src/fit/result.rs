//! What a fit found, how sure it is, and why it stopped.

use nalgebra::DMatrix;

use super::Undetermined;

/// Why a fit stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The residuals are at right angles to every direction in which the model can move.
    Gradient,
    /// The sum of squares fell, and would fall, by less than the tolerance.
    Reduction,
    /// The parameters moved by less than the tolerance.
    Step,
    /// The residuals are zero as far as numbers go.
    Exact,
    /// No step lowers the sum of squares any more: the digits are used up.
    NoProgress,
    /// The greatest number of evaluations was reached before that: not a minimum yet.
    Evaluations,
}

impl StopReason {
    /// Whether a minimum was reached.
    #[must_use]
    pub fn converged(self) -> bool {
        self != Self::Evaluations
    }
}

/// Covariance of the parameters that the data determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Place of each parameter in the matrix, if it has one.
    pub(super) places: Vec<Option<usize>>,
    pub(super) matrix: DMatrix<f64>,
}

impl Covariance {
    /// Covariance of two parameters; `None` if one is fixed, at a bound or undetermined.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> Option<f64> {
        let (i, j) = (*self.places.get(i)?, *self.places.get(j)?);
        Some(self.matrix[(i?, j?)])
    }

    /// The same times a factor, as where the noise is larger than the residuals show.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        self.matrix *= factor;
        self
    }

    /// Standard uncertainty of a parameter.
    #[must_use]
    pub fn std(&self, i: usize) -> Option<f64> {
        self.get(i, i).map(f64::sqrt)
    }

    /// Correlation coefficient of two parameters, −1 to 1.
    #[must_use]
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let size = self.std(i)? * self.std(j)?;
        self.get(i, j)
            .filter(|_| size > 0.0)
            .map(|c| (c / size).clamp(-1.0, 1.0))
    }

    /// Standard uncertainty of a function of the parameters with that gradient (one entry each
    /// parameter): √(gᵀ C g), JCGM 100:2008 (13). `None` if it depends on a parameter that has no
    /// uncertainty.
    #[must_use]
    pub fn std_of(&self, gradient: &[f64]) -> Option<f64> {
        let mut sum = 0.0;
        for (i, gi) in gradient.iter().enumerate().filter(|(_, g)| **g != 0.0) {
            for (j, gj) in gradient.iter().enumerate().filter(|(_, g)| **g != 0.0) {
                sum += gi * gj * self.get(i, j)?;
            }
        }
        Some(sum.max(0.0).sqrt())
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

    /// Correlation coefficient of two parameters.
    #[must_use]
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        self.covariance.correlation(i, j)
    }
}
