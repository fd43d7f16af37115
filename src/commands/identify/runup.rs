//! `identify runup`.

use torqcomp_model::{Dimension, Kind, Unit};

use super::{deliver, quantity, said, together, unit_or};
use crate::cli::identify::Runup;
use crate::commands::Outcome;
use crate::failure::Failure;
use crate::identify::runup::{Body, Motion, Options, Run, identify};
use crate::report::identify::Report;
use crate::signal::together::Track;
use crate::stand::update::Entry;

const TORQUE: Dimension = Dimension::new([1, 2, -2, 0, 0, 0]);
const FORCE: Dimension = Dimension::new([1, 1, -2, 0, 0, 0]);

/// Runs the test.
pub fn run(args: &Runup) -> Result<Outcome, Failure> {
    let wanted = [
        (&args.motion, args.motion_unit.as_deref()),
        (&args.torque, args.torque_unit.as_deref()),
    ]
    .map(|(channel, unit)| args.reading.options(Some(channel), unit));
    let read = together(&args.input, &wanted)?;
    let (motion, torque) = (&read.tracks[0], &read.tracks[1]);
    let motion_unit = unit_or(motion.unit.as_ref(), &motion.name, "--motion-unit")?;
    let (kind, turning) = motion_of(motion_unit.unit.dimension()).ok_or_else(|| {
        Failure::failed(format_args!(
            "the motion \"{}\" is in \"{}\"; expected an angle, a length, or one per second or second \
             squared",
            motion.name, motion_unit.text
        ))
    })?;
    let scaled =
        |samples: &[f64], factor: f64| samples.iter().map(|v| v * factor).collect::<Vec<f64>>();
    let positions = scaled(&motion.samples, motion_unit.unit.factor());
    let efforts = scaled(&torque.samples, effort_factor(args, torque, turning)?);
    let run = Run {
        rate_hz: read.rate_hz,
        motion: &positions,
        kind,
        effort: &efforts,
        body: if turning {
            Body::Turning
        } else {
            Body::Sliding
        },
    };
    let options = Options {
        by_direction: args.by_direction,
        half_window_s: args.window,
    };
    let outcome = identify(&run, &options)?;
    let entries = entries(args, &outcome)?;
    let mut report = Report::new("runup", &[&args.input], &outcome, args.findings.units);
    report.samples = positions.len();
    report.rate_hz = Some(read.rate_hz);
    let warnings = said(&read.warnings, read.lost.as_ref());
    report.warnings.extend(warnings);
    let is_lossy = read.lost.is_some();
    deliver(&report, &args.findings, &[&args.input], &entries, is_lossy)
}

/// The inertia for the stand file.
fn entries(args: &Runup, outcome: &crate::identify::Outcome) -> Result<Vec<Entry>, Failure> {
    let negative = outcome.get("inertia").filter(|found| found.value <= 0.0);
    if let (Some(found), Some(_)) = (negative, &args.findings.result.output) {
        return Err(Failure::failed(format_args!(
            "the inertia came out as {} kg m^2, which no body has, and is not written: check the sign of \"{}\" and \
             \"{}\"",
            crate::print::short(found.value),
            args.motion,
            args.torque
        )));
    }
    let source = format!("identify runup: {}", args.input);
    let entries: Vec<Entry> = outcome
        .get("inertia")
        .map(|found| Entry {
            section: "mechanics",
            key: "inertia",
            value: found.value,
            std: found.std,
            unit: found.unit.clone(),
            source,
        })
        .into_iter()
        .collect();
    if entries.is_empty() && args.findings.result.output.is_some() {
        return Err(Failure::failed(
            "a mass has no place in a stand file; leave -o out, or record an angle and a torque",
        ));
    }
    Ok(entries)
}

/// What a unit says of the motion: its derivative, and whether it turns.
fn motion_of(dimension: Dimension) -> Option<(Motion, bool)> {
    let orders = [
        (0, Motion::Position),
        (-1, Motion::Speed),
        (-2, Motion::Acceleration),
    ];
    orders.into_iter().find_map(|(seconds, motion)| {
        if dimension == Dimension::new([0, 0, seconds, 0, 0, 1]) {
            return Some((motion, true));
        }
        (dimension == Dimension::new([0, 1, seconds, 0, 0, 0])).then_some((motion, false))
    })
}

/// SI units of torque (turning) or force (sliding) for one unit of the channel.
fn effort_factor(args: &Runup, torque: &Track, turning: bool) -> Result<f64, Failure> {
    let (factor, dimension) = match &args.torque_factor {
        Some(text) => factor_of(text)?,
        None => {
            let unit = unit_or(torque.unit.as_ref(), &torque.name, "--torque-unit")?;
            (unit.unit.factor(), unit.unit.dimension())
        }
    };
    let radius = match &args.radius {
        Some(text) => Some(quantity("--radius", text, Kind::Length)?),
        None => None,
    };
    match (turning, dimension, radius) {
        (true, TORQUE, None) | (false, FORCE, None) => Ok(factor),
        (true, FORCE, Some(radius)) => Ok(factor * radius),
        (true, FORCE, None) => Err(Failure::failed(
            "a force drives a turning body at a radius; give it with --radius",
        )),
        (_, other, _) => Err(Failure::failed(format_args!(
            "the channel \"{}\" is no {} ({other}); give --torque-factor, such as \"35.15 N/V\"",
            torque.name,
            if turning { "torque" } else { "force" }
        ))),
    }
}

/// `"35.15 N/V"`: SI units of the first for one volt, and what the first is.
fn factor_of(text: &str) -> Result<(f64, Dimension), Failure> {
    let wrong = || {
        Failure::usage(format_args!(
            "--torque-factor {text}: expected a number, a unit of torque or force, and \"/\" the unit of \
             the channel, such as \"35.15 N/V\""
        ))
    };
    let (number, units) = text.trim().split_once(' ').ok_or_else(wrong)?;
    let number: f64 = number.parse().map_err(|_| wrong())?;
    let (effort, channel) = units.rsplit_once('/').ok_or_else(wrong)?;
    let effort = Unit::parse(effort).map_err(|_| wrong())?;
    // The channel's numbers are taken as they stand, so its own prefix must not count.
    Unit::parse(channel).map_err(|_| wrong())?;
    if !number.is_finite() || number == 0.0 {
        return Err(wrong());
    }
    Ok((number * effort.factor(), effort.dimension()))
}
