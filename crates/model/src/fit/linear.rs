//! Linear least squares, with the combinations of parameters not identifiable from the data.

use nalgebra::{DMatrix, DVector};

use super::covariance::covariance;
use super::reduce::reduce;
use super::{FitError, Undetermined};
use crate::quantity::Covariance;

/// A linear fit.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearFit {
    /// Parameters; the minimum-norm solution along undetermined directions.
    pub values: Vec<f64>,
    /// Standard uncertainties; `None` where undetermined.
    pub std: Vec<Option<f64>>,
    /// Covariance of the determined parameters.
    pub covariance: Covariance,
    /// Combinations of parameters that the data do not determine.
    pub undetermined: Vec<Undetermined>,
    /// Weighted residuals A x − b.
    pub residuals: Vec<f64>,
    /// Sum of their squares.
    pub sum_of_squares: f64,
    /// Rows minus the number of determined parameters.
    pub degrees_of_freedom: usize,
    /// Condition number: largest over smallest singular value, after scaling of the columns to unit
    /// length.
    pub condition: f64,
}

/// Singular values below this fraction of the largest count as zero.
const RANK_TOLERANCE: f64 = 1e-11;

/// Minimises |W (A x − b)|², with `weights` on the diagonal of W (1/σ per row), by singular value
/// decomposition of the columns scaled to unit length.
///
/// The variance of a weighted residual is estimated from the residuals, or is 1 if
/// `variance_known`.
///
/// # Errors
/// [`FitError`] if the sizes do not match, there are fewer rows than columns, or a number is not
/// finite.
///
/// ```
/// use nalgebra::DMatrix;
/// use torqcomp_model::fit::linear::solve;
/// // y = 1 + 2x through (0, 1), (1, 3), (2, 5).
/// let a = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0]);
/// let fit = solve(&a, &[1.0, 3.0, 5.0], None, false)?;
/// assert!((fit.values[0] - 1.0).abs() < 1e-12 && (fit.values[1] - 2.0).abs() < 1e-12);
/// # Ok::<(), torqcomp_model::fit::FitError>(())
/// ```
pub fn solve(
    a: &DMatrix<f64>,
    b: &[f64],
    weights: Option<&[f64]>,
    variance_known: bool,
) -> Result<LinearFit, FitError> {
    let (rows, columns) = a.shape();
    for length in [Some(b.len()), weights.map(<[f64]>::len)]
        .into_iter()
        .flatten()
    {
        if length != rows {
            return Err(FitError::Length {
                expected: rows,
                got: length,
            });
        }
    }
    if columns == 0 {
        return Err(FitError::NothingFree);
    }
    if rows < columns {
        return Err(FitError::TooFewResiduals {
            residuals: rows,
            free: columns,
        });
    }
    let mut a = a.clone();
    let mut b = b.to_vec();
    if let Some(weights) = weights {
        for mut column in a.column_iter_mut() {
            column.iter_mut().zip(weights).for_each(|(v, w)| *v *= w);
        }
        b.iter_mut().zip(weights).for_each(|(v, w)| *v *= w);
    }
    if let Some(i) = a.iter().chain(&b).position(|v| !v.is_finite()) {
        return Err(FitError::NotFinite {
            index: i % rows,
            value: f64::NAN,
        });
    }
    Ok(fitted(&a, &b, variance_known))
}

fn fitted(a: &DMatrix<f64>, b: &[f64], variance_known: bool) -> LinearFit {
    let (rows, columns) = a.shape();
    let reduced = reduce(a, b);
    let norms: Vec<f64> = (0..columns)
        .map(|j| reduced.r.column(j).norm())
        .map(|norm| if norm > 0.0 { norm } else { 1.0 })
        .collect();
    let mut scaled = reduced.r.clone();
    for (j, norm) in norms.iter().enumerate() {
        scaled.column_mut(j).unscale_mut(*norm);
    }
    let svd = scaled.svd(true, true);
    let largest = svd.singular_values.max();
    let smallest = svd.singular_values.min();
    let rank = svd
        .singular_values
        .iter()
        .filter(|s| **s > RANK_TOLERANCE * largest)
        .count();
    let mut x = svd
        .solve(&reduced.c, RANK_TOLERANCE * largest)
        .unwrap_or_else(|_| DVector::zeros(columns));
    x.iter_mut().zip(&norms).for_each(|(x, norm)| *x /= norm);
    let mut residuals = (a * &x).as_slice().to_vec();
    residuals.iter_mut().zip(b).for_each(|(r, b)| *r -= b);
    let sum_of_squares: f64 = residuals.iter().map(|r| r * r).sum();
    let freedom = rows - rank;
    let variance = match (variance_known, freedom) {
        (true, _) => Some(1.0),
        (false, 0) => None,
        (false, freedom) => Some(sum_of_squares / freedom as f64),
    };
    let indices: Vec<usize> = (0..columns).collect();
    let sizes: Vec<f64> = x
        .iter()
        .map(|v| if *v == 0.0 { 1.0 } else { v.abs() })
        .collect();
    let (covariance, undetermined) =
        covariance(&reduced.r, &indices, &sizes, columns, |_| variance);
    LinearFit {
        std: (0..columns).map(|i| covariance.std(i)).collect(),
        values: x.as_slice().to_vec(),
        covariance,
        undetermined,
        residuals,
        sum_of_squares,
        degrees_of_freedom: freedom,
        condition: if smallest > 0.0 {
            largest / smallest
        } else {
            f64::INFINITY
        },
    }
}
