//! Least squares with many columns, with cross-validation.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use torqcomp_dsp::dot;

/// Number of cross-validation folds; each is predicted from the others.
const FOLDS: usize = 8;
/// Number of segments of each record, assigned to the folds in turn.
const STRETCHES: usize = 24;
/// Prior standard deviations tried for a function's contribution to the record, relative to the RMS of the record: a
/// small one shrinks coefficients that few samples determine.
const EXPECTED: [f64; 10] = [1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 1e-5, 1e-8];
/// The same for functions that are to contribute nothing.
const NOTHING: f64 = 1e-100;
/// Maximum prior torque of a function, relative to the largest of the spring, however few samples determine it.
const LARGEST: f64 = 10.0;
/// Penalty of a coefficient of the plain stand, in noise powers: negligible.
const FREE: f64 = 1e-6;

/// Columns and their target, record by record.
pub struct Regression {
    columns: Arc<Vec<Vec<Vec<f64>>>>,
    targets: Vec<Vec<f64>>,
    /// Gram matrix of each fold, and the products of its columns with the target.
    grams: Arc<Vec<DMatrix<f64>>>,
    products: Vec<DVector<f64>>,
    /// Number of leading columns without a penalty.
    free: usize,
    noise_power: f64,
}

/// Coefficients of all columns.
pub struct Solution {
    coefficients: DVector<f64>,
    /// Coefficients found without each of the folds.
    without: Vec<DVector<f64>>,
    /// Penalty of each squared coefficient.
    ridge: DVector<f64>,
}

impl Regression {
    pub fn of(records: Vec<(Vec<Vec<f64>>, Vec<f64>)>, free: usize, noise_power: f64) -> Self {
        let (columns, targets): (Vec<_>, Vec<_>) = records.into_iter().unzip();
        let count = columns.first().map_or(0, |columns: &Vec<_>| columns.len());
        let mut grams = vec![DMatrix::zeros(count, count); FOLDS];
        for columns in &columns {
            let length = columns.first().map_or(0, Vec::len);
            for (stretch, range) in stretches(length).enumerate() {
                let gram = &mut grams[stretch % FOLDS];
                for (i, one) in columns.iter().enumerate() {
                    for (j, other) in columns[..=i].iter().enumerate() {
                        gram[(i, j)] += dot(&one[range.clone()], &other[range.clone()]);
                        gram[(j, i)] = gram[(i, j)];
                    }
                }
            }
        }
        let (columns, grams) = (Arc::new(columns), Arc::new(grams));
        Self {
            products: products(&columns, &targets, count),
            columns,
            targets,
            grams,
            free,
            noise_power,
        }
    }

    /// The same columns with another target.
    pub fn of_others(&self, others: Vec<Vec<f64>>) -> Self {
        Self {
            columns: Arc::clone(&self.columns),
            products: products(&self.columns, &others, self.count()),
            targets: others,
            grams: Arc::clone(&self.grams),
            ..*self
        }
    }

    pub fn targets(&self) -> &[Vec<f64>] {
        &self.targets
    }

    /// Number of columns.
    fn count(&self) -> usize {
        self.grams[0].nrows()
    }

    /// The solution with the prior that predicts unseen samples best, and its cross-validated residuals.
    pub fn solve(&self) -> Option<(Solution, Vec<f64>)> {
        let solved = EXPECTED.iter().filter_map(|std| {
            let ridge = self.ridge(*std);
            let without = self.without_each_fold(&ridge)?;
            let coefficients = self.coefficients(None, &ridge)?;
            let unseen = self.unseen(&without);
            let solution = Solution {
                coefficients,
                without,
                ridge,
            };
            Some((solution, unseen))
        });
        let sum = |left: &[f64]| dot(left, left);
        solved.min_by(|(_, a), (_, b)| sum(a).total_cmp(&sum(b)))
    }

    /// Cross-validated residuals with the free columns alone.
    pub fn unseen_by_free_columns(&self) -> Option<Vec<f64>> {
        let without = self.without_each_fold(&self.ridge(NOTHING))?;
        Some(self.unseen(&without))
    }

    /// Penalised sum of squares with a subset of the columns.
    pub fn left_with(&self, solution: &Solution, is_in: impl Fn(usize) -> bool) -> Option<f64> {
        let (gram, right) = self.sums(None, &solution.ridge);
        let kept: Vec<usize> = (0..right.len()).filter(|k| is_in(*k)).collect();
        let gram = gram.select_rows(&kept).select_columns(&kept);
        let right = right.select_rows(&kept);
        let found = gram.cholesky()?.solve(&right);
        Some(self.power() - found.dot(&right))
    }

    /// Penalties for a prior contribution of each function to the record.
    fn ridge(&self, expected: f64) -> DVector<f64> {
        let whole = self.power();
        let size = |k: usize| self.grams.iter().map(|gram| gram[(k, k)]).sum::<f64>();
        let cost = |k: usize| match k < self.free {
            true => FREE * self.noise_power,
            false => {
                let of_record = size(k) / (whole * expected * expected);
                self.noise_power * of_record.max(1.0 / (LARGEST * LARGEST))
            }
        };
        DVector::from_fn(self.count(), |k, _| cost(k).max(f64::MIN_POSITIVE))
    }

    /// Sum of squares of the target.
    fn power(&self) -> f64 {
        self.targets.iter().map(|target| dot(target, target)).sum()
    }

    fn sums(&self, without: Option<usize>, ridge: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let mut sum = (DMatrix::from_diagonal(ridge), DVector::zeros(ridge.len()));
        for (k, (gram, right)) in self.grams.iter().zip(&self.products).enumerate() {
            if Some(k) != without {
                sum.0 += gram;
                sum.1 += right;
            }
        }
        sum
    }

    fn coefficients(&self, without: Option<usize>, ridge: &DVector<f64>) -> Option<DVector<f64>> {
        let (gram, right) = self.sums(without, ridge);
        Some(gram.cholesky()?.solve(&right))
    }

    fn without_each_fold(&self, ridge: &DVector<f64>) -> Option<Vec<DVector<f64>>> {
        let folds = 0..FOLDS;
        folds
            .map(|fold| self.coefficients(Some(fold), ridge))
            .collect()
    }

    /// Residual of each sample with the coefficients found without it.
    fn unseen(&self, without: &[DVector<f64>]) -> Vec<f64> {
        let mut all = Vec::new();
        for (columns, target) in self.columns.iter().zip(&self.targets) {
            let mut left = target.clone();
            for (stretch, range) in stretches(target.len()).enumerate() {
                subtract(&without[stretch % FOLDS], columns, range, &mut left);
            }
            all.extend(left);
        }
        all
    }
}

impl Solution {
    /// Subtracts the fitted columns from samples.
    pub fn subtract(&self, columns: &[Vec<f64>], range: Range<usize>, left: &mut [f64]) {
        subtract(&self.coefficients, columns, range, left);
    }

    /// Functions of the coefficients, with standard uncertainties from their scatter between the folds (jackknife; B.
    /// Efron, *The Jackknife, the Bootstrap and Other Resampling Plans* (1982), 3).
    pub fn with_std(&self, of: impl Fn(&DVector<f64>) -> Vec<f64>) -> Vec<[f64; 2]> {
        let folds: Vec<Vec<f64>> = self.without.iter().map(&of).collect();
        let count = folds.len() as f64;
        let std = |k: usize| {
            let mean = folds.iter().map(|f| f[k]).sum::<f64>() / count;
            let square: f64 = folds.iter().map(|f| (f[k] - mean).powi(2)).sum();
            ((count - 1.0) / count * square).sqrt()
        };
        let values = of(&self.coefficients).into_iter().enumerate();
        values.map(|(k, value)| [value, std(k)]).collect()
    }
}

/// Products of the columns with targets in each fold.
fn products(columns: &[Vec<Vec<f64>>], targets: &[Vec<f64>], count: usize) -> Vec<DVector<f64>> {
    let mut products = vec![DVector::zeros(count); FOLDS];
    for (columns, target) in columns.iter().zip(targets) {
        for (stretch, range) in stretches(target.len()).enumerate() {
            let product = &mut products[stretch % FOLDS];
            for (sum, column) in product.iter_mut().zip(columns) {
                *sum += dot(&column[range.clone()], &target[range.clone()]);
            }
        }
    }
    products
}

fn subtract(
    coefficients: &DVector<f64>,
    columns: &[Vec<f64>],
    range: Range<usize>,
    left: &mut [f64],
) {
    for (column, c) in columns.iter().zip(coefficients.iter()) {
        let column = &column[range.clone()];
        let left = &mut left[range.clone()];
        left.iter_mut().zip(column).for_each(|(l, x)| *l -= c * x);
    }
}

/// Consecutive segments of a record.
fn stretches(count: usize) -> impl Iterator<Item = Range<usize>> {
    (0..STRETCHES).map(move |k| k * count / STRETCHES..(k + 1) * count / STRETCHES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_noise::noise;

    /// `y = 2 a + 0.5 b` in noise of 0.1, with 20 further columns of noise.
    fn made() -> Regression {
        let mut noise = noise(1);
        let records = (0..2).map(|_| {
            let columns: Vec<Vec<f64>> = (0..22)
                .map(|_| (0..2000).map(|_| noise()).collect())
                .collect();
            let y = (0..2000).map(|i| 2.0 * columns[0][i] + 0.5 * columns[1][i] + 0.35 * noise());
            let y = y.collect();
            (columns, y)
        });
        Regression::of(records.collect(), 1, 0.01)
    }

    #[test]
    fn unseen_samples_are_predicted_to_the_noise() {
        let regression = made();
        let (solution, unseen) = regression.solve().unwrap();
        let found = &solution.coefficients;
        assert!((found[0] - 2.0).abs() < 0.03 && (found[1] - 0.5).abs() < 0.03);
        // 0.35/√12 is 0.101.
        let rms = (dot(&unseen, &unseen) / 4000.0).sqrt();
        assert!((rms - 0.101).abs() < 0.003, "{rms}");
        let [_, std] = solution.with_std(|c| vec![c[1]])[0];
        // σ/√(Σ b²) = 0.101/√(4000/12).
        assert!((0.002..0.012).contains(&std));
    }

    #[test]
    fn what_is_left_out_is_missed() {
        let regression = made();
        let (solution, _) = regression.solve().unwrap();
        let left = |without: usize| regression.left_with(&solution, |k| k != without).unwrap();
        // 0.5² · 4000/12 = 83 more without the second column, no change without a noise column.
        assert!((left(1) - left(99) - 83.3).abs() < 12.0);
        assert!(left(7) - left(99) < 1.0);
    }
}
