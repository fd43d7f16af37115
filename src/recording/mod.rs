//! Content of a recording: its channels, each with its own samples, unit and time axis.
//!
//! This is the result for every format and dialect. Nothing is repaired: samples and stamps are as
//! read, non-numeric cells are `NaN` and listed with their lines.

mod aligned;
mod all_samples;
mod arrival_blocks;
mod axis;
mod block;
mod checkpoints;
mod choice;
mod fill;
mod first_samples;
pub(crate) mod formats;
mod joined;
mod loads;
mod memory_stream;
mod message_stream;
mod messages;
pub mod moment;
mod progress;
mod range;
mod rollover;
mod room;
mod shared_stamps;
mod spool;
mod stamps;
mod stream;
pub mod text;
mod uneven;
mod uniform;
mod validator;

use std::io::{Cursor, Read};

use schemars::JsonSchema;
use serde::Serialize;

use crate::failure::{ErrorCode, Failure};
use crate::io::{ChannelChoice, HEAD, Input, Reading};
use crate::unit::NamedUnit;
use crate::warning::Warning;

pub(crate) use aligned::AlignedChannels;
pub use all_samples::AllSamples;
pub(crate) use arrival_blocks::ArrivalBlocks;
pub(crate) use axis::FEWEST_UNLIKE;
pub(crate) use axis::no_stamps;
pub(crate) use axis::without_rounding;
pub use axis::{REVERSED, RateFrom, TimeAxis, falls, seconds_assumed, typical_step};
pub(crate) use block::Block;
pub(crate) use choice::{Selection, contradicted, unit_of};
pub use fill::FilledSpan;
pub(crate) use first_samples::FirstSamples;
pub(crate) use memory_stream::{check_cells, check_holes, check_size};
pub(crate) use message_stream::MessageOrigin;
pub(crate) use messages::times as message_times;
pub(crate) use rollover::rolled_over;
pub(crate) use room::MemoryNeed;
pub(crate) use shared_stamps::same_stamps;
pub(crate) use spool::Spool;
pub(crate) use stamps::{COARSE_STAMPS, StampGrid, is_uniform, rates_of};
pub(crate) use stream::ChannelStream;
pub(crate) use uneven::advice_for_uneven;
pub(crate) use uniform::{UniformRecord, UniformStream, doubts};
pub(crate) use validator::{StreamSummary, StreamValidator};

/// A file's content.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// Name of the file, for messages.
    pub source: String,
    /// `csv` for any text, `mcap`, `wav`, `uff`, `mat`, `tdms`.
    pub format: &'static str,
    /// Description of the encoding, for messages:
    /// `LabVIEW LVM, tab-separated, decimal point, 3 segments`.
    pub dialect: String,
    /// Further header entries, as pairs of key and value.
    pub details: Vec<(String, String)>,
    /// All channels, in the order of the file; with several segments, those of the first one first.
    pub channels: Vec<Channel>,
    /// The segments, if the file has more than one.
    pub segments: Vec<Segment>,
    /// Warnings about how it was read.
    pub warnings: Vec<Warning>,
    /// Announced or incomplete data that are missing.
    pub lost: Option<Warning>,
}

impl Recording {
    /// An empty recording of a format.
    pub fn empty(format: &'static str, source: String) -> Self {
        Self {
            source,
            format,
            ..Self::default()
        }
    }
}

/// A part of a file that was recorded on its own: after a trigger, or after a pause.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Segment {
    /// Display name: `segment 2`.
    pub name: String,
    /// Start after the first segment, in s; `null` if the file does not say.
    pub start_s: Option<f64>,
    /// Date and time of the start: in ISO 8601 where unambiguous, otherwise as written.
    #[serde(rename = "start_time")]
    pub start_text: Option<String>,
}

/// One channel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Channel {
    /// Its name, without the unit.
    pub name: String,
    /// Its heading as written, or `column N`.
    pub heading: String,
    /// Its unit, if known.
    pub unit: Option<NamedUnit>,
    /// Its unit as written, known or not.
    pub unit_text: Option<String>,
    /// Samples as written; `NaN` where there was no number.
    pub samples: Vec<f64>,
    /// Non-numeric cells, in order.
    pub holes: Vec<Hole>,
    /// Time axis.
    pub axis: TimeAxis,
    /// Its segment, from 0, if there are several.
    pub segment: Option<usize>,
    /// Intervals of filled samples.
    pub filled: Vec<FilledSpan>,
    /// Whether it is marked as a result of `compensate`.
    pub is_compensated: bool,
}

/// A non-numeric cell among the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hole {
    /// Index among the samples, from 0.
    pub index: usize,
    /// Line in the file, from 1 (0 if there are no lines).
    pub line: usize,
    /// Content of the cell.
    pub what: HoleKind,
}

/// Content of a cell instead of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HoleKind {
    /// The row ends before the cell.
    Missing,
    /// Empty.
    Empty,
    /// NaN, infinity, overflow.
    NonFinite,
    /// A number that instruments use for a missing value: 9.91e37, ±9.9e37.
    InstrumentsMark,
    /// A text that says that the input exceeded the range: `∞`, `OVLD`.
    OverRange,
    /// Text.
    Text,
}

/// Reads a recording of any format and dialect completely into memory, with eight bytes per number. From an MCAP file,
/// that is the only number in it.
///
/// # Errors
/// If the file cannot be read, is not a recording, or is ambiguous.
pub fn read(input: &Input, reading: &Reading) -> Result<Recording, Failure> {
    Recording::read(input, &[ChannelChoice::default()], reading)
}

/// Reads bytes of a format other than text tables and MCAP; `None` if their start matches none of these. `source` is
/// the name for messages.
pub fn read_other_format(
    source: &str,
    bytes: &[u8],
    reading: &Reading,
) -> Option<Result<Recording, Failure>> {
    let format = formats::of(bytes)?;
    Some(format.read(source, Box::new(Cursor::new(bytes.to_vec())), reading))
}

impl Recording {
    /// All channels of a text, or the selected ones of an MCAP file.
    ///
    /// # Errors
    /// See [`read`].
    pub(crate) fn read(
        input: &Input,
        choices: &[ChannelChoice],
        reading: &Reading,
    ) -> Result<Self, Failure> {
        if input.is_mcap()? {
            refuse_for_messages(reading)?;
            return messages::read(input, choices, reading);
        }
        for choice in choices {
            refuse_for_text(choice, reading)?;
        }
        let (mut recording, _) = Self::of_text(input, reading, usize::MAX)?;
        if let Some(range) = &reading.range {
            recording.keep(range).map_err(|f| f.at(input.name()))?;
        }
        Ok(recording)
    }

    /// The channels of a text, limited to about a number of values for long tables; and for channels with more,
    /// statistics of all their samples.
    ///
    /// # Errors
    /// See [`read`].
    pub(crate) fn of_text(
        input: &Input,
        reading: &Reading,
        most: usize,
    ) -> Result<(Self, Vec<Option<AllSamples>>), Failure> {
        let (name, mut bytes) = (input.name(), progress::open(input)?);
        let mut head = Vec::new();
        let first = (&mut bytes).take(HEAD as u64).read_to_end(&mut head);
        first.map_err(|error| Failure::unreadable(&error).at(&name))?;
        let format = formats::of(&head);
        let bytes = Box::new(Cursor::new(head).chain(bytes));
        if let Some(format) = format {
            return Ok((format.read(&name, bytes, reading)?, Vec::new()));
        }
        refuse_for_tables(reading)?;
        let file = text::TextFile::open(&name, bytes, reading).map_err(|f| f.at(&name))?;
        room::look(input, &file, most)?;
        file.read_first(most).map_err(|f| f.at(&name))
    }

    /// Asks whether the table is transposed, if it has few rows and hundreds of columns.
    pub(crate) fn must_not_be_transposed(&self) -> Result<(), Failure> {
        let rows = self
            .channels
            .iter()
            .map(|channel| channel.samples.len())
            .max();
        match choice::transposed(self.channels.len(), Some(rows.unwrap_or(0))) {
            Some(question) => Err(question.at(&self.source)),
            None => Ok(()),
        }
    }

    /// Losses, and further warnings.
    pub(crate) fn all_warnings(&self) -> Vec<Warning> {
        self.lost.iter().chain(&self.warnings).cloned().collect()
    }
}

/// Rejects options that apply to texts only.
pub(crate) fn refuse_for_messages(reading: &Reading) -> Result<(), Failure> {
    let given = [
        ("--time-column", reading.time_column.is_some()),
        ("--time-unit", reading.time_unit.is_some()),
        ("--delimiter", reading.dialect.delimiter.is_some()),
        ("--decimal", reading.dialect.decimal.is_some()),
        ("--full-scale", reading.full_scale.is_some()),
    ];
    refuse(
        &given,
        "the input is an MCAP file, whose messages have time stamps",
    )
}

/// Rejects options that apply to WAV files only.
fn refuse_for_tables(reading: &Reading) -> Result<(), Failure> {
    let given = [("--full-scale", reading.full_scale.is_some())];
    refuse(
        &given,
        "the input is a text file, whose numbers are already in physical units; give their unit with --unit",
    )
}

/// Rejects options that apply to messages only.
pub(crate) fn refuse_for_text(choice: &ChannelChoice, reading: &Reading) -> Result<(), Failure> {
    let given = [
        ("--topic", reading.topic.is_some()),
        ("--field", choice.field.is_some()),
        ("--signal", choice.signal.is_some()),
        ("--time", reading.time.is_some()),
        ("--spacing", reading.spacing.is_some()),
    ];
    let flag = choice.flags.channel;
    refuse(
        &given,
        &format!("the input is not an MCAP file; choose with {flag} NAME"),
    )
}

fn refuse(given: &[(&str, bool)], why: &str) -> Result<(), Failure> {
    match given.iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) => {
            Err(ErrorCode::ConflictingArguments.usage(format_args!("{flag} does not apply: {why}")))
        }
        None => Ok(()),
    }
}
