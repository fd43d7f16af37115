//! `identify runup`.

use super::factor::factor_of;
use torqcomp_model::{Dimension, Unit};

use super::{Recorded, deliver, entry, radius, stand_text, unit_or};
use crate::cli::identify::Runup;
use crate::commands::Outcome;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;
use crate::identify::runup::{Body, FreeRun, RunupOptions, identify};
use crate::identify::{Identification, Motion, gravity_hint};
use crate::io::{ChannelChoice, Input};
use crate::print::short;
use crate::quality;
use crate::recording::{AlignedChannels, Channel};
use crate::stand::{self, update::Entry};
use crate::unit::NamedUnit;

/// Runs the test.
pub fn run(args: &Runup) -> Result<Outcome, Failure> {
    let (motion_unit, torque_unit) = (args.motion_unit.as_deref(), args.torque_unit.as_deref());
    let choices = [
        ChannelChoice::named(["--motion", "--motion-unit"], &args.motion, motion_unit),
        ChannelChoice::named(["--torque", "--torque-unit"], &args.torque, torque_unit),
    ];
    let mut read = AlignedChannels::read(&Input::of(&args.input), &choices, &args.reading)?;
    let faults = [quality::clipped(&read), quality::spiked(&read)].concat();
    let (motion, torque) = (&read.channels[0], &read.channels[1]);
    let motion_unit = unit_or(motion.recorded(), "--motion-unit")?;
    let (kind, turning) = Motion::of(motion_unit.unit.dimension()).ok_or_else(|| {
        ErrorCode::UnitUnsuitable.failed(format_args!(
            "the unit of the motion \"{}\" is \"{}\"; expected an angle, a length, or their first or second \
             derivative{}",
            motion.name,
            motion_unit.text,
            hint(&motion_unit).map_or(String::new(), |hint| format!(": {hint}"))
        ))
    })?;
    let factors = [
        motion_unit.unit.factor(),
        effort_factor(args, torque, turning)?,
    ];
    for (channel, factor) in read.channels.iter_mut().zip(factors) {
        channel.samples.iter_mut().for_each(|v| *v *= factor);
    }
    let [motion, effort] = [0, 1].map(|place| &read.channels[place].samples[..]);
    let run = FreeRun {
        rate_hz: read.rate_hz,
        motion,
        kind,
        effort,
        body: if turning {
            Body::Turning
        } else {
            Body::Sliding
        },
    };
    let options = RunupOptions {
        by_direction: args.by_direction,
        half_window_s: args.window,
    };
    let result = identify(&run, &options)?;
    // A stand file that is not complete yet says nothing of the resonance.
    let stand = stand_text(&args.findings)?;
    let stand = stand.and_then(|(name, text)| stand::parse(&name, &text).ok());
    let modes = stand.map_or_else(Vec::new, |stand| stand.resonances());
    let resonance = quality::resonance::warning(effort, read.rate_hz, &modes);
    let entries = entries(args, &result)?;
    let mut recorded = Recorded::default();
    recorded.add(
        &args.input,
        motion.len(),
        Some((read.rate_hz, read.rate_std_hz)),
    );
    recorded.warn(faults, false);
    recorded.warnings.extend(resonance);
    recorded.warn(read.warnings, read.is_lossy);
    deliver(result, recorded, &args.findings, &entries)
}

/// What to write for a unit that is none of a motion.
fn hint(unit: &NamedUnit) -> Option<&'static str> {
    let per_second =
        Unit::parse("1/s").is_ok_and(|second| second.dimension() == unit.unit.dimension());
    let turns = "for turns per second give --motion-unit rev/s, for radians per second rad/s";
    gravity_hint(unit).or(per_second.then_some(turns))
}

/// The entry of the stand file: the inertia.
fn entries(args: &Runup, result: &Identification) -> Result<Vec<Entry>, Failure> {
    let is_written = args.findings.result.output.is_some();
    let source = format!("identify runup: {}", args.input.shown());
    match result.get("inertia") {
        Some(inertia) if inertia.value() <= 0.0 && is_written => {
            Err(ErrorCode::NotIdentifiable.failed(format_args!(
                "the fitted inertia is negative ({} kg m²) and is not written: check the sign of \"{}\" and \"{}\"",
                short(inertia.value()),
                args.motion,
                args.torque
            )))
        }
        Some(inertia) => Ok(vec![entry("mechanics", "inertia", inertia, &source)]),
        None if is_written => Err(ErrorCode::ConflictingArguments.failed(
            "a stand file cannot store a mass; omit -o, or record an angle and a torque",
        )),
        None => Ok(Vec::new()),
    }
}

/// SI units of torque (rotation) or force per unit of the channel.
fn effort_factor(args: &Runup, torque: &Channel, turning: bool) -> Result<f64, Failure> {
    let (factor, dimension) = match &args.torque_factor {
        Some(text) => factor_of(text, (torque.recorded(), "--torque-unit"))?,
        None => {
            let unit = unit_or(torque.recorded(), "--torque-unit")?;
            (unit.unit.factor(), unit.unit.dimension())
        }
    };
    let radius = radius(args.radius.as_deref())?;
    match (turning, dimension, radius) {
        (true, Dimension::TORQUE, None) | (false, Dimension::FORCE, None) => Ok(factor),
        (true, Dimension::FORCE, Some(radius)) => Ok(factor * radius),
        (true, Dimension::FORCE, None) => Err(ErrorCode::MissingArgument.failed(
            "a force on a rotating body needs a radius; give it with --radius",
        )),
        (true, Dimension::TORQUE, Some(_)) | (false, Dimension::FORCE, Some(_)) => {
            Err(ErrorCode::ConflictingArguments.usage(format_args!(
                "--radius goes with a force on a rotating body; \"{}\" is a {} and \"{}\" {}: omit it",
                torque.name,
                if turning { "torque" } else { "force" },
                args.motion,
                if turning {
                    "an angle or its derivative"
                } else {
                    "a linear motion"
                }
            )))
        }
        (false, Dimension::TORQUE, _) => Err(ErrorCode::UnitUnsuitable.failed(format_args!(
            "channel \"{}\" is a torque, but \"{}\" is a linear motion: give the force instead, or the motion as \
             an angle; for a drive of known ratio in between, give --torque-factor, such as \"50 N/(N m)\"",
            torque.name, args.motion
        ))),
        (_, other, _) => Err(ErrorCode::UnitUnsuitable.failed(format_args!(
            "channel \"{}\" is not a {} ({other}); give --torque-factor, such as \"35.15 N/V\"",
            torque.name,
            if turning { "torque" } else { "force" }
        ))),
    }
}
