//! Records that no diagnosis can be made of.

use std::sync::Arc;

use torqcomp_model::simulate::{Excitation, State};

use super::plain::{Constants, fit_plain};
use super::record::{Record, dot};
use super::structure::{Frame, Structure, Waves};
use super::{Case, Diagnosis, rulers};
use crate::failure::Failure;

/// Fewest periods of the natural frequency in the training records together.
const FEWEST_PERIODS: f64 = 10.0;
/// Part of the record that a plain stand must leave before the channels are tried the other way round.
const LEAVES_MUCH: f64 = 0.3;
/// Error the other way round, over that as given, below which the channels count as swapped.
const SWAPPED: f64 = 0.5;
/// Error of a plain stand fitted to the held-out records alone, over that of the one from training, below which the records
/// may be of two stands.
const APART: f64 = 0.5;

/// Refuses records that have their channels swapped or are too short.
///
/// # Errors
/// If they are.
pub fn check(case: &Case, frame: &Frame, found: Constants) -> Result<(), Failure> {
    // Swapped channels fit any frequency, which may make them look too short.
    refuse_swapped(case, frame, found)?;
    let Some((record, duration_s)) = longest(case) else {
        return Ok(());
    };
    let periods = duration_s * found.natural_hz;
    if periods >= FEWEST_PERIODS {
        return Ok(());
    }
    Err(Failure::failed(format_args!(
        "{}: {duration_s:.4} s are {periods:.1} periods of the {:.4} Hz that fit best, and a diagnosis needs at \
         least {FEWEST_PERIODS} in a training record; record for longer, or, for a stand that turns freely, use \
         \"identify runup\"",
        record.source, found.natural_hz
    )))
}

/// The longest training record and its duration in s.
fn longest(case: &Case) -> Option<(&Record, f64)> {
    let longest = case.train.iter().max_by_key(|r| r.count())?;
    Some((longest, longest.count() as f64 / longest.input.rate_hz()))
}

fn refuse_swapped(case: &Case, frame: &Frame, found: Constants) -> Result<(), Failure> {
    let as_given = left(frame, found, &case.train);
    if as_given < LEAVES_MUCH {
        return Ok(());
    }
    let swapped: Vec<Record> = case.train.iter().map(swap).collect();
    let mut other = Frame {
        rulers: rulers(&swapped),
        gain: 1.0 / frame.gain,
        gain_is_free: frame.gain_is_free,
        recorder: None,
    };
    let Ok(constants) = fit_plain(&mut other, case.declared, &swapped) else {
        return Ok(());
    };
    let periods = longest(case).map_or(0.0, |(_, duration_s)| duration_s * constants.natural_hz);
    let the_other_way = left(&other, constants, &swapped);
    if periods < FEWEST_PERIODS || the_other_way >= SWAPPED * as_given {
        return Ok(());
    }
    Err(Failure::failed(format_args!(
        "{}: the channels look swapped: a stand from --applied to --measured leaves {:.0} % of the record, one the other \
         way round {:.0} %; exchange the two",
        case.train[0].source,
        100.0 * as_given,
        100.0 * the_other_way
    )))
}

fn swap(record: &Record) -> Record {
    let input = &record.input;
    let applied = record.measured.to_vec();
    Record {
        input: Arc::new(Excitation::new(
            applied,
            input.rate_hz(),
            input.start_s(),
            input.substeps(),
        )),
        measured: Arc::new(input.samples().to_vec()),
        ..record.clone()
    }
}

/// Rms that a plain stand leaves of records, over theirs.
fn left(frame: &Frame, constants: Constants, records: &[Record]) -> f64 {
    let mut values = vec![
        constants.natural_hz / frame.rulers.natural_hz,
        constants.damping_ratio,
    ];
    if frame.gain_is_free {
        values.push(constants.gain / frame.gain);
    }
    let structure = Structure {
        frame,
        choices: Vec::new(),
    };
    let (model, _) = structure.model(&values);
    let (mut rest, mut whole) = (0.0, 0.0);
    for record in records {
        let modelled = model.simulate(&record.input, State::default());
        let range = record.range.clone();
        let nuisance = record.nuisance(&constants.mode(), &Waves::NONE, None);
        let mut measured = record.measured[range.clone()].to_vec();
        let pairs = measured.iter().zip(&modelled[range]);
        let mut residual: Vec<f64> = pairs.map(|(y, x)| y - x).collect();
        nuisance.clear(&mut residual);
        let mean = measured.iter().sum::<f64>() / measured.len() as f64;
        measured.iter_mut().for_each(|y| *y -= mean);
        rest += dot(&residual, &residual);
        whole += dot(&measured, &measured);
    }
    (rest / whole).sqrt()
}

/// The constants of plain stands fitted to training and to held-out records alone, where the two do not follow one
/// plain stand but each follows its own.
#[must_use]
pub fn apart(diagnosis: &Diagnosis) -> Option<[Constants; 2]> {
    let fitted = &diagnosis.before.fitted;
    let (mode, gain) = fitted.structure.mode(&fitted.values);
    let train = Constants {
        natural_hz: mode.omega_rad_s / std::f64::consts::TAU,
        damping_ratio: mode.damping_ratio,
        gain,
    };
    let records = &diagnosis.records;
    let mut frame = fitted.structure.frame.clone();
    let hold = fit_plain(&mut frame, Some(train), &records.hold).ok()?;
    let whole = left(fitted.structure.frame, train, &records.hold);
    let alone = left(&frame, hold, &records.hold);
    (alone < APART * whole).then_some([train, hold])
}
