//! Terms of the standards for force and torque calibration.
//!
//! X: deflection, a reading minus the zero of its series; X': the same during unloading; X_a: deflection of the fitted
//! curve; X_N: that at the largest load; i: readings.
//!
//! | term | formula | standards |
//! |---|---|---|
//! | repeatability | `(X_max − X_min)/mean X`, series at one mounting, loading | ISO 376 b', DIN 51309 b', VDI/VDE 2646 b' |
//! | reproducibility | `(X_max − X_min)/mean X`, first series of each mounting, loading | ISO 376 b, DIN 51309 b |
//! | hysteresis | mean over the series of `\|X' − X\|/X` | ISO 376 v (reversibility), DIN 51309 h, VDI/VDE 2646 h |
//! | interpolation error | `\|mean X − X_a\|/X_a`, first series of each mounting, loading | ISO 376 f_c, DIN 51309 f_a |
//! | zero return | `\|i_after − i_before\|/X_N` | ISO 376 f_0, DIN 51309 f_0, VDI/VDE 2646 f_0 |
//! | creep | `\|i_last − i_first\|/X_N`, largest load held | ISO 376 c (readings 30 s and 300 s after loading) |
//!
//! The largest value of each over loads or series, in per cent. ISO 376:2011 fits X_a to loading only; here it is the
//! curve through loading and unloading, as in case II of DIN 51309:2005.

use std::collections::{HashMap, HashSet};

use super::mixed::MOST_LOOPS;
use super::steps::LoadSteps;
use super::{NONE, Point, SAME, Term};

/// Deflections of a set of points.
struct Deflections<'a> {
    points: &'a [Point],
    steps: &'a LoadSteps,
    /// Reading without load before each series, or the zero of the curve.
    zeros: Vec<f64>,
}

/// StepRows at a load.
type StepRows<'a> = &'a [usize];

impl Deflections<'_> {
    /// Series and deflection of each of these rows, for loading (`up`) or unloading, in the wanted series.
    fn at(&self, rows: StepRows, up: bool, wanted: &dyn Fn(usize) -> bool) -> Vec<(usize, f64)> {
        rows.iter()
            .filter(|i| self.steps.is_rising[**i] == up && wanted(self.points[**i].series))
            .map(|i| {
                let point = &self.points[*i];
                (point.series, point.reading - self.zeros[point.series])
            })
            .collect()
    }

    /// The same with one value per series: the mean if the load was applied repeatedly.
    fn by_series(
        &self,
        rows: StepRows,
        up: bool,
        wanted: &dyn Fn(usize) -> bool,
    ) -> Vec<(usize, f64)> {
        let all = self.at(rows, up, wanted);
        let of = |part: &[(usize, f64)]| {
            let values: Vec<f64> = part.iter().map(|p| p.1).collect();
            (part[0].0, mean(&values))
        };
        all.chunk_by(|a, b| a.0 == b.0).map(of).collect()
    }

    fn values(&self, rows: StepRows, wanted: &dyn Fn(usize) -> bool) -> Vec<f64> {
        let each = self.by_series(rows, true, wanted);
        each.into_iter().map(|(_, value)| value).collect()
    }

    /// Mean over the series of |unloading − loading| over loading.
    fn reversibility(&self, rows: StepRows) -> Option<f64> {
        let up = self.by_series(rows, true, &|_| true);
        let mut down = HashMap::new();
        for (series, back) in self.by_series(rows, false, &|_| true) {
            down.entry(series).or_insert(back);
        }
        let pairs: Vec<f64> = up
            .iter()
            .filter_map(|(series, x)| {
                let back = down.get(series)?;
                Some(100.0 * (back - x).abs() / x.abs())
            })
            .collect();
        (!pairs.is_empty()).then(|| mean(&pairs))
    }
}

/// Largest values over all loads, in per cent; `curve` are coefficients over powers of the load.
pub(super) fn terms(points: &[Point], steps: &LoadSteps, curve: &[f64]) -> Vec<Term> {
    let largest = steps.largest;
    let around = zeros(points, largest);
    let deflections = Deflections {
        points,
        steps,
        zeros: around.iter().map(|z| z.0.unwrap_or(curve[0])).collect(),
    };
    let mut positions = vec![0; around.len()];
    for point in points.iter().rev() {
        positions[point.series] = point.position;
    }
    let first = positions[points[0].series];
    // The first series of each mounting.
    let mut seen = HashSet::new();
    let opens: Vec<bool> = positions.iter().map(|p| seen.insert(*p)).collect();
    let opens = |series: usize| opens[series];
    // Loads that hardly repeat are no steps: differences between their rows are those of the loads.
    let is_stepwise = steps.loads.len() <= MOST_LOOPS;
    let loaded = || {
        let steps = steps.iter().filter(|_| is_stepwise);
        steps.filter(|s| s.0.abs() > NONE * largest)
    };
    let value = |load: f64| -> f64 {
        let powers = curve.iter().enumerate().skip(1);
        powers.map(|(k, c)| c * load.powi(k as i32)).sum()
    };
    let spread_of = |wanted: &dyn Fn(usize) -> bool| {
        worst(loaded().map(|s| spread(&deflections.values(s.1, wanted))))
    };
    let interpolation = worst(loaded().map(|(load, rows)| {
        let up = deflections.values(rows, &opens);
        (!up.is_empty()).then(|| 100.0 * (mean(&up) - value(load)).abs() / value(load).abs())
    }));
    let full = value(largest).abs();
    let zero_return = worst(around.iter().map(|(before, after)| match (before, after) {
        (Some(before), Some(after)) => Some(100.0 * (after - before).abs() / full),
        _ => None,
    }));
    let percents = [
        spread_of(&|s| positions[s] == first),
        spread_of(&opens),
        worst(loaded().map(|s| deflections.reversibility(s.1))),
        interpolation,
        zero_return,
        creep(points, largest, full),
    ];
    NAMES
        .iter()
        .zip(percents)
        .map(|((name, formula), percent)| Term {
            name,
            formula,
            percent,
        })
        .collect()
}

/// Names and formulas of the terms, in the order of the report.
const NAMES: [(&str, &str); 6] = [
    (
        "repeatability",
        "ISO 376 b', DIN 51309 b', VDI/VDE 2646 b': spread at one load, one mounting, over its mean",
    ),
    (
        "reproducibility",
        "ISO 376 b, DIN 51309 b: spread at one load over mountings, over its mean",
    ),
    (
        "hysteresis",
        "ISO 376 v (reversibility), DIN 51309 h, VDI/VDE 2646 h: mean over series of |unloading - loading| over \
         loading",
    ),
    (
        "interpolation error",
        "ISO 376 f_c, DIN 51309 f_a: |mean of loading - curve| over curve",
    ),
    (
        "zero return",
        "ISO 376 f_0, DIN 51309 f_0, VDI/VDE 2646 f_0: |zero after - zero before| over the largest deflection",
    ),
    (
        "creep",
        "ISO 376 c: change at the largest load held, over the largest deflection",
    ),
];

/// Readings without load before and after each series.
fn zeros(points: &[Point], largest: f64) -> Vec<(Option<f64>, Option<f64>)> {
    let count = points.iter().map(|p| p.series).max().map_or(0, |m| m + 1);
    let mut of: Vec<Vec<&Point>> = vec![Vec::new(); count];
    for point in points {
        of[point.series].push(point);
    }
    let empty = |p: &&&Point| p.load.abs() <= NONE * largest;
    let around = |of: Vec<&Point>| {
        let before = of.first().filter(empty).map(|p| p.reading);
        let after = (of.len() > 1)
            .then(|| of.last().filter(empty).map(|p| p.reading))
            .flatten();
        (before, after)
    };
    of.into_iter().map(around).collect()
}

/// Difference between the first and the last of consecutive readings at the largest load.
fn creep(points: &[Point], largest: f64, full: f64) -> Option<f64> {
    let held = |p: &Point| (p.load.abs() - largest).abs() <= SAME * largest;
    let runs = points.chunk_by(|a, b| a.series == b.series && held(a) == held(b));
    worst(runs.map(|run| match run {
        [first, .., last] if held(first) => {
            Some(100.0 * (last.reading - first.reading).abs() / full)
        }
        _ => None,
    }))
}

/// Range over the mean, in per cent.
fn spread(values: &[f64]) -> Option<f64> {
    let (low, high) = ends(values);
    (values.len() > 1).then(|| 100.0 * (high - low) / mean(values).abs())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn ends(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        })
}

/// The largest of the known values; a ratio to a mean of zero is unknown.
fn worst(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    values
        .flatten()
        .filter(|value| value.is_finite())
        .fold(None, |m: Option<f64>, v| Some(m.map_or(v, |m| m.max(v))))
}
