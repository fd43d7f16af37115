//! A channel on a uniform time axis: block by block, or read as a whole into memory.

use torqcomp_dsp::resample::{Resampled, Resampler};

use super::block::{Block, BlockSource};
use super::moment::Moment;
use super::spool::Spool;
use super::stamps::StampGrid;
use super::stream::ChannelStream;
use super::text::ChannelPlan;
use super::validator::{StreamSummary, StreamValidator};
use crate::failure::Failure;
use crate::print::{plural, rounded};
use crate::warning::{Warning, WarningCode};

/// A channel on a uniform time axis, block by block; interpolated if requested.
pub(crate) struct UniformStream {
    /// Time of the first sample.
    pub(crate) start: Moment,
    /// Sampling rate in Hz.
    pub(crate) rate_hz: f64,
    /// Its standard uncertainty, if it comes from stamps.
    pub(crate) rate_std_hz: Option<f64>,
    blocks: Box<dyn BlockSource>,
    plan: Option<ChannelPlan>,
    validator: StreamValidator,
    grid: Option<StampGrid>,
    resampler: Option<Resampler>,
    block: Block,
}

impl UniformStream {
    /// Starts before the first block.
    ///
    /// # Errors
    /// If the rate is invalid.
    pub(crate) fn of(stream: ChannelStream) -> Result<Self, Failure> {
        let (rate_hz, start) = (stream.rate_hz, stream.start);
        let rate_std_hz = stream.channel.axis.rate_std_hz;
        let grid = stream.channel.axis.grid.clone();
        let is_resampled = grid.as_ref().is_some_and(|grid| grid.resampled);
        let resampler = is_resampled.then(|| Resampler::new(1.0 / rate_hz));
        let resampler = resampler.transpose()?;
        let (blocks, plan, validator) = stream.into_parts(0);
        Ok(Self {
            start,
            rate_hz,
            rate_std_hz,
            blocks,
            plan,
            validator,
            grid,
            resampler,
            block: Block::default(),
        })
    }

    /// Appends the samples of the next block; `convert` converts them to the requested unit, or reports which cannot be
    /// converted. `false` at the end.
    ///
    /// # Errors
    /// The first row that cannot be read or converted, with its line.
    pub(crate) fn next(
        &mut self,
        samples: &mut Vec<f64>,
        convert: impl Fn(&mut [f64]) -> Result<(), (usize, String)>,
    ) -> Result<bool, Failure> {
        let block = &mut self.block;
        if !self.blocks.next(block)? {
            return Ok(false);
        }
        block.read_rows(self.plan.as_ref(), self.grid.as_ref());
        self.validator.accept(block)?;
        if let Err((row, message)) = convert(&mut block.rows.values) {
            return Err(self.validator.failure_at_row(block, row, &message));
        }
        let (Some(resampler), Some(grid)) = (&mut self.resampler, &self.grid) else {
            samples.extend_from_slice(&block.rows.values);
            return Ok(true);
        };
        for (stamp, value) in block.rows.times.iter().zip(&block.rows.values) {
            resampler.push(stamp * grid.seconds_per_unit, *value, samples)?;
        }
        Ok(true)
    }

    /// Appends the samples held back by interpolation; returns the summary of the file and of the
    /// interpolation.
    ///
    /// # Errors
    /// If there were fewer than two samples.
    pub(crate) fn finish(
        mut self,
        samples: &mut Vec<f64>,
    ) -> Result<(StreamSummary, Option<Resampled>), Failure> {
        let resampled = self.resampler.map(|resampler| resampler.finish(samples));
        let mut summary = self.validator.finish(self.blocks.as_mut())?;
        summary.warnings.extend(resampled.iter().flat_map(doubts));
        Ok((summary, resampled))
    }
}

/// Warnings about samples that a resampling could only estimate.
pub(crate) fn doubts(resampled: &Resampled) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if resampled.gaps > 0 || resampled.repeated > 0 {
        let message = format!(
            "{} in the time stamps filled by linear interpolation ({}, longest step {} s), {} dropped",
            plural(resampled.gaps, "gap"),
            plural(resampled.bridged, "sample"),
            rounded(resampled.longest_step_s, 4),
            plural(resampled.repeated, "repeated time stamp")
        );
        warnings.push(WarningCode::ResampledGaps.warning(message));
    }
    if resampled.uneven > 0 {
        let message = format!(
            "{} next to time stamps that nearly coincide, or are far from uniform, interpolated by straight lines; if the \
             recorder sampled uniformly and these are times of arrival, give --rate HZ instead of --resample",
            plural(resampled.uneven, "sample"),
        );
        warnings.push(WarningCode::ResampledUneven.warning(message));
    }
    warnings
}

/// A uniformly sampled record, in SI units of the applied quantity, not yet compensated.
#[derive(Debug)]
pub(crate) struct UniformRecord {
    pub(crate) samples: Spool,
    /// Time of the first one.
    pub(crate) start: Moment,
    /// Sampling rate in Hz.
    pub(crate) rate_hz: f64,
    /// Its standard uncertainty, if it comes from stamps.
    pub(crate) rate_std_hz: Option<f64>,
    /// Summary of the file.
    pub(crate) summary: StreamSummary,
    /// Summary of the interpolation, if any.
    pub(crate) resampled: Option<Resampled>,
}

impl UniformRecord {
    /// Reads a channel to its end; `convert` converts its samples to the requested unit, or reports
    /// which cannot be converted.
    ///
    /// # Errors
    /// The first row that cannot be read or converted, with its line.
    pub(crate) fn read(
        stream: ChannelStream,
        convert: impl Fn(&mut [f64]) -> Result<(), (usize, String)>,
    ) -> Result<Self, Failure> {
        let mut stream = UniformStream::of(stream)?;
        let (rate_hz, start) = (stream.rate_hz, stream.start);
        let rate_std_hz = stream.rate_std_hz;
        let (mut samples, mut piece) = (Spool::default(), Vec::new());
        while stream.next(&mut piece, &convert)? {
            samples.keep(&piece)?;
            piece.clear();
        }
        let (summary, resampled) = stream.finish(&mut piece)?;
        samples.keep(&piece)?;
        Ok(Self {
            samples,
            start,
            rate_hz,
            rate_std_hz,
            summary,
            resampled,
        })
    }
}
