//! Text tables as recorders write them.

mod chunks;
mod columns;
mod habit;
mod layout;
mod names;
mod scan;
mod time;

use std::io::Read;

use crate::failure::Failure;
use crate::warning::Warning;

pub use chunks::{Chunks, Piece};
pub(crate) use columns::{list, time_column};
pub use layout::{Delimiter, Dialect, Layout, Told, decode_line, is_skipped};
pub(crate) use layout::{dialects, find as find_layout_in, is_not_a_number};
pub use names::{Column, NamedUnit};
pub use scan::{Defect, Problem, RowPlan, Rows, place_of};
pub(crate) use time::without_rounding;
pub use time::{Break, Stamps, TimeAxis, TimeSource};

/// Bytes of a file that its layout is told from.
const HEAD: usize = 1 << 16;
/// The same if the table begins only after that much.
const LONG_HEAD: usize = 1 << 20;

/// What the command line says about a table.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Channel to read.
    pub channel: Option<String>,
    /// Its unit, if the file does not say or is wrong.
    pub unit: Option<String>,
    /// Column of the time stamps.
    pub time_column: Option<String>,
    /// Unit of the time stamps.
    pub time_unit: Option<String>,
    /// Sampling rate; the time column is not used then, unless for resampling.
    pub rate_hz: Option<f64>,
    /// Whether irregular stamps are brought onto a grid.
    pub resample: bool,
    /// Whether stamps may be irregular, because they are only handed on.
    pub any_steps: bool,
    /// How the file is written.
    pub told: Told,
}

/// A table that is open for reading, one channel of it chosen.
pub struct Table {
    /// Name of the file, for people.
    pub source: String,
    /// How it is laid out.
    pub layout: Layout,
    /// The channel that is read.
    pub channel: Column,
    /// How its samples lie in time.
    pub time: TimeAxis,
    pub(crate) plan: RowPlan,
    pub(crate) head: Vec<u8>,
    pub(crate) input: Box<dyn Read + Send>,
    /// Mean length of a row in the head, in bytes.
    pub(crate) row_bytes: usize,
    /// Fewest characters of a value in the head.
    pub(crate) shortest_value: usize,
    /// What the command line says otherwise than the file.
    pub(crate) warnings: Vec<Warning>,
    /// First time stamp as written.
    pub(crate) first_stamp: Option<f64>,
}

impl Table {
    /// Finds the table in a text, its channel and its time axis.
    ///
    /// # Errors
    /// If the text cannot be read, holds no table, or leaves open what is to be read.
    pub fn of(
        name: String,
        mut input: Box<dyn Read + Send>,
        options: &Options,
    ) -> Result<Self, Failure> {
        match Self::read(&name, &mut input, options) {
            Ok(parts) => Ok(parts.with(name, input)),
            Err(failure) => Err(failure.at(&name)),
        }
    }

    fn read(name: &str, input: &mut dyn Read, options: &Options) -> Result<Parts, Failure> {
        let (head, layout) = find_layout(name, input, &options.told)?;
        let time_place = columns::time_column(&layout.columns, options)?;
        if time_place.is_none() && options.rate_hz.is_none() {
            return Err(Failure::failed(time::missing(&layout)));
        }
        let value_place = columns::channel(&layout.columns, time_place, options)?;
        let mut channel = layout.columns[value_place].clone();
        let mut warnings = Vec::new();
        if let Some(text) = &options.unit {
            let unit = torqcomp_model::Unit::parse(text)
                .map_err(|error| Failure::usage(format_args!("--unit {text}: {error}")))?;
            if let Some(named) = channel.unit.as_ref().filter(|named| named.unit != unit) {
                warnings.push(Warning::new(
                    "unit-overrides-heading",
                    format!(
                        "\"{}\" says {}, --unit says {text}; {text} was taken",
                        channel.heading, named.text
                    ),
                ));
            }
            channel.unit = Some(NamedUnit {
                text: text.clone(),
                unit,
            });
        }
        let plan = RowPlan {
            dialect: layout.dialect,
            time: time_place,
            value: value_place,
        };
        let sample = Sample::of(&head, head.len() < HEAD, &layout, &plan);
        let time = TimeAxis::find(&layout, time_place, &sample.rows, options)?;
        warnings.extend(time::overridden(&layout, time_place, &sample.rows, options));
        // Stamps that are not used need not be read, nor be right.
        let plan = RowPlan {
            time: plan.time.filter(|_| time.uses_stamps()),
            ..plan
        };
        Ok(Parts {
            layout,
            channel,
            time,
            plan,
            head,
            sample,
            warnings,
        })
    }
}

struct Parts {
    layout: Layout,
    channel: Column,
    time: TimeAxis,
    plan: RowPlan,
    head: Vec<u8>,
    sample: Sample,
    warnings: Vec<Warning>,
}

impl Parts {
    fn with(self, source: String, input: Box<dyn Read + Send>) -> Table {
        Table {
            source,
            layout: self.layout,
            channel: self.channel,
            time: self.time,
            plan: self.plan,
            head: self.head,
            input,
            row_bytes: self.sample.row_bytes,
            shortest_value: self.sample.shortest_value,
            warnings: self.warnings,
            first_stamp: self.sample.rows.times.first().copied(),
        }
    }
}

/// The rows in the head of a file, before the file is read in full.
struct Sample {
    rows: Rows,
    row_bytes: usize,
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

fn find_layout(
    name: &str,
    input: &mut dyn Read,
    told: &Told,
) -> Result<(Vec<u8>, Layout), Failure> {
    let reading = |error| Failure::failed(format_args!("{name}: cannot be read: {error}"));
    let mut head = chunks::head(input, HEAD).map_err(reading)?;
    refuse_other_formats(&head)?;
    let complete = head.len() < HEAD;
    let found = layout::find(&head, complete, told);
    if found.is_ok() || complete {
        return found.map(|layout| (head, layout));
    }
    let more = chunks::head(input, LONG_HEAD - HEAD).map_err(reading)?;
    head.extend(more);
    layout::find(&head, head.len() < LONG_HEAD, told).map(|layout| (head, layout))
}

/// Names the formats that are often handed over in place of text.
pub(crate) fn refuse_other_formats(head: &[u8]) -> Result<(), Failure> {
    let known: [(&[u8], &str); 5] = [
        (b"\xFF\xFE", "UTF-16 text; save it as UTF-8"),
        (b"\xFE\xFF", "UTF-16 text; save it as UTF-8"),
        (
            b"PK\x03\x04",
            "a zip archive or a spreadsheet; export the sheet as CSV",
        ),
        (
            b"\x1F\x8B",
            "compressed with gzip; pipe it: gunzip -c FILE | torqcomp … -",
        ),
        (
            b"\x28\xB5\x2F\xFD",
            "compressed with zstd; pipe it: zstdcat FILE | torqcomp … -",
        ),
    ];
    match known.iter().find(|(magic, _)| head.starts_with(magic)) {
        Some((_, what)) => Err(Failure::failed(format_args!("the file is {what}"))),
        None if is_binary(head) => Err(Failure::failed(
            "the file is binary; expected a text table (CSV, TSV or a recorder's export)",
        )),
        None => Ok(()),
    }
}

/// Whether there are more zero bytes than a fault in a text would leave.
fn is_binary(head: &[u8]) -> bool {
    head.iter().filter(|byte| **byte == 0).count() > head.len() / 100
}
