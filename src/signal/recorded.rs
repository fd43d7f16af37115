//! A signal out of a recording that was read whole, because its dialect is no plain table.

use std::sync::Arc;

use super::{Feed, RowSource, Signal};
use crate::failure::Failure;
use crate::io::csv::{Column, Options, Rows, Stamps, TimeAxis, TimeSource};
use crate::recording::{Channel, HoleKind, RateFrom, Recording};
use crate::warning::Warning;

/// Samples handed on at once.
const ROWS: usize = 1 << 13;

impl Signal {
    /// The channel of a recording that the options name.
    ///
    /// # Errors
    /// If there is no such channel, its rate is unknown, or a cell of it holds no number.
    pub fn of_recording(recording: Recording, options: &Options) -> Result<Self, Failure> {
        let source = recording.source.clone();
        let selection = recording.select(options).map_err(|f| f.at(&source))?;
        let channel = selection.channel;
        check_holes(channel).map_err(|failure| failure.at(&source))?;
        let stamps = used_stamps(channel, options);
        let time = match &stamps {
            Some(stamps) => TimeAxis::of_stamps(described(channel), stamps, options)?,
            None => TimeAxis {
                rate_hz: selection.rate_hz,
                source: match &channel.axis.rate_from {
                    RateFrom::Header(words) if options.rate_hz.is_none() => TimeSource::Header {
                        words: words.clone(),
                        start_s: selection.start_s,
                    },
                    _ => TimeSource::Given,
                },
            },
        };
        Ok(Self {
            first_stamp: stamps.as_ref().and_then(|s| s.first().copied()),
            channel: Column {
                heading: channel.heading.clone(),
                name: channel.name.clone(),
                unit: selection.unit.clone(),
            },
            time,
            origin: None,
            any_steps: options.any_steps,
            warnings: recording.warnings.clone(),
            feed: Feed::Rows(Box::new(Memory {
                samples: channel.samples.clone(),
                stamps,
                given: 0,
                lost: recording.lost.clone(),
            })),
            source,
            dialect: recording.dialect,
        })
    }
}

/// The stamps of a channel, if its samples are placed by them.
fn used_stamps(channel: &Channel, options: &Options) -> Option<Arc<Vec<f64>>> {
    let by_stamps = matches!(channel.axis.rate_from, RateFrom::Stamps(_) | RateFrom::None);
    let wanted = options.resample || (by_stamps && options.rate_hz.is_none());
    channel.axis.stamps_s.clone().filter(|_| wanted)
}

fn described(channel: &Channel) -> Stamps {
    let heading = match &channel.axis.rate_from {
        RateFrom::Stamps(heading) => heading.clone(),
        _ => "time".to_owned(),
    };
    Stamps {
        heading,
        unit: "s".to_owned(),
        seconds_per_unit: 1.0,
        copied: false,
        origin_ns: 0,
    }
}

fn check_holes(channel: &Channel) -> Result<(), Failure> {
    let Some(hole) = channel.holes.first() else {
        return Ok(());
    };
    let what = match hole.what {
        HoleKind::Missing => "is missing: the line ends before it",
        HoleKind::Empty => "is empty",
        HoleKind::NonFinite => "is not a finite number",
        HoleKind::Text => "is a text, expected a number",
    };
    Err(Failure::failed(format_args!(
        "line {}: the value of \"{}\" {what} ({} such cell(s) in all); correct or remove the line{}",
        hole.line,
        channel.name,
        channel.holes.len(),
        if channel.axis.stamps_s.is_some() {
            ", and use --resample to bridge the gap"
        } else {
            ""
        }
    )))
}

/// Samples that are in memory.
struct Memory {
    samples: Vec<f64>,
    stamps: Option<Arc<Vec<f64>>>,
    /// Samples handed on so far.
    given: usize,
    lost: Option<Warning>,
}

impl RowSource for Memory {
    fn next(&mut self, rows: &mut Rows) -> Result<bool, Failure> {
        let end = (self.given + ROWS).min(self.samples.len());
        rows.values
            .extend_from_slice(&self.samples[self.given..end]);
        if let Some(stamps) = &self.stamps {
            rows.times.extend_from_slice(&stamps[self.given..end]);
        }
        let any = end > self.given;
        self.given = end;
        Ok(any)
    }

    fn finish(&mut self) -> (Option<Warning>, Vec<Warning>) {
        (self.lost.take(), Vec::new())
    }

    fn row_name(&self) -> &'static str {
        "sample"
    }
}
