//! Blocks of samples, as the pipeline moves them.

use std::io::Read;

use super::stamps::{IrregularStep, StampGrid};
use crate::failure::Failure;
use crate::io::csv::{Chunks, Piece, RowPlan, Rows};
use crate::warning::Warning;

/// Bytes of a block of text: large enough to be quick, small enough to stay in cache.
const TEXT_BYTES: usize = 1 << 17;

/// What gives the blocks of a channel, in order.
pub(crate) trait BlockSource: Send {
    /// Makes blocks at least so many samples long, where they are of text.
    fn set_fewest(&mut self, _samples: usize) {}

    /// Fills a block with the next samples, or the text of the next rows; `false` at the end.
    ///
    /// # Errors
    /// If the source cannot be read any further.
    fn next(&mut self, block: &mut Block) -> Result<bool, Failure>;

    /// What was lost, and what else should be known, once all was read.
    fn finish(&mut self) -> (Option<Warning>, Vec<Warning>) {
        (None, Vec::new())
    }

    /// What a sample is called in a message, as in `message 12`.
    fn row_name(&self) -> &'static str;
}

/// Some samples of a channel and their stamps, out of a text with the text itself.
#[derive(Debug, Default)]
pub(crate) struct Block {
    /// The bytes of a text.
    pub(crate) text: Vec<u8>,
    /// What they say.
    pub(crate) rows: Rows,
    /// Whether the last line has no line feed.
    pub(super) unended: bool,
    /// First irregular time stamp within the block.
    pub(super) irregular: Option<IrregularStep>,
}

impl Block {
    /// Reads the rows of a text and checks the stamps. Needs no other block.
    pub(crate) fn read_rows(&mut self, plan: Option<&RowPlan>, grid: Option<&StampGrid>) {
        if let Some(plan) = plan {
            self.rows.read(&self.text, plan);
        }
        self.irregular = grid.and_then(|grid| grid.first_irregular(None, &self.rows.times));
    }
}

/// The rows of a text.
pub(super) struct TextBlocks {
    source: String,
    chunks: Chunks,
    /// Mean length of a row, in bytes.
    row_bytes: usize,
}

impl TextBlocks {
    /// The rows that follow in `input`; `head` has been read from it already.
    pub(super) fn new(
        source: String,
        head: Vec<u8>,
        input: Box<dyn Read + Send>,
        row_bytes: usize,
    ) -> Self {
        Self {
            source,
            chunks: Chunks::new(head, input, TEXT_BYTES),
            row_bytes,
        }
    }
}

impl BlockSource for TextBlocks {
    fn set_fewest(&mut self, samples: usize) {
        self.chunks
            .set_size((samples * self.row_bytes).max(TEXT_BYTES));
    }

    fn next(&mut self, block: &mut Block) -> Result<bool, Failure> {
        let piece = self.chunks.next(&mut block.text).map_err(|error| {
            Failure::failed(format_args!("{}: cannot be read: {error}", self.source))
        })?;
        block.unended = piece == Piece::Unended;
        Ok(piece != Piece::End)
    }

    fn row_name(&self) -> &'static str {
        "line"
    }
}
