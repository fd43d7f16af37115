//! The whole-record way: everything in memory, one transform.

use torqcomp_dsp::compensate::whole_record;
use torqcomp_dsp::noise::RecordNoise;
use torqcomp_dsp::spectrum::welch;

use super::sink::Sink;
use super::{Extent, Plan, Run};
use crate::cli::Compensate;
use crate::commands::convert;
use crate::commands::rows::{Rows, Times};
use crate::failure::Failure;
use crate::io::text::Text;
use crate::report::svg::Traces;
use crate::signal::Record;

/// Rows that are written at once.
const ROWS_AT_ONCE: usize = 1 << 14;
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
    let time = signal.time.clone();
    let record = Record::read(signal, |values| convert(&chain, values))?;
    let torque = whole_record(&filter, &record.samples)?;
    let scale = 1.0 / chain.applied.factor;
    let mut traces = args.plot.as_ref().map(|_| Traces::new(args.plot_range));
    let mut text = Text::default();
    for (part, first) in torque.chunks(ROWS_AT_ONCE).zip((0..).step_by(ROWS_AT_ONCE)) {
        let recorded = &record.samples[first..first + part.len()];
        let rows = Rows {
            digits: args.digits,
            scale,
            rate_hz: time.rate_hz,
            times: Times::Grid {
                start_s: record.start_s,
                first,
            },
        };
        text.clear();
        rows.write(
            &mut text,
            part,
            if args.with_recorded { recorded } else { &[] },
        );
        sink.take(text.as_bytes(), &rows, part)?;
        if let Some(traces) = &mut traces {
            for (i, (torque, recorded)) in part.iter().zip(recorded).enumerate() {
                traces.add(rows.time_s(i), recorded * scale, torque * scale);
            }
        }
    }
    let block = (record.samples.len() / 2).next_power_of_two() / 2;
    let printed: Vec<f64> = record.samples.iter().map(|x| x * scale).collect();
    let density = welch(&printed, time.rate_hz, block.min(LONGEST_BLOCK)).ok();
    Ok(Run {
        samples: torque.len(),
        start_s: record.start_s,
        extent: Extent::of(&torque).scaled(scale),
        resampled: record.resampled,
        noise: density.and_then(|density| RecordNoise::of(&filter, &density)),
        summary: record.summary,
        traces,
    })
}
