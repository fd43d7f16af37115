//! Streaming of a channel of a recording that was read as a whole.

use std::sync::Arc;

use super::block::{Block, BlockSource};
use super::stamps::StampGrid;
use super::stream::ChannelStream;
use super::text::BRIDGE;
use super::{Channel, HoleKind, RateFrom, Recording, TimeAxis};
use crate::failure::{ErrorCode, Failure, RowKind};
use crate::io::{ChannelChoice, Reading};
use crate::print::plural;
use crate::warning::Warning;

/// Number of samples per block.
const SAMPLES: usize = 1 << 13;

impl ChannelStream {
    /// The selected channel of a recording.
    ///
    /// # Errors
    /// If there is no such channel, its rate is unknown, or a cell is not numeric.
    pub(super) fn of_recording(
        mut recording: Recording,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let source = recording.source.clone();
        let place = recording.place(choice)?;
        recording.fill(place, reading)?;
        let selection = recording.select_at(place, choice, reading)?;
        let channel = selection.channel;
        check_cells(channel, reading)?;
        let stamps = used_stamps(channel, reading);
        let time = match &stamps {
            Some(stamps) => {
                let heading = channel.axis.stamps_in.as_deref().unwrap_or("time");
                let grid = StampGrid {
                    origin_ns: channel.axis.origin_ns,
                    ..StampGrid::of_seconds()
                };
                TimeAxis::of_stream(heading, grid, stamps, &[], reading)?
            }
            None if reading.rate_hz.is_some() => TimeAxis {
                start: Some(selection.start),
                ..TimeAxis::given(selection.rate_hz, None)
            },
            None => TimeAxis {
                stamps_s: None,
                start: Some(selection.start),
                ..channel.axis.clone()
            },
        };
        if !reading.any_steps {
            time.grid.iter().try_for_each(StampGrid::check_missing)?;
            time.check_rounding()?;
        }
        let mut warnings = recording.warnings.clone();
        warnings.extend(selection.warnings.iter().cloned());
        Ok(Self {
            dialect: recording.dialect.clone(),
            rate_hz: time.rate_hz.unwrap_or(selection.rate_hz),
            start: time.start.unwrap_or_default(),
            channel: Channel {
                filled: channel.filled.clone(),
                ..selection.on_axis(time, Vec::new())
            },
            origin: None,
            any_steps: reading.any_steps,
            warnings,
            blocks: Box::new(MemoryBlocks {
                samples: channel.samples.clone(),
                stamps,
                given: 0,
                lost: recording.lost.clone(),
            }),
            text: None,
            source,
        })
    }
}

/// Stamps of a channel, if its samples are placed by them.
pub(super) fn used_stamps(channel: &Channel, reading: &Reading) -> Option<Arc<Vec<f64>>> {
    let by_stamps = matches!(channel.axis.rate_from, RateFrom::Stamps(_) | RateFrom::None);
    let wanted = reading.resample || (by_stamps && reading.rate_hz.is_none());
    channel.axis.stamps_s.clone().filter(|_| wanted)
}

/// Rejects non-numeric cells among the samples, and among the stamps if these are used.
pub(crate) fn check_cells(channel: &Channel, reading: &Reading) -> Result<(), Failure> {
    refuse_holes(channel, used_stamps(channel, reading).is_some(), BRIDGE)
}

/// Rejects non-numeric samples of a table without a time, in which none is bridged.
pub(crate) fn check_holes(channel: &Channel) -> Result<(), Failure> {
    refuse_holes(channel, false, "correct or delete the row")
}

/// Maximum magnitude of a sample; the squares of larger ones overflow.
const LARGEST: f64 = 1e150;

/// Rejects samples beyond the range of any instrument.
pub(crate) fn check_size(channel: &Channel) -> Result<(), Failure> {
    let Some(row) = channel.samples.iter().position(|v| v.abs() > LARGEST) else {
        return Ok(());
    };
    Err(ErrorCode::InvalidSample.failed(format_args!(
        "sample {} of \"{}\" is {:e}, beyond any instrument; correct or exclude it",
        row + 1,
        channel.name,
        channel.samples[row]
    )))
}

fn refuse_holes(channel: &Channel, by_stamps: bool, remedy: &str) -> Result<(), Failure> {
    let of_time = channel.axis.holes.iter().filter(|_| by_stamps);
    let of_time = of_time.filter(|hole| hole.index < channel.samples.len());
    let stamps_in = channel.axis.stamps_in.as_deref().unwrap_or("time");
    let all = of_time.map(|hole| (hole, stamps_in));
    let mut all = all.chain(
        channel
            .holes
            .iter()
            .map(|hole| (hole, channel.name.as_str())),
    );
    let count = all.clone().count();
    let first = all.by_ref().min_by_key(|(hole, _)| hole.index);
    let Some((hole, name)) = first else {
        return Ok(());
    };
    let what = match hole.what {
        HoleKind::Missing => "is missing: the line ends before it",
        HoleKind::Empty => "is empty",
        HoleKind::NonFinite => "is not a finite number",
        HoleKind::InstrumentsMark => {
            "is 9.91e37 or \u{b1}9.9e37, which instruments write for no value or over range"
        }
        HoleKind::OverRange => "is over range: the peaks of the input are lost",
        HoleKind::Text => "is text, expected a number",
    };
    let refused = ErrorCode::InvalidSample.failed(format_args!(
        "the value of \"{name}\" {what} ({} in all); {remedy}",
        plural(count, "such cell")
    ));
    // Only texts have lines.
    Err(match hole.line {
        0 => refused.sample(hole.index + 1),
        line => refused.line(line),
    })
}

/// Samples in memory.
struct MemoryBlocks {
    samples: Vec<f64>,
    stamps: Option<Arc<Vec<f64>>>,
    /// Number of samples output so far.
    given: usize,
    lost: Option<Warning>,
}

impl BlockSource for MemoryBlocks {
    fn next(&mut self, block: &mut Block) -> Result<bool, Failure> {
        let rows = &mut block.rows;
        rows.clear();
        let end = (self.given + SAMPLES).min(self.samples.len());
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

    fn row_kind(&self) -> RowKind {
        RowKind::Sample
    }
}
