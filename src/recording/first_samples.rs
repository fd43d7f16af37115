//! Look-ahead at the first samples of a stream.

use super::block::{Block, BlockSource};
use super::stream::ChannelStream;
use crate::failure::{Failure, RowKind};
use crate::warning::Warning;

/// The first samples of a stream.
#[derive(Debug, Default)]
pub(crate) struct FirstSamples {
    /// As written, up to the first non-finite one.
    pub(crate) values: Vec<f64>,
    /// Whether these are all samples.
    pub(crate) is_all: bool,
}

impl ChannelStream {
    /// Reads at least `fewest` samples ahead, or all there are.
    ///
    /// # Errors
    /// If the source cannot be read.
    pub(crate) fn first_samples(&mut self, fewest: usize) -> Result<FirstSamples, Failure> {
        let plan = self.text.as_ref().map(|text| &text.plan);
        let mut first = FirstSamples::default();
        let mut held = Block::default();
        let mut block = Block::default();
        let mut has_ended = false;
        while first.values.len() < fewest && !first.is_all {
            has_ended = !self.blocks.next(&mut block)?;
            if has_ended {
                first.is_all = true;
                break;
            }
            block.read_rows(plan, None);
            let finite = block.rows.values.iter().take_while(|v| v.is_finite());
            first.values.extend(finite);
            first.is_all = block.rows.ends || block.rows.problem.is_some();
            held.append(&mut block);
        }
        let rest = std::mem::replace(&mut self.blocks, Box::new(Nothing));
        self.blocks = Box::new(HeldBlocks {
            first: Some(held),
            rest,
            has_ended,
        });
        Ok(first)
    }
}

/// Blocks of which the first were read ahead and merged into one.
struct HeldBlocks {
    first: Option<Block>,
    rest: Box<dyn BlockSource>,
    has_ended: bool,
}

impl BlockSource for HeldBlocks {
    fn set_fewest(&mut self, samples: usize) {
        self.rest.set_fewest(samples);
    }

    fn next(&mut self, block: &mut Block) -> Result<bool, Failure> {
        match self.first.take() {
            Some(first) if !first.is_empty() => {
                *block = first;
                Ok(true)
            }
            _ if self.has_ended => {
                *block = Block::default();
                Ok(false)
            }
            _ => self.rest.next(block),
        }
    }

    fn finish(&mut self) -> (Option<Warning>, Vec<Warning>) {
        self.rest.finish()
    }

    fn row_kind(&self) -> RowKind {
        self.rest.row_kind()
    }
}

/// No blocks.
struct Nothing;

impl BlockSource for Nothing {
    fn next(&mut self, _block: &mut Block) -> Result<bool, Failure> {
        Ok(false)
    }

    fn row_kind(&self) -> RowKind {
        RowKind::Sample
    }
}
