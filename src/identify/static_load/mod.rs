//! Sensitivity and zero from known loads (Appendix C, IV), with the terms of the standards.

mod filter;
mod groups;
mod linear;
mod mixed;
mod outlier;
mod plateaus;
mod ramp;
mod repeated;
mod rows;
mod series_slopes;
mod settling;
mod solve;
mod steady;
mod steps;
mod terms;
mod zero;

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::sort_by_number;

use super::{FitQuality, Identification, NamedEstimate, rms};
use crate::chart::{Chart, Series};
use crate::failure::{ErrorCode, Failure};
use crate::print::{plural, rounded};
use crate::warning::WarningCode;
use mixed::LoadCurve;
use plateaus::{PlateauLoads, PlateauReadings};
use ramp::RampReadings;
use settling::SettledReadings;
use steady::SteadyReadings;
use steps::LoadSteps;

/// One reading under a known load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Load in SI units.
    pub load: f64,
    /// Reading in SI units.
    pub reading: f64,
    /// Standard uncertainty of the reading, if known.
    pub std: Option<f64>,
    /// Number of its series.
    pub series: usize,
    /// Mounting position of the series.
    pub position: usize,
}

/// Units of loads and readings, as text.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadUnits {
    /// Of the load, such as `N m`.
    pub load: String,
    /// Of the reading, such as `V`.
    pub reading: String,
}

/// The readings at one load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationStep {
    /// The load.
    pub load: f64,
    /// Mean reading.
    pub reading: f64,
    /// Standard uncertainty of the load from the scatter of the readings.
    pub load_std: f64,
}

/// A term of a calibration standard; the formulas are those of `terms`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Term {
    /// Name, such as `repeatability`.
    pub name: &'static str,
    /// The formula, and the standards that define it.
    pub formula: &'static str,
    /// Largest value over the loads in per cent; `null` if the record lacks the readings for it.
    pub percent: Option<f64>,
}

/// Relative difference of loads, in terms of the largest, up to which they count as one step.
const SAME: f64 = 2e-3;
/// Load that counts as zero, relative to the largest.
const NONE: f64 = 1e-3;

/// Series number of each point, for tables without them: a series ends with the return to no load.
pub fn series_of(loads: &[f64]) -> Vec<usize> {
    let plateaus = PlateauLoads::of(loads);
    let loads = plateaus.as_ref().map_or(loads, |p| &p.loads);
    let largest = loads.iter().fold(0.0_f64, |m, l| m.max(l.abs()));
    let zero = |l: f64| l.abs() <= NONE * largest;
    let mut series = 0;
    let mut loaded = false;
    let mut numbers = Vec::with_capacity(loads.len());
    for (i, load) in loads.iter().enumerate() {
        // The zero after a series closes it; another zero, or the next load, opens a new one.
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

/// Standard uncertainty of the mean of readings, if theirs are known.
fn std_of_mean(points: &[Point]) -> Option<f64> {
    let variances = points.iter().map(|p| p.std.map(|std| std * std));
    let sum: Option<f64> = variances.sum();
    sum.map(|sum| sum.sqrt() / points.len() as f64)
}

/// Minimum number of rows for a single load and no load.
const ONE_WEIGHT: usize = 5;

/// Whether there is one load beside no load, which suffices for a straight line.
///
/// # Errors
/// If there are too few loads for the degree, or the reading does not change.
fn one_weight(points: &[Point], degree: usize, steps: &LoadSteps) -> Result<bool, Failure> {
    let count = steps.loads.len();
    let is_one_weight = degree == 1 && count == 2 && points.len() >= ONE_WEIGHT;
    if count < degree + 2 && !is_one_weight {
        let or = match degree {
            1 => format!(", or one load on and off ({ONE_WEIGHT} rows or more)"),
            _ => String::new(),
        };
        return Err(ErrorCode::TooFewSamples.failed(format_args!(
            "{} in {} are too few for a curve of degree {degree} and its error; apply at least {}, including no \
             load{or}",
            plural(count, "different load"),
            plural(points.len(), "row"),
            degree + 2
        )));
    }
    if points.iter().all(|p| p.reading == points[0].reading) {
        return Err(ErrorCode::NotIdentifiable.failed(
            "the reading does not change with load; check --reading and the bridge supply",
        ));
    }
    Ok(is_one_weight)
}

/// The readings that settle after each change of the load, or else those that are steady in a part of its rows.
fn unsettled(points: &[Point]) -> (Option<SettledReadings>, Option<SteadyReadings>) {
    let Some(runs) = settling::logged(points) else {
        return (None, None);
    };
    let steady = SteadyReadings::of(&runs);
    let is_at_once = steady.as_ref().is_some_and(SteadyReadings::is_at_once);
    let settled = settling::settled(&runs).filter(|_| !is_at_once);
    let steady = steady.filter(|_| settled.is_none());
    (settled, steady)
}

/// Evaluates the points with a curve of degree 1 or 3.
///
/// # Errors
/// If there are too few loads for the degree, or the reading does not change.
pub fn identify(
    points: &[Point],
    degree: usize,
    units: &LoadUnits,
) -> Result<Identification, Failure> {
    let (rows, plateaus) = (points.len(), PlateauReadings::of(points));
    let points = plateaus.as_ref().map_or(points, |p| &p.rows);
    let steps = LoadSteps::of(points);
    let is_one_weight = one_weight(points, degree, &steps)?;
    let (settled, steady) = unsettled(points);
    let means = plateaus.as_ref().map_or(points, |p| &p.means);
    let means = steady.as_ref().map_or(means, |s| &s.points);
    let points = settled.as_ref().map_or(means, |s| &s.points);
    let ramp = ramp::ranges(points);
    let points = ramp.as_ref().map_or(points, |r| &r.points);
    let steps = LoadSteps {
        is_ramp: ramp.is_some(),
        load_std: plateaus.as_ref().map_or(0.0, PlateauReadings::load_std),
        ..LoadSteps::of(points)
    };
    let largest = steps.largest;
    groups::refuse_mixed(points)?;
    linear::refuse_two_ranges(points, &steps)?;
    series_slopes::refuse(points, largest, units)?;
    let mut fit = mixed::fit(points, degree, &steps)?;
    let shared = settled.as_ref().map(|s| s.widen(&mut fit.std, largest));
    if let Some(ramp) = &ramp {
        ramp.widen(&mut fit.std, largest);
    }
    zero::limit_std(&mut fit, points, largest);
    let of_rows = (degree, points.len() == rows);
    follows(points, &fit, largest, (of_rows, units))?;
    let unscale = |(k, v): (usize, &f64)| v / largest.powi(k as i32);
    let curve: Vec<f64> = fit.values.iter().enumerate().map(unscale).collect();
    let mut result = Identification::new("static");
    if let Some((settled, shared)) = settled.as_ref().zip(shared) {
        settled.warn(&mut result, (shared / fit.values[1]).abs());
    }
    steady.iter().for_each(|steady| steady.warn(&mut result));
    if steps.is_sorted {
        rows::warn_sorted(&mut result);
    }
    result.parameters = constants(&fit, largest, units);
    let quality = quality(&curve, points, units);
    outlier::warn(&mut result, points, (of_rows, quality.relative), units);
    linear::warn(&mut result, points, &curve, &steps);
    contradicted(&mut result, &fit);
    zero::drifting(&mut result, &fit, points, (largest, &units.reading));
    result.fit = Some(quality);
    let of_plateaus = plateaus.as_ref().map(|p| p.method(&units.load));
    let of_ramp = ramp.as_ref().map(RampReadings::method);
    result.method.extend(of_plateaus.into_iter().chain(of_ramp));
    method(&mut result, &fit, points, &units.reading);
    result.terms = terms::terms(points, &steps, &curve);
    result.steps = calibration_points(points, &steps, &fit);
    draw(&mut result, points, &curve, units);
    warnings(&mut result, points, (degree, is_one_weight, &steps));
    Ok(result)
}

/// Limits of the ratio of the readings' scatter to their given uncertainty beyond which that is
/// doubtful.
const CONTRADICTED: (f64, f64) = (0.1, 3.0);

/// Warns about uncertainties of readings contradicted by their scatter.
fn contradicted(result: &mut Identification, fit: &LoadCurve) {
    let doubtful = |ratio: &f64| *ratio < CONTRADICTED.0 || *ratio > CONTRADICTED.1;
    if let Some(ratio) = fit.scatter_over_known.filter(doubtful) {
        result.warn(WarningCode::StdContradicted.warning(format!(
            "the readings scatter by {} times the standard uncertainties of --std: check their unit, which is that \
             of the readings unless the heading names another, or omit --std",
            rounded(ratio, 2)
        )));
    }
}

/// Minimum distance of the sensitivity from zero, in standard uncertainties.
const FOLLOWS: f64 = 3.0;

/// Rejects readings that do not follow the loads.
fn follows(
    points: &[Point],
    fit: &LoadCurve,
    largest: f64,
    (of_rows, units): ((usize, bool), &LoadUnits),
) -> Result<(), Failure> {
    let (slope, std) = (fit.values[1].abs(), fit.std[1].unwrap_or(0.0));
    // Rounding of the readings in memory.
    let size = points.iter().fold(0.0_f64, |m, p| m.max(p.reading.abs()));
    if slope > FOLLOWS * std && slope > 1e-12 * size {
        return Ok(());
    }
    if let Some(off) = outlier::off_line(points, of_rows, units) {
        return Err(ErrorCode::NotIdentifiable.failed(off));
    }
    let empty: Vec<&Point> = zero::without_load(points, largest).collect();
    let zero = empty.iter().map(|p| p.reading).sum::<f64>() / empty.len().max(1) as f64;
    let unsigned = |p: &Point| (p.load.abs(), (p.reading - zero).abs());
    let why = match correlation(&points.iter().map(unsigned).collect::<Vec<_>>()) > ALIKE {
        true => {
            "their magnitudes do agree: give the loads, or the readings, of one direction a minus sign"
        }
        false => {
            "check that the columns are the right ones and the rows in the order in which they were taken"
        }
    };
    Err(ErrorCode::NotIdentifiable.failed(format_args!(
        "the reading does not follow the load: the sensitivity differs from zero by less than {FOLLOWS} standard \
         uncertainties; {why}"
    )))
}

/// Correlation of the magnitudes of loads and readings above which wrong signs are suspected.
const ALIKE: f64 = 0.9;

/// Correlation coefficient of pairs.
fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
    let (x, y) = (sum(&|p| p.0) / count, sum(&|p| p.1) / count);
    let products = sum(&|p| (p.0 - x) * (p.1 - y));
    products / (sum(&|p| (p.0 - x).powi(2)) * sum(&|p| (p.1 - y).powi(2))).sqrt()
}

/// Mean reading at each load, and the standard uncertainty of the load from the readings' scatter.
fn calibration_points(
    points: &[Point],
    steps: &LoadSteps,
    fit: &LoadCurve,
) -> Vec<CalibrationStep> {
    let largest = steps.largest;
    let count = fit.degrees_of_freedom.max(1) as f64;
    let square = |p: &Point| {
        let powers = (0i32..).zip(&fit.values);
        let curve: f64 = powers.map(|(k, c)| c * (p.load / largest).powi(k)).sum();
        (p.reading - curve) * (p.reading - curve)
    };
    let scatter = (points.iter().map(square).sum::<f64>() / count).sqrt();
    let slope = (fit.values[1] / largest).abs();
    let step = |(load, rows): (f64, &[usize])| {
        let readings: Vec<f64> = rows.iter().map(|i| points[*i].reading).collect();
        let number = readings.len() as f64;
        CalibrationStep {
            load,
            reading: readings.iter().sum::<f64>() / number,
            load_std: scatter / (slope * number.sqrt()),
        }
    };
    steps.iter().map(step).collect()
}

/// The unweighted residual, relative to the range of the readings.
fn quality(curve: &[f64], points: &[Point], units: &LoadUnits) -> FitQuality {
    let left = points.iter().map(|p| p.reading - value_of(curve, p.load));
    let left: Vec<f64> = left.collect();
    let swing: Vec<f64> = points.iter().map(|p| p.reading - curve[0]).collect();
    FitQuality {
        rms: rms(&left),
        unit: units.reading.clone(),
        relative: rms(&left) / rms(&swing),
    }
}

/// Reading at a load, from the polynomial coefficients.
fn value_of(curve: &[f64], load: f64) -> f64 {
    let power = |(k, c): (usize, &f64)| c * load.powi(k as i32);
    curve.iter().enumerate().map(power).sum()
}

/// Describes the fit, and what the uncertainties allow for.
fn method(result: &mut Identification, fit: &LoadCurve, points: &[Point], unit: &str) {
    let is_weighted = points.iter().all(|p| p.std.is_some());
    result.method.push(format!(
        "{} regression of the reading on the load over {} points, loading and unloading together{}{}",
        if is_weighted { "weighted" } else { "unweighted" },
        points.len(),
        if fit.has_even_drift { ", with a linear drift of the zero" } else { "" },
        if fit.has_hysteresis { ", with hysteresis at each load" } else { "" }
    ));
    let spreads = &fit.spreads;
    let allowed = [
        (
            spreads.drift,
            "a drift of the zero by",
            " from reading to reading",
        ),
        (spreads.zero, "a spread of the zero over the series of", ""),
        (
            spreads.sensitivity,
            "a spread over the mountings, or the series at a single one, of",
            " at the largest load",
        ),
    ];
    if fit.resolution > 0.0 {
        result.method.push(format!(
            "uncertainties come from rounding: all readings are multiples of {} {unit}, taken as their last digit",
            rounded(fit.resolution, 1)
        ));
    }
    for (spread, what, when) in allowed.iter().filter(|a| a.0 > 0.0) {
        let size = rounded(*spread, 2);
        result.method.push(format!(
            "uncertainties allow for {what} {size} {unit}{when} (standard deviation)"
        ));
    }
}

/// Sensitivity, its inverse, zero, and the higher powers of the curve.
fn constants(fit: &LoadCurve, largest: f64, units: &LoadUnits) -> Vec<NamedEstimate> {
    let (load, reading) = (&units.load, &units.reading);
    let slope = fit.values[1] / largest;
    let slope_std = fit.std[1].map(|s| s / largest);
    // K = 1/S: u(K)/K = u(S)/S.
    let constant_std = slope_std.map(|s| s / (slope * slope));
    let per = |a: &str, b: &str| match b.contains([' ', '/']) {
        true => format!("{a}/({b})"),
        false => format!("{a}/{b}"),
    };
    let inverse = match (load.as_str(), reading.as_str()) {
        ("N m", "V") => "torque_per_volt",
        ("N m", "mV/V") => "torque_per_ratio",
        _ => "load_per_reading",
    };
    let mut found = vec![
        NamedEstimate::new(inverse, per(load, reading), 1.0 / slope, constant_std),
        NamedEstimate::new("sensitivity", per(reading, load), slope, slope_std),
        NamedEstimate::new("zero", reading.clone(), fit.values[0], fit.std[0]),
    ];
    if load == "N" {
        // What compensate takes for a force.
        let unit = match reading.contains([' ', '/']) {
            true => format!("({reading})/{load}"),
            false => per(reading, load),
        };
        found.push(NamedEstimate::new("static_gain", unit, slope, slope_std));
    }
    for (k, name) in [(2, "quadratic"), (3, "cubic")] {
        if let Some(value) = fit.values.get(k) {
            let size = largest.powi(k as i32);
            let unit = format!("{reading}/({load})^{k}");
            let std = fit.std[k].map(|s| s / size);
            found.push(NamedEstimate::new(name, unit, value / size, std));
        }
    }
    found
}

/// Readings with the fitted curve, and the residual.
fn draw(result: &mut Identification, points: &[Point], curve: &[f64], units: &LoadUnits) {
    let mut points = points.to_vec();
    sort_by_number(&mut points, |point| point.load);
    let loads: Vec<f64> = points.iter().map(|p| p.load).collect();
    let readings: Vec<f64> = points.iter().map(|p| p.reading).collect();
    let fitted: Vec<f64> = loads.iter().map(|load| value_of(curve, *load)).collect();
    let left: Vec<f64> = readings.iter().zip(&fitted).map(|(r, c)| r - c).collect();
    let x = format!("load, {}", units.load);
    let y = format!("reading, {}", units.reading);
    let both = vec![
        Series::dots("readings", &loads, &readings),
        Series::line("fit", &loads, &fitted),
    ];
    let rest = vec![Series::dots("reading − fit", &loads, &left)];
    result.charts.extend([
        Chart::new("Readings and fit", &x, &y, both),
        Chart::new("Residual", &x, &y, rest),
    ]);
}

/// Warns about unidentifiable terms, and the validity of the constants.
fn warnings(
    result: &mut Identification,
    points: &[Point],
    (degree, is_one_weight, steps): (usize, bool, &LoadSteps),
) {
    if points.iter().all(|p| p.series == 0) {
        let has_empty = points.iter().any(|p| p.load.abs() <= NONE * steps.largest);
        result.warn(WarningCode::OneSeries.warning(match has_empty {
            true => "the loads were applied only once: repeatability is unknown",
            false => {
                "no row without load separates the series of loads: repeatability is unknown; add the readings \
                 without load, or a column that numbers the series (--series)"
            }
        }));
    }
    if steps.is_rising.iter().all(|is_rising| *is_rising) {
        result.warn(
            WarningCode::NoUnloading
                .warning("no readings were taken during unloading: hysteresis is unknown"),
        );
    }
    if degree > 1 {
        result.warn(WarningCode::Curve.warning(
            "the constants are the slope of the curve at no load; for large loads use the curve",
        ));
    }
    if is_one_weight {
        result.warn(WarningCode::OneWeight.warning(
            "a single load besides zero does not reveal a nonlinear characteristic; apply further loads, or stay near \
             this one",
        ));
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

    /// Two series with known results: 10 N m give 1.00 and 1.02 V going up, 1.04 V coming down.
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
        let units = LoadUnits {
            load: "N m".to_owned(),
            reading: "V".to_owned(),
        };
        let found = identify(&points(&ROWS, &[]), 1, &units).unwrap();
        let percent = |name: &str| found.terms.iter().find(|t| t.name == name).unwrap().percent;
        // At 10 N m: (1.02 − 1.00)/1.01; at 5 N m: 0.
        assert!((percent("repeatability").unwrap() - 100.0 * 0.02 / 1.01).abs() < 1e-9);
        // At 5 N m: (0.52 − 0.50)/0.50 = 4 %.
        assert!((percent("hysteresis").unwrap() - 4.0).abs() < 1e-9);
        assert_eq!(percent("reproducibility"), None);
        assert_eq!(percent("creep"), None);
        // 0.01 V over 10 N m times the slope.
        let slope = found.get("sensitivity").unwrap().value();
        assert!((percent("zero return").unwrap() - 1.0 / (10.0 * slope)).abs() < 1e-9);
        assert_eq!(found.parameters[0].name, "torque_per_volt");
        assert!((found.parameters[0].value() * slope - 1.0).abs() < 1e-12);
    }

    #[test]
    fn mountings_tell_reproducibility() {
        let units = LoadUnits {
            load: "N m".to_owned(),
            reading: "V".to_owned(),
        };
        let found = identify(&points(&ROWS, &[0, 1]), 1, &units).unwrap();
        let percent = |name: &str| found.terms.iter().find(|t| t.name == name).unwrap().percent;
        assert!((percent("reproducibility").unwrap() - 100.0 * 0.02 / 1.01).abs() < 1e-9);
        assert_eq!(percent("repeatability"), None);
    }

    #[test]
    fn a_cubic_is_found_and_too_few_loads_are_refused() {
        let units = LoadUnits {
            load: "N".to_owned(),
            reading: "V".to_owned(),
        };
        let curve = |f: f64| 0.1 + 2.0 * f + 0.03 * f * f - 0.004 * f * f * f;
        let rows: Vec<(f64, f64)> = (0..7)
            .map(|i| (f64::from(i), curve(f64::from(i))))
            .collect();
        let found = identify(&points(&rows, &[]), 3, &units).unwrap();
        for (name, want) in [
            ("zero", 0.1),
            ("sensitivity", 2.0),
            ("quadratic", 0.03),
            ("cubic", -0.004),
        ] {
            let got = found.get(name).unwrap().value();
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
        assert!(identify(&points(&rows[..3], &[]), 3, &units).is_err());
    }

    #[test]
    fn one_load_on_and_off_gives_the_slope_of_the_means() {
        let units = LoadUnits {
            load: "N m".to_owned(),
            reading: "V".to_owned(),
        };
        let rows = [
            (0.0, 0.11),
            (4.0, 2.08),
            (0.0, 0.09),
            (4.0, 2.12),
            (0.0, 0.10),
        ];
        let found = identify(&points(&rows, &[]), 1, &units).unwrap();
        // Means of 0.10 V and 2.10 V.
        assert!((found.get("torque_per_volt").unwrap().value() - 2.0).abs() < 1e-3);
        assert!(
            found
                .get("torque_per_volt")
                .unwrap()
                .std()
                .is_some_and(|std| std > 0.005)
        );
        assert!(found.warnings.iter().any(|w| w.code == "one-weight"));
        let refused = identify(&points(&rows[..4], &[]), 1, &units).unwrap_err();
        assert!(
            refused.to_string().contains("on and off (5 rows or more)"),
            "{refused}"
        );
    }
}
