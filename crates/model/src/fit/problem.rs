//! Residuals as a function of parameters.

use nalgebra::DMatrix;

use super::FitError;

/// Residuals and, optionally, their derivatives.
///
/// A closure `Fn(&[f64], &mut Vec<f64>) -> Result<(), FitError>` has no derivatives; finite differences
/// are used.
pub trait Residuals: Sync {
    /// Writes the residuals at `values` (all parameters, fixed ones too) into `out`, which is empty.
    ///
    /// # Errors
    /// [`FitError::Model`] where the model cannot be evaluated; the fit then takes a smaller step.
    fn residuals(&self, values: &[f64], out: &mut Vec<f64>) -> Result<(), FitError>;

    /// The residuals at several points, as finite differences need them: one after the other, unless a model has a
    /// faster way.
    ///
    /// # Errors
    /// For each point as for [`Residuals::residuals`].
    fn residuals_of_each(&self, points: &[Vec<f64>]) -> Vec<Result<Vec<f64>, FitError>> {
        let one = |values: &Vec<f64>| {
            let mut out = Vec::new();
            self.residuals(values, &mut out).map(|()| out)
        };
        points.iter().map(one).collect()
    }

    /// Whether [`Residuals::jacobian`] is implemented; otherwise finite differences are used.
    fn has_jacobian(&self) -> bool {
        false
    }

    /// Writes ∂residual/∂parameter into the matrix, which is zero initially: one row per residual,
    /// one column per parameter, fixed ones included.
    ///
    /// # Errors
    /// As for [`Residuals::residuals`].
    fn jacobian(&self, values: &[f64], out: &mut DMatrix<f64>) -> Result<(), FitError> {
        let _ = (values, out);
        Err(FitError::Model("no derivatives are given".to_owned()))
    }
}

impl<F> Residuals for F
where
    F: Fn(&[f64], &mut Vec<f64>) -> Result<(), FitError> + Sync,
{
    fn residuals(&self, values: &[f64], out: &mut Vec<f64>) -> Result<(), FitError> {
        self(values, out)
    }
}

/// Residuals and derivatives from two closures.
pub struct WithJacobian<R, J> {
    /// The residuals.
    pub residuals: R,
    /// Their derivatives.
    pub jacobian: J,
}

impl<R, J> Residuals for WithJacobian<R, J>
where
    R: Fn(&[f64], &mut Vec<f64>) -> Result<(), FitError> + Sync,
    J: Fn(&[f64], &mut DMatrix<f64>) -> Result<(), FitError> + Sync,
{
    fn residuals(&self, values: &[f64], out: &mut Vec<f64>) -> Result<(), FitError> {
        (self.residuals)(values, out)
    }

    fn has_jacobian(&self) -> bool {
        true
    }

    fn jacobian(&self, values: &[f64], out: &mut DMatrix<f64>) -> Result<(), FitError> {
        (self.jacobian)(values, out)
    }
}

/// Finite-difference scheme for problems without derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Differences {
    /// (r(p + h) − r(p))/h: one evaluation per parameter, seven to eight digits.
    Forward,
    /// (r(p + h) − r(p − h))/2h: two evaluations per parameter, ten to eleven digits.
    Central,
}

/// A problem with the weights and number of its residuals.
pub(super) struct Evaluated<'a> {
    pub problem: &'a dyn Residuals,
    /// Weights of the residuals, if any.
    pub weights: Option<&'a [f64]>,
    pub expected: Option<usize>,
}

impl Evaluated<'_> {
    /// Weighted residuals, all finite.
    pub fn residuals(&self, values: &[f64]) -> Result<Vec<f64>, FitError> {
        let mut out = Vec::with_capacity(self.expected.unwrap_or(0));
        self.problem.residuals(values, &mut out)?;
        self.checked(out)
    }

    /// Weighted residuals at several points.
    pub fn residuals_of_each(&self, points: &[Vec<f64>]) -> Vec<Result<Vec<f64>, FitError>> {
        let each = self.problem.residuals_of_each(points).into_iter();
        each.map(|residuals| residuals.and_then(|r| self.checked(r)))
            .collect()
    }

    fn checked(&self, mut out: Vec<f64>) -> Result<Vec<f64>, FitError> {
        let expected = self.weights.map(<[f64]>::len).or(self.expected);
        if let Some(expected) = expected.filter(|n| *n != out.len()) {
            return Err(FitError::Length {
                expected,
                got: out.len(),
            });
        }
        if let Some(weights) = self.weights {
            out.iter_mut().zip(weights).for_each(|(r, w)| *r *= w);
        }
        match out.iter().position(|r| !r.is_finite()) {
            Some(index) => Err(FitError::NotFinite {
                index,
                value: out[index],
            }),
            None => Ok(out),
        }
    }
}
