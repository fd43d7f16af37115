//! Optional filling of missing samples.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::quality::broken_line::BrokenLine;

use super::memory_stream::used_stamps;
use super::{Hole, HoleKind, Recording};
use crate::failure::{ErrorCode, Failure};
use crate::io::{Fill, Reading};
use crate::print::{plural, some_of};
use crate::warning::{Warning, WarningCode};

/// Number of intervals listed in a warning.
const SAID: usize = 5;
/// Maximum number of samples filled at one place.
const LONGEST: f64 = 10_000.0;

/// A stretch of samples that were filled in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct FilledSpan {
    /// Time of the sample before it, in s.
    pub from_s: f64,
    /// Time of the sample after it, in s.
    pub to_s: f64,
    /// Samples that were filled in.
    pub samples: usize,
}

impl Recording {
    /// Fills gaps of the channel with this index, if requested, and reports which gaps a given rate ignores.
    ///
    /// # Errors
    /// If a gap is too long to be filled.
    pub(crate) fn fill(&mut self, place: usize, reading: &Reading) -> Result<(), Failure> {
        let joined = self.channels[place].joined_breaks(&self.source, reading);
        let is_new = |warning: &Warning| !self.warnings.contains(warning);
        let joined = joined.filter(is_new);
        self.warnings.extend(joined);
        let fill = match reading.fill {
            None | Some(Fill::Refuse) => return Ok(()),
            Some(fill) => fill,
        };
        let channel = &mut self.channels[place];
        let Some(rate_hz) = reading.rate_hz.or(channel.axis.rate_hz) else {
            return Ok(());
        };
        let is_stamped = used_stamps(channel, reading).is_some();
        let whole = std::mem::take(&mut channel.samples);
        let stamps = channel.axis.stamps_s.clone().filter(|_| is_stamped);
        // Rounding is not a gap: coarse stamps are replaced by those of their line.
        let on_line = stamps.as_ref().and_then(|stamps_s| {
            let places = BrokenLine::of(stamps_s)?.places(stamps_s.len()).collect();
            Some((stamps_s[0], places)) as Option<(f64, Vec<usize>)>
        });
        let time_s = |place: usize| match (&on_line, &stamps) {
            (Some((first_s, places)), _) => first_s + places[place] as f64 / rate_hz,
            (None, Some(stamps)) => stamps[place],
            (None, None) => channel.axis.start.unwrap_or_default().after_s + place as f64 / rate_hz,
        };
        let good = (0..whole.len())
            .filter(|place| whole[*place].is_finite() && time_s(*place).is_finite());
        let mut filled = Filled::default();
        for place in good {
            filled.push(time_s(place), whole[place], fill, rate_hz)?;
        }
        let origin_s = channel.axis.origin_ns as f64 * 1e-9;
        channel.samples = filled.samples;
        channel.axis.stamps_s = Some(Arc::new(filled.stamps_s)).filter(|_| is_stamped);
        channel.axis.start = filled.first_s.map(|first_s| channel.axis.moment(first_s));
        let holes = std::mem::take(&mut channel.holes);
        channel.axis.holes = Vec::new();
        let mut warning = said(&channel.name, fill, &filled.spans, |after_s| {
            channel.axis.moment(after_s).short()
        });
        warning
            .iter_mut()
            .for_each(|warning| add_marks(warning, &holes));
        let absolute = |span: FilledSpan| FilledSpan {
            from_s: span.from_s + origin_s,
            to_s: span.to_s + origin_s,
            ..span
        };
        channel.filled = filled.spans.into_iter().map(absolute).collect();
        self.warnings.extend(warning);
        Ok(())
    }
}

/// What to do about a gap of so many steps.
pub(super) fn remedy(steps: f64) -> &'static str {
    match steps > LONGEST {
        true => "that is too long to fill; use --range to select the part before or after it",
        false => "use --fill linear to fill the gap, or --range to exclude it",
    }
}

/// Adds what the cells say that were filled in.
fn add_marks(warning: &mut Warning, holes: &[Hole]) {
    let texts = [
        (
            HoleKind::InstrumentsMark,
            "read 9.91e37 or \u{b1}9.9e37, which instruments write for no value or over range",
        ),
        (
            HoleKind::OverRange,
            "over range: the peaks of the input are lost",
        ),
    ];
    for (kind, text) in texts {
        let count = holes.iter().filter(|hole| hole.what == kind).count();
        if count > 0 {
            warning.message += &format!("; {} {text}", plural(count, "cell"));
        }
    }
}

/// A record without gaps, under construction.
#[derive(Default)]
struct Filled {
    samples: Vec<f64>,
    stamps_s: Vec<f64>,
    first_s: Option<f64>,
    spans: Vec<FilledSpan>,
}

impl Filled {
    fn push(&mut self, time_s: f64, value: f64, fill: Fill, rate_hz: f64) -> Result<(), Failure> {
        self.first_s.get_or_insert(time_s);
        if let (Some(&before_s), Some(&before)) = (self.stamps_s.last(), self.samples.last()) {
            let steps = ((time_s - before_s) * rate_hz).round();
            if steps > LONGEST {
                return Err(ErrorCode::IrregularTime.failed(format_args!(
                    "{steps} samples are missing at one place, more than --fill bridges ({LONGEST}); cut the \
                     record there with --range"
                )));
            }
            for step in 1..steps.max(1.0) as usize {
                let part = step as f64 / steps;
                self.stamps_s.push(before_s + part * (time_s - before_s));
                self.samples.push(match fill {
                    Fill::Hold => before,
                    _ => before + part * (value - before),
                });
            }
            if steps > 1.0 {
                self.spans.push(FilledSpan {
                    from_s: before_s,
                    to_s: time_s,
                    samples: steps as usize - 1,
                });
            }
        }
        self.stamps_s.push(time_s);
        self.samples.push(value);
        Ok(())
    }
}

/// Note about the filled intervals.
fn said(
    name: &str,
    fill: Fill,
    spans: &[FilledSpan],
    time: impl Fn(f64) -> String,
) -> Option<Warning> {
    let count: usize = spans.iter().map(|span| span.samples).sum();
    let how = match fill {
        Fill::Hold => "the last preceding value",
        _ => "straight lines",
    };
    let each = spans.iter();
    let each = each.map(|span| format!("{} to {}", time(span.from_s), time(span.to_s)));
    let shown = some_of(each, spans.len(), SAID);
    (count > 0).then(|| {
        WarningCode::Filled.warning(format!(
            "\"{name}\": {} at {} filled with {how}: {shown}; do not trust the result there",
            plural(count, "missing sample"),
            plural(spans.len(), "place"),
        ))
    })
}
