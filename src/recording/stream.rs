//! One channel of a recording, open for reading block by block, whatever the format of the file.

use std::io::{Cursor, Read};

use super::block::BlockSource;
use super::message_stream::MessageOrigin;
use super::validator::{StreamValidator, TextRows};
use super::{TimeAxis, table, text};
use crate::failure::Failure;
use crate::io::csv::RowPlan;
use crate::io::{ChannelChoice, Input, Reading};
use crate::unit::NamedUnit;
use crate::warning::Warning;

/// Bytes that are read before the format is known.
const HEAD: u64 = 1 << 16;
/// Bytes that tell whether a text is a plain table.
const FRONT: usize = 1 << 14;

/// A channel of a recording, chosen and open for reading.
pub(crate) struct ChannelStream {
    /// Name of the file, for people.
    pub(crate) source: String,
    /// How the file is written, for people.
    pub(crate) dialect: String,
    /// Name of the channel, without the unit.
    pub(crate) name: String,
    /// Unit of its samples, if it is known.
    pub(crate) unit: Option<NamedUnit>,
    /// How its samples lie in time.
    pub(crate) time: TimeAxis,
    /// Samples a second.
    pub(crate) rate_hz: f64,
    /// Time of the first sample: its stamp, or where the file or the user says it starts.
    pub(crate) start_s: f64,
    /// Of messages, what a copy of their file needs to know.
    pub(crate) origin: Option<MessageOrigin>,
    /// Whether irregular stamps are only said.
    pub(super) any_steps: bool,
    /// What is known to be odd before reading.
    pub(super) warnings: Vec<Warning>,
    pub(super) blocks: Box<dyn BlockSource>,
    /// How the rows are written, if they are of text.
    pub(super) text: Option<TextRows>,
}

impl ChannelStream {
    /// Opens a file, finds the channel and its time axis.
    ///
    /// # Errors
    /// If the file cannot be read, holds no recording, or leaves open what is to be read.
    pub(crate) fn open(
        input: &Input,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let name = input.name();
        let mut bytes = input.open()?;
        let unreadable = |error| Failure::failed(format_args!("{name}: cannot be read: {error}"));
        let mut head = Vec::new();
        let start = (&mut bytes).take(HEAD).read_to_end(&mut head);
        let complete = start.map_err(unreadable)? < HEAD as usize;
        if head.starts_with(::mcap::MAGIC) {
            super::refuse_for_messages(reading)?;
            let bytes = Box::new(Cursor::new(head).chain(bytes));
            return Self::of_messages(input, bytes, choice, reading);
        }
        super::refuse_for_text(choice, reading)?;
        let front = &head[..head.len().min(FRONT)];
        let is_whole = complete && front.len() == head.len();
        if complete && head.is_empty() || text::is_plain(front, is_whole, reading) {
            let bytes = Box::new(Cursor::new(head).chain(bytes));
            return table::open(input, bytes, choice, reading).map_err(|f| f.at(&name));
        }
        bytes.read_to_end(&mut head).map_err(unreadable)?;
        let recording = text::read(&name, head, reading).map_err(|f| f.at(&name))?;
        Self::of_recording(recording, choice, reading)
    }

    /// Splits the stream into the parts that run side by side: getting blocks of at least so many
    /// samples, reading their text, and looking at them in order.
    pub(crate) fn into_parts(
        mut self,
        fewest: usize,
    ) -> (Box<dyn BlockSource>, Option<RowPlan>, StreamValidator) {
        self.blocks.set_fewest(fewest);
        let plan = self.text.as_ref().map(|text| text.plan);
        let validator = StreamValidator::new(
            self.source,
            self.blocks.row_name(),
            self.text,
            self.time,
            self.warnings,
            self.any_steps,
        );
        (self.blocks, plan, validator)
    }
}
