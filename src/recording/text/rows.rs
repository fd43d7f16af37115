//! Reading the rows of a table: every column at once, plain numbers quickly, the rest with care.

mod cut;

use self::cut::line_of;
use super::cell::Cell;
use super::clock::{Clock, DAY};
use crate::failure::Failure;
use crate::io::csv::{Delimiter, Dialect, is_skipped};
use crate::io::number;
use crate::recording::{Hole, HoleKind};

/// What is wanted of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// Its numbers.
    Numbers,
    /// Dates and times of day, as seconds after the first of them.
    Clock,
    /// Integers too long for an `f64`, as differences to the first of them.
    Ticks,
    /// Nothing: it holds texts.
    Nothing,
}

/// A column as read.
#[derive(Debug, Clone, Default)]
pub struct Column {
    /// A value for each row up to the last that has one.
    pub values: Vec<f64>,
    /// Cells without a number, up to the same row.
    pub holes: Vec<Hole>,
    /// The first date or time, as nanoseconds and as written.
    pub first_clock: Option<(Clock, String)>,
    /// The first of integers that differences were taken to.
    pub first_ticks: Option<i64>,
    /// Nanoseconds of the last one, with the midnights that were passed.
    last_clock: i64,
}

/// Rows as read.
#[derive(Debug, Default)]
pub struct Rows {
    /// The columns.
    pub columns: Vec<Column>,
    /// How many rows there are.
    pub count: usize,
    /// Byte at which reading stopped: the end, or the line that `stop` told.
    pub end: usize,
    /// Lines read, rows and others.
    pub lines: usize,
    /// Lines among the rows that are none: line number and text.
    pub odd: Vec<(usize, String)>,
    /// How many of them there are.
    pub odd_count: usize,
    /// Rows with more cells than columns; the first one's line.
    pub too_wide: Option<usize>,
    /// Empty cells that may still be filled in; they cost memory that the file need not have.
    budget: usize,
    /// Line at which there was no budget left.
    too_ragged: Option<usize>,
    /// Row and line of each first row after a line that is no row.
    breaks: Vec<(usize, usize)>,
}

/// Empty cells that any file may have, besides one for each byte.
const FREE_CELLS: usize = 1 << 20;
/// Odd lines that are kept to be shown.
const ODD_LINES: usize = 5;

/// Reads rows from `text[from..]`, whose first line has the number `line`, until `stop` says so of a
/// line that is no row.
///
/// # Errors
/// If the rows have so different lengths that the cells between would need far more memory than the
/// file.
pub fn read(
    text: &[u8],
    from: usize,
    line: usize,
    dialect: Dialect,
    wanted: &[Wanted],
    stop: &dyn Fn(&str) -> bool,
) -> Result<Rows, Failure> {
    let mut rows = Rows {
        budget: text.len() + FREE_CELLS,
        columns: vec![Column::default(); wanted.len()],
        end: text.len(),
        ..Rows::default()
    };
    let plan = Plan { dialect, wanted };
    let mut at = from;
    while at < text.len() {
        let end = memchr::memchr(b'\n', &text[at..]).map_or(text.len(), |place| at + place);
        let content = trimmed(&text[at..end]);
        let number = line + rows.lines;
        if !rows.accept(content, number, &plan, stop) {
            rows.end = at;
            break;
        }
        rows.lines += 1;
        at = end + 1;
    }
    match rows.too_ragged {
        None => Ok(rows),
        Some(line) => Err(Failure::failed(format_args!(
            "line {line} is so much longer than the rows before it that these would need more memory \
             than the whole file; expected rows of about the same number of cells"
        ))),
    }
}

/// Without the carriage returns at the end.
fn trimmed(mut line: &[u8]) -> &[u8] {
    while let [rest @ .., b'\r'] = line {
        line = rest;
    }
    line
}

struct Plan<'a> {
    dialect: Dialect,
    wanted: &'a [Wanted],
}

impl Rows {
    /// Takes a line in; `false` if reading is to stop before it.
    #[inline]
    fn accept(
        &mut self,
        line: &[u8],
        number: usize,
        plan: &Plan,
        stop: &dyn Fn(&str) -> bool,
    ) -> bool {
        if self.quick(line, number, plan) {
            return true;
        }
        self.careful(line, number, plan, stop)
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

    /// A row of plain numbers, empty cells, dates and texts without quotes.
    #[inline]
    fn quick(&mut self, line: &[u8], number: usize, plan: &Plan) -> bool {
        let row = self.count;
        let places = plan.wanted.len();
        let (mut at, mut numbers) = (0, 0);
        for place in 0..places {
            at = plan.skip_to_cell(line, at, place);
            let Some((value, end)) = self.quick_cell(line, at, place, plan) else {
                // Taken back: the careful way reads the whole line anew.
                for column in &mut self.columns[..place] {
                    column.values.truncate(row);
                }
                return false;
            };
            if let Some(value) = value {
                let column = &mut self.columns[place];
                if column.values.len() != row {
                    let empty = row - column.values.len();
                    if empty > self.budget {
                        self.too_ragged = Some(number);
                        return false;
                    }
                    self.budget -= empty;
                    column.fill(row, &self.breaks);
                }
                column.values.push(value);
                numbers += 1;
            }
            at = end;
        }
        if numbers == 0 {
            return false;
        }
        self.note_break(number);
        self.count += 1;
        true
    }

    /// Value of a cell, if it has one, and where the next begins; `None` if it needs care.
    #[inline]
    fn quick_cell(
        &mut self,
        line: &[u8],
        at: usize,
        place: usize,
        plan: &Plan,
    ) -> Option<(Option<f64>, usize)> {
        let is_last = place + 1 == plan.wanted.len();
        if plan.wanted[place] == Wanted::Numbers
            && let Some((value, end)) = number::read(line, at, plan.dialect.decimal)
        {
            return Some((Some(value), plan.cell_end(line, end, is_last)?));
        }
        let Delimiter::Byte(mark) = plan.dialect.delimiter else {
            return None;
        };
        let length = memchr::memchr2(mark, b'"', &line[at..]).unwrap_or(line.len() - at);
        let end = at + length;
        let next = plan.cell_end(line, end, is_last)?;
        match plan.wanted[place] {
            _ if length == 0 => Some((None, next)),
            Wanted::Nothing => Some((None, next)),
            Wanted::Numbers => None,
            Wanted::Ticks => {
                let text = std::str::from_utf8(&line[at..end]).ok()?;
                let ticks = text.trim().parse().ok()?;
                Some((Some(self.columns[place].ticks(ticks)), next))
            }
            Wanted::Clock => {
                let text = std::str::from_utf8(&line[at..end]).ok()?;
                let clock = Clock::parse(text)?;
                Some((Some(self.columns[place].seconds(clock, text.trim())), next))
            }
        }
    }

    #[cold]
    fn careful(
        &mut self,
        line: &[u8],
        number: usize,
        plan: &Plan,
        stop: &dyn Fn(&str) -> bool,
    ) -> bool {
        let text = crate::io::csv::decode_line(line);
        if stop(&text) || self.too_ragged.is_some() {
            return false;
        }
        if is_skipped(&text) && !is_all_separators(&text, plan.dialect) {
            return true;
        }
        let cells = plan.dialect.cells(&text);
        let read: Vec<Cell> = cells
            .iter()
            .map(|cell| Cell::read(cell, plan.dialect.decimal))
            .collect();
        if !is_row(&read, plan.wanted) {
            self.odd_count += 1;
            if self.odd.len() < ODD_LINES {
                self.odd
                    .push((number, text.trim().chars().take(60).collect()));
            }
            return true;
        }
        if self.too_wide.is_none()
            && read
                .iter()
                .skip(plan.wanted.len())
                .any(|cell| cell.is_number())
        {
            self.too_wide = Some(number);
        }
        self.note_break(number);
        for (place, (cell, text)) in read.iter().zip(&cells).enumerate().take(plan.wanted.len()) {
            self.put(place, *cell, text, number, plan.wanted[place]);
        }
        self.count += 1;
        true
    }

    fn put(&mut self, place: usize, cell: Cell, text: &str, line: usize, wanted: Wanted) {
        let row = self.count;
        let column = &mut self.columns[place];
        let value = match (wanted, cell) {
            (Wanted::Nothing, _) | (_, Cell::Empty) => return,
            (Wanted::Numbers, Cell::Number(value) | Cell::Grouped(value)) => Ok(value),
            (Wanted::Clock, Cell::Clock(clock)) => Ok(column.seconds(clock, text)),
            (Wanted::Ticks, Cell::Number(_)) => match text.parse() {
                Ok(ticks) => Ok(column.ticks(ticks)),
                Err(_) => Err(HoleKind::Text),
            },
            (_, Cell::NonFinite) => Err(HoleKind::NonFinite),
            _ => Err(HoleKind::Text),
        };
        let empty = row - column.values.len().min(row);
        if empty > self.budget {
            self.too_ragged = Some(line);
            return;
        }
        self.budget -= empty;
        if column.values.len() < row {
            column.fill(row, &self.breaks);
        }
        column.values.push(value.unwrap_or(f64::NAN));
        if let Err(what) = value {
            column.holes.push(Hole {
                index: row,
                line,
                what,
            });
        }
    }
}

/// Whether there is something in the line, but only separators.
fn is_all_separators(text: &str, dialect: Dialect) -> bool {
    let Delimiter::Byte(byte) = dialect.delimiter else {
        return false;
    };
    byte != b'\t'
        && text.contains(char::from(byte))
        && text.chars().all(|c| !c.is_alphanumeric())
        && !text.trim_start().starts_with(['#', '%', '!', '/'])
}

/// Whether cells make a row: a number or a date where one is wanted, or nothing at all.
fn is_row(cells: &[Cell], wanted: &[Wanted]) -> bool {
    let all_empty = cells.iter().all(|cell| *cell == Cell::Empty);
    let good = cells
        .iter()
        .zip(wanted)
        .filter(|(cell, wanted)| match wanted {
            Wanted::Numbers | Wanted::Ticks => cell.is_number() || **cell == Cell::NonFinite,
            Wanted::Clock => matches!(cell, Cell::Clock(_)),
            Wanted::Nothing => false,
        })
        .count();
    let bad = cells
        .iter()
        .zip(wanted)
        .filter(|(cell, wanted)| **wanted != Wanted::Nothing && **cell == Cell::Text)
        .count();
    all_empty || good > 0 && good >= bad
}

impl Column {
    /// Fills up to a row with holes: the cells before it were empty.
    #[cold]
    fn fill(&mut self, row: usize, breaks: &[(usize, usize)]) {
        for index in self.values.len()..row {
            self.holes.push(Hole {
                index,
                line: line_of(breaks, index),
                what: HoleKind::Empty,
            });
            self.values.push(f64::NAN);
        }
    }

    /// The difference of an integer to the first one.
    fn ticks(&mut self, ticks: i64) -> f64 {
        let first = *self.first_ticks.get_or_insert(ticks);
        ticks.wrapping_sub(first) as f64
    }

    /// Seconds of a date or time after the first one. Without a date, a step back by more than half a
    /// day passes midnight.
    fn seconds(&mut self, clock: Clock, text: &str) -> f64 {
        let mut total = clock.total();
        match &self.first_clock {
            None => self.first_clock = Some((clock, text.to_owned())),
            Some(_) if clock.day.is_none() => {
                let back = self.last_clock - total;
                total += (back + DAY / 2).div_euclid(DAY).max(0) * DAY;
            }
            Some(_) => {}
        }
        self.last_clock = total;
        let first = self.first_clock.as_ref().map_or(total, |(c, _)| c.total());
        (total - first) as f64 * 1e-9
    }
}

impl Plan<'_> {
    /// Where the text of a cell begins, spaces passed.
    #[inline]
    fn skip_to_cell(&self, line: &[u8], mut at: usize, place: usize) -> usize {
        let is_spaces = self.dialect.delimiter == Delimiter::Spaces;
        if is_spaces && place > 0 && at < line.len() && !is_space(line[at]) {
            return line.len();
        }
        while at < line.len() && (line[at] == b' ' || is_spaces && line[at] == b'\t') {
            at += 1;
        }
        at
    }

    /// Where the next cell begins, if the cell's number ends here.
    #[inline]
    fn cell_end(&self, line: &[u8], mut at: usize, is_last: bool) -> Option<usize> {
        if self.dialect.delimiter != Delimiter::Spaces {
            while line.get(at) == Some(&b' ') {
                at += 1;
            }
        }
        match (line.get(at), self.dialect.delimiter) {
            // The cells that the row ends before are empty.
            (None, _) => Some(at),
            (Some(byte), Delimiter::Byte(mark)) if *byte == mark => {
                // After the last column there may be empty cells only.
                let rest_is_empty = || line[at..].iter().all(|byte| *byte == mark || *byte == b' ');
                (!is_last || rest_is_empty()).then_some(at + 1)
            }
            (Some(byte), Delimiter::Spaces) if is_space(*byte) => {
                let rest_is_empty = || line[at..].iter().all(|byte| is_space(*byte));
                (!is_last || rest_is_empty()).then_some(at)
            }
            _ => None,
        }
    }
}

fn is_space(byte: u8) -> bool {
    byte == b' ' || byte == b'\t'
}
