//! A record read as a whole into memory, converted to the applied quantity at rest.

use torqcomp_dsp::resample::{Resampled, Resampler};

use super::{Batch, Signal, Summary};
use crate::failure::Failure;
use crate::io::csv::TimeSource;

/// A uniformly sampled record, in SI units of the applied quantity, not yet compensated.
#[derive(Debug, Clone)]
pub struct Record {
    /// The samples.
    pub samples: Vec<f64>,
    /// Time of the first one.
    pub start_s: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// What the file held.
    pub summary: Summary,
    /// What was interpolated, if anything.
    pub resampled: Option<Resampled>,
}

impl Record {
    /// Reads a signal to its end; `convert` brings its samples to the units wanted, or says which
    /// cannot be.
    ///
    /// # Errors
    /// The first row that cannot be read or converted, with its line.
    pub fn read(
        signal: Signal,
        convert: impl Fn(&mut [f64]) -> Result<(), (usize, String)>,
    ) -> Result<Self, Failure> {
        let time = signal.time.clone();
        let start_s = signal.first_time_s();
        let (mut fetch, plan, mut sequence) = signal.into_stream(0);
        let mut samples = Vec::new();
        let mut times = Vec::new();
        let mut batch = Batch::default();
        while fetch.next(&mut batch)? {
            batch.read_rows(plan.as_ref(), &time);
            sequence.accept(&mut batch)?;
            if let Err((row, message)) = convert(&mut batch.rows.values) {
                return Err(sequence.failure_at_row(&batch, row, &message));
            }
            samples.extend_from_slice(&batch.rows.values);
            if time.is_resampled() {
                times.extend_from_slice(&batch.rows.times);
            }
        }
        let mut resampled = None;
        if let TimeSource::Stamps {
            seconds_per_unit,
            resampled: true,
            ..
        } = &time.source
        {
            let mut resampler = Resampler::new(1.0 / time.rate_hz)?;
            let mut grid = Vec::new();
            for (stamp, value) in times.iter().zip(&samples) {
                resampler.push(stamp * seconds_per_unit, *value, &mut grid)?;
            }
            resampled = Some(resampler.finish(&mut grid));
            samples = grid;
        }
        Ok(Self {
            samples,
            start_s,
            rate_hz: time.rate_hz,
            summary: sequence.finish(&mut fetch)?,
            resampled,
        })
    }
}
