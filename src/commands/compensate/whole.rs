//! The whole-record way: everything in memory, one transform.

use torqcomp_dsp::compensate::whole_record;
use torqcomp_dsp::noise::RecordNoise;
use torqcomp_dsp::spectrum::{Density, welch};

use super::deliver::deliver;
use super::sink::Sink;
use super::{Extent, Plan, Run};
use crate::cli::Compensate;
use crate::commands::convert;
use crate::failure::Failure;
use crate::quality::excerpt;
use crate::signal::Record;

/// Longest block of the noise estimate.
const LONGEST_BLOCK: usize = 1 << 12;

/// Reads, compensates and writes the record.
pub fn run(args: &Compensate, plan: Plan, sink: &mut Sink) -> Result<Run, Failure> {
    let Plan {
        signal,
        chain,
        filter,
        ..
    } = plan;
    let record = Record::read(signal, |values| convert(&chain, values))?;
    let torque = whole_record(&filter, &record.samples)?;
    let scale = 1.0 / chain.applied.factor;
    let traces = deliver(args, sink, &record, &torque, scale)?;
    let density = density(&record, scale);
    Ok(Run {
        samples: torque.len(),
        start_s: record.start_s,
        extent: Extent::of(&torque).scaled(scale),
        resampled: record.resampled,
        noise: density.and_then(|density| RecordNoise::of(&filter, &density)),
        summary: record.summary,
        excerpt: excerpt::of_memory(record.samples),
        traces,
        refined: None,
    })
}

/// Power density of a record in printed units, if it is long enough.
pub fn density(record: &Record, scale: f64) -> Option<Density> {
    let block = (record.samples.len() / 2).next_power_of_two() / 2;
    let printed: Vec<f64> = record.samples.iter().map(|x| x * scale).collect();
    welch(&printed, record.rate_hz, block.min(LONGEST_BLOCK)).ok()
}
