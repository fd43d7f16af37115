//! What a recorder stored: its channels, each with its own samples, unit and time axis.
//!
//! Whatever the format and dialect of a file, this is what comes out of it. Nothing is repaired:
//! samples and stamps are as read, cells that hold no number are `NaN` and listed with their lines.

mod aligned;
mod all_samples;
mod axis;
mod block;
mod checkpoints;
mod choice;
mod fill;
mod first_samples;
pub(crate) mod formats;
mod joined;
mod memory_stream;
mod message_stream;
mod messages;
pub mod moment;
mod progress;
mod range;
mod room;
mod spool;
mod stamps;
mod stream;
pub mod text;
mod uniform;
mod validator;

use std::io::{Cursor, Read};

use schemars::JsonSchema;
use serde::Serialize;

use crate::failure::{ErrorCode, Failure};
use crate::io::{ChannelChoice, HEAD, Input, Reading};
use crate::unit::NamedUnit;
use crate::warning::Warning;

pub(crate) use aligned::{AlignedChannel, AlignedChannels, resampled};
pub use all_samples::AllSamples;
pub(crate) use axis::without_rounding;
pub use axis::{REVERSED, RateFrom, TimeAxis, falls, seconds_assumed, typical_step};
pub(crate) use block::Block;
pub(crate) use choice::{Selection, contradicted, unit_of};
pub use fill::FilledSpan;
pub(crate) use memory_stream::{check_cells, check_holes, check_size};
pub(crate) use message_stream::MessageOrigin;
pub(crate) use messages::times as message_times;
pub(crate) use spool::Spool;
pub(crate) use stamps::{COARSE_STAMPS, StampGrid, is_uniform, rates_of, same_stamps};
pub(crate) use stream::ChannelStream;
pub(crate) use uniform::{UniformRecord, UniformStream};
pub(crate) use validator::{StreamSummary, StreamValidator};

/// A file's content.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name of the file, for people.
    pub source: String,
    /// `csv` for any text, `mcap`, `wav`, `uff`, `mat`, `tdms`.
    pub format: &'static str,
    /// How it is written, for people: `LabVIEW LVM, tab-separated, decimal point, 3 segments`.
    pub dialect: String,
    /// What the head of the file says besides, as pairs of key and value.
    pub details: Vec<(String, String)>,
    /// All channels, in the order of the file; of several segments, those of the first one first.
    pub channels: Vec<Channel>,
    /// The segments, if the file has more than one.
    pub segments: Vec<Segment>,
    /// What a user should know about how it was read.
    pub warnings: Vec<Warning>,
    /// What was announced or begun, but is not there.
    pub lost: Option<Warning>,
}

impl Recording {
    /// Nothing yet, of a format.
    #[must_use]
    pub fn empty(format: &'static str, source: String) -> Self {
        Self {
            source,
            format,
            dialect: String::new(),
            details: Vec::new(),
            channels: Vec::new(),
            segments: Vec::new(),
            warnings: Vec::new(),
            lost: None,
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
    /// Its date and time: in ISO 8601 where unambiguous, otherwise as written.
    #[serde(rename = "start_time")]
    pub start_text: Option<String>,
}

/// One channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Its name, without the unit.
    pub name: String,
    /// Its heading as written, or `column N`.
    pub heading: String,
    /// Its unit, if it is known to torqcomp.
    pub unit: Option<NamedUnit>,
    /// Its unit as written, known or not.
    pub unit_text: Option<String>,
    /// Samples as written; `NaN` where there was no number.
    pub samples: Vec<f64>,
    /// The cells that held no number, in order.
    pub holes: Vec<Hole>,
    /// How its samples lie in time.
    pub axis: TimeAxis,
    /// The segment it belongs to, from 0, if there are several.
    pub segment: Option<usize>,
    /// Stretches of samples that were filled in.
    pub filled: Vec<FilledSpan>,
    /// Whether it is marked as a result of `compensate`.
    pub is_compensated: bool,
}

/// A cell among the samples that holds no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hole {
    /// Its place among the samples, from 0.
    pub index: usize,
    /// Its line in the file, from 1 (0 where there are no lines).
    pub line: usize,
    /// What stands there.
    pub what: HoleKind,
}

/// What stands in place of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HoleKind {
    /// The row ends before the cell.
    Missing,
    /// Nothing.
    Empty,
    /// NaN, infinity, overflow.
    NonFinite,
    /// A number with which instruments say that they have none: 9.91e37, ±9.9e37.
    InstrumentsMark,
    /// A text.
    Text,
}

/// Reads a recording of any format and dialect as a whole into memory: eight bytes for each number in it. Of an MCAP file that is the only number in it.
///
/// # Errors
/// If the file cannot be read, is no recording, or leaves open how it is to be read.
pub fn read(input: &Input, reading: &Reading) -> Result<Recording, Failure> {
    Recording::read(input, &[ChannelChoice::default()], reading)
}

/// Reads bytes of a format that is neither text of a table nor MCAP; `None` if they begin as none of these. `source` is
/// the name for people.
#[must_use]
pub fn read_other_format(
    source: &str,
    bytes: &[u8],
    reading: &Reading,
) -> Option<Result<Recording, Failure>> {
    let format = formats::of(bytes)?;
    Some(format.read(source, Box::new(Cursor::new(bytes.to_vec())), reading))
}

impl Recording {
    /// All channels of a text; of an MCAP file those that are chosen.
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

    /// The channels of a text, of long tables only about so many numbers; and of channels that have more, what all of
    /// their samples come to.
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

    /// Asks whether the table is transposed, if it has a few rows and hundreds of columns.
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

    /// What was lost, and what else should be known.
    pub(crate) fn all_warnings(&self) -> Vec<Warning> {
        self.lost.iter().chain(&self.warnings).cloned().collect()
    }
}

/// Refuses what only texts have.
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

/// Refuses what only WAV files have.
fn refuse_for_tables(reading: &Reading) -> Result<(), Failure> {
    let given = [("--full-scale", reading.full_scale.is_some())];
    refuse(
        &given,
        "the input is a text, whose numbers are values; give their unit with --unit",
    )
}

/// Refuses what only messages have.
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
        &format!("the input is no MCAP file; choose with {flag} NAME"),
    )
}

fn refuse(given: &[(&str, bool)], why: &str) -> Result<(), Failure> {
    match given.iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) => Err(Failure::usage(
            ErrorCode::ConflictingArguments,
            format_args!("{flag} does not apply: {why}"),
        )),
        None => Ok(()),
    }
}
