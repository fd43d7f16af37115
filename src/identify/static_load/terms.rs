//! Terms of the standards for force and torque calibration.
//!
//! X: deflection, a reading less the zero of its series; X': the same while unloading; X_a: deflection of
//! the fitted curve; X_N: that at the largest load; i: readings.
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
//! The largest value of each over loads or series, in per cent. ISO 376:2011 fits X_a to loading alone; here
//! it is the curve through loading and unloading, as in case II of DIN 51309:2005.

use super::{NONE, Point, SAME, Term};

/// Whether the load (in size) was raised to a point, not lowered.
pub(super) fn rising(points: &[Point], i: usize) -> bool {
    let before = (0..i).rev().find(|j| points[*j].series == points[i].series);
    before.is_none_or(|j| points[i].load.abs() >= points[j].load.abs())
}

/// Deflections of a set of points.
struct Deflections<'a> {
    points: &'a [Point],
    /// Reading of the empty stand before each series, or the zero of the curve.
    zeros: Vec<f64>,
    largest: f64,
}

impl Deflections<'_> {
    /// Series and deflection of each point at a load, during loading (`up`) or unloading, in the wanted series.
    fn at(&self, step: f64, up: bool, wanted: &dyn Fn(usize) -> bool) -> Vec<(usize, f64)> {
        (0..self.points.len())
            .filter(|i| (self.points[*i].load - step).abs() <= SAME * self.largest)
            .filter(|i| rising(self.points, *i) == up && wanted(self.points[*i].series))
            .map(|i| {
                let point = &self.points[i];
                (point.series, point.reading - self.zeros[point.series])
            })
            .collect()
    }

    /// The same with one value for each series: the mean if the load was applied repeatedly.
    fn by_series(&self, step: f64, up: bool, wanted: &dyn Fn(usize) -> bool) -> Vec<(usize, f64)> {
        let all = self.at(step, up, wanted);
        let of = |part: &[(usize, f64)]| {
            let values: Vec<f64> = part.iter().map(|p| p.1).collect();
            (part[0].0, mean(&values))
        };
        all.chunk_by(|a, b| a.0 == b.0).map(of).collect()
    }

    fn values(&self, step: f64, wanted: &dyn Fn(usize) -> bool) -> Vec<f64> {
        let each = self.by_series(step, true, wanted);
        each.into_iter().map(|(_, value)| value).collect()
    }

    /// Mean over the series of |unloading − loading| over loading.
    fn reversibility(&self, step: f64) -> Option<f64> {
        let up = self.by_series(step, true, &|_| true);
        let down = self.by_series(step, false, &|_| true);
        let pairs: Vec<f64> = up
            .iter()
            .filter_map(|(series, x)| {
                let back = down.iter().find(|(other, _)| other == series)?.1;
                Some(100.0 * (back - x).abs() / x.abs())
            })
            .collect();
        (!pairs.is_empty()).then(|| mean(&pairs))
    }
}

/// Largest values over all loads, in per cent; `curve` are coefficients over powers of the load.
pub(super) fn terms(points: &[Point], steps: &[f64], curve: &[f64], largest: f64) -> Vec<Term> {
    let around = zeros(points, largest);
    let deflections = Deflections {
        points,
        zeros: around.iter().map(|z| z.0.unwrap_or(curve[0])).collect(),
        largest,
    };
    let position = |series: usize| {
        let of = points.iter().find(|p| p.series == series);
        of.map_or(0, |p| p.position)
    };
    let first = position(points[0].series);
    // The first series of each mounting.
    let opens = |series: usize| (0..series).all(|s| position(s) != position(series));
    let loaded = || steps.iter().filter(|s| s.abs() > NONE * largest);
    let value = |load: f64| -> f64 {
        let powers = curve.iter().enumerate().skip(1);
        powers.map(|(k, c)| c * load.powi(k as i32)).sum()
    };
    let spread_of = |wanted: &dyn Fn(usize) -> bool| {
        worst(loaded().map(|s| spread(&deflections.values(*s, wanted))))
    };
    let interpolation = worst(loaded().map(|s| {
        let up = deflections.values(*s, &opens);
        (!up.is_empty()).then(|| 100.0 * (mean(&up) - value(*s)).abs() / value(*s).abs())
    }));
    let full = value(largest).abs();
    let zero_return = worst(around.iter().map(|(before, after)| match (before, after) {
        (Some(before), Some(after)) => Some(100.0 * (after - before).abs() / full),
        _ => None,
    }));
    let percents = [
        spread_of(&|s| position(s) == first),
        spread_of(&opens),
        worst(loaded().map(|s| deflections.reversibility(*s))),
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

/// Readings of the empty stand before and after each series.
fn zeros(points: &[Point], largest: f64) -> Vec<(Option<f64>, Option<f64>)> {
    let count = points.iter().map(|p| p.series).max().map_or(0, |m| m + 1);
    (0..count)
        .map(|series| {
            let of: Vec<&Point> = points.iter().filter(|p| p.series == series).collect();
            let empty = |p: &&&Point| p.load.abs() <= NONE * largest;
            let before = of.first().filter(empty).map(|p| p.reading);
            let after = (of.len() > 1)
                .then(|| of.last().filter(empty).map(|p| p.reading))
                .flatten();
            (before, after)
        })
        .collect()
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

/// Largest less smallest over the mean, in per cent.
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

/// The largest of the known values; one over a mean of zero is not known.
fn worst(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    values
        .flatten()
        .filter(|value| value.is_finite())
        .fold(None, |m: Option<f64>, v| Some(m.map_or(v, |m| m.max(v))))
}
