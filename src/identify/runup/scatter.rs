//! Covariance of the parameters of a regression over overlapping windows.
//!
//! ```text
//! Cov x = B Aᵀ Ω A B,   B = (AᵀA − nN)⁻¹,   Ω = covariance of the rows' errors
//! ```
//!
//! Ω is estimated twice. *White*: noise of torque and motion is white from sample to sample, and the shape of the
//! window gives the correlation of overlapping rows; only the variance of the noise comes from the residuals.
//! *Coloured*: from the residuals themselves (W. K. Newey, K. D. West, Econometrica 55 (1987), 703), which includes
//! the error of an incomplete model. The coloured estimate has more scatter and is biased low, so it is used only
//! where it is the larger one.

use nalgebra::{DMatrix, DVector};

use super::regression::Errors;

/// Covariance of the (scaled) parameters, and the largest ratio of an uncertainty to that for white noise.
pub(super) fn covariance(
    a: DMatrix<f64>,
    inverse: &DMatrix<f64>,
    residuals: &DVector<f64>,
    values: &[f64],
    rows: usize,
    errors: &Errors,
) -> (DMatrix<f64>, f64) {
    let count = a.ncols();
    let freedom = rows as f64 / (rows - count) as f64;
    let power = residuals.norm_squared() / rows as f64;
    let shape = shape(power, values, errors);
    let white = inverse * gathered(&a, &shape) * inverse;
    // The residuals are smaller than the errors by what the fit absorbs; overlapping windows count less than
    // independent rows.
    let mean: f64 = trace_of_fit(&a, inverse, &shape) / (rows as f64 * shape[0]);
    let white = white / (1.0 - mean).max(0.1);
    let coloured = inverse * scores(a, residuals, rows, errors.overlap) * inverse * freedom;
    let factors: Vec<f64> = (0..count)
        .map(|i| (coloured[(i, i)] / white[(i, i)]).sqrt())
        .map(|ratio| ratio.max(1.0))
        .collect();
    let largest = factors.iter().copied().fold(1.0, f64::max);
    let joined = DMatrix::from_fn(count, count, |i, j| white[(i, j)] * factors[i] * factors[j]);
    (joined, largest)
}

/// Covariance of rows 0, 1, … windows apart: from motion noise, and from torque noise for the rest of the power of
/// the residuals.
fn shape(power: f64, values: &[f64], errors: &Errors) -> Vec<f64> {
    let motion: Vec<f64> = (0..=errors.overlap)
        .map(|lag| (errors.motion)(lag, values))
        .collect();
    let torque: Vec<f64> = (0..=errors.overlap)
        .map(|lag| (errors.torque)(lag))
        .collect();
    let part = (motion[0] / power).min(1.0);
    (0..=errors.overlap)
        .map(|lag| {
            let of_motion = if motion[0] > 0.0 {
                part * motion[lag] / motion[0]
            } else {
                0.0
            };
            power * (of_motion + (1.0 - part) * torque[lag] / torque[0])
        })
        .collect()
}

/// AᵀΩA for a covariance that depends only on the distance of rows.
fn gathered(a: &DMatrix<f64>, shape: &[f64]) -> DMatrix<f64> {
    let rows = a.nrows();
    let mut sum = a.tr_mul(a) * shape[0];
    for (lag, covariance) in shape.iter().enumerate().skip(1).take(rows - 1) {
        let cross = a.rows(lag, rows - lag).tr_mul(&a.rows(0, rows - lag));
        sum += (&cross + cross.transpose()) * *covariance;
    }
    sum
}

/// Power of the errors that the fit absorbs: trace of B AᵀΩA.
fn trace_of_fit(a: &DMatrix<f64>, inverse: &DMatrix<f64>, shape: &[f64]) -> f64 {
    (inverse * gathered(a, shape)).trace()
}

/// Covariance of Σ aᵢ rᵢ, with Bartlett's weights for neighbouring rows.
fn scores(
    mut scores: DMatrix<f64>,
    residuals: &DVector<f64>,
    rows: usize,
    overlap: usize,
) -> DMatrix<f64> {
    let all = scores.nrows();
    for mut column in scores.column_iter_mut() {
        column.component_mul_assign(residuals);
    }
    let lags = (4.0 * (rows as f64 / 100.0).powf(2.0 / 9.0)).floor() as usize + overlap;
    let lags = lags.min(rows / 4);
    let mut sum = scores.tr_mul(&scores);
    for lag in 1..=lags {
        let weight = 1.0 - lag as f64 / (lags + 1) as f64;
        let cross = scores
            .rows(lag, all - lag)
            .tr_mul(&scores.rows(0, all - lag));
        sum += (&cross + cross.transpose()) * weight;
    }
    sum
}
