//! A shift between the channels of records, or between their clocks, compared with effects as an
//! explanation.

use super::alignment::{Alignment, Shift};
use super::record::StandRecord;
use super::records::Records;
use super::refuse::{LARGE_ERROR, longest, relative_error};
use super::residual_tests::without_mean;
use super::score::ScoredModel;
use super::structure::FitContext;
use super::verdict::remains;
use super::{Case, SearchState};
use crate::failure::{ErrorCode, Failure};
use crate::print::{relative, rounded};
use crate::warning::{Warning, WarningCode};
use torqcomp_dsp::dot;

/// Relative error of the plain stand above which a shift of the channels is considered.
const NOTABLE_ERROR: f64 = 0.02;
/// Ratio of the error with aligned channels to that as given, below which they count as shifted, and as having
/// two clocks.
const SHIFTED: f64 = 0.2;
const TWO_CLOCKS: f64 = 0.5;
/// Minimum reduction of the criterion from effects to aligned channels for the shift to explain more, and ratio of the
/// errors up to which it explains as much.
const BETTER: f64 = 10.0;
const MUCH_LESS: f64 = 0.7;
const AS_GOOD: f64 = 1.05;

/// Rejects channels of two clocks, and a measured channel that is far ahead of the applied one.
pub fn refuse(case: &Case, alignment: &Alignment) -> Result<(), Failure> {
    let [as_given, error] = alignment.errors;
    let (shift, train) = (alignment.shift, &case.records.train);
    let text = if shift.per_s != 0.0 && error < TWO_CLOCKS * as_given {
        two_clocks(train, alignment)
    } else if shift.late_s < 0.0 && error < SHIFTED * as_given {
        too_early(&train[0], shift, as_given, error)
    } else {
        return Ok(());
    };
    Err(ErrorCode::UnsuitableRecord
        .failed(text)
        .at(&train[0].source))
}

/// Compares a shift of the channels with the effects found. `smooth` are the records with band-limited input, if the
/// effects were found with another one.
pub fn weigh(
    found: &SearchState,
    smooth: Option<&Records>,
    alignment: &Alignment,
    threads: usize,
) -> Option<ShiftWarning> {
    let (records, after, shift) = (&found.records, &found.after, alignment.shift);
    let first = &records.train[0];
    let [as_given, error] = alignment.errors;
    if shift.per_s != 0.0 {
        let explains = error < TWO_CLOCKS * as_given;
        return explains.then(|| ShiftWarning {
            warning: WarningCode::TwoClocks.warning(two_clocks(&records.train, alignment)),
            outdoes: true,
        });
    }
    let effects = after.effect_names();
    if shift.late_s > 0.0 && effects.contains(&"time-delay") {
        return None;
    }
    let all = std::iter::once(records).chain(smooth);
    let models = all.filter_map(|records| alignment.instead_of(after, records, threads));
    let shifted = models.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))?;
    let whole = RelativeTo::of(&records.train);
    let count: usize = records.train.iter().map(StandRecord::count).sum();
    // The shift is one more parameter.
    let criterion = shifted.criterion() + (count as f64).ln();
    // A low-pass is a lag, too, and usually the better explanation.
    let has_lag = shift.late_s > 0.0 && effects.contains(&"recorder-lowpass");
    let is_less = !has_lag || shifted.train_rms() < MUCH_LESS * after.train_rms();
    if is_less && criterion < after.criterion() - BETTER {
        let [before, after] = [&found.before, &shifted].map(|model| whole.error(model));
        let text = match shift.late_s > 0.0 {
            true => too_late(first, shift, before, after),
            false => too_early(first, shift, before, after),
        };
        return Some(ShiftWarning {
            warning: WarningCode::ShiftExplainsMore.warning(text),
            outdoes: true,
        });
    }
    let [after, shifted] = [after, &shifted].map(|model| whole.error(model));
    if effects.is_empty() || shift.late_s > 0.0 || shifted > AS_GOOD * after {
        return None;
    }
    let text = format!(
        "a lag of {} of the applied channel explains the training records about as well as {} (remaining error {}, \
         against {}): check that one recorder takes both channels, with the same filters",
        stated(-shift.late_s, first.rate_hz()),
        effects.join(" and "),
        relative(shifted, 3),
        relative(after, 3),
    );
    Some(ShiftWarning {
        warning: WarningCode::ShiftOrEffect.warning(text),
        outdoes: false,
    })
}

/// Explanation by a shift of the channels.
pub struct ShiftWarning {
    pub warning: Warning,
    /// Whether it explains the records better than the effects found.
    pub outdoes: bool,
}

/// A shift of the channels that reduces the error of the plain stand, if effects were found that resemble one, or a
/// residual remains.
pub fn find(case: &Case, context: &FitContext, found: &SearchState) -> Option<Alignment> {
    if case.records.are_free() {
        return None;
    }
    let resembles = found.after.effect_names().contains(&"second-mode");
    if !resembles && !remains(&found.after, &found.tests, found.noise_floor) {
        return None;
    }
    let as_given = relative_error(context, &case.records.train);
    // Above that it has already been tried.
    (NOTABLE_ERROR..LARGE_ERROR)
        .contains(&as_given)
        .then(|| Alignment::find(case, context, as_given))
        .flatten()
}

/// RMS of measured records about their means.
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

/// A shift in samples and in ms, as text.
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
        "the applied channel lags by {}: a plain stand has an error of {}, and of {} with the lag removed; no stand \
         responds before it is driven. Record both channels with one recorder and the same filters, or move the \
         applied column up by that many rows",
        stated(-shift.late_s, record.rate_hz()),
        relative(as_given, 2),
        relative(error, 2),
    )
}

fn too_late(record: &StandRecord, shift: Shift, as_given: f64, error: f64) -> String {
    format!(
        "the measured channel lags by {}: a plain stand has an error of {}, and of {} with the lag removed, less than \
         with any effect of the list; declare it as [recorder] delay = \"{} ms\" in the stand file",
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
        "the two channels have different clocks: relative to the response to the applied channel, the measured one is \
         {} at the start and {} at the end, a difference of {} ppm; a plain stand has an error of {as_given}, and of \
         {error} with the drift removed; record both channels with one clock, or resample one of them onto the \
         other's",
        late(shift.late_s),
        late(shift.late_s + shift.per_s * end_s),
        rounded(1e6 * shift.per_s, 3),
    )
}
