//! Regression of readings on loads where errors are not independent: a mixed linear model.
//!
//! ```text
//! y_i = Σ_k c_k x_i^k + d i ± g_j + a_s + b_p x_i + w_i + e_i
//! ```
//!
//! x: load over the largest; c: the curve; d: even drift of the zero over the rows i; g_j: half the width of the hysteresis
//! at load step j, plus in loading, minus in unloading; a_s: zero of series s; b_p: deviation of the sensitivity at
//! mounting p; w: uneven drift of the zero, a random walk over the rows; e: independent errors of the readings. d and g are
//! estimated where they are significant; a, b and the steps of w are normal with variances that maximise the restricted
//! likelihood. (H. D. Patterson, R. Thompson, Biometrika 58 (1971), 545; C. R. Henderson, Biometrics 31 (1975), 423.)
//!
//! An estimate whose variance comes from few series follows Student's distribution, with the degrees of freedom of Welch
//! and Satterthwaite; its standard uncertainty is enlarged so that ±1.96 of it include 95 %. The sensitivity over m
//! mountings has the uncertainty of the mean of m sensitivities, with m − 1 degrees of freedom.
//!
//! Readings are rounded to their last digit d: however small the residual, e is taken as no smaller than d/√12, unless
//! the readings come with uncertainties of their own (JCGM 100:2008, F.2.2.1).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use torqcomp_model::fit::FitError;

use super::{Point, SAME, terms};
use crate::noise_colour::student;

/// Significance level of the hysteresis.
const CHANCE: f64 = 0.01;
/// Part of a column, in its sum of squares, that other columns may not explain.
const APART: f64 = 0.05;
/// Fewest degrees of freedom that the hysteresis leaves.
const LEAST_FREEDOM: usize = 3;
/// Variances, over that of a reading, that are tried first: powers of 10 from and to, in steps of a half.
const TRIED: (i32, i32) = (-6, 16);
/// Rounds over all variances, and halvings of the step after the first rounds.
const ROUNDS: (usize, usize) = (3, 6);
/// Residual over the readings below which it is rounding.
const ROUNDING: f64 = 1e-12;

/// The fitted curve.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadCurve {
    /// Coefficients over powers of the load over the largest.
    pub values: Vec<f64>,
    /// Their standard uncertainties; `None` without degrees of freedom.
    pub std: Vec<Option<f64>>,
    /// Readings less coefficients of the curve.
    pub degrees_of_freedom: usize,
    /// Standard deviations of the random parts, in units of the reading.
    pub spreads: Spreads,
    /// Last digit of the readings, if the uncertainties come from it; otherwise 0.
    pub resolution: f64,
    /// Scatter of the readings over their known standard uncertainties, if these are given.
    pub scatter_over_known: Option<f64>,
    /// Whether an even drift of the zero is part of the model.
    pub has_even_drift: bool,
    /// Whether a hysteresis is part of the model.
    pub has_hysteresis: bool,
}

/// Standard deviations of the random parts, in units of the reading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spreads {
    /// Drift of the zero from one row to the next.
    pub drift: f64,
    /// Zero of the series.
    pub zero: f64,
    /// Deflection at the largest load, of the mountings.
    pub sensitivity: f64,
}

/// Variances of drift, zeros and sensitivities, over that of a reading.
type VarianceRatios = [f64; 3];

/// The model's matrices.
struct Mixed {
    readings: Vec<f64>,
    /// Curve, then even drift and hysteresis.
    fixed: DMatrix<f64>,
    /// Indicators of series; none if there is only one.
    series: DMatrix<f64>,
    /// Load by mounting; none if there is only one.
    mountings: DMatrix<f64>,
    /// Variance of each reading, known or 1.
    variances: Vec<f64>,
    is_known: bool,
}

/// The model solved for given variances.
struct SolvedLoads {
    /// −2 ln of the restricted likelihood.
    deviance: f64,
    values: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Estimated variance of a reading, over the known one.
    variance: f64,
}

/// Fits a curve of that degree; loads up to `largest`, in the given steps.
///
/// # Errors
/// [`FitError`] if there are fewer points than coefficients, or the loads do not determine them.
pub(super) fn fit(
    points: &[Point],
    degree: usize,
    (steps, largest): (&[f64], f64),
) -> Result<LoadCurve, FitError> {
    let mut columns = Vec::new();
    let mut model = Mixed::of(points, degree, largest, &columns);
    // From −½ to ½, so that the zero is that of the middle row.
    let row = |i: usize, _| (i as f64 + 0.5) / points.len() as f64 - 0.5;
    let drift = DVector::from_fn(points.len(), row);
    let mut has_even_drift = model.is_apart(&drift);
    if has_even_drift {
        let next = Mixed::of(points, degree, largest, std::slice::from_ref(&drift));
        has_even_drift = next.is_better(&model, model.best_ratios());
        if has_even_drift {
            (columns, model) = (vec![drift], next);
        }
    }
    let mut loops = hysteresis(points, steps, largest);
    let mut has_hysteresis = !loops.is_empty();
    if has_hysteresis {
        columns.append(&mut loops);
        let next = Mixed::of(points, degree, largest, &columns);
        has_hysteresis = next.is_better(&model, model.best_ratios());
        if has_hysteresis {
            model = next;
        }
    }
    let ratios = model.best_ratios();
    let mut found = model.fit(degree, ratios)?;
    if let Some(std) = over_mountings(points, degree, largest, ratios) {
        found.std[1] = Some(std);
    }
    Ok(LoadCurve {
        has_even_drift,
        has_hysteresis,
        ..found
    })
}

/// Standard uncertainty of the mean sensitivity from its scatter over the mountings; `None` if there is one mounting, or
/// one with too few points.
fn over_mountings(
    points: &[Point],
    degree: usize,
    largest: f64,
    ratios: VarianceRatios,
) -> Option<f64> {
    let mut positions: Vec<usize> = points.iter().map(|p| p.position).collect();
    positions.sort_unstable();
    positions.dedup();
    let [drift, zeros, _] = ratios;
    let sensitivity = |position: &usize| {
        let own = points.iter().filter(|p| p.position == *position);
        let own: Vec<Point> = own.copied().collect();
        let solved = Mixed::of(&own, degree, largest, &[]).solve([drift, zeros, 0.0])?;
        Some(solved.values[1])
    };
    let each: Vec<f64> = positions.iter().map(sensitivity).collect::<Option<_>>()?;
    let count = each.len() as f64;
    if each.len() < 2 {
        return None;
    }
    let mean = each.iter().sum::<f64>() / count;
    let squares: f64 = each.iter().map(|s| (s - mean).powi(2)).sum();
    let freedom = count - 1.0;
    Some((squares / freedom / count).sqrt() * student(freedom))
}

/// Smallest digits that are looked for, as powers of 10, and part of one that rounding in memory may be.
const DIGITS: (i32, i32) = (-12, 6);
const OF_DIGIT: f64 = 1e-4;

/// The last digit of readings: the largest power of 10 that all are multiples of; `None` if they have more digits than
/// their display could show. The steps of a converter are another thing (`torqcomp_dsp::quality::quantisation`): any
/// number, about any offset, seen in hundreds of samples, where a display counts in powers of 10 from zero and is read
/// five times.
fn resolution(readings: &[f64]) -> Option<f64> {
    let is_multiple = |digit: f64| {
        readings.iter().all(|r| {
            let digits = (r / digit).round();
            (r / digit - digits).abs() < OF_DIGIT && (digits != 0.0 || *r == 0.0)
        })
    };
    let largest = readings.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
    let digits = (DIGITS.0..=DIGITS.1).rev().map(|k| 10.0_f64.powi(k));
    let shown = digits.filter(|digit| largest / digit < 0.1 * OF_DIGIT / f64::EPSILON);
    shown.into_iter().find(|digit| is_multiple(*digit))
}

/// A column for each load step that is read in both directions: 1 in loading, −1 in unloading.
fn hysteresis(points: &[Point], steps: &[f64], largest: f64) -> Vec<DVector<f64>> {
    let side = |step: f64, i: usize| match (points[i].load - step).abs() <= SAME * largest {
        true if terms::rising(points, i) => 1.0,
        true => -1.0,
        false => 0.0,
    };
    steps
        .iter()
        .map(|step| DVector::from_fn(points.len(), |i, _| side(*step, i)))
        .filter(|column| column.min() < 0.0 && column.max() > 0.0)
        .collect()
}

/// Indicators of the different numbers, each times a factor of its row; none if there is only one number.
fn indicators(numbers: &[usize], factor: impl Fn(usize) -> f64) -> DMatrix<f64> {
    let mut different = numbers.to_vec();
    different.sort_unstable();
    different.dedup();
    let count = if different.len() > 1 {
        different.len()
    } else {
        0
    };
    DMatrix::from_fn(numbers.len(), count, |i, j| {
        if numbers[i] == different[j] {
            factor(i)
        } else {
            0.0
        }
    })
}

impl Mixed {
    fn of(points: &[Point], degree: usize, largest: f64, more: &[DVector<f64>]) -> Self {
        let load = |i: usize| points[i].load / largest;
        let curve = DMatrix::from_fn(points.len(), degree + 1, |i, k| load(i).powi(k as i32));
        let mut columns: Vec<DVector<f64>> = curve.column_iter().map(|c| c.clone_owned()).collect();
        columns.extend_from_slice(more);
        let series: Vec<usize> = points.iter().map(|p| p.series).collect();
        let positions: Vec<usize> = points.iter().map(|p| p.position).collect();
        let is_known = points.iter().all(|p| p.std.is_some());
        Self {
            readings: points.iter().map(|p| p.reading).collect(),
            fixed: DMatrix::from_columns(&columns),
            series: indicators(&series, |_| 1.0),
            mountings: indicators(&positions, load),
            variances: match is_known {
                true => points
                    .iter()
                    .map(|p| p.std.map_or(1.0, |s| s * s))
                    .collect(),
                false => vec![1.0; points.len()],
            },
            is_known,
        }
    }

    fn freedom(&self) -> usize {
        self.readings.len().saturating_sub(self.fixed.ncols())
    }

    /// Whether a column differs enough from those of the model for its coefficient to be identifiable.
    fn is_apart(&self, column: &DVector<f64>) -> bool {
        let readings = column.as_slice().to_vec();
        let variances = vec![1.0; readings.len()];
        let fixed = self.fixed.clone();
        let none = DMatrix::zeros(readings.len(), 0);
        let of_column = Self {
            readings,
            fixed,
            series: none.clone(),
            mountings: none,
            variances,
            is_known: false,
        };
        let mean = column.mean();
        let all: f64 = column.iter().map(|v| (v - mean).powi(2)).sum();
        of_column
            .weighted([0.0; 3])
            .is_some_and(|left| left > APART * all)
    }

    /// Whether this model's additional columns are significant beside another, with these variances.
    fn is_better(&self, other: &Self, ratios: VarianceRatios) -> bool {
        if self.freedom() < LEAST_FREEDOM {
            return false;
        }
        let (Some(own), Some(others)) = (self.weighted(ratios), other.weighted(ratios)) else {
            return false;
        };
        let more = (self.fixed.ncols() - other.fixed.ncols()) as f64;
        let freedom = self.freedom() as f64;
        let ratio = (others - own) / more / (own / freedom);
        let limit = FisherSnedecor::new(more, freedom).map(|d| d.inverse_cdf(1.0 - CHANCE));
        limit.is_ok_and(|limit| ratio > limit)
    }

    /// Weighted sum of squares for given variances.
    fn weighted(&self, ratios: VarianceRatios) -> Option<f64> {
        let solved = self.solve(ratios)?;
        Some(solved.variance * self.freedom() as f64)
    }

    fn fit(&self, degree: usize, ratios: VarianceRatios) -> Result<LoadCurve, FitError> {
        let singular = || FitError::Model("the loads do not determine the curve".to_owned());
        let solved = self.solve(ratios).ok_or_else(singular)?;
        let (digit, rounding) = match resolution(&self.readings) {
            Some(digit) if !self.is_known => (digit, digit * digit / 12.0),
            _ => (0.0, 0.0),
        };
        let scale = match self.is_known {
            true => 1.0,
            false => solved.variance.max(rounding),
        };
        let spread = |ratio: f64| (ratio * scale).sqrt();
        let std = |k: usize| -> Option<f64> {
            if self.freedom() == 0 && !self.is_known {
                return None;
            }
            let std = (scale * solved.covariance[(k, k)]).sqrt();
            Some(std * student(self.freedom_of(ratios, k, solved.covariance[(k, k)])))
        };
        Ok(LoadCurve {
            values: solved.values.as_slice()[..=degree].to_vec(),
            std: (0..=degree).map(std).collect(),
            degrees_of_freedom: self.readings.len().saturating_sub(degree + 1),
            resolution: if solved.variance < rounding {
                digit
            } else {
                0.0
            },
            spreads: Spreads {
                drift: spread(ratios[0]),
                zero: spread(ratios[1]),
                sensitivity: spread(ratios[2]),
            },
            scatter_over_known: (self.is_known && self.freedom() >= LEAST_FREEDOM)
                .then(|| solved.variance.sqrt()),
            has_even_drift: false,
            has_hysteresis: false,
        })
    }

    /// Degrees of freedom of a coefficient's variance (Welch and Satterthwaite).
    fn freedom_of(&self, ratios: VarianceRatios, k: usize, variance: f64) -> f64 {
        let groups = self.series.ncols() + self.mountings.ncols();
        let inner = self
            .readings
            .len()
            .saturating_sub(self.fixed.ncols() + groups);
        let mut rest = variance;
        let mut sum = 0.0;
        for (place, columns) in [(1, self.series.ncols()), (2, self.mountings.ncols())] {
            let mut without = ratios;
            without[place] = 0.0;
            let share = self
                .solve(without)
                .map_or(0.0, |s| (variance - s.covariance[(k, k)]).max(0.0));
            rest -= share;
            sum += share * share / columns.saturating_sub(1).max(1) as f64;
        }
        if !self.is_known {
            sum += rest.max(0.0).powi(2) / inner.max(1) as f64;
        }
        match sum > 0.0 {
            true => (variance * variance / sum).max(1.0),
            false => f64::INFINITY,
        }
    }

    /// The variances with the largest restricted likelihood: a search over each in turn, in finer and finer steps.
    fn best_ratios(&self) -> VarianceRatios {
        let mut best = [0.0; 3];
        let Some(plain) = self.solve(best) else {
            return best;
        };
        let size: f64 = self.readings.iter().map(|y| y * y).sum();
        if self.freedom() < LEAST_FREEDOM || plain.variance <= ROUNDING.powi(2) * size {
            return best;
        }
        let unit = match self.is_known {
            true => self.variances.iter().sum::<f64>() / self.variances.len() as f64,
            false => 1.0,
        };
        let coarse: Vec<f64> = std::iter::once(0.0)
            .chain((TRIED.0..=TRIED.1).map(|k| unit * 10_f64.powf(0.5 * f64::from(k))))
            .collect();
        let mut least = plain.deviance;
        let is_open = [true, self.series.ncols() > 0, self.mountings.ncols() > 0];
        let mut attempt = |best: &mut VarianceRatios, place: usize, ratio: f64| {
            let mut next = *best;
            next[place] = ratio;
            if let Some(solved) = self.solve(next)
                && solved.deviance < least
            {
                least = solved.deviance;
                *best = next;
            }
        };
        for _ in 0..ROUNDS.0 {
            for place in (0..3).filter(|p| is_open[*p]) {
                coarse.iter().for_each(|r| attempt(&mut best, place, *r));
            }
        }
        let mut factor = 10_f64.powf(0.25);
        for _ in 0..ROUNDS.1 {
            for place in (0..3).filter(|p| is_open[*p]) {
                let here = best[place];
                attempt(&mut best, place, here * factor);
                attempt(&mut best, place, here / factor);
            }
            factor = factor.sqrt();
        }
        best
    }

    /// Henderson's equations for given variances; `None` if they are singular.
    fn solve(&self, [drift, zeros, sensitivities]: VarianceRatios) -> Option<SolvedLoads> {
        let (count, fixed) = (self.readings.len(), self.fixed.ncols());
        let mut all = DMatrix::zeros(count, fixed + self.series.ncols() + self.mountings.ncols());
        all.columns_mut(0, fixed).copy_from(&self.fixed);
        let series = all.ncols() - self.mountings.ncols();
        all.columns_mut(fixed, self.series.ncols())
            .copy_from(&(&self.series * zeros.sqrt()));
        all.columns_mut(series, self.mountings.ncols())
            .copy_from(&(&self.mountings * sensitivities.sqrt()));
        let mut readings = DVector::from_column_slice(&self.readings);
        let logarithm = self.whiten(drift, &mut all, &mut readings);
        let mut equations = all.tr_mul(&all);
        for i in fixed..all.ncols() {
            equations[(i, i)] += 1.0;
        }
        let factor = equations.cholesky()?;
        let mut solution = factor.solve(&all.tr_mul(&readings));
        // What is left is summed, as a difference of sums would be that of rounding beside a large zero; so is its share in the
        // solution, solved for once more.
        let mut rest = &readings - &all * &solution;
        let mut correction = all.tr_mul(&rest);
        for i in fixed..all.ncols() {
            correction[i] -= solution[i];
        }
        solution += factor.solve(&correction);
        rest = readings - &all * &solution;
        let random = solution.rows(fixed, all.ncols() - fixed);
        let left = rest.norm_squared() + random.norm_squared();
        let freedom = self.freedom();
        let determinant = 2.0
            * factor
                .l_dirty()
                .diagonal()
                .iter()
                .map(|d| d.ln())
                .sum::<f64>();
        let of_left = match self.is_known {
            true => left,
            false => freedom as f64 * left.max(f64::MIN_POSITIVE).ln(),
        };
        Some(SolvedLoads {
            deviance: logarithm + determinant + of_left,
            values: solution.rows(0, fixed).into(),
            covariance: factor.inverse().view((0, 0), (fixed, fixed)).into(),
            variance: left / freedom.max(1) as f64,
        })
    }

    /// Makes the rows independent with variance 1, where the zero drifts as a random walk from the first row on
    /// (Kalman's filter); ln of the determinant of their covariance.
    fn whiten(&self, drift: f64, all: &mut DMatrix<f64>, readings: &mut DVector<f64>) -> f64 {
        let mut variance = 0.0;
        let mut levels = vec![0.0; all.ncols() + 1];
        let mut logarithm = 0.0;
        for (i, own) in self.variances.iter().enumerate() {
            if i > 0 {
                variance += drift;
            }
            let total = variance + own;
            let gain = variance / total;
            logarithm += total.ln();
            let step = |value: &mut f64, level: &mut f64| {
                let innovation = *value - *level;
                *level += gain * innovation;
                *value = innovation / total.sqrt();
            };
            let (last, others) = levels.split_last_mut().expect("there is one more");
            for (value, level) in all.row_mut(i).iter_mut().zip(others) {
                step(value, level);
            }
            step(&mut readings[i], last);
            variance *= own / total;
        }
        logarithm
    }
}
