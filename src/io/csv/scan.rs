//! Rows of numbers out of bytes: the quick way for plain rows, the careful way for the rest.

use super::habit::Habit;
use super::layout::{Delimiter, Dialect, is_not_a_number, is_skipped};
use crate::io::number;

/// Which cells of a row are wanted and how they are written.
#[derive(Debug, Clone, Copy)]
pub struct RowPlan {
    /// How the file is written.
    pub dialect: Dialect,
    /// Place of the time stamps, from 0.
    pub time: Option<usize>,
    /// Place of the channel, from 0.
    pub value: usize,
}

/// Rows of one piece of a file.
#[derive(Debug, Default)]
pub struct Rows {
    /// Time stamps as written (in the file's unit); empty without a time column.
    pub times: Vec<f64>,
    /// Where the text of each time stamp stands: offset in the upper, length in the lower half.
    pub time_text: Vec<u64>,
    /// The channel's values as written.
    pub values: Vec<f64>,
    /// Lines seen, rows and others.
    pub lines: usize,
    /// First of the empty lines that no row follows yet; counted only without stamps, where an empty
    /// line may be a lost sample.
    pub empty_at: Option<usize>,
    /// The row that could not be read, if any; nothing after it was looked at.
    pub problem: Option<Problem>,
}

/// A row that could not be read.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Line within the piece, from 0.
    pub line: usize,
    /// Byte within the piece at which the line starts.
    pub offset: usize,
    /// Place of the cell, from 0.
    pub cell: usize,
    /// What is wrong.
    pub what: Defect,
}

/// What is wrong with a cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Defect {
    /// The row ends before it.
    Missing,
    /// It is empty.
    Empty,
    /// It says that there is no number.
    NonFinite(String),
    /// It is no number.
    NotANumber(String),
}

impl Problem {
    /// An empty line among rows that have no stamps to tell whether a sample is missing.
    #[must_use]
    pub fn empty_line(line: usize, plan: &RowPlan) -> Self {
        Self {
            line,
            offset: 0,
            cell: plan.value,
            what: Defect::Empty,
        }
    }
}

impl Rows {
    /// Empties the rows, keeping their memory.
    pub fn clear(&mut self) {
        self.times.clear();
        self.time_text.clear();
        self.values.clear();
        self.lines = 0;
        self.empty_at = None;
        self.problem = None;
    }

    /// Reads all lines of a piece. Every line ends with a line feed but perhaps the last.
    pub fn read(&mut self, text: &[u8], plan: &RowPlan) {
        self.clear();
        let mut habit = Habit::of(plan);
        let mut at = 0;
        while at < text.len() {
            // A habit is made of a stamp and a value.
            if let Some(row) = habit.row(text, at, plan) {
                self.times.push(row.time);
                self.time_text.push(row.time_text);
                self.values.push(row.value);
                self.lines += 1;
                at = row.end;
                continue;
            }
            let end = line_end(text, at);
            if !self.read_line(text, at, end, plan) {
                return;
            }
            habit.learn(text, at, plan);
            at = end;
        }
    }

    /// Reads the line `text[at..end]`; `false` if it is wrong.
    fn read_line(&mut self, text: &[u8], at: usize, end: usize, plan: &RowPlan) -> bool {
        let before = self.values.len();
        match plan.quick_row(text, at) {
            Some(row) if row.end == end => {
                if plan.time.is_some() {
                    self.times.push(row.time);
                    self.time_text.push(row.time_text);
                }
                self.values.push(row.value);
            }
            _ => {
                if let Err((cell, what)) = self.careful_row(&text[at..end], at, plan) {
                    self.problem = Some(Problem {
                        line: self.lines,
                        offset: at,
                        cell,
                        what,
                    });
                    return false;
                }
            }
        }
        if let Some(line) = self.empty_at
            && self.values.len() > before
        {
            self.values.pop();
            self.problem = Some(Problem::empty_line(line, plan));
            return false;
        }
        self.lines += 1;
        true
    }

    /// Reads a line that is not a plain row of numbers: quoted, padded, a comment, or wrong.
    #[cold]
    fn careful_row(
        &mut self,
        line: &[u8],
        at: usize,
        plan: &RowPlan,
    ) -> Result<(), (usize, Defect)> {
        let text = String::from_utf8_lossy(line);
        if is_skipped(&text) {
            let is_comment = text.trim_start().starts_with(['#', '%', '!', '/']);
            if plan.time.is_none() && !is_comment {
                self.empty_at = self.empty_at.or(Some(self.lines));
            }
            return Ok(());
        }
        let cells = plan.dialect.cells(&text);
        let time = plan
            .time
            .map(|place| read_cell(&cells, place, plan.dialect.decimal))
            .transpose()?;
        let value = read_cell(&cells, plan.value, plan.dialect.decimal)?;
        if let (Some(time), Some(place)) = (time, plan.time) {
            // The text is copied to the output only from where it stands unquoted.
            // The same text elsewhere in the line does as well.
            let cell = cells[place].as_bytes();
            let span =
                memchr::memmem::find(line, cell).map_or(0, |offset| span(at + offset, cell.len()));
            self.times.push(time);
            self.time_text.push(span);
        }
        self.values.push(value);
        Ok(())
    }
}

fn read_cell(cells: &[String], place: usize, decimal: u8) -> Result<f64, (usize, Defect)> {
    let defect = match cells.get(place).map(String::as_str) {
        None => Defect::Missing,
        Some("") => Defect::Empty,
        Some(cell) => match number::cell(cell, decimal) {
            Some(value) => return Ok(value),
            None if is_not_a_number(cell) => Defect::NonFinite(cell.to_owned()),
            None => Defect::NotANumber(cell.to_owned()),
        },
    };
    Err((place, defect))
}

/// Offset and length of a text in one number.
#[inline]
pub(super) fn span(offset: usize, length: usize) -> u64 {
    (offset as u64) << 32 | length as u64
}

/// Offset and length of a span, as made by [`Rows::read`].
#[inline]
#[must_use]
pub fn place_of(span: u64) -> (usize, usize) {
    ((span >> 32) as usize, (span & 0xFFFF_FFFF) as usize)
}

/// Position after the line feed that ends the line at `at`.
#[inline]
fn line_end(text: &[u8], at: usize) -> usize {
    memchr::memchr(b'\n', &text[at..]).map_or(text.len(), |place| at + place + 1)
}

/// A row that was read without looking twice.
pub(super) struct QuickRow {
    pub(super) time: f64,
    pub(super) time_text: u64,
    pub(super) value: f64,
    /// Where the next line starts.
    pub(super) end: usize,
}

impl RowPlan {
    /// A row of plain numbers; `None` if the careful way has to look at it.
    #[inline(always)]
    fn quick_row(&self, text: &[u8], start: usize) -> Option<QuickRow> {
        let separator = match self.dialect.delimiter {
            Delimiter::Byte(byte) => byte,
            // No number holds a line feed: a single column has no separator.
            Delimiter::None => b'\n',
            Delimiter::Spaces => return None,
        };
        let time = self.time.unwrap_or(self.value);
        // A stamp is copied and compared, a value is computed with.
        let time_first = time < self.value;
        let a = self.number(text, start, time.min(self.value), separator, time_first)?;
        let b = match time.abs_diff(self.value) {
            0 => a,
            cells if text.get(a.end) == Some(&separator) => {
                self.number(text, a.end + 1, cells - 1, separator, !time_first)?
            }
            _ => return None,
        };
        let end = end_of_row(text, b.end, separator)?;
        let (time, value) = if time_first { (a, b) } else { (b, a) };
        Some(QuickRow {
            time: time.value,
            time_text: span(time.start, time.end - time.start),
            value: value.value,
            end,
        })
    }

    /// The number after so many cells that are not wanted.
    #[inline(always)]
    fn number(
        &self,
        text: &[u8],
        mut at: usize,
        skip: usize,
        separator: u8,
        is_time: bool,
    ) -> Option<Number> {
        for _ in 0..skip {
            at = skip_cell(text, at, separator)? + 1;
        }
        while text.get(at) == Some(&b' ') {
            at += 1;
        }
        let (value, end) = if is_time {
            number::read_nearly(text, at, self.dialect.decimal)?
        } else {
            number::read(text, at, self.dialect.decimal)?
        };
        Some(Number {
            value,
            start: at,
            end,
        })
    }
}

/// A number and where it stands.
#[derive(Clone, Copy)]
struct Number {
    value: f64,
    start: usize,
    end: usize,
}

/// Position of the separator after an unwanted cell, on the same line and outside quotes.
#[inline]
fn skip_cell(text: &[u8], at: usize, separator: u8) -> Option<usize> {
    let place = at + memchr::memchr3(separator, b'\n', b'"', &text[at..])?;
    (text[place] == separator).then_some(place)
}

/// Position of the next line, if the cell ends where a number ended.
#[inline]
pub(super) fn end_of_row(text: &[u8], at: usize, separator: u8) -> Option<usize> {
    match text.get(at) {
        Some(b'\n') => Some(at + 1),
        Some(b'\r') if text.get(at + 1) == Some(&b'\n') => Some(at + 2),
        Some(byte) if *byte == separator => Some(line_end(text, at)),
        None => Some(at),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMMA: Dialect = Dialect {
        delimiter: Delimiter::Byte(b','),
        decimal: b'.',
    };

    fn read(text: &str, plan: RowPlan) -> Rows {
        let mut rows = Rows::default();
        rows.read(text.as_bytes(), &plan);
        rows
    }

    fn spanned(text: &str, span: u64) -> &[u8] {
        let (offset, length) = place_of(span);
        &text.as_bytes()[offset..offset + length]
    }

    fn plan(time: Option<usize>, value: usize) -> RowPlan {
        RowPlan {
            dialect: COMMA,
            time,
            value,
        }
    }

    #[test]
    fn plain_rows() {
        let text = "0.0,1.5\n0.1,-2e-3\r\n0.2,3";
        let rows = read(text, plan(Some(0), 1));
        assert_eq!(rows.values, [1.5, -2e-3, 3.0]);
        assert_eq!(rows.times, [0.0, 0.1, 0.2]);
        assert_eq!(rows.lines, 3);
        let texts: Vec<&[u8]> = rows.time_text.iter().map(|s| spanned(text, *s)).collect();
        assert_eq!(texts, [b"0.0", b"0.1", b"0.2"]);
    }

    #[test]
    fn columns_in_any_order_with_others_between() {
        let rows = read("7,x y,1.0,9,0.5\n8,\"a,b\",2.0,9,0.6\n", plan(Some(4), 2));
        assert_eq!(rows.values, [1.0, 2.0]);
        assert_eq!(rows.times, [0.5, 0.6]);
        assert_eq!(rows.problem, None);
    }

    #[test]
    fn padding_quotes_comments_and_blank_lines() {
        let text = " 0 ,  1.5 ,\n\n# remark\n\"1\",\"2.5\"\n,,\n2,3.5\n";
        let rows = read(text, plan(Some(0), 1));
        assert_eq!(rows.values, [1.5, 2.5, 3.5]);
        assert_eq!(rows.lines, 6);
        assert_eq!(spanned(text, rows.time_text[1]), b"1");
    }

    #[test]
    fn other_separators() {
        let tab = Dialect {
            delimiter: Delimiter::Byte(b'\t'),
            decimal: b',',
        };
        let rows = read(
            "0,5\t-1,25\n",
            RowPlan {
                dialect: tab,
                time: Some(0),
                value: 1,
            },
        );
        assert_eq!((rows.times[0], rows.values[0]), (0.5, -1.25));
        let spaces = Dialect {
            delimiter: Delimiter::Spaces,
            decimal: b'.',
        };
        let rows = read(
            "  0.5   1.25\n 1 2\n",
            RowPlan {
                dialect: spaces,
                time: Some(0),
                value: 1,
            },
        );
        assert_eq!(rows.values, [1.25, 2.0]);
        let none = Dialect {
            delimiter: Delimiter::None,
            decimal: b'.',
        };
        let rows = read(
            "1\n2\n",
            RowPlan {
                dialect: none,
                time: None,
                value: 0,
            },
        );
        assert_eq!(rows.values, [1.0, 2.0]);
    }

    #[test]
    fn defects_are_named() {
        for (text, line, cell, what) in [
            ("0,1\n1\n", 1, 1, Defect::Missing),
            ("0,1\n1,\n", 1, 1, Defect::Empty),
            ("0,NaN\n", 0, 1, Defect::NonFinite("NaN".to_owned())),
            ("0,-1.#IND\n", 0, 1, Defect::NonFinite("-1.#IND".to_owned())),
            (
                "0,1\n\n1,2\n2,abc\n",
                3,
                1,
                Defect::NotANumber("abc".to_owned()),
            ),
            ("0,1.5V\n", 0, 1, Defect::NotANumber("1.5V".to_owned())),
            ("x,1\n", 0, 0, Defect::NotANumber("x".to_owned())),
        ] {
            let problem = read(text, plan(Some(0), 1)).problem.expect(text);
            assert_eq!(
                (problem.line, problem.cell, problem.what),
                (line, cell, what),
                "{text}"
            );
        }
    }
}
