//! `identify static`.

use std::collections::HashMap;

use torqcomp_decimal::digits;
use torqcomp_model::{Dimension, Estimate, Kind, RatioOf, Unit};

use super::{Recorded, deliver, entry, quantity, radius, replaced, unit_or};
use crate::cli::identify::Static;
use crate::commands::Outcome;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;
use crate::identify::Identification;
use crate::identify::static_load::{CalibrationStep, LoadUnits, Point, identify, series_of};
use crate::io::{ChannelChoice, Flags, Input};
use crate::recording::{Recording, unit_of};
use crate::stand::update::Entry;
use crate::stand::{AT_TORQUE, TransducerSignal};
use crate::unit::{NamedUnit, RecordedChannel};
use crate::warning::Warning;

/// Range of gravity on the Earth's surface, including mountains, in m/s².
const ON_EARTH: std::ops::RangeInclusive<f64> = 9.76..=9.84;

/// Runs the test.
pub fn run(args: &Static) -> Result<Outcome, Failure> {
    if args.table.resample {
        return Err(ErrorCode::ConflictingArguments
            .usage("--resample does not apply: a table of loads has no time axis"));
    }
    let columns = LoadColumns::of(args);
    let [set, read] = columns.set_and_read();
    let input = Input::of(&args.input);
    let recording = Recording::of_loads(&input, [&set, &read], &args.table)?;
    let mut recorded = Recorded::default();
    let (points, units) = points(args, &columns, &recording, &mut recorded.warnings)?;
    let result = identify(&points, args.degree, &units)?;
    let entries = entries(args, &result, &units);
    if entries.is_empty() && args.findings.result.output.is_some() {
        return Err(ErrorCode::UnitUnsuitable.failed(
            "a stand file takes a calibration of torque, or the static_gain of a force without --degree; give the load as \
             a torque, or as a force or mass (with --radius for a torque), and the reading in V, mV/V, mA, Hz, ustrain \
             or N; or omit -o",
        ));
    }
    if units.load == "N m" {
        recorded
            .warnings
            .extend(replaced::warnings(&result, &args.findings)?);
    }
    recorded.add(&args.input, points.len(), None);
    recorded.warn(recording.all_warnings(), recording.lost.is_some());
    deliver(result, recorded, &args.findings, &entries)
}

/// The columns read.
struct LoadColumns {
    load: ChannelChoice,
    reading: ChannelChoice,
    series: Option<ChannelChoice>,
    position: Option<ChannelChoice>,
    std: Option<ChannelChoice>,
}

impl LoadColumns {
    fn of(args: &Static) -> Self {
        let plain = |channel: &'static str, name: &Option<String>| {
            let flags = Flags {
                channel,
                unit: None,
            };
            let name = name.as_deref()?;
            Some(ChannelChoice::of(flags, Some(name), None))
        };
        let (load_unit, unit) = (args.load_unit.as_deref(), args.reading_unit.as_deref());
        Self {
            load: ChannelChoice::named(["--load", "--load-unit"], &args.load, load_unit),
            reading: ChannelChoice::named(["--reading", "--reading-unit"], &args.reading, unit),
            series: plain("--series", &args.series),
            position: plain("--position", &args.position),
            std: plain("--std", &args.std),
        }
    }

    /// What is set for each step, and what is read in each row.
    fn set_and_read(&self) -> [Vec<ChannelChoice>; 2] {
        let all = |first: &ChannelChoice, further: &[&Option<ChannelChoice>]| {
            let further = further.iter().copied().flatten();
            std::iter::once(first).chain(further).cloned().collect()
        };
        [
            all(&self.load, &[&self.series, &self.position]),
            all(&self.reading, &[&self.std]),
        ]
    }
}

/// Loads and readings in SI units, with the names of the units, and warnings about units that contradict the headings.
fn points(
    args: &Static,
    columns: &LoadColumns,
    recording: &Recording,
    warnings: &mut Vec<Warning>,
) -> Result<(Vec<Point>, LoadUnits), Failure> {
    let (loads, load_unit) = column(recording, &columns.load, warnings)?;
    let (readings, unit) = column(recording, &columns.reading, warnings)?;
    let is_effort = [Dimension::TORQUE, Dimension::FORCE].contains(&unit.unit.dimension());
    let is_signal = load_unit.unit.dimension() != Dimension::FORCE
        && TransducerSignal::of(&load_unit.unit).is_some();
    if is_signal && is_effort {
        return Err(ErrorCode::UnitUnsuitable.usage(format_args!(
            "--load \"{}\" is in {} and --reading \"{}\" in {}; the columns are swapped",
            args.load, load_unit.text, args.reading, unit.text
        )));
    }
    let (load_factor, load) = load_of(args, &load_unit)?;
    let (factor, reading) = reading_of(args, &unit)?;
    let loads: Vec<f64> = loads.iter().map(|v| v * load_factor).collect();
    let series = numbers(recording, columns.series.as_ref())?.unwrap_or_else(|| series_of(&loads));
    let positions = numbers(recording, columns.position.as_ref())?;
    let series = match &positions {
        Some(positions) => at_mountings(&series, positions),
        None => series,
    };
    let stds = stds(args, columns, recording, (&unit, factor))?;
    let point = |i: usize| Point {
        load: loads[i],
        reading: readings[i] * factor,
        std: stds.as_ref().map(|s| s[i]),
        series: series[i],
        position: positions.as_ref().map_or(0, |p| p[i]),
    };
    let points = (0..loads.len()).map(point).collect();
    Ok((points, LoadUnits { load, reading }))
}

/// Standard uncertainties of the readings, converted like these: in the unit of their column, or by default in that of
/// the readings.
fn stds(
    args: &Static,
    columns: &LoadColumns,
    recording: &Recording,
    (reading_unit, factor): (&NamedUnit, f64),
) -> Result<Option<Vec<f64>>, Failure> {
    let Some(choice) = &columns.std else {
        return Ok(None);
    };
    let channel = recording.channel(choice)?;
    let (unit, _) = unit_of(choice, &channel.heading, channel.unit.as_ref())?;
    let refused = |text: &str| {
        ErrorCode::UnitUnsuitable.usage(format_args!(
            "--std \"{}\" is in \"{text}\" and --reading \"{}\" in {}; write the standard uncertainty of each reading in the \
             unit of the readings (0.1 % of 2 V is 0.002 V; one of the load, times the sensitivity)",
            channel.name, args.reading, reading_unit.text
        ))
    };
    let factor = match (&unit, channel.unit_text.as_deref()) {
        (None, _) if channel.name.contains('%') => return Err(refused("%")),
        (None, None | Some("")) => factor,
        (None, Some(text)) => return Err(refused(text)),
        (Some(unit), _) => {
            let (own, name) = reading_of(args, unit).map_err(|_| refused(&unit.text))?;
            let (_, of_readings) = reading_of(args, reading_unit)?;
            match name == of_readings {
                true => own,
                false => return Err(refused(&unit.text)),
            }
        }
    };
    match channel.samples.iter().position(|s| s.is_nan() || *s <= 0.0) {
        Some(i) => Err(ErrorCode::InvalidSample.failed(format_args!(
            "row {} of {}: the standard uncertainty must be greater than 0",
            i + 1,
            args.input.shown()
        ))),
        None => Ok(Some(channel.samples.iter().map(|s| s * factor).collect())),
    }
}

/// Numbers of series, made distinct between mounting positions, as numbering may restart at each.
fn at_mountings(series: &[usize], positions: &[usize]) -> Vec<usize> {
    let pairs: Vec<(usize, usize)> = positions
        .iter()
        .copied()
        .zip(series.iter().copied())
        .collect();
    let mut known = pairs.clone();
    known.sort_unstable();
    known.dedup();
    let number = |pair| known.partition_point(|of| of < pair);
    pairs.iter().map(number).collect()
}

/// Values of a column, numbered by first appearance.
fn numbers(
    recording: &Recording,
    choice: Option<&ChannelChoice>,
) -> Result<Option<Vec<usize>>, Failure> {
    let Some(choice) = choice else {
        return Ok(None);
    };
    Ok(Some(ranks(&recording.channel(choice)?.samples)))
}

fn column(
    recording: &Recording,
    choice: &ChannelChoice,
    warnings: &mut Vec<Warning>,
) -> Result<(Vec<f64>, NamedUnit), Failure> {
    let (channel, unit, warning) = recording.column(choice)?;
    warnings.extend(warning);
    let flag = choice.flags.unit.unwrap_or_default();
    let named = RecordedChannel {
        unit: unit.as_ref(),
        ..channel.recorded()
    };
    let unit = unit_or(named, flag)?;
    Ok((channel.samples.clone(), unit))
}

/// Rejects a gravity that occurs nowhere on Earth.
fn on_earth(gravity: Option<f64>, text: Option<&str>) -> Result<(), Failure> {
    match (gravity, text) {
        (Some(value), Some(text)) if !ON_EARTH.contains(&value) => {
            Err(ErrorCode::InvalidValue.usage(format_args!(
                "--gravity {text}: gravity on the ground is between {} and {} m/s^2 (9.780 at the equator, 9.832 at the poles); \
                 give the local one, as --gravity \"9.81 m/s^2\"",
                ON_EARTH.start(),
                ON_EARTH.end()
            )))
        }
        _ => Ok(()),
    }
}

/// Asks whether a unit of the load contains a mass or a weight.
fn refuse_unclear_weight(args: &Static, unit: &NamedUnit) -> Result<(), Failure> {
    if unit.unit.has_bare_weight()
        && let Some([force, mass]) = Unit::readings_of_weight(&unit.text)
    {
        return Err(ErrorCode::UnitUnclear.usage(format_args!(
            "--load \"{}\" is in \"{}\", which can be read with a force or with a mass; give --load-unit \
             \"{force}\" or --load-unit \"{mass}\"",
            args.load, unit.text
        )));
    }
    if let Some(force) = unit.weight_as(Dimension::TORQUE) {
        return Err(ErrorCode::UnitUnclear.usage(format_args!(
            "--load \"{}\" is in \"{}\", a mass times a length; if it is a torque, give --load-unit \"{force}\"",
            args.load, unit.text
        )));
    }
    Ok(())
}

/// SI units per unit of the load, and their name.
fn load_of(args: &Static, unit: &NamedUnit) -> Result<(f64, String), Failure> {
    let factor = unit.unit.factor();
    let radius = radius(args.radius.as_deref())?;
    let gravity = args.gravity.as_deref();
    let gravity = gravity.map(|text| quantity("--gravity", text, Kind::Acceleration));
    let gravity = gravity.transpose()?;
    on_earth(gravity, args.gravity.as_deref())?;
    refuse_unclear_weight(args, unit)?;
    let is_mass = unit.unit.dimension() == Dimension::MASS;
    if gravity.is_some() && !is_mass {
        return Err(ErrorCode::ConflictingArguments.usage(format_args!(
            "--gravity goes with a load that is a mass; \"{}\" is in {}",
            args.load, unit.text
        )));
    }
    match (unit.unit.dimension(), radius) {
        (Dimension::TORQUE, None) => Ok((factor, "N m".to_owned())),
        (Dimension::FORCE, Some(radius)) => Ok((factor * radius, "N m".to_owned())),
        (Dimension::FORCE, None) => Ok((factor, "N".to_owned())),
        (_, radius) if is_mass => match (gravity, radius) {
            (None, _) => Err(ErrorCode::MissingArgument.usage(format_args!(
                "--load \"{}\" is in {}, a mass; give the local gravity, as --gravity \"9.81 m/s^2\" (9.780 \
                 m/s^2 at the equator, 9.832 at the poles)",
                args.load, unit.text
            ))),
            (Some(gravity), Some(radius)) => Ok((factor * gravity * radius, "N m".to_owned())),
            (Some(gravity), None) => Ok((factor * gravity, "N".to_owned())),
        },
        (_, Some(_)) => Err(ErrorCode::ConflictingArguments.usage(format_args!(
            "--radius goes with a load that is a force or a mass; \"{}\" is in {}",
            args.load, unit.text
        ))),
        (_, None) => Ok((1.0, unit.text.clone())),
    }
}

/// Evaluation units of the readings per unit of the file, and their name.
fn reading_of(args: &Static, unit: &NamedUnit) -> Result<(f64, String), Failure> {
    if let Some(signal) = TransducerSignal::of(&unit.unit) {
        let (usual, factor) = signal.usual_unit();
        return Ok((signal.factor(&unit.unit) / factor, usual.to_owned()));
    }
    if unit.unit.ratio_of() == Some(RatioOf::Anything) {
        let text = &unit.text;
        return Err(ErrorCode::UnitUnclear.usage(format_args!(
            "--reading \"{}\" is in \"{text}\", which could be a ratio of voltages or a strain; give \
             --reading-unit \"{text} V/V\" or \"{text} strain\"",
            args.reading
        )));
    }
    Ok((1.0, unit.text.clone()))
}

/// Numbers the distinct values from 0, by first appearance.
fn ranks(values: &[f64]) -> Vec<usize> {
    let mut seen = HashMap::new();
    let rank = |value: &f64| {
        let next = seen.len();
        // 0 and −0 are equal but differ in their bits.
        *seen.entry((value + 0.0).to_bits()).or_insert(next)
    };
    values.iter().map(rank).collect()
}

/// The entries of the stand file: the calibration in the form for the readings' unit, and the zero.
fn entries(args: &Static, result: &Identification, units: &LoadUnits) -> Vec<Entry> {
    let source = format!("identify static: {}", args.input.shown());
    if units.load != "N m" {
        let gain = result.get("static_gain").filter(|_| args.degree == 1);
        let mut entries: Vec<Entry> = gain
            .map(|gain| entry("mechanics", "static_gain", gain, &source))
            .into_iter()
            .collect();
        let zero = result.get("zero").filter(|_| !entries.is_empty());
        entries.extend(zero.map(|zero| entry("recorder", "zero", zero, &source)));
        return entries;
    }
    let is_signal = |signal: &TransducerSignal| signal.usual_unit().0 == units.reading;
    let Some(signal) = TransducerSignal::ALL.into_iter().find(is_signal) else {
        return Vec::new();
    };
    if args.degree > 1 {
        let point = |step: &CalibrationStep| {
            let reading = format!("{} {}", digits::text(step.reading, 9), units.reading);
            let torque = |number: f64| format!("{} N m", digits::text(number, 9));
            [reading, torque(step.load), torque(step.load_std)]
        };
        let points: Vec<_> = result.steps.iter().map(point).collect();
        let degree = Entry::whole("calibration", "degree", args.degree as i64);
        return vec![Entry::points(&points), degree];
    }
    let constant = match signal {
        TransducerSignal::Voltage => Some("torque_per_volt"),
        TransducerSignal::Ratio => Some("torque_per_ratio"),
        _ => None,
    };
    let mut entries: Vec<Entry> = match constant {
        Some(key) => {
            let found = result.get(key);
            let made = found.map(|found| entry("calibration", key, found, &source));
            made.into_iter().collect()
        }
        None => at_largest_load(result, units, &source),
    };
    let zero = result.get("zero");
    entries.extend(zero.map(|zero| entry("recorder", "zero", zero, &source)));
    entries
}

/// `sensitivity` and `at_torque`: the change of the reading at the largest load.
fn at_largest_load(result: &Identification, units: &LoadUnits, source: &str) -> Vec<Entry> {
    let Some(slope) = result.get("sensitivity") else {
        return Vec::new();
    };
    let loads = result.steps.iter().map(|s| s.load.abs());
    let largest = loads.fold(0.0, f64::max);
    let change = Estimate::of(
        units.reading.clone(),
        slope.value() * largest,
        slope.std().map(|std| std * largest),
    );
    let at = Estimate::of(Kind::Torque, largest, None);
    vec![
        Entry::quantity("calibration", "sensitivity", &change, source),
        Entry::quantity("calibration", AT_TORQUE, &at, source),
    ]
}
