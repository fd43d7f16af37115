//! Pieces of a signal, as the pipeline moves them.

use std::io::Read;

use crate::failure::Failure;
use crate::io::csv::{Break, Chunks, Piece, RowPlan, Rows, TimeAxis};
use crate::warning::Warning;

/// Bytes of a piece: large enough to be quick, small enough to stay in cache.
const PIECE: usize = 1 << 17;

/// Samples that come as numbers, not as text: from a file of messages, or from memory.
pub trait RowSource: Send {
    /// Fills `rows` with the next samples and, if there are any, their stamps; `false` at the end.
    ///
    /// # Errors
    /// If the source cannot be read any further.
    fn next(&mut self, rows: &mut Rows) -> Result<bool, Failure>;

    /// What was lost, and what else should be known, once all was read.
    fn finish(&mut self) -> (Option<Warning>, Vec<Warning>);

    /// What a sample is called in a message, as in `message 12`.
    fn row_name(&self) -> &'static str;
}

/// A piece of a file and the rows in it.
#[derive(Debug, Default)]
pub struct Batch {
    /// The bytes.
    pub text: Vec<u8>,
    /// What they say.
    pub rows: Rows,
    /// Whether the last line has no line feed.
    pub(super) unended: bool,
    /// First irregular time stamp within the piece.
    pub(super) time_break: Option<Break>,
}

impl Batch {
    /// Reads the rows and checks their stamps. Needs no other batch.
    pub fn read_rows(&mut self, plan: Option<&RowPlan>, time: &TimeAxis) {
        if let Some(plan) = plan {
            self.rows.read(&self.text, plan);
        }
        self.time_break = time.first_break(None, &self.rows.times);
    }
}

/// Gets the pieces of a signal.
pub enum Fetch {
    /// Out of a text.
    Text {
        /// Name of the file.
        source: String,
        /// Its lines.
        chunks: Chunks,
    },
    /// As numbers.
    Rows(Box<dyn RowSource>),
}

impl Fetch {
    /// Pieces of at least so many bytes of a text; `head` has been read from it already.
    #[must_use]
    pub fn text(source: String, head: Vec<u8>, input: Box<dyn Read + Send>, bytes: usize) -> Self {
        Self::Text {
            source,
            chunks: Chunks::new(head, input, bytes.max(PIECE)),
        }
    }

    /// Fills a batch with the next piece; `false` at the end.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn next(&mut self, batch: &mut Batch) -> Result<bool, Failure> {
        match self {
            Self::Text { source, chunks } => {
                let piece = chunks.next(&mut batch.text).map_err(|error| {
                    Failure::failed(format_args!("{source}: cannot be read: {error}"))
                })?;
                batch.unended = piece == Piece::Unended;
                Ok(piece != Piece::End)
            }
            Self::Rows(source) => {
                batch.rows.clear();
                source.next(&mut batch.rows)
            }
        }
    }

    /// What was lost and what else should be known of a source of numbers.
    pub(super) fn finish(&mut self) -> (Option<Warning>, Vec<Warning>) {
        match self {
            Self::Text { .. } => (None, Vec::new()),
            Self::Rows(source) => source.finish(),
        }
    }
}
