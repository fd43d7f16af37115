//! Regression of readings on loads with correlated errors: a linear mixed model.
//!
//! ```text
//! y_i = Σ_k c_k x_i^k + d i ± g_j + a_s + b_p x_i + w_i + e_i
//! ```
//!
//! x: load over the largest; c: the curve; d: linear drift of the zero over the rows i; g_j: half the width of the
//! hysteresis at load step j, or in range j of the load if there are many steps, plus in loading, minus in unloading;
//! a_s: zero of series s; b_p: deviation of the sensitivity at mounting p, or in series p at a single mounting; w:
//! random drift of the zero, a random walk over the rows; e: independent errors of the readings. d and g are estimated
//! where they are significant; a, b and the steps of w are normal with variances that maximise the restricted
//! likelihood. (H. D. Patterson, R. Thompson, Biometrika 58 (1971), 545; C. R. Henderson, Biometrics 31 (1975), 423.)
//!
//! An estimate whose variance comes from few series follows Student's distribution, with the degrees of freedom of
//! Welch and Satterthwaite; its standard uncertainty is enlarged so that ±1.96 of it cover 95 %. The sensitivity over m
//! mountings has the uncertainty of the mean of m sensitivities, with m − 1 degrees of freedom.
//!
//! Readings are rounded to their last digit d: however small the residual, e is at least d/√12, unless the readings
//! have given uncertainties (JCGM 100:2008, F.2.2.1). Errors of rounding that repeat are added (`repeated`).

use std::collections::BTreeMap;

use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use torqcomp_model::fit::FitError;

use super::Point;
use super::repeated;
use super::solve::{Mixed, VarianceRatios};
use super::steps::LoadSteps;
use crate::student::student;

/// Significance level of additional coefficients.
const CHANCE: f64 = 0.01;
/// Upper limit of variance ratios, to avoid overflow of their products.
const LARGEST_RATIO: f64 = 1e100;
/// Minimum fraction of a column's sum of squares not explained by other columns.
const APART: f64 = 0.05;
/// Minimum degrees of freedom that must remain with the hysteresis.
const LEAST_FREEDOM: usize = 3;
/// Maximum number of steps with their own hysteresis, as the time of a fit grows with their square; with more, ranges
/// of the load share one.
pub(super) const MOST_LOOPS: usize = 32;
/// Variance ratios to the readings tried first: exponents of 10, in steps of a half.
const TRIED: (i32, i32) = (-6, 16);
/// Rounds over all variances, and halvings of the step after the first rounds.
const ROUNDS: (usize, usize) = (3, 6);
/// Relative residual below which it is rounding.
const ROUNDING: f64 = 1e-12;

/// The fitted curve.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadCurve {
    /// Coefficients of powers of the normalised load.
    pub values: Vec<f64>,
    /// Their standard uncertainties; `None` without degrees of freedom.
    pub std: Vec<Option<f64>>,
    /// Number of readings minus coefficients of the curve.
    pub degrees_of_freedom: usize,
    /// Standard deviations of the random parts, in units of the reading.
    pub spreads: Spreads,
    /// Last digit of the readings, if the uncertainties come from it; otherwise 0.
    pub resolution: f64,
    /// Scatter of the readings relative to their given standard uncertainties, if any.
    pub scatter_over_known: Option<f64>,
    /// Whether the model includes a linear drift of the zero.
    pub has_even_drift: bool,
    /// Whether the model includes hysteresis.
    pub has_hysteresis: bool,
}

/// Standard deviations of the random parts, in units of the reading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spreads {
    /// Drift of the zero between rows.
    pub drift: f64,
    /// Zero between series.
    pub zero: f64,
    /// Deflection at the largest load between mountings, or between series at a single one.
    pub sensitivity: f64,
}

/// Fits a curve of this degree to the load steps.
///
/// # Errors
/// [`FitError`] if there are fewer points than coefficients, or the loads do not determine them.
pub(super) fn fit(
    points: &[Point],
    degree: usize,
    steps: &LoadSteps,
) -> Result<LoadCurve, FitError> {
    let largest = steps.largest;
    let mut columns = Vec::new();
    let mut model = Mixed::of(points, degree, largest, &columns);
    // From −½ to ½, so that the zero is that of the middle row.
    let row = |i: usize| (i as f64 + 0.5) / points.len() as f64 - 0.5;
    let drift: Vec<f64> = (0..points.len()).map(row).collect();
    let mut has_even_drift = !steps.is_sorted && model.is_apart(&drift);
    let mut ratios = None;
    if has_even_drift {
        let next = Mixed::of(points, degree, largest, std::slice::from_ref(&drift));
        let of_model = model.best_ratios(steps);
        has_even_drift = next.is_better(&model, of_model);
        if has_even_drift {
            (columns, model) = (vec![drift], next);
        } else {
            ratios = Some(of_model);
        }
    }
    let mut ratios = ratios.unwrap_or_else(|| model.best_ratios(steps));
    let mut loops = hysteresis(points.len(), steps);
    let mut has_hysteresis = !loops.is_empty();
    if has_hysteresis {
        columns.append(&mut loops);
        let next = Mixed::of(points, degree, largest, &columns);
        has_hysteresis = next.is_better(&model, ratios);
        if has_hysteresis {
            model = next;
            ratios = model.best_ratios(steps);
        }
    }
    let mut found = model.fit(degree, ratios)?;
    if steps.is_ramp {
        model.average(&mut found, ratios);
    }
    if let Some(std) = over_mountings(points, degree, largest, ratios) {
        found.std[1] = Some(std);
    }
    repeated::widen(&mut found.std, &model, steps);
    Ok(LoadCurve {
        has_even_drift,
        has_hysteresis,
        ..found
    })
}

/// Standard uncertainty of the mean sensitivity from its scatter between mountings; `None` for one mounting, or one
/// with too few points.
fn over_mountings(
    points: &[Point],
    degree: usize,
    largest: f64,
    ratios: VarianceRatios,
) -> Option<f64> {
    let mut mountings: BTreeMap<usize, Vec<Point>> = BTreeMap::new();
    for point in points {
        mountings.entry(point.position).or_default().push(*point);
    }
    let [drift, zeros, _] = ratios;
    let sensitivity = |own: &Vec<Point>| {
        let solved = Mixed::of(own, degree, largest, &[]).solve([drift, zeros, 0.0])?;
        Some(solved.values[1])
    };
    let each: Vec<f64> = mountings.values().map(sensitivity).collect::<Option<_>>()?;
    let count = each.len() as f64;
    if each.len() < 2 {
        return None;
    }
    let mean = each.iter().sum::<f64>() / count;
    let squares: f64 = each.iter().map(|s| (s - mean).powi(2)).sum();
    let freedom = count - 1.0;
    Some((squares / freedom / count).sqrt() * student(freedom))
}

/// Range of last digits considered, as powers of 10, and relative rounding error of numbers in memory.
const DIGITS: (i32, i32) = (-12, 6);
const OF_DIGIT: f64 = 1e-4;

/// Last digit of readings: the largest power of 10 of which all are multiples; `None` if they have more digits than a
/// display. The quantisation of a converter is a different matter (`torqcomp_dsp::quality::quantisation`): any step
/// with any offset, detected from hundreds of samples, while a display counts in powers of 10 from zero and is read
/// five times.
pub(super) fn resolution(readings: &[f64]) -> Option<f64> {
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

/// Deviations of a reading from a line through others, in last digits, that rounding explains: half a digit of its own,
/// and up to as much again where the line is extrapolated.
const ROUNDED: f64 = 1.5;

/// Deviation up to which a reading may be on a line through others, as all are rounded.
pub(super) fn last_digits(points: &[Point]) -> f64 {
    let readings: Vec<f64> = points.iter().map(|p| p.reading).collect();
    ROUNDED * resolution(&readings).unwrap_or(0.0)
}

/// A column for each load step that is read in both directions, or for each range of the load if there are many: 1 in
/// loading, −1 in unloading.
fn hysteresis(count: usize, steps: &LoadSteps) -> Vec<Vec<f64>> {
    let side = |i: &usize| if steps.is_rising[*i] { 1.0 } else { -1.0 };
    let both = |rows: &&[usize]| {
        let is_rising = |i: &usize| steps.is_rising[*i];
        rows.iter().any(is_rising) && !rows.iter().all(is_rising)
    };
    let at_steps: Vec<&[usize]> = steps.iter().map(|s| s.1).filter(both).collect();
    let ranges = ranges_of_load(steps);
    let classes = match at_steps.len() > MOST_LOOPS {
        true => ranges.iter().map(Vec::as_slice).filter(both).collect(),
        false => at_steps,
    };
    let column = |rows: &&[usize]| {
        let mut column = vec![0.0; count];
        rows.iter().for_each(|i| column[*i] = side(i));
        column
    };
    classes.iter().map(column).collect()
}

/// Rows in each of [`MOST_LOOPS`] equal ranges of the load.
fn ranges_of_load(steps: &LoadSteps) -> Vec<Vec<usize>> {
    let mut ranges = vec![Vec::new(); MOST_LOOPS];
    let (Some(first), Some(last)) = (steps.loads.first(), steps.loads.last()) else {
        return ranges;
    };
    for (load, rows) in steps.iter() {
        let part = (load - first) / (last - first);
        let range = (part * MOST_LOOPS as f64) as usize;
        ranges[range.min(MOST_LOOPS - 1)].extend(rows);
    }
    ranges
}

/// Whether a sum of squares is significantly smaller than another with fewer coefficients, by F-test; `more` is the
/// number of additional coefficients, `freedom` that of degrees of freedom that remain.
pub(super) fn is_significant((others, own): (f64, f64), more: f64, freedom: f64) -> bool {
    let ratio = (others - own) / more / (own / freedom);
    let law = FisherSnedecor::new(more, freedom);
    ratio > 0.0 && law.is_ok_and(|law| law.sf(ratio.min(LARGEST_RATIO)) < CHANCE)
}

impl Mixed {
    /// Whether a column is sufficiently independent of those of the model for its coefficient to be
    /// identifiable.
    fn is_apart(&self, column: &[f64]) -> bool {
        let of_column = Self {
            readings: column.to_vec(),
            fixed: self.fixed.clone(),
            loads: self.loads.clone(),
            series: self.series.clone(),
            mountings: self.mountings.clone(),
            variances: vec![1.0; column.len()],
            is_known: false,
        };
        let mean = column.iter().sum::<f64>() / column.len() as f64;
        let all: f64 = column.iter().map(|v| (v - mean).powi(2)).sum();
        of_column
            .weighted([0.0; 3])
            .is_some_and(|left| left > APART * all)
    }

    /// Whether this model's additional columns are significant compared with another, with these
    /// variances.
    fn is_better(&self, other: &Self, ratios: VarianceRatios) -> bool {
        if self.freedom() < LEAST_FREEDOM {
            return false;
        }
        let (Some(own), Some(others)) = (self.weighted(ratios), other.weighted(ratios)) else {
            return false;
        };
        let more = self.fixed.len() - other.fixed.len();
        is_significant((others, own), more as f64, self.freedom() as f64)
    }

    /// Weighted sum of squares for given variances.
    fn weighted(&self, ratios: VarianceRatios) -> Option<f64> {
        let solved = self.solve(ratios)?;
        Some(solved.variance * self.freedom() as f64)
    }

    fn fit(&self, degree: usize, mut ratios: VarianceRatios) -> Result<LoadCurve, FitError> {
        let singular = || FitError::Model("the loads do not determine the curve".to_owned());
        let mut solved = self.solve(ratios).ok_or_else(singular)?;
        let mut scale = if self.is_known { 1.0 } else { solved.variance };
        let mut shown = 0.0;
        if let Some(digit) = resolution(&self.readings).filter(|_| !self.is_known) {
            let rounding = digit * digit / 12.0;
            if scale < rounding {
                // Of the reading alone; the other variances keep their sizes.
                ratios = ratios.map(|ratio| ratio * scale / rounding);
                solved = self.solve(ratios).ok_or_else(singular)?;
                (scale, shown) = (rounding, digit);
            }
        }
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
            resolution: shown,
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

    /// Replaces the curve by that of ordinary least squares, with uncertainties that allow for these variances.
    fn average(&self, found: &mut LoadCurve, ratios: VarianceRatios) {
        let solved = self.solve(ratios).zip(self.ordinary(ratios));
        let Some((weighted, (values, variances))) = solved else {
            return;
        };
        let scale = if self.is_known {
            1.0
        } else {
            weighted.variance
        };
        let factor = student(self.freedom() as f64);
        let curve = found.values.iter_mut().zip(&mut found.std);
        for ((value, std), (ordinary, variance)) in curve.zip(values.iter().zip(variances)) {
            *value = *ordinary;
            *std = std.map(|_| (scale * variance).sqrt() * factor);
        }
    }

    /// Degrees of freedom of a coefficient's variance (Welch and Satterthwaite).
    fn freedom_of(&self, ratios: VarianceRatios, k: usize, variance: f64) -> f64 {
        let groups = self.series.count() + self.mountings.count();
        let inner = self
            .readings
            .len()
            .saturating_sub(self.fixed.len() + groups);
        let mut rest = variance;
        let mut sum = 0.0;
        for (place, columns) in [(1, self.series.count()), (2, self.mountings.count())] {
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

    /// The variances that maximise the restricted likelihood, by coordinate search with decreasing steps.
    fn best_ratios(&self, steps: &LoadSteps) -> VarianceRatios {
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
        let is_open = [
            !steps.is_sorted,
            self.series.count() > 0,
            self.mountings.count() > 0,
        ];
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
        // If nothing has changed since a variance was last searched, the search would find nothing
        // better.
        let mut searched = [None; 3];
        for _ in 0..ROUNDS.0 {
            for place in (0..3).filter(|p| is_open[*p]) {
                if searched[place] != Some(best) {
                    coarse.iter().for_each(|r| attempt(&mut best, place, *r));
                    searched[place] = Some(best);
                }
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
}
