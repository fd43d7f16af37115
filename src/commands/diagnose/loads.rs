//! Slowly applied known loads of a diagnosis.

use std::path::Path;

use super::read::{Pair, two_columns};
use crate::cli::Diagnose;
use crate::diagnose::KnownLoads;
use crate::failure::{ErrorCode, Failure};
use crate::io::{Input, Reading};
use crate::recording::Recording;
use crate::stand::Stand;
use crate::unit::NamedUnit;

/// The loads and readings of each file.
pub(super) fn pairs(args: &Diagnose) -> Result<Vec<Pair>, Failure> {
    args.static_loads
        .iter()
        .map(|file| pair(args, file))
        .collect()
}

fn pair(args: &Diagnose, file: &Path) -> Result<Pair, Failure> {
    let needs = "--static needs --applied COL, the channel with the known loads";
    let choices = two_columns(args, needs)?;
    // The times of the loads do not matter, so no time axis is searched for, whatever options the records have.
    let reading = Reading {
        rate_hz: None,
        time_column: None,
        time_unit: None,
        resample: false,
        range: None,
        ..args.reading.clone()
    };
    let [load, gage] = &choices;
    let columns = [load, gage].map(std::slice::from_ref);
    let recording = Recording::of_loads(&Input::of(file), columns, &reading)?;
    let (load, applied_unit, of_load) = recording.column(load)?;
    let (gage, measured_unit, of_gage) = recording.column(gage)?;
    Ok(Pair {
        source: recording.source.clone(),
        applied: Some(load.samples.clone()),
        measured: gage.samples.clone(),
        rate_hz: 1.0,
        start_s: 0.0,
        applied_unit,
        measured_unit,
        warnings: recording
            .all_warnings()
            .into_iter()
            .chain(of_load)
            .chain(of_gage)
            .collect(),
        is_lossy: recording.lost.is_some(),
    })
}

/// Rejects loads or readings of another kind than the records; units of one kind may differ.
pub(super) fn check_units(loads: &[Pair], record: &Pair) -> Result<(), Failure> {
    let are_apart = |units: [&Option<NamedUnit>; 2]| {
        let [from, to] = units.map(Option::as_ref);
        NamedUnit::factor_between(from, to).is_none()
    };
    let differs = |load: &&Pair| {
        are_apart([&load.applied_unit, &record.applied_unit])
            || are_apart([&load.measured_unit, &record.measured_unit])
    };
    match loads.iter().find(differs) {
        None => Ok(()),
        Some(load) => Err(ErrorCode::RecordsDiffer.failed(format_args!(
            "{} and {} have their channels in units of different kinds; give --applied-unit and --measured-unit, or convert one \
             of them",
            record.source, load.source
        ))),
    }
}

/// Loads and readings in SI units; `calibrated` is the stand that converts the readings to torque.
pub(super) fn known(pair: Pair, calibrated: Option<&Stand>) -> Result<KnownLoads, Failure> {
    let factor = pair.applied_unit.as_ref().map_or(1.0, |u| u.unit.factor());
    let applied = pair.applied.iter().flatten().map(|u| u * factor);
    let measured = pair.measured_si(calibrated)?;
    KnownLoads::new(pair.source, &applied.collect::<Vec<_>>(), &measured)
}
