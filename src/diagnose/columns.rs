//! Columns that a residual is cleared of.

use std::sync::Arc;

use torqcomp_dsp::dot;

/// Part of a column that must be left after the others are taken out of it.
const LEFT: f64 = 1e-6;
/// Part above which what is left is orthogonal to within rounding (B. N. Parlett, *The Symmetric Eigenvalue Problem* (1980), 107).
const MUCH: f64 = 0.5;

/// Columns, made orthonormal one after the other.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    orthonormal: Vec<Arc<Vec<f64>>>,
    /// The columns as they came, each a combination of the orthonormal ones up to its own:
    /// `raw_k = Σ_j mix[k][j] orthonormal_j`; none for a column that depends on those before.
    mix: Vec<Option<Vec<f64>>>,
}

impl Columns {
    /// Columns that came, those that depend on others among them.
    #[must_use]
    pub fn count(&self) -> usize {
        self.mix.len()
    }

    /// Adds a column. Where most of it is taken out it is orthogonalised twice, as once is not enough for nearly dependent ones.
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

    /// Clears a residual of all columns.
    pub fn clear(&self, residual: &mut [f64]) {
        let _ = self.take(residual);
    }

    /// Clears a residual; the coefficients of the columns as they came, dependent ones having none.
    pub fn fit(&self, residual: &mut [f64]) -> Vec<f64> {
        // mix is triangular: solved from the last column on.
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

    /// Sum of the squares that clearing takes out of a residual.
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
        // 2·a − 3·b + (0, 0, 0, 5), the other columns depending on these.
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
