//! Look-ahead at the first samples of a stream.

use std::ops::Range;

use torqcomp_dsp::resample::Resampler;

use super::block::{Block, BlockSource};
use super::stream::ChannelStream;
use crate::failure::{Failure, RowKind};
use crate::warning::Warning;

/// The first samples of a stream.
#[derive(Debug, Default)]
pub(crate) struct FirstSamples {
    /// As they are used, that is on the grid of resampled stamps, up to the first that cannot be.
    pub(crate) values: Vec<f64>,
    /// Stretches of them that were filled in, in order.
    pub(crate) filled: Vec<Range<usize>>,
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
        let (mut times, mut has_ended) = (Vec::new(), false);
        while first.values.len() < fewest && !first.is_all {
            has_ended = !self.blocks.next(&mut block)?;
            if has_ended {
                first.is_all = true;
                break;
            }
            block.read_rows(plan, None);
            let finite = block.rows.values.iter().take_while(|v| v.is_finite());
            first.values.extend(finite);
            times.extend_from_slice(&block.rows.times);
            first.is_all = block.rows.ends || block.rows.problem.is_some();
            held.append(&mut block);
        }
        let rest = std::mem::replace(&mut self.blocks, Box::new(Nothing));
        self.blocks = Box::new(HeldBlocks {
            first: Some(held),
            rest,
            has_ended,
        });
        Ok(match self.resampled(&times, &first.values) {
            Some((values, filled)) => FirstSamples {
                values,
                filled,
                ..first
            },
            None => FirstSamples {
                filled: self.filled_by_option(),
                ..first
            },
        })
    }

    /// Samples on the grid of resampled stamps, and the gaps bridged among them; `None` if stamps are not resampled.
    fn resampled(&self, times: &[f64], values: &[f64]) -> Option<(Vec<f64>, Vec<Range<usize>>)> {
        let grid = self.channel.axis.grid.as_ref();
        let grid = grid.filter(|grid| grid.resampled)?;
        let mut resampler = Resampler::new(1.0 / self.rate_hz).ok()?;
        let mut all = Vec::new();
        for (time, value) in times.iter().zip(values) {
            // What cannot be resampled is rejected later, with its line.
            if resampler
                .push(time * grid.seconds_per_unit, *value, &mut all)
                .is_err()
            {
                break;
            }
        }
        let done = resampler.finish(&mut all);
        let place = |after_s: f64| (after_s * self.rate_hz).ceil() as usize;
        let gaps = done.bridged_gaps.iter();
        let gaps = gaps
            .map(|gap| place(gap.from_s)..place(gap.to_s).min(all.len()))
            .collect();
        Some((all, gaps))
    }

    /// The stretches filled by `--fill`.
    fn filled_by_option(&self) -> Vec<Range<usize>> {
        let spans = self.channel.filled.iter();
        let stretch = |from_s: f64, samples: usize| {
            let first = ((from_s - self.start.seconds()) * self.rate_hz).round() as usize + 1;
            first..first + samples
        };
        spans
            .map(|span| stretch(span.from_s, span.samples))
            .collect()
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
