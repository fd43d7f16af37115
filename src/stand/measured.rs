//! Parsing of `[calibration]`: data of certificates and data sheets.

use nalgebra::DMatrix;
use torqcomp_decimal::digits;
use torqcomp_dsp::curve::CalibrationCurve;
use torqcomp_model::fit::linear;
use torqcomp_model::{Estimate, Kind, UnitSystem};

use super::section::Section;
use super::signal::TransducerSignal;
use super::static_law::together;
use crate::failure::Failure;

/// A measured calibration: torque over a signal.
#[derive(Debug, Clone)]
pub struct MeasuredCalibration {
    /// The calibrated signal.
    pub signal: TransducerSignal,
    /// The calibration law.
    pub law: CalibrationLaw,
    /// Signal at no load, in SI units, if given by the calibration itself.
    pub zero: Option<Estimate>,
    /// Relative standard uncertainty of the torque, if known; for a curve at its largest torque.
    pub relative_std: Option<f64>,
    /// Magnitude of the transducer's rated torque in N m, if given.
    pub rated_n_m: Option<f64>,
}

/// Conversion of a signal to torque.
#[derive(Debug, Clone)]
pub enum CalibrationLaw {
    /// Torque per signal, in SI units.
    Constant(Estimate),
    /// Torque over signal, both in SI units.
    Curve(CalibrationCurve),
}

impl MeasuredCalibration {
    /// The constant, if it is for volts.
    pub fn torque_per_volt(&self) -> Option<&Estimate> {
        self.constant_of(TransducerSignal::Voltage)
    }

    /// The constant, if it is for this signal.
    pub fn constant_of(&self, signal: TransducerSignal) -> Option<&Estimate> {
        match &self.law {
            CalibrationLaw::Constant(constant) if self.signal == signal => Some(constant),
            _ => None,
        }
    }

    /// Magnitude of the signal change from no load to rated torque in SI units, if both are known.
    pub fn change_at_rated(&self) -> Option<(TransducerSignal, f64)> {
        let CalibrationLaw::Constant(constant) = &self.law else {
            return None;
        };
        let change = self.rated_n_m? / constant.value().abs();
        Some((self.signal, change))
    }

    /// The calibration as text.
    pub fn described(&self, units: UnitSystem) -> String {
        match &self.law {
            CalibrationLaw::Constant(constant) => match self.signal {
                TransducerSignal::Voltage => {
                    format!("measured constant of {}", constant.text(units))
                }
                signal => {
                    let (unit, factor) = signal.slope_unit(units);
                    let scaled = |v: f64| v / factor;
                    let std = constant.std_uncertainty().map(scaled);
                    let printed = Estimate::of(unit, scaled(constant.value()), std);
                    format!("measured constant of {}", printed.text(units))
                }
            },
            CalibrationLaw::Curve(curve) => {
                let (low, high) = curve.range();
                let [low, high] = [low, high].map(|end| self.signal.text(end));
                format!("measured curve from {low} to {high}")
            }
        }
    }
}

/// Keys that each start another form.
const FORMS: [&str; 6] = [
    "torque_per_volt",
    "torque_per_ratio",
    "sensitivity",
    "frequency_at_rated",
    "points",
    "lever_arm",
];

/// Keys that take a torque and those under which a force may be given, with the kind, unit and size of the torque in SI
/// units.
const OF_TORQUE: [(&str, &str, Kind, &str, f64); 3] = [
    (
        "torque_per_volt",
        "force_per_volt",
        Kind::TorquePerVolt,
        "N m/V",
        1.0,
    ),
    (
        "torque_per_ratio",
        "force_per_ratio",
        Kind::TorquePerRatio,
        "N m/(mV/V)",
        1e3,
    ),
    ("rated_torque", "rated_force", Kind::Torque, "N m", 1.0),
];

/// Answers a force in place of a torque with the torque at the lever arm.
///
/// # Errors
/// If there is one.
fn refuse_forces(section: &Section) -> Result<(), Failure> {
    let arm = section.glance("lever_arm");
    for (key, of_force, kind, unit, size) in OF_TORQUE {
        let given = [of_force, key].into_iter().find(|key| section.has(key));
        let text = given.and_then(|given| section.glance(given));
        let parts = text.and_then(|text| text.trim().split_once(' '));
        // With a force, that is the torque per metre of the arm.
        let torque = parts.map(|(number, unit)| kind.parse(&format!("{number} m {unit}")));
        let (Some(given), Some(text), Some(Ok(torque))) = (given, text, torque) else {
            continue;
        };
        let arm_m = Kind::Length.parse(arm.unwrap_or("1 m"));
        let arm_m = arm_m.map_err(|error| section.fail("lever_arm", error))?;
        let torque = digits::text(torque * arm_m / size, 6);
        let is_alone = key == "rated_torque" && !section.has("sensitivity");
        let how = match arm {
            Some(arm) => format!("at the lever_arm of {arm} it is {key} = \"{torque} {unit}\""),
            None => {
                format!("multiply it by the lever arm; at 1 m it is {key} = \"{torque} {unit}\"")
            }
        };
        let omit = if arm.is_none() || is_alone {
            ""
        } else {
            "; omit lever_arm"
        };
        let message = format!("\"{text}\" has a force in place of a torque; {how}{omit}");
        return Err(section.fail(given, message));
    }
    Ok(())
}

/// Reads the section.
pub(super) fn calibration(section: &Section) -> Result<MeasuredCalibration, Failure> {
    refuse_forces(section)?;
    let given: Vec<&str> = FORMS.into_iter().filter(|key| section.has(key)).collect();
    if let [first, second, ..] = given[..] {
        return Err(section.fail(
            second,
            format_args!(
                "{first} and {second} both convert the record to torque; keep one of them"
            ),
        ));
    }
    let read = match given.first() {
        None if section.has("zero_frequency") => frequency(section)?,
        Some(&"torque_per_ratio") => {
            constant(section, "torque_per_ratio", TransducerSignal::Ratio)?
        }
        Some(&"lever_arm") => constant(section, "lever_arm", TransducerSignal::Force)?,
        Some(&"sensitivity") => sensitivity(section)?,
        Some(&"frequency_at_rated") => frequency(section)?,
        Some(&"points") => points(section)?,
        Some(_) => constant(section, "torque_per_volt", TransducerSignal::Voltage)?,
        None => {
            finish(section)?;
            return Err(section.fail("", HOW));
        }
    };
    finish(section)?;
    Ok(read)
}

/// Advice if the section contains none of the forms.
const HOW: &str = "write one of torque_per_volt = \"12.5 N m/V\"; torque_per_ratio = \"25 N m/(mV/V)\"; sensitivity = \
    \"2.0012 mV/V\" with rated_torque = \"50 N m\"; zero_frequency = \"60 kHz\", frequency_at_rated = \"90 kHz\" and \
    rated_torque = \"50 N m\"; lever_arm = \"0.5 m\"; points = [{ reading = \"1 mV/V\", torque = \"25 N m\" }, …]";

/// Rejects keys that the form does not accept; the message lists those of all forms.
fn finish(section: &Section) -> Result<(), Failure> {
    if section.finish().is_ok() {
        return Ok(());
    }
    let beside = ["rated_torque", AT_TORQUE, "zero_frequency", "degree"];
    let taken: Vec<&str> = FORMS
        .into_iter()
        .chain(beside)
        .filter(|key| section.has(key))
        .collect();
    for key in beside.into_iter().chain(FORMS) {
        let _ = section.raw(key);
    }
    section.finish()?;
    Err(section.fail(
        "",
        match taken[..] {
            [one] => format!("{one} alone does not convert a record; {HOW}"),
            _ => format!("{} cannot be combined; {HOW}", taken.join(" and ")),
        },
    ))
}

fn constant(
    section: &Section,
    key: &'static str,
    signal: TransducerSignal,
) -> Result<MeasuredCalibration, Failure> {
    let kind = match signal {
        TransducerSignal::Ratio => Kind::TorquePerRatio,
        TransducerSignal::Force => Kind::Length,
        _ => Kind::TorquePerVolt,
    };
    let constant = section.required(key, kind)?;
    if constant.value() == 0.0 {
        return Err(section.fail(key, "the constant must not be zero"));
    }
    Ok(MeasuredCalibration {
        signal,
        relative_std: constant.relative_std(),
        law: CalibrationLaw::Constant(constant),
        zero: None,
        rated_n_m: optional_rated(section)?,
    })
}

/// Optional `rated_torque` of a form that does not need it.
fn optional_rated(section: &Section) -> Result<Option<f64>, Failure> {
    let rated = section.quantity("rated_torque", Kind::Torque)?;
    match rated.map(|rated| rated.value().abs()) {
        Some(0.0) => Err(section.fail("rated_torque", "the rated torque must not be zero")),
        rated => Ok(rated),
    }
}

/// `sensitivity` at `rated_torque`, as in data sheets: change of the output from no load to the rated torque.
fn sensitivity(section: &Section) -> Result<MeasuredCalibration, Failure> {
    let read = TransducerSignal::read(section, "sensitivity")?;
    let (signal, change) =
        read.ok_or_else(|| section.fail("sensitivity", "expected a quantity"))?;
    per_change(section, signal, &change, "sensitivity", None)
}

/// `zero_frequency` and `frequency_at_rated`.
fn frequency(section: &Section) -> Result<MeasuredCalibration, Failure> {
    let zero = section.required("zero_frequency", Kind::Frequency)?;
    let rated = section.required("frequency_at_rated", Kind::Frequency)?;
    let change = Estimate::derive(Kind::Frequency, "stand file", &[&rated, &zero], |x| {
        x[0] - x[1]
    })
    .map_err(|error| section.fail("frequency_at_rated", error))?;
    let key = "frequency_at_rated";
    per_change(
        section,
        TransducerSignal::Frequency,
        &change,
        key,
        Some(zero),
    )
}

/// Key of a torque of `sensitivity` other than the rated one, as from known loads.
pub const AT_TORQUE: &str = "at_torque";

/// The constant that follows from the change of the signal at the rated torque, or at another one.
fn per_change(
    section: &Section,
    signal: TransducerSignal,
    change: &Estimate,
    key: &'static str,
    zero: Option<Estimate>,
) -> Result<MeasuredCalibration, Failure> {
    let (of, torque) = match section.quantity(AT_TORQUE, Kind::Torque)? {
        Some(torque) => (AT_TORQUE, torque),
        None => (
            "rated_torque",
            section.required("rated_torque", Kind::Torque)?,
        ),
    };
    for (key, value) in [(key, change.value()), (of, torque.value())] {
        if value == 0.0 {
            return Err(section.fail(
                key,
                "the output must change with torque, and the torque must not be zero",
            ));
        }
    }
    let relative_std = together(&[torque.relative_std(), change.relative_std()]);
    let value = torque.value() / change.value();
    let unit = Kind::TorquePerVolt;
    let law = match signal {
        TransducerSignal::Voltage => {
            Estimate::of(unit, value, relative_std.map(|r| r * value.abs()))
        }
        _ => Estimate::of("", value, relative_std.map(|r| r * value.abs())),
    };
    Ok(MeasuredCalibration {
        signal,
        law: CalibrationLaw::Constant(law.with_source("stand file")),
        zero,
        relative_std,
        rated_n_m: optional_rated(section)?,
    })
}

/// One point of a table.
struct CalibrationPoint {
    reading: f64,
    torque: Estimate,
}

/// `points`, interpolated linearly or fitted by a polynomial of `degree`.
fn points(section: &Section) -> Result<MeasuredCalibration, Failure> {
    let table = section.sections("points").map_err(|_| {
        section.fail(
            "points",
            "expected points = [{ reading = \"1 mV/V\", torque = \"25 N m\" }, …]",
        )
    })?;
    let mut signal = None;
    let mut points = Vec::new();
    for row in &table {
        let (of, point) = point(row)?;
        if signal.is_some_and(|signal| signal != of) {
            return Err(row.fail(
                "reading",
                "the readings have different kinds of unit; use one",
            ));
        }
        signal = Some(of);
        points.push(point);
    }
    let Some(signal) = signal else {
        return Err(section.fail("points", "the table has no points"));
    };
    let wrong = |error: &dyn std::fmt::Display| section.fail("points", error);
    let (curve, relative_std) = match section.whole("degree")? {
        None => {
            let pairs: Vec<_> = points
                .iter()
                .map(|p| (p.reading, p.torque.value()))
                .collect();
            let largest = points
                .iter()
                .max_by(|a, b| a.torque.value().abs().total_cmp(&b.torque.value().abs()));
            let std = largest.and_then(|point| point.torque.relative_std());
            (
                CalibrationCurve::through(&pairs).map_err(|error| wrong(&error))?,
                std,
            )
        }
        Some(degree @ 1..=3) => {
            polynomial(&points, degree as usize).map_err(|error| wrong(&error))?
        }
        Some(_) => return Err(section.fail("degree", "expected 1, 2 or 3")),
    };
    Ok(MeasuredCalibration {
        signal,
        law: CalibrationLaw::Curve(curve),
        zero: None,
        relative_std,
        rated_n_m: optional_rated(section)?,
    })
}

/// One point, and the signal of its reading.
fn point(row: &Section) -> Result<(TransducerSignal, CalibrationPoint), Failure> {
    let expected = "expected reading = \"1.0003 mV/V\", torque = \"25 N m\"";
    let read = TransducerSignal::read(row, "reading")?;
    let (signal, reading) = read.ok_or_else(|| row.fail("", expected))?;
    let torque = row.required("torque", Kind::Torque)?;
    let std = row.quantity("std", Kind::Torque)?.map(|std| std.value());
    row.finish()?;
    let std = std.or(torque.std_uncertainty());
    let torque = Estimate::new(Kind::Torque, torque.value(), std, "stand file")
        .map_err(|error| row.fail("std", error))?;
    let reading = reading.value();
    Ok((signal, CalibrationPoint { reading, torque }))
}

/// Least-squares polynomial through points, weighted if every point has a `std`, and the relative standard
/// uncertainty of its torque at the largest reading.
fn polynomial(
    points: &[CalibrationPoint],
    degree: usize,
) -> Result<(CalibrationCurve, Option<f64>), Box<dyn std::error::Error>> {
    let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.reading.abs()));
    let design = DMatrix::from_fn(points.len(), degree + 1, |row, power| {
        (points[row].reading / largest).powi(power as i32)
    });
    let torques: Vec<f64> = points.iter().map(|p| p.torque.value()).collect();
    let weights: Option<Vec<f64>> = points
        .iter()
        .map(|p| {
            p.torque
                .std_uncertainty()
                .filter(|std| *std > 0.0)
                .map(f64::recip)
        })
        .collect();
    let fit = linear::solve(&design, &torques, weights.as_deref(), weights.is_some())?;
    let scaled = (0i32..).zip(&fit.values).map(|(k, c)| c / largest.powi(k));
    let readings = points.iter().map(|p| p.reading);
    let low = readings.clone().fold(f64::INFINITY, f64::min);
    let high = readings.fold(f64::NEG_INFINITY, f64::max);
    let curve = CalibrationCurve::polynomial(scaled.collect(), low, high)?;
    let end = if high >= -low { high } else { low };
    let gradient: Vec<f64> = (0..=degree as i32)
        .map(|k| (end / largest).powi(k))
        .collect();
    let relative = |std: f64| Some(std / curve.applied(end).ok()?.abs());
    let relative_std = fit.covariance.std_of(&gradient).and_then(relative);
    Ok((curve, relative_std.filter(|std| std.is_finite())))
}
