//! Records that cannot be diagnosed.

use std::ops::Range;
use std::sync::Arc;

use torqcomp_model::simulate::{Excitation, MotionState};

use super::alignment::{Alignment, Shift};
use super::plain::find_plain;
use super::record::{NuisanceTerms, StandRecord, dot};
use super::records::Records;
use super::residual_tests::without_mean;
use super::score::ScoredModel;
use super::structure::{FitContext, PlainStand, Structure};
use super::verdict::remains;
use super::{Case, SearchState, scales};
use crate::failure::{ErrorCode, Failure};
use crate::print::{relative, rounded};
use crate::warning::Warning;

/// Minimum number of periods of the natural frequency in the longest training record.
const FEWEST_PERIODS: f64 = 10.0;
/// Relative error of the plain stand from which on the channels are tried the other way round.
const LARGE_ERROR: f64 = 0.3;
/// The same from which on a shift of the channels is looked for.
const NOTABLE_ERROR: f64 = 0.02;
/// Error with the channels aligned, over that as given, below which they count as shifted, and as of two clocks.
const SHIFTED: f64 = 0.2;
const TWO_CLOCKS: f64 = 0.5;
/// Reduction of the criterion from effects to channels aligned from which on the shift explains more, and error over that with
/// effects up to which it explains as much.
const BETTER: f64 = 10.0;
const MUCH_LESS: f64 = 0.7;
const AS_GOOD: f64 = 1.05;
/// Error the other way round, over that as given, below which the channels count as swapped.
const SWAPPED: f64 = 0.5;
/// Error with the gain left free, over that with the declared one, below which the declared one belongs to another unit.
const ANOTHER_UNIT: f64 = 0.5;
/// Ratios of the gain to the declared one that the effect `gain-error` describes.
const GAIN_ERRORS: Range<f64> = 0.1..11.0;
/// Error of a plain stand fitted to the held-out records alone, over that of the one from training, below which the records
/// may be of two stands.
const APART: f64 = 0.5;

/// Refuses records that have the wrong sign or unit, have their channels swapped or shifted, or are too short; the shift of the
/// channels that remains to be weighed against effects.
///
/// # Errors
/// If they are.
pub fn check(case: &Case, context: &FitContext) -> Result<Option<Alignment>, Failure> {
    let as_given = relative_error(context, &case.records.train);
    let alignment = (as_given >= LARGE_ERROR)
        .then(|| Alignment::find(case, context, as_given))
        .flatten();
    if let Some(alignment) = &alignment {
        refuse_shifted(case, alignment)?;
    }
    let is_shifted = alignment
        .as_ref()
        .is_some_and(|a| a.errors[1] < ANOTHER_UNIT * as_given);
    if as_given >= LARGE_ERROR && !is_shifted {
        refuse_sign_or_unit(case, context, as_given)?;
        // Swapped channels fit any frequency, which may make them look too short.
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
    Err(Failure::failed(
        ErrorCode::TooFewSamples,
        format_args!(
            "{duration_s:.4} s are only {periods:.1} periods of the fitted natural frequency ({natural_hz:.4} Hz); \
             at least one training record must have {FEWEST_PERIODS} periods. Record for longer, or, for a stand \
             that turns freely, use \"identify runup\""
        ),
    )
    .at(&record.source))
}

/// Refuses channels of two clocks, and a measured channel that comes long before the applied one.
fn refuse_shifted(case: &Case, alignment: &Alignment) -> Result<(), Failure> {
    let [as_given, error] = alignment.errors;
    let (shift, train) = (alignment.shift, &case.records.train);
    let text = if shift.per_s != 0.0 && error < TWO_CLOCKS * as_given {
        two_clocks(train, alignment)
    } else if shift.late_s < 0.0 && error < SHIFTED * as_given {
        too_early(&train[0], shift, as_given, error)
    } else {
        return Ok(());
    };
    Err(Failure::failed(ErrorCode::UnsuitableRecord, text).at(&train[0].source))
}

/// Weighs a shift of the channels against the effects that were found. `training` are the records with an input of limited band,
/// beside which effects may have been found with another one.
pub fn weigh_shift(
    found: &SearchState,
    training: &Records,
    alignment: &Alignment,
    threads: usize,
) -> Option<ShiftWarning> {
    let (records, after, shift) = (&found.records, &found.after, alignment.shift);
    let first = &records.train[0];
    let [as_given, error] = alignment.errors;
    if shift.per_s != 0.0 {
        let explains = error < TWO_CLOCKS * as_given;
        return explains.then(|| ShiftWarning {
            warning: Warning::new("two-clocks", two_clocks(&records.train, alignment)),
            outdoes: true,
        });
    }
    let effects = after.effect_names();
    if shift.late_s > 0.0 && effects.contains(&"time-delay") {
        return None;
    }
    let models = [records, training];
    let models = models.map(|records| alignment.instead_of(after, records, threads));
    let models = models.into_iter().flatten();
    let shifted = models.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))?;
    let whole = RelativeTo::of(&records.train);
    let count: usize = records.train.iter().map(StandRecord::count).sum();
    // The shift is one more parameter.
    let criterion = shifted.criterion() + (count as f64).ln();
    // A low-pass is a lag, too, and usually the better one.
    let has_lag = shift.late_s > 0.0 && effects.contains(&"recorder-lowpass");
    let is_less = !has_lag || shifted.train_rms() < MUCH_LESS * after.train_rms();
    if is_less && criterion < after.criterion() - BETTER {
        let [before, after] = [&found.before, &shifted].map(|model| whole.error(model));
        let text = match shift.late_s > 0.0 {
            true => too_late(first, shift, before, after),
            false => too_early(first, shift, before, after),
        };
        return Some(ShiftWarning {
            warning: Warning::new("shift-explains-more", text),
            outdoes: true,
        });
    }
    let [after, shifted] = [after, &shifted].map(|model| whole.error(model));
    if effects.is_empty() || shift.late_s > 0.0 || shifted > AS_GOOD * after {
        return None;
    }
    let text = format!(
        "an applied channel that is late by {} explains the training records about as well as {} ({} of error left, against \
         {}): check that one recorder takes both channels, with the same filters",
        stated(-shift.late_s, first.rate_hz()),
        effects.join(" and "),
        relative(shifted, 3),
        relative(after, 3),
    );
    Some(ShiftWarning {
        warning: Warning::new("shift-or-effect", text),
        outdoes: false,
    })
}

/// What a shift of the channels explains.
pub struct ShiftWarning {
    pub warning: Warning,
    /// Whether it explains the records better than the effects that were found.
    pub outdoes: bool,
}

/// A shift of the channels that lowers the error of the plain stand, where effects were found that resemble one, or something is
/// left.
pub fn find_shift(case: &Case, context: &FitContext, found: &SearchState) -> Option<Alignment> {
    let resembles = found.after.effect_names().contains(&"second-mode");
    if !resembles && !remains(&found.after, &found.tests, found.noise_floor) {
        return None;
    }
    let as_given = relative_error(context, &case.records.train);
    (as_given >= NOTABLE_ERROR)
        .then(|| Alignment::find(case, context, as_given))
        .flatten()
}

/// The rms of measured records, about their means.
struct RelativeTo(f64);

impl RelativeTo {
    fn of(records: &[StandRecord]) -> Self {
        let power = |r: &StandRecord| {
            let measured = without_mean(r.measured_in_range());
            dot(&measured, &measured)
        };
        let count: usize = records.iter().map(StandRecord::count).sum();
        Self((records.iter().map(power).sum::<f64>() / count as f64).sqrt())
    }

    fn error(&self, model: &ScoredModel) -> f64 {
        model.train_rms() / self.0
    }
}

/// A shift in samples and in ms.
fn stated(shift_s: f64, rate_hz: f64) -> String {
    let samples = rounded(shift_s * rate_hz, 3);
    let plural = if samples == "1" { "" } else { "s" };
    format!(
        "{samples} sample{plural} ({} ms)",
        rounded(1e3 * shift_s, 3)
    )
}

fn too_early(record: &StandRecord, shift: Shift, as_given: f64, error: f64) -> String {
    format!(
        "the applied channel comes late, by {}: a plain stand has an error of {}, and of {} with the applied channel \
         shifted back by that; no stand answers before it is driven. Record both channels with one recorder and the same \
         filters, or move the applied column up by that many rows",
        stated(-shift.late_s, record.rate_hz()),
        relative(as_given, 2),
        relative(error, 2),
    )
}

fn too_late(record: &StandRecord, shift: Shift, as_given: f64, error: f64) -> String {
    format!(
        "the measured channel comes late, by {}: a plain stand has an error of {}, and of {} with that taken out, which no \
         effect of the list reaches; declare the lag as [recorder] delay = \"{} ms\" in the stand file",
        stated(shift.late_s, record.rate_hz()),
        relative(as_given, 2),
        relative(error, 2),
        rounded(1e3 * shift.late_s, 4),
    )
}

fn two_clocks(train: &[StandRecord], alignment: &Alignment) -> String {
    let shift = alignment.shift;
    let record = longest(train).map_or(&train[0], |(record, _)| record);
    let rate_hz = record.rate_hz();
    let end_s = record.measured.len() as f64 / rate_hz;
    let [as_given, error] = alignment.errors.map(|e| relative(e, 2));
    let late = |shift_s: f64| {
        let side = if shift_s < 0.0 { "early" } else { "late" };
        format!("{} {side}", stated(shift_s.abs(), rate_hz))
    };
    format!(
        "the two channels have different clocks: against what the applied channel causes, the measured one is {} at the start \
         and {} at the end, a difference of {} ppm; a plain stand has an error of {as_given}, and of {error} with that \
         taken out; record both channels with one clock, or resample one of them onto the other's",
        late(shift.late_s),
        late(shift.late_s + shift.per_s * end_s),
        rounded(1e6 * shift.per_s, 3),
    )
}

/// Whether no training record has enough periods of the fitted natural frequency.
pub fn is_short(case: &Case, context: &FitContext) -> bool {
    let longest = longest(&case.records.train);
    longest.is_some_and(|(_, duration_s)| duration_s * context.plain.natural_hz < FEWEST_PERIODS)
}

/// The longest training record and its duration in s.
fn longest(train: &[StandRecord]) -> Option<(&StandRecord, f64)> {
    let longest = train.iter().max_by_key(|r| r.count())?;
    Some((longest, longest.count() as f64 / longest.rate_hz()))
}

/// Refuses a measured channel that a declared gain turns upside down or makes many times too large or too small.
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
    Err(Failure::failed(
        ErrorCode::UnsuitableRecord,
        format_args!(
            "{}: the measured torque {what}: a stand fitted to it as it is has an error of {}, one with that factor {}; \
         {remedy}",
            train[0].source,
            relative(as_given, 2),
            relative(scaled, 2)
        ),
    ))
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
    Err(Failure::failed(
        ErrorCode::UnsuitableRecord,
        format_args!(
            "the channels look swapped: a stand from --applied to --measured has an error of {}, one from \
             --measured to --applied {}; exchange the two",
            relative(as_given, 2),
            relative(the_other_way, 2)
        ),
    )
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

/// Rms error of the plain stand of a context on records, over their rms.
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
        let nuisance = record.nuisance(&plain.mode(), &NuisanceTerms::NONE, None);
        nuisance.clear(&mut residual);
        let measured = without_mean(measured);
        error += dot(&residual, &residual);
        whole += dot(&measured, &measured);
    }
    (error / whole).sqrt()
}

/// The plain stands fitted to training and to held-out records alone, where no common one fits both but each has its
/// own.
pub fn plain_stands_apart(before: &ScoredModel) -> Option<[PlainStand; 2]> {
    let train = before.fitted.stand();
    let common = &before.fitted.structure.context;
    let records: Vec<StandRecord> = before.compared.iter().map(|r| r.record.clone()).collect();
    let alone = find_plain(common, Some(train), &records).ok()?;
    let error_alone = relative_error(&alone, &records);
    let is_apart = error_alone < APART * relative_error(&common.at(train), &records);
    is_apart.then_some([train, alone.plain])
}
