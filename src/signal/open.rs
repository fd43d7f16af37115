//! Opening a channel of a file of any format.

use super::sequence::TextRows;
use super::{Feed, Signal};
use crate::failure::Failure;
use crate::io::csv::{Options, Place, Table};

impl Signal {
    /// Opens a file, finds the channel and its time axis.
    ///
    /// # Errors
    /// If the file cannot be read, holds no recording, or leaves open what is to be read.
    pub fn open(place: &Place, options: &Options) -> Result<Self, Failure> {
        Table::open(place, options).map(Self::of_table)
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
            feed: Feed::Text {
                rows,
                head,
                input,
                row_bytes,
            },
        }
    }
}
