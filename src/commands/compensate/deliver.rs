//! A result that is there as a whole, written in parts.

use super::plot::Traces;
use super::sink::Sink;
use crate::cli::Compensate;
use crate::commands::rows::{Rows, Times};
use crate::failure::Failure;
use crate::io::text::Text;
use crate::signal::Record;

/// Rows that are written at once.
const ROWS_AT_ONCE: usize = 1 << 14;

/// Writes the torque of a record, and draws it if that is wanted; `scale` is in printed units per SI unit.
pub fn deliver(
    args: &Compensate,
    sink: &mut Sink,
    record: &Record,
    torque: &[f64],
    scale: f64,
) -> Result<Option<Traces>, Failure> {
    let mut traces = args.plot.as_ref().map(|_| Traces::new(args.plot_range));
    let mut text = Text::default();
    for (part, first) in torque.chunks(ROWS_AT_ONCE).zip((0..).step_by(ROWS_AT_ONCE)) {
        let recorded = &record.samples[first..first + part.len()];
        let rows = Rows {
            digits: args.digits,
            scale,
            rate_hz: record.rate_hz,
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
    Ok(traces)
}
