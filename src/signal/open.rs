//! Opening a channel of a file of any format.

use std::io::{Cursor, Read};

use super::sequence::TextRows;
use super::{Feed, Options, Signal};
use crate::failure::Failure;
use crate::io::Input;
use crate::io::csv::{self, Table};
use crate::io::mcap::{SignalReader, TimeOptions};
use crate::recording;

/// Bytes that are read before anything is told.
const HEAD: u64 = 1 << 16;
/// Bytes that tell whether a text is a plain table.
const FRONT: usize = 1 << 14;

impl Signal {
    /// Opens a file, finds the channel and its time axis.
    ///
    /// # Errors
    /// If the file cannot be read, holds no recording, or leaves open what is to be read.
    pub fn open(place: &Input, options: &Options) -> Result<Self, Failure> {
        let name = place.name();
        let mut input = place.open()?;
        let unreadable =
            |error| Failure::failed(format_args!("{}: cannot be read: {error}", place.name()));
        let mut head = Vec::new();
        let start = (&mut input).take(HEAD).read_to_end(&mut head);
        let complete = start.map_err(unreadable)? < HEAD as usize;
        if head.starts_with(::mcap::MAGIC) {
            options.check_for_messages()?;
            return Self::open_messages(place, Box::new(Cursor::new(head).chain(input)), options);
        }
        options.check_for_text()?;
        let table = &options.table;
        let front = &head[..head.len().min(FRONT)];
        let is_whole = complete && front.len() == head.len();
        if complete && head.is_empty() || recording::text::is_plain(front, is_whole, table) {
            let input = Box::new(Cursor::new(head).chain(input));
            return Table::of(name, input, table).map(|found| Self::of_table(found, table));
        }
        input.read_to_end(&mut head).map_err(unreadable)?;
        let recording = recording::text::read(&name, head, table).map_err(|f| f.at(&name))?;
        Self::of_recording(recording, table)
    }

    fn open_messages(
        place: &Input,
        input: Box<dyn Read + Send>,
        options: &Options,
    ) -> Result<Self, Failure> {
        let time = TimeOptions {
            time: options.messages.time,
            spacing: options.messages.spacing.clone(),
        };
        let choice = &options.messages.selection;
        let reader = SignalReader::with_stream(place, input, choice, &time)?;
        Self::of_messages(reader, &options.table, &options.messages)
    }

    /// The signal of a plain table.
    fn of_table(table: Table, options: &csv::Options) -> Self {
        let Table {
            source,
            layout,
            channel,
            time,
            plan,
            mut head,
            input,
            row_bytes,
            shortest_value,
            warnings,
            first_stamp,
        } = table;
        head.drain(..layout.data_offset);
        let rows = TextRows {
            plan,
            columns: layout.columns.iter().map(|c| c.heading.clone()).collect(),
            shortest_value,
            lines_before: layout.data_line - 1,
        };
        Self {
            source,
            dialect: layout.dialect.describe(),
            channel,
            time,
            first_stamp,
            warnings,
            origin: None,
            any_steps: options.any_steps,
            feed: Feed::Text {
                rows,
                head,
                input,
                row_bytes,
            },
        }
    }
}
