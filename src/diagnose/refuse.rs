//! Rejection of records that cannot be diagnosed.

use std::ops::Range;
use std::sync::Arc;

use torqcomp_model::simulate::{Excitation, MotionState};

use super::alignment::Alignment;
use super::plain::find_plain;
use super::record::StandRecord;
use super::residual_tests::without_mean;
use super::score::ScoredModel;
use super::structure::{FitContext, PlainStand, Structure};
use super::{Case, scales, shift};
use crate::failure::{ErrorCode, Failure};
use crate::print::{relative, rounded};
use torqcomp_dsp::dot;

/// Minimum number of periods of the natural frequency in the longest training record.
const FEWEST_PERIODS: f64 = 10.0;
/// Relative error of the plain stand above which the channels are also tried swapped.
pub const LARGE_ERROR: f64 = 0.3;
/// Ratio of the error with swapped channels to that as given, below which they count as swapped.
const SWAPPED: f64 = 0.5;
/// Ratio of the error with a free gain to that with the declared one, below which the declared one has the wrong unit.
const ANOTHER_UNIT: f64 = 0.5;
/// Ratios of the gain to the declared one that the effect `gain-error` covers.
const GAIN_ERRORS: Range<f64> = 0.1..11.0;
/// Ratio of the error of a plain stand fitted to the held-out records alone to that of the one from training, below
/// which the records may be of two stands.
const APART: f64 = 0.5;

/// Rejects records that have the wrong sign or unit, have their channels swapped or shifted, or are too short; returns
/// the remaining shift of the channels, to be weighed against effects.
///
/// # Errors
/// If the records are rejected.
pub fn check(case: &Case, context: &FitContext) -> Result<Option<Alignment>, Failure> {
    if case.records.are_free() {
        // A free decay has no other channel.
        return refuse_short(case, context).map(|()| None);
    }
    let as_given = relative_error(context, &case.records.train);
    let alignment = (as_given >= LARGE_ERROR)
        .then(|| Alignment::find(case, context, as_given))
        .flatten();
    if as_given >= LARGE_ERROR {
        // A delay of half a period is close to an inversion; the sign is the simpler explanation.
        let shifted = alignment.as_ref().map(|a| a.errors[1]);
        refuse_sign_or_unit(case, context, shifted.unwrap_or(as_given).min(as_given))?;
    }
    if let Some(alignment) = &alignment {
        shift::refuse(case, alignment)?;
    }
    let is_shifted = alignment
        .as_ref()
        .is_some_and(|a| a.errors[1] < ANOTHER_UNIT * as_given);
    if as_given >= LARGE_ERROR && !is_shifted {
        // Swapped channels fit any frequency, so the record may seem too short.
        refuse_swapped(case, context, as_given)?;
    }
    refuse_short(case, context)?;
    Ok(alignment)
}

fn refuse_short(case: &Case, context: &FitContext) -> Result<(), Failure> {
    let Some((record, duration_s)) = longest(&case.records.train) else {
        return Ok(());
    };
    let natural_hz = context.plain.natural_hz;
    let periods = duration_s * natural_hz;
    if periods >= FEWEST_PERIODS {
        return Ok(());
    }
    Err(ErrorCode::TooFewSamples.failed(format_args!(
        "{duration_s:.4} s are only {periods:.1} periods of the fitted natural frequency ({natural_hz:.4} Hz); \
         at least one training record must have {FEWEST_PERIODS} periods. Record for longer, or, for a stand \
         that turns freely, use \"identify runup\""
    ))
    .at(&record.source))
}

/// Whether no training record has enough periods of the fitted natural frequency.
pub fn is_short(case: &Case, context: &FitContext) -> bool {
    let longest = longest(&case.records.train);
    longest.is_some_and(|(_, duration_s)| duration_s * context.plain.natural_hz < FEWEST_PERIODS)
}

/// The longest training record and its duration in s.
pub fn longest(train: &[StandRecord]) -> Option<(&StandRecord, f64)> {
    let longest = train.iter().max_by_key(|r| r.count())?;
    Some((longest, longest.count() as f64 / longest.rate_hz()))
}

/// Rejects a measured channel whose sign or magnitude contradicts the declared gain.
fn refuse_sign_or_unit(case: &Case, context: &FitContext, as_given: f64) -> Result<(), Failure> {
    if context.gain_is_free {
        return Ok(());
    }
    let train = &case.records.train;
    let free = FitContext {
        gain_is_free: true,
        ..context.clone()
    };
    let Ok(free) = find_plain(&free, case.declared, train) else {
        return Ok(());
    };
    let ratio = free.plain.gain / context.plain.gain;
    let scaled = relative_error(&free, train);
    if GAIN_ERRORS.contains(&ratio) || scaled >= ANOTHER_UNIT * as_given {
        return Ok(());
    }
    let (what, remedy) = if GAIN_ERRORS.contains(&-ratio) {
        (
            format!(
                "is {} times what the applied torque and the stand give, of the opposite sign",
                rounded(ratio, 4)
            ),
            "change the sign of one of the two channels, or of the [calibration]",
        )
    } else {
        (
            format!(
                "is {} times what the applied torque and the stand give",
                rounded(ratio, 4)
            ),
            "check the unit of both channels (mV under a heading in V?), the [calibration] and the [recorder] gain",
        )
    };
    Err(ErrorCode::UnsuitableRecord.failed(format_args!(
        "{}: the measured torque {what}: a stand fitted to it as it is has an error of {}, one with that factor {}; \
         {remedy}",
        train[0].source,
        relative(as_given, 2),
        relative(scaled, 2)
    )))
}

fn refuse_swapped(case: &Case, context: &FitContext, as_given: f64) -> Result<(), Failure> {
    let train = &case.records.train;
    let swapped: Vec<StandRecord> = train.iter().map(swap).collect();
    let plain = PlainStand {
        natural_hz: 1.0,
        gain: 1.0 / context.plain.gain,
        ..context.plain
    };
    let other = FitContext {
        scales: scales(&swapped),
        recorder: None,
        several: None,
        ..context.at(plain)
    };
    let Ok(other) = find_plain(&other, case.declared, &swapped) else {
        return Ok(());
    };
    let duration_s = longest(train).map_or(0.0, |(_, duration_s)| duration_s);
    let the_other_way = relative_error(&other, &swapped);
    if duration_s * other.plain.natural_hz < FEWEST_PERIODS || the_other_way >= SWAPPED * as_given {
        return Ok(());
    }
    Err(ErrorCode::UnsuitableRecord.failed(format_args!(
        "the channels look swapped: a stand from --applied to --measured has an error of {}, one from \
         --measured to --applied {}; exchange the two",
        relative(as_given, 2),
        relative(the_other_way, 2)
    ))
    .at(&train[0].source))
}

fn swap(record: &StandRecord) -> StandRecord {
    let input = &record.input;
    let applied = record.measured.to_vec();
    let (rate_hz, start_s) = (input.rate_hz(), input.start_s());
    StandRecord {
        input: Arc::new(Excitation::new(applied, rate_hz, start_s, input.substeps())),
        measured: Arc::new(input.samples().to_vec()),
        ..record.clone()
    }
}

/// RMS error of the plain stand of a context on records, relative to their RMS.
pub fn relative_error(context: &FitContext, records: &[StandRecord]) -> f64 {
    let plain = context.plain;
    let structure = Structure::plain(Arc::new(context.clone()));
    let (model, _) = structure.model(&context.plain_values(&plain));
    let (mut error, mut whole) = (0.0, 0.0);
    for record in records {
        let modelled = model.simulate(&record.input, MotionState::default());
        let measured = record.measured_in_range();
        let pairs = measured.iter().zip(&modelled[record.range.clone()]);
        let mut residual: Vec<f64> = pairs.map(|(y, x)| y - x).collect();
        let nuisance = record.nuisance(&plain.mode(), &context.terms(), None);
        nuisance.clear(&mut residual);
        let measured = without_mean(measured);
        error += dot(&residual, &residual);
        whole += dot(&measured, &measured);
    }
    (error / whole).sqrt()
}

/// The plain stands fitted to training and to held-out records alone, if no common one fits both but each has its
/// own.
pub fn plain_stands_apart(before: &ScoredModel) -> Option<[PlainStand; 2]> {
    let train = before.fitted.stand();
    let common = &before.fitted.structure.context;
    let records: Vec<StandRecord> = before.compared().iter().map(|r| r.record.clone()).collect();
    let alone = find_plain(common, Some(train), &records).ok()?;
    let error_alone = relative_error(&alone, &records);
    let is_apart = error_alone < APART * relative_error(&common.at(train), &records);
    is_apart.then_some([train, alone.plain])
}
