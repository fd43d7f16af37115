//! Least squares over overlapping rows, with regressor noise of known covariance.

use nalgebra::{DMatrix, DVector};
use torqcomp_model::{Covariance, Estimates};

use super::scatter;
use crate::failure::{ErrorCode, Failure};

/// Error model of the rows.
pub(super) struct Errors<'a> {
    /// Covariance of the errors of two columns in one row.
    pub noise: &'a dyn Fn(usize, usize) -> f64,
    /// Covariance between rows at a distance, for white errors of the right-hand side with variance
    /// 1.
    pub torque: &'a dyn Fn(usize) -> f64,
    /// The same for errors of the columns with these parameters.
    pub motion: &'a dyn Fn(usize, &[f64]) -> f64,
    /// Largest distance of overlapping rows.
    pub overlap: usize,
}

/// A regression without the bias from noise in its regressors.
#[derive(Debug, Clone)]
pub(super) struct Corrected {
    /// The parameters.
    pub numbers: Estimates,
    /// Left-hand side minus right-hand side, for all rows.
    pub residuals: Vec<f64>,
    /// Largest noise power in a column, relative to its total.
    pub noise_share: f64,
    /// Largest ratio of a standard uncertainty to that for white noise.
    pub coloured: f64,
}

/// Solves `A x ≈ b` over the chosen rows, where the errors of the columns have a known covariance N in
/// every row: `(AᵀA − n N) x = Aᵀb` (T. Söderström, Errors-in-variables methods in system
/// identification, Automatica 43 (2007), 939, bias-compensating least squares). For its covariance see
/// [`scatter`]. `names` are those of the columns, for messages.
pub(super) fn solve(
    names: &[&str],
    columns: &[Vec<f64>],
    right: &[f64],
    chosen: &[bool],
    errors: &Errors,
) -> Result<Corrected, Failure> {
    let rows = chosen.iter().filter(|c| **c).count();
    let (all, count) = (right.len(), columns.len());
    // Excluded rows become zeros, to keep distances in time.
    let kept = |r: usize, v: f64| if chosen[r] { v } else { 0.0 };
    let mut scaled = DMatrix::from_fn(all, count, |r, c| kept(r, columns[c][r]));
    let b = DVector::from_fn(all, |r, _| kept(r, right[r]));
    let sizes: Vec<f64> = scaled.column_iter().map(|c| c.norm()).collect();
    if let Some(i) = sizes.iter().position(|s| *s == 0.0 || !s.is_finite()) {
        return Err(ErrorCode::NotIdentifiable.failed(format_args!(
            "the {} term of the equation of motion is zero throughout the record",
            names[i].replace('_', " ")
        )));
    }
    for (mut column, size) in scaled.column_iter_mut().zip(&sizes) {
        column.unscale_mut(*size);
    }
    let part = DMatrix::from_fn(count, count, |i, j| {
        rows as f64 * (errors.noise)(i, j) / (sizes[i] * sizes[j])
    });
    let noise_share = (0..count).map(|i| part[(i, i)]).fold(0.0, f64::max);
    let gram = scaled.tr_mul(&scaled);
    if worst_share(&gram, &part).is_none_or(|share| share > most_noise(rows)) {
        return Err(not_identifiable());
    }
    let inverse = (gram - part)
        .cholesky()
        .ok_or_else(not_identifiable)?
        .inverse();
    let x = &inverse * scaled.tr_mul(&b);
    let values: Vec<f64> = x.iter().zip(&sizes).map(|(x, s)| x / s).collect();
    let kept_residuals = &scaled * &x - &b;
    let (covariance, coloured) =
        scatter::covariance(scaled, &inverse, &kept_residuals, &values, rows, errors);
    let unscaled = |i, j| covariance[(i, j)] / (sizes[i] * sizes[j]);
    let covariance = Covariance::of(DMatrix::from_fn(count, count, unscaled));
    Ok(Corrected {
        residuals: residuals(columns, &values, right),
        numbers: Estimates::new(values, covariance),
        noise_share,
        coloured,
    })
}

/// Power of a column of size 1 without its part along the others, below which only rounding is left of it.
const DEPENDENT: f64 = 1e-13;

/// Noise power in the combination of columns that has the largest share of it; `None` if a combination is zero.
///
/// Under one constant torque the combination `J θ'' + f θ' − T` is all noise: whatever the constants are, its multiples
/// may be added to them. Each term alone may be a thousand times its noise.
fn worst_share(gram: &DMatrix<f64>, noise: &DMatrix<f64>) -> Option<f64> {
    let lower = gram.clone().cholesky()?.l();
    if lower.diagonal().min().powi(2) < DEPENDENT {
        return None;
    }
    let half = lower.solve_lower_triangular(noise)?;
    let whitened = lower.solve_lower_triangular(&half.transpose())?;
    Some(whitened.symmetric_eigenvalues().max())
}

/// Largest share of noise with which a combination is known: half, or less where the rows are too few to tell its power
/// from that of noise. That of noise scatters by `√(2/(rows/2))` of itself, as about two rows share their errors; six
/// times this is never by chance.
fn most_noise(rows: usize) -> f64 {
    1.0 / (1.0 + 12.0 / (rows as f64).sqrt()).max(2.0)
}

/// Left-hand side minus right-hand side of each row.
fn residuals(columns: &[Vec<f64>], values: &[f64], right: &[f64]) -> Vec<f64> {
    let mut left = left_side(columns, values);
    left.iter_mut().zip(right).for_each(|(l, b)| *l -= b);
    left
}

/// Left-hand side of each row with these parameters.
pub(super) fn left_side(columns: &[Vec<f64>], values: &[f64]) -> Vec<f64> {
    let mut left = vec![0.0; columns.first().map_or(0, Vec::len)];
    for (column, value) in columns.iter().zip(values) {
        let rows = left.iter_mut().zip(column);
        rows.for_each(|(sum, term)| *sum += value * term);
    }
    left
}

pub(super) fn not_identifiable() -> Failure {
    ErrorCode::NotIdentifiable.failed(
        "the terms of the equation of motion are not separately identifiable from this record: at one constant torque, \
         or coasting alone, any multiple of inertia and friction fits; the torque must vary, with speeds and \
         accelerations that stand out of the noise",
    )
}
