//! Opening a channel of a file of any format.

use std::io::Read;

use super::sequence::TextRows;
use super::{Feed, Options, Signal};
use crate::failure::Failure;
use crate::io::csv::{Place, Table};
use crate::io::mcap::record::frames::Frames;
use crate::io::mcap::record::input::Input;
use crate::io::mcap::{self, Source, selection::Wanted};

impl Signal {
    /// Opens a file, finds the channel and its time axis.
    ///
    /// # Errors
    /// If the file cannot be read, holds no recording, or leaves open what is to be read.
    pub fn open(place: &Place, options: &Options) -> Result<Self, Failure> {
        let name = place.name();
        let mut input = place.open()?;
        let mut head = Vec::new();
        (&mut input)
            .take(MAGIC.len() as u64)
            .read_to_end(&mut head)
            .map_err(|error| Failure::failed(format_args!("{name}: cannot be read: {error}")))?;
        let is_mcap = head == MAGIC;
        let input = Box::new(std::io::Cursor::new(head).chain(input));
        if is_mcap {
            options.check_for_messages()?;
            let wanted = match options.messages.selection.check()? {
                Wanted::Only => mcap::inventory::only_topic(place)?,
                wanted => wanted,
            };
            let frames = Frames::new(name, Input::new(input))?;
            let reading = mcap::Options {
                time: options.messages.time,
                spacing: options.messages.spacing.clone(),
            };
            let source = Source::read(frames, &wanted, &reading)?;
            return Self::of_messages(source, &options.table, &options.messages);
        }
        options.check_for_text()?;
        Table::of(name, input, &options.table).map(Self::of_table)
    }

    /// The signal of a plain table.
    fn of_table(table: Table) -> Self {
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
            feed: Feed::Text {
                rows,
                head,
                input,
                row_bytes,
            },
        }
    }
}

/// What an MCAP file begins with.
const MAGIC: &[u8] = ::mcap::MAGIC;
