//! Inverse of matrices of normal equations.

use nalgebra::DMatrix;

/// Inverse of a symmetric positive matrix, after scaling its diagonal to 1 and adding `added` to it.
pub(super) fn invert(matrix: &DMatrix<f64>, added: f64) -> Option<DMatrix<f64>> {
    let sizes: Vec<f64> = matrix.diagonal().iter().map(|d| d.sqrt()).collect();
    let mut scaled = matrix.clone();
    for i in 0..sizes.len() {
        for j in 0..sizes.len() {
            scaled[(i, j)] /= sizes[i] * sizes[j];
        }
        scaled[(i, i)] += added;
    }
    let mut inverse = scaled.cholesky()?.inverse();
    for i in 0..sizes.len() {
        for j in 0..sizes.len() {
            inverse[(i, j)] /= sizes[i] * sizes[j];
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_of_uneven_sizes_are_inverted() {
        // [[4e12, 2], [2, 4e-12]] has the determinant 12.
        let matrix = DMatrix::from_row_slice(2, 2, &[4e12, 2.0, 2.0, 4e-12]);
        let want = DMatrix::from_row_slice(2, 2, &[4e-12, -2.0, -2.0, 4e12]) / 12.0;
        let got = invert(&matrix, 0.0).unwrap();
        let off = |i: usize| (got[i] / want[i] - 1.0).abs();
        assert!((0..4).all(|i| off(i) < 1e-12), "{got}");
        let singular = DMatrix::from_element(2, 2, 1.0);
        assert!(invert(&singular, 0.0).is_none_or(|m| m[(0, 0)] > 1e12));
    }
}
