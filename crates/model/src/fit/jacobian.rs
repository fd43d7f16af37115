//! Derivatives of the residuals, from the problem or by finite differences.

use nalgebra::DMatrix;

use super::problem::Evaluated;
use super::{Differences, FitError, Parameter, Residuals};

/// Parameters and method of the derivatives.
pub(super) struct Derivatives<'a> {
    pub parameters: &'a [Parameter],
    /// Indices of the parameters that are not fixed.
    pub free: &'a [usize],
    pub differences: Differences,
}

/// Number of points at which the residuals are evaluated at once.
const AT_ONCE: usize = 4;

/// Columns of the free parameters, and the number of evaluations.
pub(super) fn jacobian(
    evaluated: &Evaluated,
    how: &Derivatives,
    values: &[f64],
    at: &[f64],
) -> Result<(DMatrix<f64>, usize), FitError> {
    if evaluated.problem.has_jacobian() {
        let mut all = DMatrix::zeros(at.len(), values.len());
        evaluated.problem.jacobian(values, &mut all)?;
        let mut chosen = all.select_columns(how.free);
        if let Some(weights) = evaluated.weights {
            for mut column in chosen.column_iter_mut() {
                column.iter_mut().zip(weights).for_each(|(d, w)| *d *= w);
            }
        }
        return finite(chosen).map(|matrix| (matrix, 1));
    }
    let (matrix, evaluations) = by_differences(evaluated, how, values, at)?;
    finite(matrix).map(|matrix| (matrix, evaluations))
}

/// Derivatives of the residuals with respect to all parameters, fixed ones included: those of the problem, or by central
/// differences.
///
/// # Errors
/// [`FitError`] if the residuals cannot be evaluated.
///
/// ```
/// use torqcomp_model::fit::{Parameter, derivatives};
/// let residuals = |p: &[f64], out: &mut Vec<f64>| {
///     out.push(p[0] * p[0]);
///     Ok(())
/// };
/// let slopes = derivatives(&residuals, &[Parameter::new("x", 3.0)], &[3.0])?;
/// assert!((slopes[(0, 0)] - 6.0).abs() < 1e-8);
/// # Ok::<(), torqcomp_model::fit::FitError>(())
/// ```
pub fn derivatives(
    problem: &dyn Residuals,
    parameters: &[Parameter],
    values: &[f64],
) -> Result<DMatrix<f64>, FitError> {
    let evaluated = Evaluated {
        problem,
        weights: None,
        expected: None,
    };
    let at = evaluated.residuals(values)?;
    let all: Vec<usize> = (0..values.len()).collect();
    let how = Derivatives {
        parameters,
        free: &all,
        differences: Differences::Central,
    };
    jacobian(&evaluated, &how, values, &at).map(|(matrix, _)| matrix)
}

fn finite(matrix: DMatrix<f64>) -> Result<DMatrix<f64>, FitError> {
    match matrix.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(FitError::NotFinite {
            index: i % matrix.nrows(),
            value: matrix.as_slice()[i],
        }),
        None => Ok(matrix),
    }
}

/// Evaluation points of one column, and its divisor.
struct Ends {
    points: Vec<Vec<f64>>,
    width: f64,
}

/// All columns, and the number of evaluations; points are evaluated in batches, to limit memory.
fn by_differences(
    evaluated: &Evaluated,
    how: &Derivatives,
    values: &[f64],
    at: &[f64],
) -> Result<(DMatrix<f64>, usize), FitError> {
    let ends: Vec<Ends> = how
        .free
        .iter()
        .map(|index| how.ends(values, *index))
        .collect();
    let points: Vec<Vec<f64>> = ends.iter().flat_map(|e| e.points.clone()).collect();
    let some = points.chunks(AT_ONCE);
    let mut residuals = some.flat_map(|some| evaluated.residuals_of_each(some));
    let mut matrix = DMatrix::zeros(at.len(), how.free.len());
    for (mut column, ends) in matrix.column_iter_mut().zip(&ends) {
        let mut next = || residuals.next().expect("one for each point");
        let above = next()?;
        let below = match ends.points.len() {
            1 => None,
            _ => Some(next()?),
        };
        let pairs = above.iter().zip(below.as_deref().unwrap_or(at));
        for (slope, (a, b)) in column.iter_mut().zip(pairs) {
            *slope = (a - b) / ends.width;
        }
    }
    Ok((matrix, points.len()))
}

impl Derivatives<'_> {
    /// Evaluation points of ∂r/∂p for one parameter, central or one-sided, within its bounds.
    fn ends(&self, values: &[f64], index: usize) -> Ends {
        let parameter = &self.parameters[index];
        let value = values[index];
        let size = value.abs().max(parameter.scale * 1e-3);
        let moved = |to: f64| {
            let mut there = values.to_vec();
            there[index] = to;
            there
        };
        if self.differences == Differences::Central {
            let step = f64::EPSILON.cbrt() * size;
            let (up, down) = (value + step, value - step);
            if up <= parameter.upper && down >= parameter.lower {
                return Ends {
                    points: vec![moved(up), moved(down)],
                    width: up - down,
                };
            }
        }
        // At a bound, or forward differences: one-sided, with a suitable step.
        let step = f64::EPSILON.sqrt() * size;
        let to = match value + step <= parameter.upper {
            true => value + step,
            false => (value - step).max(parameter.lower),
        };
        Ends {
            points: vec![moved(to)],
            width: to - value,
        }
    }
}
