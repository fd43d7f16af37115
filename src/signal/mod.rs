//! One channel of a recording, open for reading piece by piece, whatever the format of the file.

mod feed;
mod messages;
mod open;
mod options;
mod record;
mod recorded;
mod sequence;
pub mod together;

use crate::io::csv::{Column, RowPlan, TimeAxis, TimeSource};
use crate::io::mcap::TimeChoice;
use crate::io::mcap::decode::Encoding;
use crate::warning::Warning;

pub use feed::{Batch, Fetch, RowSource};
pub use options::{MessageOptions, Options};
pub use record::Record;
pub use sequence::{Sequence, Summary, TextRows};
pub use together::Together;

/// A channel of a recording, chosen and open for reading.
pub struct Signal {
    /// Name of the file, for people.
    pub source: String,
    /// How the file is written, for people.
    pub dialect: String,
    /// The channel.
    pub channel: Column,
    /// How its samples lie in time.
    pub time: TimeAxis,
    /// Of messages, what a copy of their file needs to know.
    pub origin: Option<Origin>,
    /// Whether irregular stamps are only said.
    any_steps: bool,
    /// First time stamp as written.
    first_stamp: Option<f64>,
    /// What is known to be odd before reading.
    warnings: Vec<Warning>,
    feed: Feed,
}

/// Where messages come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// Their topic.
    pub topic: String,
    /// Their encoding, if it is known.
    pub encoding: Option<Encoding>,
    /// Time of the first sample, in ns.
    pub first_ns: i64,
    /// What a sample's time is ahead of the file's log times, in ns.
    pub log_offset_ns: i64,
    /// The time that was asked for.
    pub time: Option<TimeChoice>,
}

/// Where the samples come from.
enum Feed {
    /// From the lines of a text.
    Text {
        rows: TextRows,
        /// What was read of the rows already.
        head: Vec<u8>,
        input: Box<dyn std::io::Read + Send>,
        /// Mean length of a row, in bytes.
        row_bytes: usize,
    },
    /// As numbers.
    Rows(Box<dyn RowSource>),
}

impl Signal {
    /// Time of the first sample: its stamp, or where the file or the user says it starts.
    #[must_use]
    pub fn first_time_s(&self) -> f64 {
        match (&self.time.source, self.first_stamp) {
            (
                TimeSource::Stamps {
                    seconds_per_unit,
                    origin_ns,
                    ..
                },
                Some(stamp),
            ) => *origin_ns as f64 * 1e-9 + stamp * seconds_per_unit,
            (TimeSource::Header { start_s, .. }, _) => *start_s,
            _ => 0.0,
        }
    }

    /// Splits the signal into the parts that run side by side: getting pieces of at least `rows`
    /// rows, reading text, and looking at the rows in order.
    #[must_use]
    pub fn into_stream(self, rows: usize) -> (Fetch, Option<RowPlan>, Sequence) {
        let sequence = |name, text| {
            Sequence::new(
                self.source.clone(),
                name,
                text,
                self.time.clone(),
                self.warnings.clone(),
            )
            .with_any_steps(self.any_steps)
        };
        match self.feed {
            Feed::Text {
                rows: text,
                head,
                input,
                row_bytes,
            } => {
                let (plan, sequence) = (text.plan, sequence("line", Some(text)));
                let fetch = Fetch::text(self.source.clone(), head, input, rows * row_bytes);
                (fetch, Some(plan), sequence)
            }
            Feed::Rows(source) => {
                let sequence = sequence(source.row_name(), None);
                (Fetch::Rows(source), None, sequence)
            }
        }
    }
}
