//! `identify static`.

use torqcomp_model::{Dimension, Kind};

use super::{deliver, quantity, read, said, unit_of, whole};
use crate::cli::identify::Static;
use crate::commands::Outcome;
use crate::failure::Failure;
use crate::identify::static_load::{Options, Point, Units, identify, series_of};
use crate::io::csv::{self, NamedUnit};
use crate::recording::Recording;
use crate::report::identify::{Report, Term};
use crate::stand::update::Entry;

const TORQUE: Dimension = Dimension::new([1, 2, -2, 0, 0, 0]);
const FORCE: Dimension = Dimension::new([1, 1, -2, 0, 0, 0]);
const VOLTAGE: Dimension = Dimension::new([1, 2, -3, -1, 0, 0]);

/// Runs the test.
pub fn run(args: &Static) -> Result<Outcome, Failure> {
    let mut options = args.table.options(None, None);
    // A table of loads has no time axis; a rate keeps it from being looked for.
    options.rate_hz = options.rate_hz.or(Some(1.0));
    let recording = read(&args.input, &wanted(args, &options))?;
    let (points, units) = points(args, &recording)?;
    let options = Options {
        degree: args.degree,
    };
    let found = identify(&points, options, &units)?;
    let entries = entries(args, &found.outcome);
    if entries.is_empty() && args.findings.result.output.is_some() {
        return Err(Failure::failed(
            "only a torque over a voltage has a place in a stand file; leave -o out, or give the load as a \
             torque and the reading in volts",
        ));
    }
    let inputs = [args.input.as_str()];
    let mut report = Report::new("static", &inputs, &found.outcome, args.findings.units);
    report.samples = points.len();
    let term = |t: &crate::identify::static_load::Term| Term {
        name: t.name,
        formula: t.formula,
        percent: t.percent,
    };
    report.terms = found.terms.iter().map(term).collect();
    let warnings = said(&recording.warnings, recording.lost.as_ref());
    report.warnings.extend(warnings);
    let is_lossy = recording.lost.is_some();
    deliver(&report, &args.findings, &inputs, &entries, is_lossy)
}

/// The columns that are read.
fn wanted(args: &Static, options: &csv::Options) -> Vec<csv::Options> {
    let names = [
        Some(&args.load),
        Some(&args.reading),
        args.series.as_ref(),
        args.position.as_ref(),
        args.std.as_ref(),
    ];
    let one = |name: &String| csv::Options {
        channel: Some(name.clone()),
        ..options.clone()
    };
    names.into_iter().flatten().map(one).collect()
}

/// Loads and readings in SI units, with what they are called.
fn points(args: &Static, recording: &Recording) -> Result<(Vec<Point>, Units), Failure> {
    let load_flag = args.load_unit.as_deref();
    let (loads, load_unit) = column(recording, &args.load, load_flag, "--load-unit")?;
    let flag = args.reading_unit.as_deref();
    let (readings, unit) = column(recording, &args.reading, flag, "--reading-unit")?;
    let is_effort = [TORQUE, FORCE].contains(&unit.unit.dimension());
    if load_unit.unit.dimension() == VOLTAGE && is_effort {
        return Err(Failure::usage(format_args!(
            "--load \"{}\" is in {} and --reading \"{}\" in {}; the columns are swapped",
            args.load, load_unit.text, args.reading, unit.text
        )));
    }
    let (load_factor, load) = load_of(args, &load_unit)?;
    let (factor, reading) = match unit.unit.dimension() {
        VOLTAGE => (unit.unit.factor(), "V".to_owned()),
        _ => (1.0, unit.text.clone()),
    };
    let loads: Vec<f64> = loads.iter().map(|v| v * load_factor).collect();
    let series = numbers(recording, args.series.as_ref())?.unwrap_or_else(|| series_of(&loads));
    let positions = numbers(recording, args.position.as_ref())?;
    let stds = stds(args, recording)?;
    let counts = [
        Some(readings.len()),
        positions.as_ref().map(Vec::len),
        stds.as_ref().map(Vec::len),
        Some(series.len()),
    ];
    if counts
        .into_iter()
        .flatten()
        .any(|count| count != loads.len())
    {
        return Err(Failure::failed(format_args!(
            "{}: the columns have different numbers of rows; each load needs a reading",
            args.input
        )));
    }
    let point = |i: usize| Point {
        load: loads[i],
        reading: readings[i] * factor,
        std: stds.as_ref().map(|s| s[i] * factor),
        series: series[i],
        position: positions.as_ref().map_or(0, |p| p[i]),
    };
    let points = (0..loads.len()).map(point).collect();
    Ok((points, Units { load, reading }))
}

/// Standard uncertainties of the readings as they stand in their column.
fn stds(args: &Static, recording: &Recording) -> Result<Option<Vec<f64>>, Failure> {
    let Some(name) = &args.std else {
        return Ok(None);
    };
    let stds = recording.channel(Some(name))?.samples.clone();
    match stds.iter().position(|s| s.is_nan() || *s <= 0.0) {
        Some(i) => Err(Failure::failed(format_args!(
            "row {} of {}: the standard uncertainty must be greater than 0",
            i + 1,
            args.input
        ))),
        None => Ok(Some(stds)),
    }
}

/// A column's different values, numbered in the order they come.
fn numbers(recording: &Recording, name: Option<&String>) -> Result<Option<Vec<usize>>, Failure> {
    let Some(name) = name else { return Ok(None) };
    let channel = recording.channel(Some(name))?;
    Ok(Some(ranks(&channel.samples)))
}

fn column(
    recording: &Recording,
    name: &str,
    unit: Option<&str>,
    flag: &str,
) -> Result<(Vec<f64>, NamedUnit), Failure> {
    let options = csv::Options {
        channel: Some(name.to_owned()),
        unit: unit.map(str::to_owned),
        rate_hz: Some(1.0),
        ..Default::default()
    };
    let selection = recording.select(&options)?;
    whole(&selection)?;
    let unit = unit_of(&selection, flag)?;
    Ok((selection.samples.to_vec(), unit))
}

/// SI units for one unit of the load, and what they are called.
fn load_of(args: &Static, unit: &NamedUnit) -> Result<(f64, String), Failure> {
    let factor = unit.unit.factor();
    let radius = args
        .radius
        .as_deref()
        .map(|text| quantity("--radius", text, Kind::Length))
        .transpose()?;
    match (unit.unit.dimension(), radius) {
        (TORQUE, None) => Ok((factor, "N m".to_owned())),
        (FORCE, Some(radius)) => Ok((factor * radius, "N m".to_owned())),
        (FORCE, None) => Ok((factor, "N".to_owned())),
        (_, Some(_)) => Err(Failure::usage(format_args!(
            "--radius goes with a load that is a force; \"{}\" is in {}",
            args.load, unit.text
        ))),
        (_, None) => Ok((1.0, unit.text.clone())),
    }
}

/// Numbers the different values from 0 in the order they come.
fn ranks(values: &[f64]) -> Vec<usize> {
    let mut seen: Vec<f64> = Vec::new();
    values
        .iter()
        .map(|v| {
            seen.iter().position(|s| s == v).unwrap_or_else(|| {
                seen.push(*v);
                seen.len() - 1
            })
        })
        .collect()
}

fn entries(args: &Static, outcome: &crate::identify::Outcome) -> Vec<Entry> {
    let source = format!("identify static: {}", args.input);
    outcome
        .get("torque_per_volt")
        .map(|found| Entry {
            section: "calibration",
            key: "torque_per_volt",
            value: found.value,
            std: found.std,
            unit: found.unit.clone(),
            source: source.clone(),
        })
        .into_iter()
        .chain(
            outcome
                .get("torque_per_volt")
                .and(outcome.get("zero"))
                .map(|zero| Entry {
                    section: "recorder",
                    key: "zero",
                    value: zero.value,
                    std: zero.std,
                    unit: "V".to_owned(),
                    source: source.clone(),
                }),
        )
        .collect()
}
