//! `identify response`.

use torqcomp_model::Dimension;

use super::anchor::{Ratios, Told, follow};
use super::{ONE_MODE, deliver, plain, said, together};
use crate::cli::identify::{Excitation, Measured, Response};
use crate::commands::Outcome;
use crate::failure::Failure;
use crate::identify::anchored::Ringer;
use crate::identify::response::{self, Driven, Evaluated, Options, identify};
use crate::io::csv::NamedUnit;
use crate::report::identify::Report;
use crate::stand::update::Entry;
use crate::warning::Warning;

/// A record as it is evaluated.
struct Loaded {
    name: String,
    rate_hz: f64,
    applied: Vec<f64>,
    measured: Vec<f64>,
    applied_unit: Option<NamedUnit>,
    unit: Option<NamedUnit>,
    warnings: Vec<Warning>,
    is_lossy: bool,
}

/// Runs the test.
pub fn run(args: &Response) -> Result<Outcome, Failure> {
    let loaded: Vec<Loaded> = args
        .inputs
        .iter()
        .map(|input| load(args, input))
        .collect::<Result<_, _>>()?;
    let records: Vec<Driven> = loaded
        .iter()
        .map(|l| Driven {
            name: &l.name,
            rate_hz: l.rate_hz,
            applied: &l.applied,
            measured: &l.measured,
        })
        .collect();
    let options = Options {
        excitation: args.excitation.map(|e| match e {
            Excitation::Impact => response::Excitation::Impact,
            Excitation::Random => response::Excitation::Random,
            Excitation::Periodic => response::Excitation::Periodic,
        }),
        band_hz: args.band,
        modes: args.modes.map(usize::from),
        period: args.period,
        segment: args.segment,
        order: order(args, loaded[0].unit.as_ref()),
        with_delay: args.delay,
    };
    let mut evaluated = identify(&records, &options)?;
    if let Some(quality) = &mut evaluated.outcome.quality {
        quality.unit = loaded[0]
            .unit
            .as_ref()
            .map_or_else(String::new, |u| u.text.clone());
    }
    let entries = entries(args, rad_per_n_m(&loaded, options.order)?, &mut evaluated)?;
    let inputs: Vec<&str> = args.inputs.iter().map(String::as_str).collect();
    let mut report = Report::new("response", &inputs, &evaluated.outcome, args.findings.units);
    report.samples = loaded.iter().map(|l| l.applied.len()).sum();
    report.rate_hz = Some(loaded[0].rate_hz);
    report.held_out_errors = evaluated
        .held_out
        .iter()
        .map(|e| Some(*e).filter(|e| e.is_finite()))
        .collect();
    let warnings = loaded.iter().flat_map(|l| l.warnings.iter().cloned());
    report.warnings.extend(warnings);
    let is_lossy = loaded.iter().any(|l| l.is_lossy);
    deliver(&report, &args.findings, &inputs, &entries, is_lossy)
}

fn load(args: &Response, input: &str) -> Result<Loaded, Failure> {
    let wanted =
        [&args.applied, &args.measured].map(|channel| args.reading.options(Some(channel), None));
    let mut read = together(input, &wanted)?;
    let (Some(measured), Some(applied)) = (read.tracks.pop(), read.tracks.pop()) else {
        return Err(Failure::failed(format_args!(
            "{input}: two channels are needed"
        )));
    };
    Ok(Loaded {
        name: input.to_owned(),
        rate_hz: read.rate_hz,
        applied: applied.samples,
        measured: measured.samples,
        applied_unit: applied.unit,
        unit: measured.unit,
        warnings: said(&read.warnings, read.lost.as_ref()),
        is_lossy: read.lost.is_some(),
    })
}

/// Derivative of displacement that the measured channel is.
fn order(args: &Response, unit: Option<&NamedUnit>) -> i32 {
    match args.measured_as {
        Some(Measured::Displacement) => 0,
        Some(Measured::Speed) => 1,
        Some(Measured::Acceleration) => 2,
        None => {
            let is = |seconds: i32| {
                unit.is_some_and(|u| {
                    [Dimension::new([0, 1, seconds, 0, 0, 0]), turning(seconds)]
                        .contains(&u.unit.dimension())
                })
            };
            if is(-2) { 2 } else { i32::from(is(-1)) }
        }
    }
}

const TORQUE: Dimension = Dimension::new([1, 2, -2, 0, 0, 0]);

/// An angle times seconds to that power.
fn turning(seconds: i32) -> Dimension {
    Dimension::new([0, 0, seconds, 0, 0, 1])
}

/// Radians (per second, per second squared) over newton metres of one unit measured over one applied, if the one is
/// a motion and the other a torque.
fn rad_per_n_m(loaded: &[Loaded], order: i32) -> Result<Option<f64>, Failure> {
    let of = |record: &Loaded| {
        let (measured, applied) = (
            record.unit.as_ref()?.unit,
            record.applied_unit.as_ref()?.unit,
        );
        let known = measured.dimension() == turning(-order) && applied.dimension() == TORQUE;
        known.then(|| measured.factor() / applied.factor())
    };
    let first = of(&loaded[0]);
    match loaded.iter().find(|l| of(l) != first) {
        None => Ok(first),
        Some(other) => Err(Failure::failed(format_args!(
            "{} and {} have their channels in different units; records of one response must have the same",
            loaded[0].name, other.name
        ))),
    }
}

/// Constants that follow from a single mode, and an anchor where they need one, and the entries of the stand file.
fn entries(
    args: &Response,
    rad_per_n_m: Option<f64>,
    evaluated: &mut Evaluated,
) -> Result<Vec<Entry>, Failure> {
    let get = |name: &str| evaluated.outcome.get(name).cloned();
    let pair = (get("natural_frequency"), get("damping_ratio"));
    let (Some(frequency), Some(ratio)) = pair else {
        return match args.findings.result.output {
            Some(_) => Err(Failure::failed(ONE_MODE)),
            None => Ok(Vec::new()),
        };
    };
    let source = format!("identify response: {}", args.inputs.join(", "));
    if let (Some(size), Some(answer)) = (rad_per_n_m, evaluated.single) {
        let (answer, outcome) = (answer.scaled(size), &mut evaluated.outcome);
        return plain::follow(&args.anchors, &args.findings, &answer, &source, outcome);
    }
    let pole = evaluated.modal.poles[0];
    let told = Told {
        mode: Ringer {
            rate_per_s: pole.rate_per_s,
            omega_rad_per_s: pole.omega_rad_per_s,
            covariance: evaluated.spread[0],
        },
        ratios: Ratios::OverStiffness,
        modal: [&frequency, &ratio],
        source,
    };
    follow(&args.anchors, &args.findings, &told, &mut evaluated.outcome)
}
