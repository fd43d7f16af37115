//! Reduction of a tall least-squares problem to a small one without squaring its condition number.

use nalgebra::{DMatrix, DVector};
use torqcomp_fourier::dot;

/// Rows per block: large enough for few rounds, small enough for the cache.
const BLOCK: usize = 2048;

/// The problem min |A x − b| as min |R x − c|² + rest², with R square and upper triangular.
pub(super) struct Reduced {
    /// Upper triangular factor of A.
    pub r: DMatrix<f64>,
    /// The part of b in the range of A.
    pub c: DVector<f64>,
}

/// Reduces [A | b] by Householder transformations, one block of rows after another (Golub & Van Loan, Matrix
/// Computations, 4th ed., 5.2, and 6.5.3 for joining blocks). A block with zero columns is first reduced without them,
/// so that parameters that affect only some of the rows cost nothing in the others.
pub(super) fn reduce(a: &DMatrix<f64>, b: &[f64]) -> Reduced {
    let (rows, columns) = a.shape();
    let width = columns + 1;
    let mut top = DMatrix::zeros(width, width);
    let mut from = 0;
    while from < rows {
        let count = BLOCK.max(width).min(rows - from);
        let block = from..from + count;
        let of_column = |j: usize| match j == columns {
            true => &b[block.clone()],
            false => &a.as_slice()[j * rows..][block.clone()],
        };
        let is_active = |j: &usize| *j == columns || of_column(*j).iter().any(|v| *v != 0.0);
        let active: Vec<usize> = (0..width).filter(is_active).collect();
        let is_whole = active.len() == width;
        let height = if is_whole {
            count
        } else {
            active.len().min(count)
        };
        let mut stacked = DMatrix::zeros(width + height, width);
        stacked.rows_mut(0, width).copy_from(&top);
        if is_whole {
            for j in active {
                stacked.column_mut(j).as_mut_slice()[width..].copy_from_slice(of_column(j));
            }
        } else {
            let mut few = DMatrix::zeros(count, active.len());
            for (k, j) in active.iter().enumerate() {
                few.column_mut(k)
                    .as_mut_slice()
                    .copy_from_slice(of_column(*j));
            }
            triangularize(&mut few);
            for (k, j) in active.into_iter().enumerate() {
                let source = &few.column(k);
                stacked.column_mut(j).as_mut_slice()[width..]
                    .copy_from_slice(&source.as_slice()[..height]);
            }
        }
        triangularize(&mut stacked);
        top.copy_from(&stacked.rows(0, width));
        from += count;
    }
    Reduced {
        r: top.view((0, 0), (columns, columns)).into_owned(),
        c: top.view((0, columns), (columns, 1)).column(0).into_owned(),
    }
}

/// Applies Householder reflections in place; the matrix is upper triangular afterwards.
fn triangularize(matrix: &mut DMatrix<f64>) {
    let (rows, columns) = matrix.shape();
    let data = matrix.as_mut_slice();
    let mut v = vec![0.0; rows];
    for k in 0..columns.min(rows) {
        let column = &mut data[k * rows + k..(k + 1) * rows];
        let largest = column.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        if largest == 0.0 {
            continue;
        }
        // Squares of large and small numbers would overflow and underflow.
        let v = &mut v[..rows - k];
        let both = v.iter_mut().zip(column.iter());
        both.for_each(|(v, x)| *v = x / largest);
        let norm = largest * dot(v, v).sqrt();
        let head = column[0];
        let alpha = if head > 0.0 { -norm } else { norm };
        // Scaled to v₀ = 1.
        let pivot = head - alpha;
        let scale = largest / pivot;
        v.iter_mut().for_each(|v| *v *= scale);
        v[0] = 1.0;
        let beta = -pivot / alpha;
        column.fill(0.0);
        column[0] = alpha;
        for j in k + 1..columns {
            let target = &mut data[j * rows + k..(j + 1) * rows];
            let factor = beta * dot(target, v);
            let both = target.iter_mut().zip(v.iter());
            both.for_each(|(t, v)| *t -= factor * v);
        }
    }
}

/// Solves R x = b for an upper triangular R without zeros on its diagonal.
pub(super) fn back_substitute(r: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    r.solve_upper_triangular(b)
        .filter(|x| x.iter().all(|v| v.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_normal_equations() {
        let value = |i: usize, j: usize| ((i * (j + 2)) as f64 * 0.37).sin();
        keeps(&DMatrix::from_fn(5000, 3, value));
        // The last three columns are each nonzero in some of the rows only, as the amplitudes of several
        // decays.
        keeps(&DMatrix::from_fn(9000, 5, |i, j| {
            match j < 2 || i / 3000 + 2 == j {
                true => value(i, j),
                false => 0.0,
            }
        }));
    }

    fn keeps(a: &DMatrix<f64>) {
        let rows = a.nrows();
        let b: Vec<f64> = (0..rows).map(|i| (i as f64 * 0.11).cos()).collect();
        let reduced = reduce(a, &b);
        let error = (reduced.r.tr_mul(&reduced.r) - a.tr_mul(a)).norm();
        assert!(error < 1e-9, "{error}");
        let right = a.tr_mul(&DVector::from_vec(b));
        let error = (reduced.r.tr_mul(&reduced.c) - right).norm();
        assert!(error < 1e-9, "{error}");
    }
}
