//! Covariance of the parameters, and the directions not identifiable from the data.

use nalgebra::{DMatrix, DVector};

use crate::quantity::Covariance;

/// Singular values below this fraction of the largest, after scaling of the columns, count as zero: finite-difference
/// derivatives have about ten digits.
const RANK_TOLERANCE: f64 = 1e-9;
/// Share of a parameter in an undetermined direction above which the parameter itself is
/// undetermined.
const SHARE: f64 = 1e-3;

/// A combination of parameters along which the fit does not change.
#[derive(Debug, Clone, PartialEq)]
pub struct Undetermined {
    /// Index of each parameter involved and its relative change along the direction.
    pub shares: Vec<(usize, f64)>,
}

/// Covariance and undetermined directions from the triangular factor of the Jacobian.
///
/// `indices` are the parameters of the columns, out of `count`; `variance` returns the variance of
/// a residual of weight 1 from the rank, `None` if unknown.
pub(super) fn covariance(
    r: &DMatrix<f64>,
    indices: &[usize],
    sizes: &[f64],
    count: usize,
    variance: impl Fn(usize) -> Option<f64>,
) -> (Covariance, Vec<Undetermined>) {
    let n = indices.len();
    if n == 0 {
        // Every parameter is fixed at a bound, so nothing was fitted and there is no covariance.
        let places = vec![None; count];
        let matrix = DMatrix::zeros(0, 0);
        return (Covariance { places, matrix }, Vec::new());
    }
    let norms: Vec<f64> = (0..n).map(|j| r.column(j).norm()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| {
        if norms[j] > 0.0 {
            r[(i, j)] / norms[j]
        } else {
            0.0
        }
    });
    let svd = scaled.svd(false, true);
    let v_t = svd.v_t.expect("the right side was asked for");
    let largest = svd.singular_values.iter().fold(0.0_f64, |m, s| m.max(*s));
    let mut inverse = DMatrix::zeros(n, n);
    let mut undetermined = Vec::new();
    let mut open = vec![false; n];
    for (k, singular) in svd.singular_values.iter().enumerate() {
        let row: DVector<f64> = v_t.row(k).transpose();
        if *singular > RANK_TOLERANCE * largest {
            inverse += &row * row.transpose() / (singular * singular);
            continue;
        }
        (0..n)
            .filter(|j| row[*j].abs() > SHARE)
            .for_each(|j| open[j] = true);
        undetermined.push(direction(&row, &norms, indices, sizes));
    }
    let variance = variance(n - undetermined.len());
    let kept: Vec<usize> = (0..n).filter(|j| !open[*j] && variance.is_some()).collect();
    let known: Vec<usize> = kept.iter().map(|j| indices[*j]).collect();
    let variance = variance.unwrap_or(0.0);
    let matrix = DMatrix::from_fn(kept.len(), kept.len(), |a, b| {
        let (i, j) = (kept[a], kept[b]);
        variance * inverse[(i, j)] / (norms[i] * norms[j])
    });
    (Covariance::of_some(&known, count, matrix), undetermined)
}

/// A null direction in relative changes of the parameters, normalised to a maximum of 1.
fn direction(row: &DVector<f64>, norms: &[f64], indices: &[usize], sizes: &[f64]) -> Undetermined {
    let dead = norms.contains(&0.0);
    let change: Vec<f64> = (0..indices.len())
        .map(|j| match (dead, norms[j] > 0.0) {
            // A column without effect is a null direction by itself.
            (true, false) => row[j],
            (true, true) if row[j].abs() <= SHARE => 0.0,
            _ => row[j] / (norms[j] * sizes[j]),
        })
        .collect();
    let largest = change
        .iter()
        .fold(0.0_f64, |m, c| if c.abs() > m.abs() { *c } else { m });
    let shares = indices
        .iter()
        .zip(&change)
        .map(|(index, c)| (*index, c / largest))
        .filter(|(_, share)| share.abs() > SHARE)
        .collect();
    Undetermined { shares }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As when every parameter ends at a bound.
    #[test]
    fn no_column_has_no_covariance() {
        let (found, undetermined) = covariance(&DMatrix::zeros(0, 0), &[], &[], 2, |_| Some(1.0));
        assert_eq!((found.std(0), found.std(1)), (None, None));
        assert!(undetermined.is_empty());
    }
}
