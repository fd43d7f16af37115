//! Rows of a result as text.

use std::ops::Range;

use torqcomp_decimal::{Digits, Span, Text, digits, number};

use crate::failure::Failure;
use crate::io::output::Output;
use crate::recording::moment::Moment;
use crate::recording::{Block, StampGrid};

/// Writes the rows of a result: time, torque and, if requested, the recorded torque.
pub(super) struct ResultRows<'a> {
    pub(super) digits: Digits,
    /// Printed units per SI unit.
    pub(super) scale: f64,
    pub(super) rate_hz: f64,
    pub(super) times: Times<'a>,
}

/// Source of the text of the time column.
pub(super) enum Times<'a> {
    /// Copied from the input.
    Copied { text: &'a [u8], spans: &'a [Span] },
    /// Time stamps in another unit, multiplied by seconds per unit.
    Stamps { times: &'a [f64], seconds: f64 },
    /// Time stamps relative to an origin.
    Counted {
        times: &'a [f64],
        grid: &'a StampGrid,
    },
    /// A grid: start, index of the first sample, rate.
    Grid { start: Moment, first: usize },
}

/// Number of rows written at once.
const ROWS_AT_ONCE: usize = 1 << 14;

/// The parts of some samples of a record on a uniform time axis, each with the range of its samples.
pub(super) fn uniform_parts(
    (digits, scale): (Digits, f64),
    (rate_hz, start): (f64, Moment),
    samples: Range<usize>,
) -> impl Iterator<Item = (ResultRows<'static>, Range<usize>)> {
    let end = samples.end;
    samples.step_by(ROWS_AT_ONCE).map(move |first| {
        let rows = ResultRows {
            digits,
            scale,
            rate_hz,
            times: Times::Grid { start, first },
        };
        (rows, first..end.min(first + ROWS_AT_ONCE))
    })
}

/// Writes samples of a record on a uniform time axis, the first of which is the `first` of the record.
pub(super) fn write_uniform(
    output: &mut Output,
    digits: Digits,
    axis: (f64, Moment),
    first: usize,
    samples: &[f64],
) -> Result<(), Failure> {
    let mut text = Text::default();
    for (rows, range) in uniform_parts((digits, 1.0), axis, first..first + samples.len()) {
        text.clear();
        rows.write(
            &mut text,
            &samples[range.start - first..range.end - first],
            &[],
        );
        output.write(text.as_bytes())?;
    }
    Ok(())
}

impl<'a> Times<'a> {
    /// The times of a block whose first sample is the `first` of the record.
    pub(super) fn of(
        block: &'a Block,
        grid: Option<&'a StampGrid>,
        start: Moment,
        first: usize,
    ) -> Self {
        let times = &block.rows.times;
        match grid.filter(|grid| !grid.resampled && !grid.is_coarse()) {
            None => Self::Grid { start, first },
            Some(grid) if grid.copied => Self::Copied {
                text: &block.text,
                spans: &block.rows.time_text,
            },
            Some(grid) if grid.origin_ns != 0 => Self::Counted { times, grid },
            Some(grid) => Self::Stamps {
                times,
                seconds: grid.seconds_per_unit,
            },
        }
    }
}

impl ResultRows<'_> {
    /// Digits that resolve a thousandth of a step at the time of the last row. Epoch stamps need more
    /// than a record that starts at zero.
    fn time_digits(&self, rows: usize) -> Digits {
        let (Some(last), rate_hz) = (rows.checked_sub(1), self.rate_hz) else {
            return digits::DEFAULT_DIGITS;
        };
        let steps = (self.time_s(last).abs() * rate_hz).max(1.0);
        match (steps.log10() as u32).saturating_add(5) {
            ..=12 => digits::DEFAULT_DIGITS,
            count @ 13..=15 => Digits::Significant(count),
            _ => Digits::Shortest,
        }
    }

    /// Appends the rows of `torque`, with `recorded` if not empty.
    pub(super) fn write(&self, out: &mut Text, torque: &[f64], recorded: &[f64]) {
        if let (Times::Copied { text, spans }, Digits::Significant(count), []) =
            (&self.times, self.digits, recorded)
        {
            out.rows((text, spans), (torque, self.scale), count);
            return;
        }
        let time_digits = self.time_digits(torque.len());
        for (i, value) in torque.iter().enumerate() {
            self.write_time(out, i, time_digits);
            out.number(value * self.scale, self.digits);
            self.end_row(out, recorded.get(i));
        }
    }

    #[inline]
    fn write_time(&self, out: &mut Text, i: usize, digits: Digits) {
        match &self.times {
            Times::Copied { text, spans } => out.copy(text, spans[i]),
            Times::Stamps { times, seconds } => out.number(times[i] * seconds, digits),
            Times::Counted { times, grid } => out.seconds(grid.nanoseconds(times[i])),
            Times::Grid { start, first } => match start.origin_ns {
                0 => out.number(self.time_s(i), digits),
                _ => out.seconds(self.on_grid(*start, first + i).nanoseconds()),
            },
        }
        out.byte(b',');
    }

    #[inline]
    fn end_row(&self, out: &mut Text, recorded: Option<&f64>) {
        if let Some(value) = recorded {
            out.byte(b',');
            out.number(value * self.scale, self.digits);
        }
        out.byte(b'\n');
    }

    fn on_grid(&self, start: Moment, sample: usize) -> Moment {
        start.later(sample as f64 / self.rate_hz)
    }

    /// Time of the row `i` in ns; a grid begins at `start_ns`.
    pub(super) fn time_ns(&self, i: usize, start_ns: i64) -> i64 {
        match &self.times {
            Times::Counted { times, grid } => grid.nanoseconds(times[i]),
            Times::Grid { first, .. } => {
                start_ns + (1e9 * (first + i) as f64 / self.rate_hz).round() as i64
            }
            _ => (1e9 * self.time_s(i)).round() as i64,
        }
    }

    /// Time of the row `i`.
    pub(super) fn time_s(&self, i: usize) -> f64 {
        match &self.times {
            Times::Copied { text, spans } => {
                number::read(text, spans[i].offset(), b'.').map_or(f64::NAN, |(value, _)| value)
            }
            Times::Stamps { times, seconds } => times[i] * seconds,
            Times::Counted { times, grid } => grid.nanoseconds(times[i]) as f64 * 1e-9,
            Times::Grid { start, first } => self.on_grid(*start, first + i).seconds(),
        }
    }
}
