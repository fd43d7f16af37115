//! Records of a diagnosis in which the torque is unknown.

use std::path::Path;

use super::read::Pair;
use crate::cli::Diagnose;
use crate::diagnose::RunningRecord;
use crate::failure::{ErrorCode, Failure};
use crate::io::{ChannelChoice, Input};
use crate::recording::AlignedChannels;
use crate::stand::Stand;
use crate::unit::NamedUnit;

/// The record of the measured quantity alone.
pub(super) fn measured_alone(args: &Diagnose, file: &Path) -> Result<Pair, Failure> {
    let choice = ChannelChoice::measured_alone(&args.measured, args.measured_unit.as_deref());
    let mut read = AlignedChannels::read(&Input::of(file), &[choice], &args.reading)?;
    let measured = read.channels.swap_remove(0);
    measured.must_be_as_recorded(&read.source)?;
    Ok(Pair {
        source: read.source,
        applied: None,
        measured: measured.samples,
        rate_hz: read.rate_hz,
        start_s: read.start.after_s,
        applied_unit: None,
        measured_unit: measured.unit,
        warnings: read.warnings,
        is_lossy: read.is_lossy,
    })
}

/// The running records; the measured quantity must be of the same kind as in another record.
pub(super) fn pairs(args: &Diagnose, record: &Pair) -> Result<Vec<Pair>, Failure> {
    let running = args.running.iter().map(|file| measured_alone(args, file));
    let running: Vec<Pair> = running.collect::<Result<_, _>>()?;
    let differs = |other: &&Pair| {
        let [from, to] = [*other, record].map(|pair| pair.measured_unit.as_ref());
        NamedUnit::factor_between(from, to).is_none()
    };
    match running.iter().find(differs) {
        None => Ok(running),
        Some(other) => Err(ErrorCode::RecordsDiffer.failed(format_args!(
            "{} and {} have the measured quantity in units of different kinds; give --measured-unit, or convert one \
             of them",
            record.source, other.source
        ))),
    }
}

/// The record in the unit of the diagnosis; `calibrated` is the stand that converts it to torque.
pub(super) fn record(pair: Pair, calibrated: Option<&Stand>) -> Result<RunningRecord, Failure> {
    Ok(RunningRecord {
        measured: pair.measured_si(calibrated)?,
        source: pair.source,
        rate_hz: pair.rate_hz,
    })
}
