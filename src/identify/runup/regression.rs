//! Least squares whose regressors carry noise of known covariance.

use nalgebra::{DMatrix, DVector};

use crate::failure::Failure;

/// A regression with the noise of its regressors taken out.
#[derive(Debug, Clone)]
pub struct Corrected {
    /// The parameters.
    pub values: Vec<f64>,
    covariance: DMatrix<f64>,
    /// Left side minus right side.
    pub residuals: Vec<f64>,
    /// Right side.
    pub right: Vec<f64>,
    columns: DMatrix<f64>,
    /// Largest part of a column's power that is noise.
    pub noise_share: f64,
}

impl Corrected {
    /// Standard uncertainty of a parameter.
    pub fn std(&self, i: usize) -> Option<f64> {
        Some(self.covariance[(i, i)].sqrt()).filter(|std| std.is_finite())
    }

    /// Correlation coefficient of two parameters.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        let c = &self.covariance;
        c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()
    }

    /// How far other values would move the left side, as a part of the right side.
    pub fn change_to(&self, values: &[f64]) -> f64 {
        let change = DVector::from_iterator(
            values.len(),
            values.iter().zip(&self.values).map(|(a, b)| a - b),
        );
        let right: f64 = self.right.iter().map(|v| v * v).sum();
        (&self.columns * change).norm() / right.sqrt()
    }
}

/// Solves `A x ≈ b` where `noise(i, j)` is the covariance of the errors of columns i and j in every
/// row: `(AᵀA − n N) x = Aᵀb` (T. Söderström, Errors-in-variables methods in system identification,
/// Automatica 43 (2007), 939, bias-compensating least squares).
///
/// The covariance allows for errors that differ from row to row and follow from one to the next (W. K.
/// Newey, K. D. West, Econometrica 55 (1987), 703).
pub fn solve(
    columns: &[Vec<f64>],
    right: Vec<f64>,
    noise: impl Fn(usize, usize) -> f64,
) -> Result<Corrected, Failure> {
    let (rows, count) = (right.len(), columns.len());
    let sizes: Vec<f64> = columns
        .iter()
        .map(|c| c.iter().map(|v| v * v).sum::<f64>().sqrt())
        .collect();
    if let Some(i) = sizes.iter().position(|s| *s == 0.0 || !s.is_finite()) {
        return Err(Failure::failed(format_args!(
            "term {} of the equation of motion is zero throughout; the record does not show it",
            i + 1
        )));
    }
    let scaled = DMatrix::from_fn(rows, count, |r, c| columns[c][r] / sizes[c]);
    let part = DMatrix::from_fn(count, count, |i, j| {
        rows as f64 * noise(i, j) / (sizes[i] * sizes[j])
    });
    let noise_share = (0..count).map(|i| part[(i, i)]).fold(0.0, f64::max);
    let normal = scaled.tr_mul(&scaled) - part;
    let b = DVector::from_column_slice(&right);
    let inverse = normal
        .cholesky()
        .ok_or_else(|| {
            Failure::failed(
                "the terms of the equation of motion cannot be told apart in this record: it needs \
                 speeds and accelerations that vary, and less noise",
            )
        })?
        .inverse();
    let x = &inverse * scaled.tr_mul(&b);
    let residuals = &scaled * &x - &b;
    let meat = scores(&scaled, &residuals);
    let small_sample = rows as f64 / (rows - count) as f64;
    let covariance = &inverse * meat * &inverse * small_sample;
    let unscaled = |i: usize, j: usize| covariance[(i, j)] / (sizes[i] * sizes[j]);
    Ok(Corrected {
        values: x.iter().zip(&sizes).map(|(x, s)| x / s).collect(),
        covariance: DMatrix::from_fn(count, count, unscaled),
        residuals: residuals.as_slice().to_vec(),
        columns: DMatrix::from_fn(rows, count, |r, c| columns[c][r]),
        right,
        noise_share,
    })
}

/// Covariance of Σ aᵢ rᵢ with Bartlett's weights over neighbouring rows.
fn scores(a: &DMatrix<f64>, residuals: &DVector<f64>) -> DMatrix<f64> {
    let (rows, count) = a.shape();
    let scores = DMatrix::from_fn(rows, count, |r, c| a[(r, c)] * residuals[r]);
    // Neighbouring windows overlap up to three strides.
    let lags = (4.0 * (rows as f64 / 100.0).powf(2.0 / 9.0)).floor() as usize + 4;
    let lags = lags.min(rows / 4);
    let mut sum = scores.tr_mul(&scores);
    for lag in 1..=lags {
        let weight = 1.0 - lag as f64 / (lags + 1) as f64;
        let ahead = scores.rows(lag, rows - lag);
        let behind = scores.rows(0, rows - lag);
        let cross = ahead.tr_mul(&behind);
        sum += (&cross + cross.transpose()) * weight;
    }
    sum
}
