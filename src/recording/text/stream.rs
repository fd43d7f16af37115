//! Streaming of one channel of a table.

use torqcomp_decimal::{Span, number};

use super::axes::Role;
use super::cell::{is_instruments_mark, is_non_finite, is_over_range};
use super::chunks::Chunks;
use super::clock::unwrap_periods;
use super::last_line::shortened;
use super::rows::{ColumnKind, LineNotes, RowPlan, Rows};
use super::table::Layout;

/// Advice for a missing number.
pub const BRIDGE: &str = "bridge it with --fill linear or --fill hold, or correct the line";

/// A channel read piece by piece; the pieces come in order and can be parsed independently.
pub struct TextStream {
    /// Pieces of whole lines.
    pub chunks: Chunks,
    /// Parsing of their rows.
    pub plan: ChannelPlan,
    /// The table.
    pub layout: Layout,
    /// Format of its stamps, if they are read.
    pub stamps: Option<StampColumn>,
    /// Mean length of a row, in bytes.
    pub row_bytes: usize,
    /// Byte of the file after the first rows, if further rows can be read there without conversion.
    pub behind_first_rows: Option<u64>,
}

/// Use of the stamps of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StampUse {
    /// Not read.
    Unread,
    /// They place the samples.
    Placing,
    /// A rate replaces them; gaps among them are reported.
    Watched,
}

/// A column of stamps.
pub struct StampColumn {
    /// Its heading.
    pub heading: String,
    /// Unit of its values, for messages.
    pub unit: &'static str,
    /// Seconds per unit.
    pub seconds_per_unit: f64,
    /// Origin in ns.
    pub origin_ns: i64,
    /// Whether their text is a number of seconds in the format of the output.
    pub copied: bool,
    /// Those of the first rows, in their unit.
    pub first: Vec<f64>,
}

/// The cells of a row that belong to the channel.
#[derive(Debug, Clone)]
pub struct ChannelPlan {
    rows: RowPlan,
    time: Option<usize>,
    value: usize,
    /// Whether the stamps are not needed, so that unreadable ones are not a fault.
    is_watched: bool,
    /// Seconds after which the clock of the stamps starts again, if it has no date.
    pub period_s: Option<f64>,
    headings: Vec<String>,
}

/// Rows of one channel in a piece of a file.
#[derive(Debug, Default)]
pub struct ChannelRows {
    /// Time stamps as written (in the file's unit); empty without a time column.
    pub times: Vec<f64>,
    /// Position of the text of each time stamp: offset in the upper, length in the lower half.
    pub time_text: Vec<Span>,
    /// The channel's values as written.
    pub values: Vec<f64>,
    /// Number of lines seen, rows and others.
    pub lines: usize,
    /// First of the lines without numbers not yet followed by a row; only without stamps, where such
    /// a line may be a lost sample.
    pub empty_at: Option<usize>,
    /// The unreadable row, if any; nothing after it counts.
    pub problem: Option<Problem>,
    /// Whether the table ends within the piece.
    pub ends: bool,
    /// Notes about the lines.
    pub notes: LineNotes,
    rows: Rows,
}

/// An unreadable row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Problem {
    /// Line within the piece, from 0.
    pub line: usize,
    /// Index of the cell, from 0.
    pub cell: usize,
}

impl TextStream {
    /// A channel of a table by its column.
    pub(super) fn new(
        mut chunks: Chunks,
        layout: Layout,
        value: usize,
        stamp_use: StampUse,
        is_decoded: bool,
    ) -> Self {
        let rule = match layout.axes.roles[value] {
            Role::Channel(rule) => layout.axes.rules[rule].stamps.clone(),
            _ => None,
        };
        let stamps = rule.filter(|_| stamp_use != StampUse::Unread);
        let is_watched = stamp_use == StampUse::Watched;
        let time = stamps.as_ref().map(|rule| rule.place);
        let plan = ChannelPlan::new(&layout, time, value, is_watched);
        chunks.skip(layout.offset);
        let rows = &layout.first_rows;
        let stamps = stamps.map(|rule| {
            let mut first = rows.columns[rule.place].values.clone();
            if let Some(period_s) = plan.period_s {
                unwrap_periods(&mut first, period_s);
            }
            StampColumn {
                copied: rule.seconds_per_unit == 1.0
                    && matches!(
                        layout.plan.kinds[rule.place],
                        ColumnKind::Numbers | ColumnKind::Offset(_)
                    )
                    && layout.plan.dialect.decimal == b'.',
                heading: rule.heading,
                unit: rule.unit,
                seconds_per_unit: rule.seconds_per_unit,
                origin_ns: rule.origin_ns,
                first,
            }
        });
        Self {
            row_bytes: layout.first_bytes / rows.count.max(1) + 1,
            behind_first_rows: (!is_decoded && plan.period_s.is_none())
                .then_some((layout.offset + layout.first_bytes) as u64),
            plan,
            layout,
            stamps,
            chunks,
        }
    }
}

impl ChannelPlan {
    fn new(layout: &Layout, time: Option<usize>, value: usize, is_watched: bool) -> Self {
        let last = value.max(time.unwrap_or(0));
        let kind = |place: usize| match Some(place) == time || place == value {
            true => layout.plan.kinds[place],
            false => ColumnKind::Nothing,
        };
        Self {
            rows: RowPlan {
                kinds: (0..=last).map(kind).collect(),
                stamps: time.filter(|_| !is_watched),
                items: layout
                    .plan
                    .items
                    .iter()
                    .filter(|item| item.column == value)
                    .cloned()
                    .collect(),
                keeps_stamp_text: time.is_some() && !is_watched,
                ..layout.plan.clone()
            },
            is_watched,
            period_s: time.and_then(|place| match layout.plan.kinds[place] {
                ColumnKind::Clock(first) => first.period_s(),
                _ => None,
            }),
            time,
            value,
            headings: layout
                .header
                .fields
                .iter()
                .map(|field| field.heading.clone())
                .collect(),
        }
    }

    /// Index of the channel's column.
    pub fn value_cell(&self) -> usize {
        self.value
    }

    /// The fault of a cell, and what to do.
    pub fn describe(&self, line: &str, cell: usize) -> String {
        let column = cell + 1;
        let name = self.headings.get(cell).map_or("", String::as_str);
        let decimal = self.rows.dialect.decimal;
        let cells = self.rows.dialect.cells(line);
        match cells.get(cell).map(String::as_str) {
            None if line.trim().is_empty() => self.describe_empty(column, name),
            None => format!(
                "column {column} (\"{name}\") is missing: the line \"{}\" has too few cells; \
                 complete or remove it",
                shortened(line)
            ),
            Some("") => self.describe_empty(column, name),
            Some(text) if is_instruments_mark(text) => format!(
                "column {column} (\"{name}\") reads \"{text}\", which instruments write for no value or over range; \
                 {BRIDGE}"
            ),
            Some(text) if is_over_range(text) => format!(
                "column {column} (\"{name}\") reads \"{text}\", which the recorder writes where the input exceeds its \
                 range: the peaks are lost. Record with a larger range, or exclude the part with --range; \
                 --fill linear only draws a straight line across"
            ),
            Some(text) if is_non_finite(text) => format!(
                "column {column} (\"{name}\") reads \"{text}\", which is not a finite number; {BRIDGE}"
            ),
            Some(text) => format!(
                "column {column} (\"{name}\") reads \"{}\", expected a number{}; correct or remove \
                 the line, or bridge it with --fill linear",
                shortened(text),
                other_mark(text, decimal)
            ),
        }
    }

    fn describe_empty(&self, column: usize, name: &str) -> String {
        format!("column {column} (\"{name}\") is empty; {BRIDGE}")
    }

    /// Line, from 0, of a row of a piece.
    pub fn line_of_row(&self, text: &[u8], row: usize) -> usize {
        let mut rows = ChannelRows::default();
        rows.read(text, self);
        rows.rows.line_of(row)
    }
}

impl ChannelRows {
    /// Empties the rows, keeping their memory.
    pub fn clear(&mut self) {
        self.times.clear();
        self.time_text.clear();
        self.values.clear();
        self.lines = 0;
        self.empty_at = None;
        self.problem = None;
        self.ends = false;
        self.notes = LineNotes::default();
    }

    /// Parses all lines of a piece. Every line ends with a line feed, except possibly the last.
    pub fn read(&mut self, text: &[u8], plan: &ChannelPlan) {
        self.clear();
        self.exchange(plan);
        self.rows.begin(0, plan.rows.kinds.len());
        let end = self.rows.read(text, &plan.rows);
        self.ends = end.is_ok_and(|end| end < text.len());
        let time = plan.time.filter(|_| !plan.is_watched);
        let places = [time.unwrap_or(plan.value), plan.value];
        self.rows.fill_together(&places);
        let holes = places.iter().filter_map(|place| {
            let hole = self.rows.columns[*place].holes.first()?;
            Some((hole.index, hole.line, *place))
        });
        // The leftmost bad cell of the first bad line.
        let first = holes.min_by_key(|(index, _, place)| (*index, *place));
        let filled = self.rows.columns[plan.value].values.len();
        if filled < self.rows.count && time.is_none() {
            self.empty_at = Some(self.rows.line_of(filled));
        }
        self.lines = self.rows.line;
        self.notes = std::mem::take(&mut self.rows.notes);
        self.exchange(plan);
        if let Some((row, line, cell)) = first {
            self.times.truncate(row);
            self.time_text.truncate(row);
            self.values.truncate(row);
            self.lines = line;
            self.problem = Some(Problem { line, cell });
        }
        if let Some(period_s) = plan.period_s {
            unwrap_periods(&mut self.times, period_s);
        }
    }

    /// Moves the columns into the parser, or out of it.
    fn exchange(&mut self, plan: &ChannelPlan) {
        let columns = &mut self.rows.columns;
        columns.resize_with(plan.rows.kinds.len(), Default::default);
        std::mem::swap(&mut columns[plan.value].values, &mut self.values);
        if let Some(time) = plan.time {
            std::mem::swap(&mut columns[time].values, &mut self.times);
        }
        std::mem::swap(&mut self.rows.stamp_text, &mut self.time_text);
    }
}

/// A hint if the number would be valid with the other decimal mark.
pub(super) fn other_mark(text: &str, decimal: u8) -> &'static str {
    let other = if decimal == b'.' { b',' } else { b'.' };
    match number::cell(text, other) {
        Some(_) if decimal == b'.' => " with a decimal point (see --decimal)",
        Some(_) => " with a decimal comma (see --decimal)",
        None => "",
    }
}
