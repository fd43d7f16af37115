//! Blocks of samples, the unit of the pipeline.

use super::stamps::{IrregularStep, StampGrid};
use super::text::{ChannelPlan, ChannelRows, Chunks, LastLine, Piece, RowPlan, last_line};
use crate::failure::{Failure, RowKind};
use crate::warning::Warning;

/// A source of the blocks of a channel, in order.
pub(crate) trait BlockSource: Send {
    /// Sets the minimum number of samples per block, for text.
    fn set_fewest(&mut self, _samples: usize) {}

    /// Fills a block with the next samples, or the text of the next rows; `false` at the end.
    ///
    /// # Errors
    /// If the source cannot be read further.
    fn next(&mut self, block: &mut Block) -> Result<bool, Failure>;

    /// Losses, and further warnings, after everything was read.
    fn finish(&mut self) -> (Option<Warning>, Vec<Warning>) {
        (None, Vec::new())
    }

    /// What a sample is called in messages, as in `message 12`.
    fn row_kind(&self) -> RowKind;
}

/// Samples of a channel and their stamps; for a text, with the text itself.
#[derive(Debug, Default)]
pub(crate) struct Block {
    /// Bytes of the text.
    pub(crate) text: Vec<u8>,
    /// Samples read from the text.
    pub(crate) rows: ChannelRows,
    /// A last line without a line end: its kind and text.
    pub(super) last_line: Option<(LastLine, String)>,
    /// First irregular time stamp within the block.
    pub(super) irregular: Option<IrregularStep>,
}

impl Block {
    /// Parses the rows of a text and checks the stamps, independently of other blocks.
    pub(crate) fn read_rows(&mut self, plan: Option<&ChannelPlan>, grid: Option<&StampGrid>) {
        if let Some(plan) = plan {
            self.rows.read(&self.text, plan);
        }
        self.irregular = grid.and_then(|grid| grid.first_irregular(None, &self.rows.times));
    }
}

impl Block {
    /// Appends the content of the next block; rows of a text are then parsed again.
    pub(super) fn append(&mut self, next: &mut Self) {
        self.text.append(&mut next.text);
        self.rows.values.append(&mut next.rows.values);
        self.rows.times.append(&mut next.rows.times);
        self.last_line = next.last_line.take();
    }

    pub(super) fn is_empty(&self) -> bool {
        self.text.is_empty() && self.rows.values.is_empty()
    }
}

/// Rows of a text.
pub(super) struct TextBlocks {
    pub(super) source: String,
    pub(super) chunks: Chunks,
    /// Mean length of a row, in bytes.
    pub(super) row_bytes: usize,
    /// Parsing of all columns of the table.
    pub(super) table: RowPlan,
    /// Whether the next piece is the first.
    pub(super) is_first: bool,
}

impl TextBlocks {
    /// Judges a last line without a line end, and removes it if the file was truncated within it.
    fn look_at_last_line(&self, block: &mut Block) {
        let judged = LastLine::of(&block.text, self.is_first, &self.table);
        let last = last_line(&block.text);
        let text = String::from_utf8_lossy(last).into_owned();
        if judged == LastLine::Cut {
            block.text.truncate(block.text.len() - last.len());
        }
        block.last_line = Some((judged, text));
    }
}

impl BlockSource for TextBlocks {
    fn set_fewest(&mut self, samples: usize) {
        self.chunks.set_size(samples * self.row_bytes);
    }

    fn next(&mut self, block: &mut Block) -> Result<bool, Failure> {
        let piece = self.chunks.next(&mut block.text);
        let piece = piece.map_err(|failure| failure.at(&self.source))?;
        block.last_line = None;
        if piece == Piece::Unended {
            self.look_at_last_line(block);
        }
        self.is_first = false;
        Ok(piece != Piece::End)
    }

    fn row_kind(&self) -> RowKind {
        RowKind::Line
    }
}
