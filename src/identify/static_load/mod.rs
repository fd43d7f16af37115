//! Sensitivity and zero from known loads (Appendix C, IV), with the terms of the standards.

mod terms;

use nalgebra::DMatrix;
use torqcomp_model::fit::linear::{self, LinearFit};

use super::{Found, Outcome, Quality, rms};
use crate::failure::Failure;
use crate::print::rounded;
use crate::report::chart::{Chart, Series};

/// One reading under a known load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Load in SI units.
    pub load: f64,
    /// Reading in SI units.
    pub reading: f64,
    /// Standard uncertainty of the reading, if it is known.
    pub std: Option<f64>,
    /// Number of the series it belongs to.
    pub series: usize,
    /// Mounting position of the series.
    pub position: usize,
}

/// How loads are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Highest power of the load: 1 or 3.
    pub degree: usize,
}

/// Units of the loads and readings, as text.
#[derive(Debug, Clone, PartialEq)]
pub struct Units {
    /// Of the load, such as `N m`.
    pub load: String,
    /// Of the reading, such as `V`.
    pub reading: String,
}

/// A term of a calibration standard; the formulas are those of `terms`.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Name, such as `repeatability`.
    pub name: &'static str,
    /// Whose formula it is, and the formula.
    pub formula: &'static str,
    /// Largest value over the loads in per cent; `None` where the record does not hold what it
    /// takes.
    pub percent: Option<f64>,
}

/// A calibration that was evaluated.
#[derive(Debug, Clone)]
pub struct Evaluated {
    /// The numbers.
    pub outcome: Outcome,
    /// The terms of the standards.
    pub terms: Vec<Term>,
    /// The points.
    pub points: Vec<Point>,
    /// Coefficients of the reading over powers of the load, from 0.
    pub coefficients: Vec<f64>,
}

/// Loads closer than this part of the largest are one step.
const SAME: f64 = 2e-3;
/// Loads below this part of the largest count as none.
const NONE: f64 = 1e-3;

/// Numbers the series of points: a new one begins with each return to no load, if the user does not
/// number them.
#[must_use]
pub fn series_of(loads: &[f64]) -> Vec<usize> {
    let largest = loads.iter().fold(0.0_f64, |m, l| m.max(l.abs()));
    let zero = |l: f64| l.abs() <= NONE * largest;
    let mut series = 0;
    let mut loaded = false;
    let mut numbers = Vec::with_capacity(loads.len());
    for (i, load) in loads.iter().enumerate() {
        // The zero after a series closes it; one more zero, or the next load, opens a new one.
        let closed = loaded && i > 0 && zero(loads[i - 1]);
        if closed {
            series += 1;
            loaded = false;
        }
        loaded |= !zero(*load);
        numbers.push(series);
    }
    numbers
}

/// Evaluates the points.
///
/// # Errors
/// If there are too few loads for the degree.
pub fn identify(points: &[Point], options: Options, units: &Units) -> Result<Evaluated, Failure> {
    let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.load.abs()));
    let steps = steps(points, largest);
    if steps.len() < options.degree + 2 {
        return Err(Failure::failed(format_args!(
            "{} different loads cannot determine a curve of degree {} and how far it is off; load at least \
             {} steps, the empty stand included",
            steps.len(),
            options.degree,
            options.degree + 2
        )));
    }
    if points.iter().all(|p| p.reading == points[0].reading) {
        return Err(Failure::failed(
            "the reading is the same under every load; check --reading and whether the bridge was supplied",
        ));
    }
    let design = DMatrix::from_fn(points.len(), options.degree + 1, |r, c| {
        (points[r].load / largest).powi(c as i32)
    });
    let readings: Vec<f64> = points.iter().map(|p| p.reading).collect();
    let weights: Option<Vec<f64>> = points.iter().map(|p| p.std.map(|s| 1.0 / s)).collect();
    let fit = linear::solve(&design, &readings, weights.as_deref(), weights.is_some())?;
    let mut evaluated = Evaluated {
        outcome: outcome(&fit, points, &weights, largest, units),
        terms: Vec::new(),
        points: points.to_vec(),
        coefficients: scaled(&fit, largest),
    };
    evaluated.terms = terms::terms(points, &steps, &evaluated.coefficients, largest);
    draw(&mut evaluated, units);
    poor(&mut evaluated.outcome);
    say(&mut evaluated.outcome, points, options);
    Ok(evaluated)
}

/// Coefficients over the load itself.
fn scaled(fit: &LinearFit, largest: f64) -> Vec<f64> {
    let unscale = |(k, v): (usize, &f64)| v / largest.powi(k as i32);
    fit.values.iter().enumerate().map(unscale).collect()
}

fn outcome(
    fit: &LinearFit,
    points: &[Point],
    weights: &Option<Vec<f64>>,
    largest: f64,
    units: &Units,
) -> Outcome {
    let mut outcome = Outcome {
        found: constants(fit, largest, units),
        ..Outcome::default()
    };
    let left: Vec<f64> = match weights {
        Some(weights) => fit
            .residuals
            .iter()
            .zip(weights)
            .map(|(r, w)| r / w)
            .collect(),
        None => fit.residuals.clone(),
    };
    let swing: Vec<f64> = points.iter().map(|p| p.reading - fit.values[0]).collect();
    outcome.quality = Some(Quality {
        rms: rms(&left),
        unit: units.reading.clone(),
        relative: rms(&left) / rms(&swing),
    });
    outcome.method.push(format!(
        "{} regression of the reading on the load over {} points, loading and unloading together",
        if weights.is_some() {
            "weighted"
        } else {
            "plain"
        },
        points.len()
    ));
    outcome
}

/// Sensitivity, its inverse, zero, and the higher powers of the curve.
fn constants(fit: &LinearFit, largest: f64, units: &Units) -> Vec<Found> {
    let (load, reading) = (&units.load, &units.reading);
    let slope = fit.values[1] / largest;
    let slope_std = fit.std[1].map(|s| s / largest);
    // K = 1/S: u(K)/K = u(S)/S.
    let constant_std = slope_std.map(|s| s / (slope * slope));
    let per = |a: &str, b: &str| match b.contains(' ') {
        true => format!("{a}/({b})"),
        false => format!("{a}/{b}"),
    };
    let mut found = vec![
        Found::new(
            constant_name(units),
            1.0 / slope,
            constant_std,
            per(load, reading),
        ),
        Found::new("sensitivity", slope, slope_std, per(reading, load)),
        Found::new("zero", fit.values[0], fit.std[0], reading),
    ];
    for (k, name) in [(2, "quadratic"), (3, "cubic")] {
        if let Some(value) = fit.values.get(k) {
            let size = largest.powi(k as i32);
            let unit = format!("{reading}/({load})^{k}");
            found.push(Found::new(
                name,
                value / size,
                fit.std[k].map(|s| s / size),
                unit,
            ));
        }
    }
    found
}

/// Readings with the curve through them, and how far they are off.
fn draw(evaluated: &mut Evaluated, units: &Units) {
    let mut points = evaluated.points.clone();
    points.sort_by(|a, b| a.load.total_cmp(&b.load));
    let loads: Vec<f64> = points.iter().map(|p| p.load).collect();
    let readings: Vec<f64> = points.iter().map(|p| p.reading).collect();
    let value = |load: &f64| -> f64 {
        let power = |(k, c): (usize, &f64)| c * load.powi(k as i32);
        evaluated.coefficients.iter().enumerate().map(power).sum()
    };
    let curve: Vec<f64> = loads.iter().map(value).collect();
    let left: Vec<f64> = readings.iter().zip(&curve).map(|(r, c)| r - c).collect();
    let x = format!("load, {}", units.load);
    let y = format!("reading, {}", units.reading);
    let both = vec![
        Series::dots("readings", &loads, &readings),
        Series::line("fit", &loads, &curve),
    ];
    let rest = vec![Series::dots("reading less fit", &loads, &left)];
    let charts = [
        Chart::new("Readings and fit", &x, &y, both),
        Chart::new("Residual", &x, &y, rest),
    ];
    evaluated.outcome.charts.extend(charts);
}

fn constant_name(units: &Units) -> &'static str {
    match (units.load.as_str(), units.reading.as_str()) {
        ("N m", "V") => "torque_per_volt",
        _ => "load_per_reading",
    }
}

/// The different loads, without the empty stand, rising in size.
fn steps(points: &[Point], largest: f64) -> Vec<f64> {
    let mut loads: Vec<f64> = points.iter().map(|p| p.load).collect();
    loads.sort_by(f64::total_cmp);
    loads.dedup_by(|a, b| (*a - *b).abs() <= SAME * largest);
    loads
}

/// Part of the readings' swing that a calibration may leave.
const POOR: f64 = 0.05;

fn poor(outcome: &mut Outcome) {
    let relative = outcome.quality.as_ref().map_or(0.0, |q| q.relative);
    if relative > POOR {
        outcome.warn(
            "poor-fit",
            format!(
                "the curve leaves {} % of the readings' swing: check that the columns are the right ones and the rows \
                 in the order they were taken, or use --degree 3",
                rounded(100.0 * relative, 2)
            ),
        );
    }
}

fn say(outcome: &mut Outcome, points: &[Point], options: Options) {
    let series = points.iter().map(|p| p.series).max().map_or(0, |m| m + 1);
    if series < 2 {
        outcome.warn(
            "one-series",
            "the loads were applied once: how far the readings repeat is not known",
        );
    }
    if (0..points.len()).all(|i| terms::rising(points, i)) {
        outcome.warn(
            "no-unloading",
            "there are no readings while unloading: hysteresis is not known",
        );
    }
    if options.degree > 1 {
        outcome.warn(
            "curve",
            "the constants are the slope of the curve at no load; at large loads the curve is to be used",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(rows: &[(f64, f64)], position: &[usize]) -> Vec<Point> {
        let loads: Vec<f64> = rows.iter().map(|r| r.0).collect();
        let series = series_of(&loads);
        rows.iter()
            .zip(series)
            .map(|((load, reading), series)| Point {
                load: *load,
                reading: *reading,
                std: None,
                series,
                position: position.get(series).copied().unwrap_or(0),
            })
            .collect()
    }

    /// Two series, worked by hand: 10 N m give 1.00 and 1.02 V going up, 1.04 V coming down.
    const ROWS: [(f64, f64); 10] = [
        (0.0, 0.00),
        (5.0, 0.50),
        (10.0, 1.00),
        (5.0, 0.52),
        (0.0, 0.01),
        (0.0, 0.00),
        (5.0, 0.50),
        (10.0, 1.02),
        (5.0, 0.52),
        (0.0, 0.00),
    ];

    #[test]
    fn series_end_where_the_load_is_gone() {
        let loads: Vec<f64> = ROWS.iter().map(|r| r.0).collect();
        assert_eq!(series_of(&loads), [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
        assert_eq!(series_of(&[0.0, 1.0, 0.0, 1.0, 0.0]), [0, 0, 0, 1, 1]);
    }

    #[test]
    fn terms_are_those_worked_by_hand() {
        let units = Units {
            load: "N m".to_owned(),
            reading: "V".to_owned(),
        };
        let found = identify(&points(&ROWS, &[]), Options { degree: 1 }, &units).unwrap();
        let percent = |name: &str| found.terms.iter().find(|t| t.name == name).unwrap().percent;
        // At 10 N m: (1.02 − 1.00)/1.01; at 5 N m: 0.
        assert!((percent("repeatability").unwrap() - 100.0 * 0.02 / 1.01).abs() < 1e-9);
        // At 5 N m: (0.52 − 0.50)/0.50 = 4 %.
        assert!((percent("hysteresis").unwrap() - 4.0).abs() < 1e-9);
        assert_eq!(percent("reproducibility"), None);
        assert_eq!(percent("creep"), None);
        // 0.01 V over 10 N m times the slope.
        let slope = found.outcome.get("sensitivity").unwrap().value;
        assert!((percent("zero return").unwrap() - 1.0 / (10.0 * slope)).abs() < 1e-9);
        assert_eq!(found.outcome.found[0].name, "torque_per_volt");
        assert!((found.outcome.found[0].value * slope - 1.0).abs() < 1e-12);
    }

    #[test]
    fn mountings_tell_reproducibility() {
        let units = Units {
            load: "N m".to_owned(),
            reading: "V".to_owned(),
        };
        let found = identify(&points(&ROWS, &[0, 1]), Options { degree: 1 }, &units).unwrap();
        let percent = |name: &str| found.terms.iter().find(|t| t.name == name).unwrap().percent;
        assert!((percent("reproducibility").unwrap() - 100.0 * 0.02 / 1.01).abs() < 1e-9);
        assert_eq!(percent("repeatability"), None);
    }

    #[test]
    fn a_cubic_is_found_and_too_few_loads_are_refused() {
        let units = Units {
            load: "N".to_owned(),
            reading: "V".to_owned(),
        };
        let curve = |f: f64| 0.1 + 2.0 * f + 0.03 * f * f - 0.004 * f * f * f;
        let rows: Vec<(f64, f64)> = (0..7)
            .map(|i| (f64::from(i), curve(f64::from(i))))
            .collect();
        let found = identify(&points(&rows, &[]), Options { degree: 3 }, &units).unwrap();
        for (got, want) in found.coefficients.iter().zip([0.1, 2.0, 0.03, -0.004]) {
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
        assert!(identify(&points(&rows[..3], &[]), Options { degree: 3 }, &units).is_err());
    }
}
