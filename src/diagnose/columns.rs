//! Projection of a residual off a set of columns.

use std::sync::Arc;

use torqcomp_dsp::dot;

/// Minimum fraction of a column that must remain after orthogonalisation.
const LEFT: f64 = 1e-6;
/// Fraction above which the remainder is orthogonal to within rounding (B. N. Parlett, *The Symmetric Eigenvalue
/// Problem* (1980), 107).
const MUCH: f64 = 0.5;

/// Columns, orthonormalised one after the other.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    orthonormal: Vec<Arc<Vec<f64>>>,
    /// The original columns as combinations of the orthonormal ones:
    /// `raw_k = Σ_j mix[k][j] orthonormal_j`; `None` for a column that depends on the preceding
    /// ones.
    mix: Vec<Option<Vec<f64>>>,
}

impl Columns {
    /// Number of columns added, including dependent ones.
    #[must_use]
    pub fn count(&self) -> usize {
        self.mix.len()
    }

    /// Adds a column. If most of it is removed, it is orthogonalised twice, as once is not enough for nearly dependent
    /// columns.
    pub fn push(&mut self, mut column: Vec<f64>) {
        let size = dot(&column, &column).sqrt();
        let mut mix = vec![0.0; self.orthonormal.len()];
        let mut left = size;
        for _ in 0..2 {
            for (share, other) in mix.iter_mut().zip(&self.orthonormal) {
                let part = dot(&column, other);
                *share += part;
                let both = column.iter_mut().zip(other.iter());
                both.for_each(|(c, o)| *c -= part * o);
            }
            left = dot(&column, &column).sqrt();
            if left > MUCH * size {
                break;
            }
        }
        let is_new = left > LEFT * size && left > 0.0;
        if is_new {
            column.iter_mut().for_each(|c| *c /= left);
            self.orthonormal.push(Arc::new(column));
            mix.push(left);
        }
        self.mix.push(is_new.then_some(mix));
    }

    /// Projects a residual off all columns.
    pub fn clear(&self, residual: &mut [f64]) {
        let _ = self.take(residual);
    }

    /// Projects a residual off all columns and returns the coefficients of the original columns,
    /// zero for dependent ones.
    pub fn fit(&self, residual: &mut [f64]) -> Vec<f64> {
        // mix is triangular: back substitution.
        let mut rest = self.take(residual);
        let mut raw = vec![0.0; self.mix.len()];
        for (raw, row) in raw.iter_mut().zip(&self.mix).rev() {
            let Some(row) = row else { continue };
            let last = rest.pop().unwrap_or_default();
            *raw = last / row[rest.len()];
            for (r, share) in rest.iter_mut().zip(row) {
                *r -= *raw * share;
            }
        }
        raw
    }

    /// Sum of squares of a residual explained by the columns.
    #[must_use]
    pub fn explained(&self, residual: &[f64]) -> f64 {
        let part = |column: &Arc<Vec<f64>>| dot(column, residual).powi(2);
        self.orthonormal.iter().map(part).sum()
    }

    fn take(&self, residual: &mut [f64]) -> Vec<f64> {
        let mut parts = Vec::with_capacity(self.orthonormal.len());
        for column in &self.orthonormal {
            let part = dot(residual, column);
            residual
                .iter_mut()
                .zip(column.iter())
                .for_each(|(r, c)| *r -= part * c);
            parts.push(part);
        }
        parts
    }
}

impl FromIterator<Vec<f64>> for Columns {
    fn from_iter<I: IntoIterator<Item = Vec<f64>>>(all: I) -> Self {
        let mut columns = Self::default();
        all.into_iter().for_each(|column| columns.push(column));
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_and_what_is_left() {
        // 2·a − 3·b + (0, 0, 0, 5); the other columns depend on these.
        let (a, b) = (vec![1.0, 1.0, 1.0, 0.0], vec![1.0, 2.0, 3.0, 0.0]);
        let (twice, sum) = (vec![2.0, 2.0, 2.0, 0.0], vec![2.0, 3.0, 4.0, 0.0]);
        let columns: Columns = [a, twice, b, sum].into_iter().collect();
        let mut residual = vec![-1.0, -4.0, -7.0, 5.0];
        assert!((columns.explained(&residual) - 66.0).abs() < 1e-12);
        let raw = columns.fit(&mut residual);
        for (got, want) in raw.iter().zip([2.0, 0.0, -3.0, 0.0]) {
            assert!((got - want).abs() < 1e-12, "{raw:?}");
        }
        for (got, want) in residual.iter().zip([0.0, 0.0, 0.0, 5.0]) {
            assert!((got - want).abs() < 1e-12, "{residual:?}");
        }
    }
}
