//! Solution of the mixed model for given variances, in time proportional to the number of rows.

use nalgebra::{DMatrix, DVector};

use super::Point;
use super::filter::LevelFilter;
use super::groups::Groups;

/// Variances of drift, zeros and sensitivities, relative to that of a reading.
pub(super) type VarianceRatios = [f64; 3];

/// The model: readings, fixed effects, and shared errors.
pub(super) struct Mixed {
    pub readings: Vec<f64>,
    /// Columns of the fixed effects: the curve, then linear drift and hysteresis.
    pub fixed: Vec<Vec<f64>>,
    /// Normalised load.
    pub loads: Vec<f64>,
    pub series: Groups,
    /// Groups with a common deviation of the sensitivity.
    pub mountings: Groups,
    /// Variance of each reading, known or 1.
    pub variances: Vec<f64>,
    pub is_known: bool,
}

/// The model solved for given variances.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SolvedLoads {
    /// −2 ln of the restricted likelihood.
    pub deviance: f64,
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Estimated variance of a reading, relative to the known one.
    pub variance: f64,
}

/// A level of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Level {
    Drift,
    Zero(usize),
    Sensitivity(usize),
}

impl Mixed {
    /// The model of these points with additional columns.
    pub fn of(points: &[Point], degree: usize, largest: f64, more: &[Vec<f64>]) -> Self {
        let loads: Vec<f64> = points.iter().map(|p| p.load / largest).collect();
        let power = |k: usize| loads.iter().map(|load| load.powi(k as i32)).collect();
        let mut fixed: Vec<Vec<f64>> = (0..=degree).map(power).collect();
        fixed.extend_from_slice(more);
        let is_known = points.iter().all(|p| p.std.is_some());
        let variance = |p: &Point| p.std.filter(|_| is_known).map_or(1.0, |s| s * s);
        Self {
            readings: points.iter().map(|p| p.reading).collect(),
            fixed,
            series: Groups::of(points.iter().map(|p| p.series)),
            mountings: Groups::of_sensitivity(points, largest),
            variances: points.iter().map(variance).collect(),
            loads,
            is_known,
        }
    }

    /// Number of rows minus estimated coefficients.
    pub fn freedom(&self) -> usize {
        self.readings.len().saturating_sub(self.fixed.len())
    }

    /// Generalised least squares for given variances; `None` if the columns do not determine their coefficients.
    pub fn solve(&self, ratios: VarianceRatios) -> Option<SolvedLoads> {
        let fixed = self.fixed.len();
        if self.readings.len() < fixed {
            return None;
        }
        let (rows, logarithm) = self.whitened(ratios);
        let rows = || rows.chunks_exact(fixed + 1);
        let mut equations = vec![0.0; fixed * fixed];
        let mut products = DVector::zeros(fixed);
        for row in rows() {
            // Half of the symmetric matrix suffices for its Cholesky factor.
            for (j, column) in equations.chunks_exact_mut(fixed).enumerate() {
                add(&mut column[j..], row[j], &row[j..fixed]);
            }
            add(products.as_mut_slice(), row[fixed], &row[..fixed]);
        }
        let factor = DMatrix::from_vec(fixed, fixed, equations).cholesky()?;
        let mut values = factor.solve(&products);
        let rest = |values: &DVector<f64>, row: &[f64]| {
            let pairs = row.iter().zip(values.iter());
            row[fixed] - pairs.map(|(x, c)| x * c).sum::<f64>()
        };
        // The residuals are summed directly, as a difference of sums would be dominated by rounding for a large zero;
        // one step of iterative refinement likewise corrects the solution.
        let mut correction = DVector::zeros(fixed);
        for row in rows() {
            add(correction.as_mut_slice(), rest(&values, row), &row[..fixed]);
        }
        values += factor.solve(&correction);
        let left: f64 = rows().map(|row| rest(&values, row).powi(2)).sum();
        let diagonal = factor.l_dirty().diagonal();
        let determinant = 2.0 * diagonal.iter().map(|d| d.ln()).sum::<f64>();
        let freedom = self.freedom();
        let of_left = match self.is_known {
            true => left,
            false => freedom as f64 * left.max(f64::MIN_POSITIVE).ln(),
        };
        Some(SolvedLoads {
            deviance: logarithm + determinant + of_left,
            values,
            covariance: factor.inverse(),
            variance: left / freedom.max(1) as f64,
        })
    }

    /// Weight of each reading in each coefficient of ordinary least squares, `(XᵀX)⁻¹Xᵀ`.
    pub fn weights(&self) -> Option<DMatrix<f64>> {
        let design = DMatrix::from_fn(self.readings.len(), self.fixed.len(), |i, k| {
            self.fixed[k][i]
        });
        let inverse = design.tr_mul(&design).cholesky()?.inverse();
        Some(inverse * design.transpose())
    }

    /// Coefficients by ordinary least squares, and their variances with errors of these variances, relative to that of
    /// a reading; `None` if the columns do not determine them. With A = (XᵀX)⁻¹Xᵀ, that of a coefficient is
    /// `Σ_i A_i² + v_w Σ_i (Σ_{k≥i} A_k)² + v_a Σ_s (Σ_{k∈s} A_k)² + v_b Σ_p (Σ_{k∈p} A_k x_k)²`.
    pub fn ordinary(
        &self,
        [drift, zeros, sensitivities]: VarianceRatios,
    ) -> Option<(DVector<f64>, Vec<f64>)> {
        let weights = self.weights()?;
        let values = &weights * DVector::from_column_slice(&self.readings);
        let variance = |k: usize| {
            let row: Vec<f64> = weights.row(k).iter().copied().collect();
            let own: f64 = row
                .iter()
                .zip(&self.variances)
                .map(|(a, v)| a * a * v)
                .sum();
            let mut tail = 0.0;
            let tails = row.iter().skip(1).rev().map(|a| {
                tail += a;
                tail * tail
            });
            let walk: f64 = tails.sum();
            let by_group = |groups: &Groups, factor: &dyn Fn(usize) -> f64| {
                let mut sums = vec![0.0; groups.count()];
                for (i, group) in groups.of_row.iter().enumerate() {
                    if let Some(sum) = sums.get_mut(*group) {
                        *sum += row[i] * factor(i);
                    }
                }
                sums.iter().map(|sum| sum * sum).sum::<f64>()
            };
            let of_series = by_group(&self.series, &|_| 1.0);
            let of_mountings = by_group(&self.mountings, &|i| self.loads[i]);
            own + drift * walk + zeros * of_series + sensitivities * of_mountings
        };
        Some((values, (0..self.fixed.len()).map(variance).collect()))
    }

    /// Rows of the columns and the reading, whitened one after the other; also ln of the determinant of their
    /// covariance.
    fn whitened(&self, ratios: VarianceRatios) -> (Vec<f64>, f64) {
        let [drift, zeros, sensitivities] = ratios.map(f64::sqrt);
        let width = self.fixed.len() + 1;
        let mut filter = LevelFilter::new(width);
        let mut open = Vec::new();
        if drift > 0.0 {
            filter.open(0.0);
            open.push(Level::Drift);
        }
        let mut all = Vec::with_capacity(self.readings.len() * width);
        let mut logarithm = 0.0;
        let mut factors = Vec::new();
        for (i, own) in self.variances.iter().enumerate() {
            if i > 0 && drift > 0.0 {
                filter.step(drift);
            }
            let (series, mounting) = (self.series.of_row[i], self.mountings.of_row[i]);
            let begins = |groups: &Groups, group: usize| {
                groups.ranges.get(group).is_some_and(|range| range[0] == i)
            };
            if zeros > 0.0 && begins(&self.series, series) {
                filter.open(zeros);
                open.push(Level::Zero(series));
            }
            if sensitivities > 0.0 && begins(&self.mountings, mounting) {
                filter.open(sensitivities);
                open.push(Level::Sensitivity(mounting));
            }
            factors.clear();
            factors.extend(open.iter().map(|level| match level {
                Level::Drift => 1.0,
                Level::Zero(of) => f64::from(u8::from(*of == series)),
                Level::Sensitivity(of) if *of == mounting => self.loads[i],
                Level::Sensitivity(_) => 0.0,
            }));
            let start = all.len();
            all.extend(self.fixed.iter().map(|column| column[i]));
            all.push(self.readings[i]);
            let total = filter.whiten(&factors, own.sqrt(), &mut all[start..]);
            logarithm += 2.0 * total.ln();
            // Backwards, so that the indices of the preceding ones remain valid.
            for place in (0..open.len()).rev() {
                if self.ends(open[place], i) {
                    filter.close(place);
                    open.remove(place);
                }
            }
        }
        (all, logarithm)
    }

    /// Whether no later row depends on the level.
    fn ends(&self, level: Level, row: usize) -> bool {
        match level {
            Level::Drift => false,
            Level::Zero(series) => self.series.ranges[series][1] == row,
            Level::Sensitivity(mounting) => self.mountings.ranges[mounting][1] == row,
        }
    }
}

/// Adds a multiple of values to sums.
fn add(sums: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

#[cfg(test)]
#[path = "solve_tests.rs"]
mod tests;
