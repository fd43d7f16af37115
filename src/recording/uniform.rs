//! A channel read as a whole into memory, converted to the applied quantity at rest.

use torqcomp_dsp::resample::{Resampled, Resampler};

use super::block::Block;
use super::moment::Moment;
use super::stream::ChannelStream;
use super::validator::StreamSummary;
use crate::failure::Failure;

/// A uniformly sampled record, in SI units of the applied quantity, not yet compensated.
#[derive(Debug, Clone)]
pub(crate) struct UniformRecord {
    pub(crate) samples: Vec<f64>,
    /// Time of the first one.
    pub(crate) start: Moment,
    /// Samples a second.
    pub(crate) rate_hz: f64,
    /// What the file held.
    pub(crate) summary: StreamSummary,
    /// What was interpolated, if anything.
    pub(crate) resampled: Option<Resampled>,
}

impl UniformRecord {
    /// Reads a channel to its end; `convert` brings its samples to the units wanted, or says which
    /// cannot be.
    ///
    /// # Errors
    /// The first row that cannot be read or converted, with its line.
    pub(crate) fn read(
        stream: ChannelStream,
        convert: impl Fn(&mut [f64]) -> Result<(), (usize, String)>,
    ) -> Result<Self, Failure> {
        let (rate_hz, start) = (stream.rate_hz, stream.start);
        let grid = stream.time.grid.clone();
        let resampled_grid = grid.as_ref().filter(|grid| grid.resampled);
        let (mut blocks, plan, mut validator) = stream.into_parts(0);
        let mut samples = Vec::new();
        let mut times = Vec::new();
        let mut block = Block::default();
        while blocks.next(&mut block)? {
            block.read_rows(plan.as_ref(), grid.as_ref());
            validator.accept(&mut block)?;
            if let Err((row, message)) = convert(&mut block.rows.values) {
                return Err(validator.failure_at_row(&block, row, &message));
            }
            samples.extend_from_slice(&block.rows.values);
            if resampled_grid.is_some() {
                times.extend_from_slice(&block.rows.times);
            }
        }
        let mut resampled = None;
        if let Some(grid) = resampled_grid {
            let mut resampler = Resampler::new(1.0 / rate_hz)?;
            let mut on_grid = Vec::new();
            for (stamp, value) in times.iter().zip(&samples) {
                resampler.push(stamp * grid.seconds_per_unit, *value, &mut on_grid)?;
            }
            resampled = Some(resampler.finish(&mut on_grid));
            samples = on_grid;
        }
        Ok(Self {
            samples,
            start,
            rate_hz,
            summary: validator.finish(blocks.as_mut())?,
            resampled,
        })
    }
}
