//! A channel of a plain table of text, as a stream.

use std::io::Read;

use super::TimeAxis;
use super::block::TextBlocks;
use super::checkpoints;
use super::choice::{self, Label, choose};
use super::stamps::StampGrid;
use super::stream::ChannelStream;
use super::validator::TextRows;
use crate::failure::Failure;
use crate::io::csv::{self, Column, Layout, RowPlan, Rows};
use crate::io::{ChannelChoice, Input, Reading};
use crate::print::list;
use crate::unit::NamedUnit;

/// Bytes of a file that its layout is told from.
const HEAD: usize = 1 << 16;
/// The same if the table begins only after that much.
const LONG_HEAD: usize = 1 << 20;

/// Finds the table in a text, its channel and its time axis.
///
/// # Errors
/// If the text cannot be read, holds no table, or leaves open what is to be read.
pub(super) fn open(
    input: &Input,
    mut bytes: Box<dyn Read + Send>,
    choice: &ChannelChoice,
    reading: &Reading,
) -> Result<ChannelStream, Failure> {
    let (mut head, layout) = find_layout(&mut bytes, reading)?;
    let stamps_at = time_column(&layout.columns, reading)?;
    if stamps_at.is_none() && reading.rate_hz.is_none() {
        return Err(Failure::failed(missing(&layout)));
    }
    let value_at = channel(&layout.columns, stamps_at, choice)?;
    let column = &layout.columns[value_at];
    let (unit, warning) = choice::unit_of(choice, &column.heading, column.unit.as_ref())?;
    let plan = RowPlan {
        dialect: layout.dialect,
        time: stamps_at,
        value: value_at,
    };
    let sample = Sample::of(&head, head.len() < HEAD, &layout, &plan);
    let stamps = stamps_at.map(|place| &layout.columns[place]);
    let later = checkpoints::of_text(input, head.len() as u64, &plan);
    let known = [sample.rows.times.as_slice(), &later];
    let (time, overridden) = time_axis(&layout, stamps, known, reading)?;
    // Stamps that are not used need not be read, nor be right.
    let plan = RowPlan {
        time: plan.time.filter(|_| time.grid.is_some()),
        ..plan
    };
    head.drain(..layout.data_offset);
    let name = input.name();
    Ok(ChannelStream {
        source: name.clone(),
        dialect: layout.dialect.describe(),
        name: column.name.clone(),
        unit,
        rate_hz: time.rate_hz.unwrap_or(f64::NAN),
        start_s: time.start_s.unwrap_or(0.0),
        time,
        origin: None,
        any_steps: reading.any_steps,
        warnings: warning.into_iter().chain(overridden).collect(),
        blocks: Box::new(TextBlocks::new(name, head, bytes, sample.row_bytes)),
        text: Some(TextRows {
            plan,
            columns: layout.columns.iter().map(|c| c.heading.clone()).collect(),
            shortest_value: sample.shortest_value,
            lines_before: layout.data_line - 1,
        }),
    })
}

/// The time axis of a table: by the stamps that its first rows begin with, or at the rate that is given.
fn time_axis(
    layout: &Layout,
    stamps: Option<&Column>,
    [first, later]: [&[f64]; 2],
    reading: &Reading,
) -> Result<(TimeAxis, Option<crate::warning::Warning>), Failure> {
    match (stamps, reading.rate_hz) {
        (Some(column), rate_hz) if rate_hz.is_none() || reading.resample => {
            let NamedUnit { text, unit } = stamp_unit(column, reading)?;
            let grid = StampGrid {
                unit: text,
                seconds_per_unit: unit.factor(),
                copied: unit.factor() == 1.0 && layout.dialect.decimal == b'.',
                ..StampGrid::of_seconds()
            };
            let axis = TimeAxis::of_stream(&column.heading, grid, first, later, reading)?;
            Ok((axis, None))
        }
        (stamps, Some(rate_hz)) => {
            let overridden = stamps.and_then(|column| {
                let factor = stamp_unit(column, reading).ok()?.unit.factor();
                let first_s: Vec<f64> = first.iter().map(|stamp| stamp * factor).collect();
                choice::overridden(reading, &column.heading, &first_s)
            });
            Ok((TimeAxis::given(rate_hz), overridden))
        }
        (_, None) => Err(Failure::failed(missing(layout))),
    }
}

/// The unit of a column of stamps: from the user, or from the heading.
fn stamp_unit(column: &Column, reading: &Reading) -> Result<NamedUnit, Failure> {
    let named = match (&reading.time_unit, &column.unit) {
        (Some(text), _) => NamedUnit::given("--time-unit", text)?,
        (None, Some(named)) => named.clone(),
        (None, None) => {
            return Err(Failure::failed(format_args!(
                "the time column \"{}\" does not say its unit; give it with --time-unit s (or ms, \
                 us, min)",
                column.heading
            )));
        }
    };
    if named.is_time() {
        Ok(named)
    } else {
        Err(Failure::failed(format_args!(
            "the time column \"{}\" is in \"{}\", which is no unit of time; give it with \
             --time-unit s (or ms, us, min), or another column with --time-column",
            column.heading, named.text
        )))
    }
}

/// What to do about a table without a time axis.
fn missing(layout: &Layout) -> String {
    if layout.heading_line.is_none() && layout.columns.len() > 1 {
        return "the columns have no headings, so none is known to be the time; give --rate HZ, or \
                --time-column 1 --time-unit s if the first column is the time in seconds"
            .to_owned();
    }
    "there is no time column, so the sampling rate is unknown; give it with --rate HZ, or name the \
     column with --time-column"
        .to_owned()
}

fn label(column: &Column) -> Label<'_> {
    Label {
        heading: &column.heading,
        name: &column.name,
        segment: None,
    }
}

/// Place of the time column, if there is one.
pub(super) fn time_column(columns: &[Column], reading: &Reading) -> Result<Option<usize>, Failure> {
    if let Some(wanted) = &reading.time_column {
        let labels: Vec<Label> = columns.iter().map(label).collect();
        return choose(&labels, Some(wanted), "--time-column").map(Some);
    }
    let candidates: Vec<usize> = (0..columns.len())
        .filter(|i| columns[*i].is_time())
        .collect();
    let named: Vec<usize> = candidates
        .iter()
        .copied()
        .filter(|i| columns[*i].is_named_time())
        .collect();
    match (named.as_slice(), candidates.as_slice()) {
        ([one], _) | ([], [one]) => Ok(Some(*one)),
        (_, []) => Ok(None),
        (_, several) if reading.rate_hz.is_some() && !reading.resample => {
            Ok(several.first().copied())
        }
        (_, several) => Err(Failure::failed(format_args!(
            "{} columns could be the time axis; choose one with --time-column {}",
            several.len(),
            list(
                several
                    .iter()
                    .map(|i| format!("\"{}\"", columns[*i].heading))
            )
        ))),
    }
}

/// Place of the column of the channel: like `inspect`, this does not count columns of time.
fn channel(
    columns: &[Column],
    stamps_at: Option<usize>,
    choice: &ChannelChoice,
) -> Result<usize, Failure> {
    let signals: Vec<usize> = (0..columns.len())
        .filter(|i| Some(*i) != stamps_at && !columns[*i].is_time())
        .collect();
    if signals.is_empty() {
        return Err(Failure::failed(
            "there is no column besides the time; expected one with the signal",
        ));
    }
    let labels: Vec<Label> = signals.iter().map(|i| label(&columns[*i])).collect();
    let place = choose(&labels, choice.channel.as_deref(), choice.flags.channel)?;
    Ok(signals[place])
}

/// The rows in the head of a file, before the file is read in full.
struct Sample {
    rows: Rows,
    /// Mean length of a row, in bytes.
    row_bytes: usize,
    /// Fewest characters of a value.
    shortest_value: usize,
}

impl Sample {
    fn of(head: &[u8], complete: bool, layout: &Layout, plan: &RowPlan) -> Self {
        let data = &head[layout.data_offset..];
        // The last line may be cut by the end of the head. A row that cannot be read is not
        // counted here: it is an error when its turn comes.
        let last = memchr::memrchr(b'\n', data).map_or(data.len(), |place| place + 1);
        let end = if complete { data.len() } else { last };
        let mut rows = Rows::default();
        let mut line = Rows::default();
        for text in data[..end].split_inclusive(|byte| *byte == b'\n') {
            line.read(text, plan);
            rows.times.extend_from_slice(&line.times);
            rows.values.extend_from_slice(&line.values);
        }
        let shortest_value = String::from_utf8_lossy(&data[..end])
            .lines()
            .filter_map(|line| layout.dialect.cells(line).get(plan.value).map(String::len))
            .filter(|length| *length > 0)
            .min()
            .unwrap_or(0);
        Self {
            row_bytes: end / rows.values.len().max(1) + 1,
            rows,
            shortest_value,
        }
    }
}

fn find_layout(input: &mut dyn Read, reading: &Reading) -> Result<(Vec<u8>, Layout), Failure> {
    let unreadable = |error| Failure::failed(format_args!("cannot be read: {error}"));
    let mut head = csv::head(input, HEAD).map_err(unreadable)?;
    csv::refuse_other_formats(&head)?;
    let complete = head.len() < HEAD;
    let found = csv::find_layout_in(&head, complete, &reading.dialect);
    if found.is_ok() || complete {
        return found.map(|layout| (head, layout));
    }
    let more = csv::head(input, LONG_HEAD - HEAD).map_err(unreadable)?;
    head.extend(more);
    csv::find_layout_in(&head, head.len() < LONG_HEAD, &reading.dialect)
        .map(|layout| (head, layout))
}
