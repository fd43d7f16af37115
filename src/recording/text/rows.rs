//! Parsing of rows of numbers from lines, for every wanted column.
//!
//! Nearly all rows have the format of the preceding one ([`RowTemplate`]) or contain plain numbers
//! between separators. Anything else in a line (quotes, thousands separators, remarks, faults) is
//! parsed carefully. All three parsers give the same numbers.

mod cut;
mod items;
mod plain_row;

use torqcomp_decimal::{Span, number};

use super::blocks::TableEnd;
use super::cell::{Cell, is_instruments_mark, is_over_range};
use super::clock::Clock;
use super::row_template::RowTemplate;
use crate::failure::{ErrorCode, Failure};
use crate::recording::text::dialect::{Dialect, decode_line, is_comment, is_skipped};
use crate::recording::{Hole, HoleKind};
use cut::line_of;
pub use items::{Item, items};

/// Content of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// Numbers.
    Numbers,
    /// Dates and times of day, as seconds relative to this one.
    Clock(Clock),
    /// Numbers with more digits than an `f64` has, as differences from this integer.
    Offset(i64),
    /// Texts, or nothing wanted.
    Nothing,
}

/// Format of rows and their wanted content.
#[derive(Debug, Clone)]
pub struct RowPlan {
    /// How cells and numbers are written.
    pub dialect: Dialect,
    /// Content of the columns, up to the last wanted one.
    pub kinds: Vec<ColumnKind>,
    /// Number of columns of the table; numbers beyond them are reported.
    pub width: usize,
    /// Column of the time stamps in use. Without stamps, a line that is not a row may be a lost
    /// sample.
    pub stamps: Option<usize>,
    /// Whether the position of each stamp's text is kept, for copying. Such stamps are compared with
    /// a tolerance, so that their last bit does not matter.
    pub keeps_stamp_text: bool,
    /// What ends the table.
    pub end: TableEnd,
    /// Columns whose values are identified by names in other columns.
    pub items: Vec<Item>,
}

/// A parsed column.
#[derive(Debug, Clone, Default)]
pub struct Column {
    /// A value for each row up to the last that has one.
    pub values: Vec<f64>,
    /// Non-numeric cells, up to the same row.
    pub holes: Vec<Hole>,
}

/// Parsed rows.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// The columns.
    pub columns: Vec<Column>,
    /// Position of the text of each stamp: offset in the upper, length in the lower half.
    pub stamp_text: Vec<Span>,
    /// Number of rows.
    pub count: usize,
    /// Number of the next line.
    pub line: usize,
    /// Notes about the lines.
    pub notes: LineNotes,
    /// Number of empty cells that may still be filled; they take memory that the file need not
    /// have.
    budget: usize,
    /// Line at which the budget was exhausted.
    too_ragged: Option<usize>,
    /// Row and line of each first row after a line that is not a row.
    breaks: Vec<(usize, usize)>,
}

/// Notes about the lines of a table.
#[derive(Debug, Clone, Default)]
pub struct LineNotes {
    /// The first line among the rows that is not a row, and its text.
    pub odd: Option<(usize, String)>,
    /// Number of such lines.
    pub odd_count: usize,
    /// The first row with numbers beyond the columns.
    pub too_wide: Option<usize>,
    /// Number of zero bytes skipped.
    pub zeros: usize,
    /// Number of rows in which an item of a list was at another index.
    pub moved: usize,
}

/// Number of empty cells that any file may have, in addition to one per byte.
const FREE_CELLS: usize = 1 << 20;
/// Number of characters of an odd line that are shown.
const SHOWN: usize = 60;

impl Rows {
    /// Resets to no rows; the next line has this number.
    pub fn begin(&mut self, line: usize, columns: usize) {
        let mut kept = std::mem::take(&mut self.columns);
        for column in &mut kept {
            column.values.clear();
            column.holes.clear();
        }
        kept.resize_with(columns, Column::default);
        let mut stamp_text = std::mem::take(&mut self.stamp_text);
        stamp_text.clear();
        *self = Self {
            columns: kept,
            stamp_text,
            line,
            budget: FREE_CELLS,
            ..Self::default()
        };
    }

    /// Parses the lines of a piece, after those of preceding pieces. Every line ends with a line
    /// feed, except possibly the last. Returns the number of bytes consumed: fewer than available if
    /// the table ends before.
    ///
    /// # Errors
    /// If the row lengths differ so much that the cells between would need far more memory than the
    /// file.
    pub fn read(&mut self, text: &[u8], plan: &RowPlan) -> Result<usize, Failure> {
        self.budget += text.len();
        let mut template = RowTemplate::of(plan);
        let mut at = 0;
        while at < text.len() {
            at = self.rows_like(&mut template, text, at, plan);
            if at == text.len() {
                break;
            }
            let end = match self.plain_row(text, at, plan) {
                Some(end) => end,
                None => {
                    let end = line_end(text, at);
                    if !self.careful_row(&text[at..end], at, plan) {
                        break;
                    }
                    end
                }
            };
            self.line += 1;
            template.learn(text, at, plan);
            at = end;
        }
        match self.too_ragged {
            None => Ok(at),
            Some(line) => Err(ErrorCode::NotARecording.failed(format_args!(
                "line {line} is so much longer than the rows before it that these would need more \
                 memory than the whole file; expected rows of about the same number of cells"
            ))),
        }
    }

    /// Parses the rows from `at` on that match the template; returns their end.
    #[inline]
    fn rows_like(
        &mut self,
        template: &mut RowTemplate,
        text: &[u8],
        mut at: usize,
        plan: &RowPlan,
    ) -> usize {
        let (row, line) = (self.count, self.line);
        let [first, second, ..] = self.columns.as_mut_slice() else {
            return at;
        };
        if first.values.len() != row || second.values.len() != row {
            return at;
        }
        while let Some((pair, end)) = template.row(text, at, plan) {
            first.values.push(pair.values[0]);
            second.values.push(pair.values[1]);
            if plan.keeps_stamp_text {
                self.stamp_text.push(pair.copied);
            }
            at = end;
        }
        let count = first.values.len() - row;
        if count > 0 {
            self.note_break(line);
            self.count += count;
            self.line += count;
        }
        at
    }

    fn note_break(&mut self, number: usize) {
        let expected = self
            .breaks
            .last()
            .map(|(row, line)| line + (self.count - row));
        if expected != Some(number) {
            self.breaks.push((self.count, number));
        }
    }

    /// Processes a line that is not a plain row; `false` if the table ends before it.
    #[cold]
    fn careful_row(&mut self, line: &[u8], at: usize, plan: &RowPlan) -> bool {
        let (text, zeros) = cleaned(line);
        self.notes.zeros += zeros;
        if self.too_ragged.is_some() || plan.end.is_at(&text) {
            return false;
        }
        let number = self.line;
        if is_skipped(&text) {
            if !is_comment(&text) {
                self.add_empty_row(plan);
            }
            return true;
        }
        let cells = plan.dialect.cells(&text);
        let read: Vec<Cell> = cells
            .iter()
            .map(|cell| Cell::read(cell, plan.dialect.decimal))
            .collect();
        if is_of_other_columns(&read, plan) {
            self.add_empty_row(plan);
            return true;
        }
        if !is_row(&read, plan) && !is_damaged_row(&text, &read) {
            self.notes.odd_count += 1;
            let shown = || (number, text.trim().chars().take(SHOWN).collect());
            self.notes.odd.get_or_insert_with(shown);
            self.add_empty_row(plan);
            return true;
        }
        if read.iter().skip(plan.width).any(|cell| cell.is_number()) {
            self.notes.too_wide.get_or_insert(number);
        }
        self.note_break(number);
        let mut moved = false;
        for place in 0..read.len().min(plan.kinds.len()) {
            let item = plan.items.iter().find(|item| item.column == place);
            let from = item.map_or(Some(place), |item| item.place_in(&cells));
            moved |= from != Some(place);
            match from {
                Some(from) if from < read.len() => self.put(place, read[from], &cells[from], plan),
                _ => self.put(place, Cell::Text, "", plan),
            }
        }
        self.notes.moved += usize::from(moved);
        if plan.keeps_stamp_text {
            // The same text elsewhere in the line is equivalent, as long as it is not quoted.
            let cell = plan.stamps.and_then(|place| cells.get(place));
            let cell = cell.map_or(&b""[..], |cell| cell.as_bytes());
            let found = memchr::memmem::find(line, cell);
            self.stamp_text
                .push(found.map_or(Span::default(), |offset| Span::new(at + offset, cell.len())));
        }
        self.count += 1;
        true
    }

    /// Treats a line without numbers as a row, unless stamps would show that a sample is missing there.
    fn add_empty_row(&mut self, plan: &RowPlan) {
        if plan.stamps.is_none() {
            self.note_break(self.line);
            self.count += 1;
        }
    }

    fn put(&mut self, place: usize, cell: Cell, text: &str, plan: &RowPlan) {
        let decimal = plan.dialect.decimal;
        let value = match (plan.kinds[place], cell) {
            (ColumnKind::Nothing, _) | (_, Cell::Empty) => return,
            (ColumnKind::Numbers, Cell::Number(value) | Cell::Grouped(value)) => Ok(value),
            (ColumnKind::Clock(first), Cell::Clock(clock)) => Ok(clock.seconds_after(first)),
            (ColumnKind::Offset(origin), Cell::Number(value) | Cell::Grouped(value)) => {
                let after = number::read_after(text.as_bytes(), 0, decimal, origin);
                let after = after.filter(|(_, end)| *end == text.len());
                Ok(after.map_or(value - origin as f64, |(after, _)| after))
            }
            (_, Cell::NonFinite) if is_instruments_mark(text) => Err(HoleKind::InstrumentsMark),
            (_, Cell::NonFinite) if is_over_range(text) => Err(HoleKind::OverRange),
            (_, Cell::NonFinite) => Err(HoleKind::NonFinite),
            _ => Err(HoleKind::Text),
        };
        self.push(place, value.unwrap_or(f64::NAN));
        if let Err(what) = value
            && self.columns[place].values.len() > self.count
        {
            self.columns[place].holes.push(Hole {
                index: self.count,
                line: self.line,
                what,
            });
        }
    }

    /// Adds a value to a column; the rows without one become holes.
    #[inline]
    fn push(&mut self, place: usize, value: f64) {
        if self.columns[place].values.len() != self.count {
            self.fill(place);
        }
        self.columns[place].values.push(value);
    }

    /// Fills a column up to the present row with holes for empty cells.
    #[cold]
    fn fill(&mut self, place: usize) {
        let column = &mut self.columns[place];
        let empty = self.count - column.values.len();
        if empty > self.budget {
            self.too_ragged = Some(self.line);
            return;
        }
        self.budget -= empty;
        for index in column.values.len()..self.count {
            column.holes.push(Hole {
                index,
                line: line_of(&self.breaks, index),
                what: HoleKind::Empty,
            });
            column.values.push(f64::NAN);
        }
    }

    /// Fills columns up to the last row in which any of them has a value.
    pub fn fill_together(&mut self, places: &[usize]) {
        let lengths = places.iter().map(|place| self.columns[*place].values.len());
        let longest = lengths.max().unwrap_or(0);
        places
            .iter()
            .for_each(|place| self.fill_up_to(*place, longest));
    }

    /// Fills a column that has fewer values than `rows`.
    pub fn fill_up_to(&mut self, place: usize, rows: usize) {
        if self.columns[place].values.len() < rows {
            let count = std::mem::replace(&mut self.count, rows);
            self.fill(place);
            self.count = count;
        }
    }
}

impl LineNotes {
    /// Merges notes of lines that follow `before` others.
    pub fn join(&mut self, more: &Self, before: usize) {
        if let Some((line, text)) = &more.odd {
            self.odd
                .get_or_insert_with(|| (before + line, text.clone()));
        }
        self.odd_count += more.odd_count;
        self.too_wide = self.too_wide.or(more.too_wide.map(|line| before + line));
        self.zeros += more.zeros;
        self.moved += more.moved;
    }
}

/// Rows of a maker's own table with numbers in some columns, up to a line that begins with one of
/// `marks`; and their end.
pub fn of_numbers(
    text: &[u8],
    line: usize,
    dialect: Dialect,
    numbers: impl IntoIterator<Item = usize>,
    marks: &'static [&'static str],
) -> Result<(Rows, usize), Failure> {
    let mut kinds = Vec::new();
    for place in numbers {
        kinds.resize(kinds.len().max(place + 1), ColumnKind::Nothing);
        kinds[place] = ColumnKind::Numbers;
    }
    let plan = RowPlan {
        dialect,
        width: usize::MAX,
        stamps: Some(0),
        keeps_stamp_text: false,
        end: TableEnd::of_marks(marks, dialect),
        items: Vec::new(),
        kinds,
    };
    let mut rows = Rows::default();
    rows.begin(line, plan.kinds.len());
    let end = rows.read(text, &plan)?;
    Ok((rows, end))
}

/// A line as text, without zero bytes and line end, and the number of zero bytes.
pub(super) fn cleaned(line: &[u8]) -> (String, usize) {
    let zeros = memchr::memchr_iter(0, line).count();
    let text = match zeros {
        0 => decode_line(line),
        _ => decode_line(
            &line
                .iter()
                .copied()
                .filter(|b| *b != 0)
                .collect::<Vec<u8>>(),
        ),
    };
    let text = text.trim_end_matches(['\r', '\n', '\u{1a}']).to_owned();
    (text, zeros)
}

/// Whether cells form a row: a number or a date where one is wanted, and no more texts than those.
fn is_row(cells: &[Cell], plan: &RowPlan) -> bool {
    let wanted = || cells.iter().zip(&plan.kinds);
    let is_good = |(cell, kind): &(&Cell, &ColumnKind)| match kind {
        ColumnKind::Numbers | ColumnKind::Offset(_) => {
            cell.is_number() || **cell == Cell::NonFinite
        }
        ColumnKind::Clock(_) => matches!(cell, Cell::Clock(_)),
        ColumnKind::Nothing => false,
    };
    let is_bad =
        |(cell, kind): &(&Cell, &ColumnKind)| **kind != ColumnKind::Nothing && **cell == Cell::Text;
    let good = wanted().filter(is_good).count();
    good > 0 && good >= wanted().filter(is_bad).count()
}

/// Whether a row has data only in columns that are not wanted.
fn is_of_other_columns(cells: &[Cell], plan: &RowPlan) -> bool {
    let is_wanted = |place: usize| {
        let kind = plan.kinds.get(place);
        kind.is_some_and(|kind| *kind != ColumnKind::Nothing)
    };
    let mut cells = cells.iter().take(plan.width).enumerate();
    cells
        .clone()
        .any(|(place, cell)| !is_wanted(place) && cell.is_datum())
        && cells.all(|(place, cell)| !is_wanted(place) || *cell == Cell::Empty)
}

/// Whether an unreadable line was meant as a row: it begins with a digit, has no letters, and is not a
/// date.
fn is_damaged_row(text: &str, cells: &[Cell]) -> bool {
    let text = text.trim_start_matches([' ', '\t', '"', '-', '+', '.']);
    text.starts_with(|c: char| c.is_ascii_digit())
        && !text.chars().any(char::is_alphabetic)
        && !cells.iter().any(|cell| matches!(cell, Cell::Clock(_)))
}

/// Position after the line feed that ends the line at `at`.
#[inline]
pub(super) fn line_end(text: &[u8], at: usize) -> usize {
    memchr::memchr(b'\n', &text[at..]).map_or(text.len(), |place| at + place + 1)
}
