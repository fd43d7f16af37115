//! Blocks of samples, as the pipeline moves them.

use super::stamps::{IrregularStep, StampGrid};
use super::text::{ChannelPlan, ChannelRows, Chunks, LastLine, Piece, RowPlan, last_line};
use crate::failure::{Failure, RowKind};
use crate::warning::Warning;

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
    fn row_kind(&self) -> RowKind;
}

/// Some samples of a channel and their stamps, out of a text with the text itself.
#[derive(Debug, Default)]
pub(crate) struct Block {
    /// The bytes of a text.
    pub(crate) text: Vec<u8>,
    /// What they say.
    pub(crate) rows: ChannelRows,
    /// What a last line without a line end is, and its text.
    pub(super) last_line: Option<(LastLine, String)>,
    /// First irregular time stamp within the block.
    pub(super) irregular: Option<IrregularStep>,
}

impl Block {
    /// Reads the rows of a text and checks the stamps. Needs no other block.
    pub(crate) fn read_rows(&mut self, plan: Option<&ChannelPlan>, grid: Option<&StampGrid>) {
        if let Some(plan) = plan {
            self.rows.read(&self.text, plan);
        }
        self.irregular = grid.and_then(|grid| grid.first_irregular(None, &self.rows.times));
    }
}

impl Block {
    /// Moves the content of the next block behind that of this one; rows of a text are then read again.
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

/// The rows of a text.
pub(super) struct TextBlocks {
    pub(super) source: String,
    pub(super) chunks: Chunks,
    /// Mean length of a row, in bytes.
    pub(super) row_bytes: usize,
    /// How all columns of the table are read.
    pub(super) table: RowPlan,
    /// Whether no line stands before the next piece.
    pub(super) is_first: bool,
}

impl TextBlocks {
    /// Judges a last line that has no line end, and takes it away if the file was cut within it.
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
