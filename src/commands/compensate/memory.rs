//! The whole record in memory: one transform, or the inverse of effects that no filter describes.

use torqcomp_dsp::compensate::whole_record;
use torqcomp_dsp::noise::RecordNoise;
use torqcomp_dsp::spectrum::{Density, welch};

use super::report::CompensateReport;
use super::sink::{Part, Sink};
use super::statistics::Sums;
use super::{Plan, Seen, refined};
use crate::cli::Compensate;
use crate::commands::convert;
use crate::commands::rows::uniform_parts;
use crate::failure::Failure;
use crate::io::text::Text;
use crate::quality::excerpt;
use crate::recording::UniformRecord;

/// Longest block of the noise estimate.
const LONGEST_BLOCK: usize = 1 << 12;

/// Reads, compensates and writes the record.
pub(super) fn run(
    args: &Compensate,
    plan: Plan,
    sink: &mut Sink,
    report: &mut CompensateReport,
) -> Result<Seen, Failure> {
    let Plan {
        stream,
        stand,
        chain,
        filter,
        undo,
        ..
    } = plan;
    let record = UniformRecord::read(stream, |values| convert(&chain, values))?;
    let scale = 1.0 / chain.applied.factor;
    report.scale = scale;
    report.start = record.start;
    if let Some(density) = density(&record, scale) {
        report.noise.record = RecordNoise::of(&filter, &density);
    }
    let torque = match &undo {
        None => whole_record(&filter, &record.samples)?,
        Some(undo) => refined::torque(undo, (&stand, chain.std), &record, report)?,
    };
    deliver(args, sink, &record, &torque, scale)?;
    report.samples = torque.len();
    report.result = Sums::of(&torque).statistics(scale);
    report.resampled = record.resampled;
    Ok(Seen {
        summary: record.summary,
        excerpt: excerpt::of_memory(record.samples),
    })
}

/// Power density of a record in printed units, if it is long enough.
fn density(record: &UniformRecord, scale: f64) -> Option<Density> {
    let block = (record.samples.len() / 2).next_power_of_two() / 2;
    let printed: Vec<f64> = record.samples.iter().map(|x| x * scale).collect();
    welch(&printed, record.rate_hz, block.min(LONGEST_BLOCK)).ok()
}

fn deliver(
    args: &Compensate,
    sink: &mut Sink,
    record: &UniformRecord,
    torque: &[f64],
    scale: f64,
) -> Result<(), Failure> {
    let mut text = Text::default();
    let axis = (record.rate_hz, record.start);
    for (rows, range) in uniform_parts((args.digits, scale), axis, 0..torque.len()) {
        let (torque, recorded) = (&torque[range.clone()], &record.samples[range]);
        text.clear();
        if sink.is_text() {
            let beside = if args.with_recorded { recorded } else { &[] };
            rows.write(&mut text, torque, beside);
        }
        sink.take(&Part {
            rows,
            text: text.as_bytes(),
            torque,
            recorded,
        })?;
    }
    Ok(())
}
