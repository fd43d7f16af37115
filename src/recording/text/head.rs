//! The first lines of a text, and detection of the table of numbers in them.

use std::collections::BTreeMap;

use super::cell::Cell;
use super::chunks::Chunks;
use super::commas;
use super::display_scale;
use super::no_table;
use super::rows::cleaned;
use super::table::FIRST_ROWS;
use super::thousands;
use super::upward;
use crate::failure::{ErrorCode, Failure};
use crate::io::DialectOverride;
use crate::recording::text::dialect::{Delimiter, Dialect, dialects, is_skipped};

/// Bytes in which a table is searched for, increased if there is none.
const HEADS: [usize; 4] = [FIRST_ROWS, 1 << 18, 1 << 20, 1 << 23];
/// Minimum fraction of rows among the lines from the first row on.
const MOSTLY: f64 = 0.8;

/// Number of lines at the end of a head for finding the most promising dialect.
const PROMISING: usize = 32;

/// Number of lines for recognising a maker.
const FOR_NAMES: usize = 120;

/// A line: its offset and text.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Offset of its first byte.
    pub offset: usize,
    /// Its text, without line end.
    pub text: String,
}

/// The first lines of a text, or of a part of it.
#[derive(Debug, Clone)]
pub struct Head {
    /// The lines.
    pub lines: Vec<Line>,
    /// Number of the first of them in the file, from 1.
    pub first_number: usize,
    /// Whether the text is complete.
    pub complete: bool,
}

/// Location and dialect of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// How it is written.
    pub dialect: Dialect,
    /// Index of its first row among the lines of the head.
    pub first: usize,
    /// Number of columns of its widest row.
    pub width: usize,
    /// Whether rows contain texts as well as numbers.
    pub has_texts: bool,
}

/// Whether a text begins with another, ignoring case.
pub fn starts(text: &str, with: &str) -> bool {
    text.get(..with.len())
        .is_some_and(|start| start.eq_ignore_ascii_case(with))
}

impl Head {
    /// Lines of a text, the first of which has this number; `complete` means that no more follow.
    pub fn of(text: &[u8], complete: bool, number: usize) -> Self {
        let mut lines = Vec::new();
        let mut offset = 0;
        for piece in text.split_inclusive(|byte| *byte == b'\n') {
            // A line that continues after the head is inconclusive.
            if complete || piece.ends_with(b"\n") {
                let (text, _) = cleaned(piece);
                lines.push(Line { offset, text });
            }
            offset += piece.len();
            if lines.last().is_some_and(|line| is_end(&line.text)) {
                break;
            }
        }
        Self {
            lines,
            first_number: number,
            complete,
        }
    }

    /// Whether a line begins with a text, ignoring case.
    pub fn starts(&self, line: usize, with: &str) -> bool {
        self.lines
            .get(line)
            .is_some_and(|line| starts(&line.text, with))
    }

    /// Whether one of the first lines satisfies a predicate.
    pub fn any(&self, is: impl Fn(&str) -> bool) -> bool {
        self.lines.iter().take(FOR_NAMES).any(|line| is(&line.text))
    }

    /// Number of a line in the file.
    pub fn number(&self, line: usize) -> usize {
        self.first_number + line
    }
}

/// Finds the next table in a text; `number` is that of its first line.
///
/// # Errors
/// If there is none, or it is ambiguous.
pub fn find(
    chunks: &mut Chunks,
    number: usize,
    marks: &DialectOverride,
) -> Result<(Head, Table), Failure> {
    let mut failure = None;
    for bytes in HEADS {
        let (text, complete) = chunks.peek(bytes)?;
        let head = Head::of(text, complete, number);
        match find_in(&head, marks) {
            Ok(table) => return Ok((head, table)),
            Err(error) => failure = Some(error),
        }
        if complete {
            break;
        }
    }
    Err(failure.unwrap_or_else(|| {
        ErrorCode::NotARecording.failed("the file is empty; expected rows of numbers")
    }))
}

/// The table in a head.
fn find_in(head: &Head, marks: &DialectOverride) -> Result<Table, Failure> {
    let quoted = head.lines.iter().any(|line| line.text.contains('"'));
    let occurs = |byte: u8| {
        head.lines
            .iter()
            .any(|line| line.text.as_bytes().contains(&byte))
    };
    let mut all = dialects(marks, quoted);
    all.retain(|dialect| match dialect.delimiter {
        Delimiter::Byte(byte) => marks.delimiter.is_some() || occurs(byte),
        Delimiter::Spaces | Delimiter::None => true,
    });
    let strict = tables(head, &all, strict_row);
    if let Some(best) = best(&strict) {
        let mut table = unambiguous(head, &strict, best)?.table.clone();
        display_scale::refuse(head, &table)?;
        table.first = upward::first_row(head, &table);
        if marks.delimiter.is_none() {
            commas::refuse(head, &table)?;
        }
        if marks.decimal.is_none() {
            thousands::refuse_mixed(head, &table)?;
        }
        return Ok(below_numbering(head, table));
    }
    let lenient = tables(head, &all, lenient_row);
    let Some(best) = best(&lenient).map(|best| with_fewest_texts(&lenient, best)) else {
        return Err(ErrorCode::NotARecording.failed(no_table::why(head)));
    };
    super::listing::refuse(head, &best.table)?;
    Ok(best.table.clone())
}

/// The table without a first row that numbers the columns, `1,2,3`, after which time would step
/// back.
fn below_numbering(head: &Head, mut table: Table) -> Table {
    let mut rows = (table.first..head.lines.len())
        .filter(|line| !is_skipped(&head.lines[*line].text))
        .map(|line| (line, table.dialect.cells(&head.lines[line].text)));
    let (Some((_, numbers)), Some((next, cells))) = (rows.next(), rows.next()) else {
        return table;
    };
    let first = cells
        .first()
        .map(|cell| Cell::read(cell, table.dialect.decimal));
    let falls = matches!(first, Some(Cell::Number(value)) if value < 1.0);
    if table.width > 1 && numbers.len() >= table.width && is_numbering(&numbers) && falls {
        table.first = next;
    }
    table
}

/// Whether cells number the columns: `1,2,3`.
pub fn is_numbering(cells: &[String]) -> bool {
    let mut numbered = cells.iter().zip(1_usize..);
    cells.len() > 1 && numbered.all(|(cell, number)| *cell == number.to_string())
}

/// Whether a line marks the end of the data, followed by lists of another kind.
pub fn is_end(line: &str) -> bool {
    line.trim_end() == "EOF"
}

/// Properties of a line as a row.
#[derive(Debug, Clone, Copy)]
struct Shape {
    /// Number of cells, without empty ones at the end.
    width: usize,
    /// Number of cells with thousands separators.
    grouped: usize,
    /// Number of cells with texts.
    texts: usize,
    /// Whether its first cell is a text.
    is_named: bool,
}

/// A row without texts.
fn strict_row(line: &str, dialect: Dialect) -> Option<Shape> {
    shape(line, dialect, |numbers, texts, _| numbers > 0 && texts == 0)
}

/// A row with at most as many texts as numbers and times.
fn lenient_row(line: &str, dialect: Dialect) -> Option<Shape> {
    shape(line, dialect, |numbers, texts, data| {
        numbers > 0 && data + texts > 1 && data >= texts
    })
}

fn shape(line: &str, dialect: Dialect, good: fn(usize, usize, usize) -> bool) -> Option<Shape> {
    // Quick rejection of prose: without digits there is no row.
    if !line.bytes().any(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let (mut numbers, mut texts, mut data, mut grouped, mut width) = (0, 0, 0, 0, 0);
    let mut is_named = false;
    for (place, text) in dialect.cells(line).iter().enumerate() {
        let cell = Cell::read(text, dialect.decimal);
        numbers += usize::from(cell.is_number());
        texts += usize::from(cell == Cell::Text);
        is_named |= place == 0 && cell == Cell::Text;
        data += usize::from(cell.is_datum());
        grouped += usize::from(matches!(cell, Cell::Grouped(_)));
        if cell != Cell::Empty {
            width = place + 1;
        }
    }
    good(numbers, texts, data).then_some(Shape {
        width,
        grouped,
        texts,
        is_named,
    })
}

/// A table in one dialect, and how much it explains.
struct Found {
    table: Table,
    rows: usize,
    grouped: usize,
    texts: usize,
}

/// Parses a line as a row.
type ReadRow = fn(&str, Dialect) -> Option<Shape>;

/// The tables in the dialects that explain most rows, in the order of the dialects; others may be omitted.
fn tables(head: &Head, dialects: &[Dialect], row: ReadRow) -> Vec<Found> {
    let lines = head.lines.iter().enumerate();
    let lines: Vec<(usize, &Line)> = lines.filter(|(_, line)| !is_skipped(&line.text)).collect();
    // With the best of them first, the others are soon known to explain less.
    let end = &lines[lines.len().saturating_sub(PROMISING)..];
    let promise = |dialect: Dialect| {
        let rows = end.iter().filter_map(|(_, line)| row(&line.text, dialect));
        rows.count()
    };
    let mut order: Vec<(usize, Dialect)> = dialects.iter().copied().enumerate().collect();
    order.sort_by_cached_key(|(_, dialect)| std::cmp::Reverse(promise(*dialect)));
    let mut found = BTreeMap::new();
    let mut least = 0;
    for (place, dialect) in order {
        if let Some(table) = Found::of(&lines, dialect, row, least) {
            least = least.max(table.rows);
            found.insert(place, table);
        }
    }
    found.into_values().collect()
}

impl Found {
    /// Also `None` if it explains less than `least` rows.
    fn of(lines: &[(usize, &Line)], dialect: Dialect, row: ReadRow, least: usize) -> Option<Self> {
        let mut shapes: Vec<(usize, Option<Shape>)> = Vec::with_capacity(lines.len());
        let mut possible = lines.len();
        for (place, line) in lines {
            let shape = row(&line.text, dialect);
            possible -= usize::from(shape.is_none());
            if possible < least {
                return None;
            }
            shapes.push((*place, shape));
        }
        let from = first_row(&shapes)?;
        let rows: Vec<Shape> = shapes[from..].iter().filter_map(|(_, s)| *s).collect();
        // A single row is a table only if there is nothing else.
        if rows.len() < 2 && shapes.len() > 2 {
            return None;
        }
        Some(Self {
            table: Table {
                dialect,
                first: shapes[from].0,
                width: rows.iter().map(|shape| shape.width).max()?,
                has_texts: false,
            },
            rows: rows.len(),
            grouped: rows.iter().map(|shape| shape.grouped).sum(),
            texts: rows.iter().map(|shape| shape.texts).sum(),
        })
    }
}

/// Index of the first row: the first from which on most lines are rows. A line with a different
/// width than the rows after it is excluded.
fn first_row(shapes: &[(usize, Option<Shape>)]) -> Option<usize> {
    let mut rows_after = vec![0_usize; shapes.len() + 1];
    for place in (0..shapes.len()).rev() {
        rows_after[place] = rows_after[place + 1] + usize::from(shapes[place].1.is_some());
    }
    let usual = usual_width(shapes)?;
    let rows = shapes.iter().filter_map(|(_, shape)| *shape);
    let named = rows.clone().filter(|shape| shape.is_named).count();
    let are_named = 2 * named > rows.count();
    let is_first = |place: &usize| {
        let Some(shape) = shapes[*place].1 else {
            return false;
        };
        let mostly = rows_after[*place] as f64 >= MOSTLY * (shapes.len() - place) as f64;
        let next = shapes.get(place + 1).and_then(|(_, shape)| *shape);
        // A line of numbers below a key of its own, followed by text, is not a row.
        let is_alone = place + 1 < shapes.len() && next.is_none();
        let fits = shape.width == usual || next.is_none_or(|next| next.width == shape.width);
        // A key with values above rows of numbers is not one of them.
        mostly && fits && !is_alone && shape.is_named == are_named
    };
    (0..shapes.len()).find(is_first)
}

fn usual_width(shapes: &[(usize, Option<Shape>)]) -> Option<usize> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    for (_, shape) in shapes {
        if let Some(shape) = shape {
            *counts.entry(shape.width).or_default() += 1;
        }
    }
    let most = counts
        .iter()
        .max_by_key(|(width, count)| (**count, **width));
    most.map(|(width, _)| *width)
}

/// The dialect with the most rows; among equals the one with the fewest thousands separators, then
/// the first.
fn best(found: &[Found]) -> Option<&Found> {
    found.iter().reduce(|best, other| {
        let better =
            other.rows > best.rows || other.rows == best.rows && other.grouped < best.grouped;
        if better { other } else { best }
    })
}

/// The decimal mark with which the fewest cells are texts: beside a column of remarks, a column of decimal commas could
/// pass for another one.
fn with_fewest_texts<'a>(found: &'a [Found], best: &'a Found) -> &'a Found {
    let delimiter = |found: &Found| found.table.dialect.delimiter;
    let equal = |other: &&Found| other.rows == best.rows && delimiter(other) == delimiter(best);
    let fewest = found.iter().filter(equal).min_by_key(|other| other.texts);
    fewest
        .filter(|other| other.texts < best.texts)
        .unwrap_or(best)
}

/// The best dialect, unless a comma has two readings that explain all rows: then headings decide, or
/// the user is asked.
fn unambiguous<'a>(head: &Head, found: &'a [Found], best: &'a Found) -> Result<&'a Found, Failure> {
    let equal = |other: &&Found| other.rows == best.rows && other.table != best.table;
    let comma = Delimiter::Byte(b',');
    let (line, text) = {
        let line = best.table.first;
        (head.number(line), head.lines[line].text.trim())
    };
    let others = found.iter().filter(equal).filter(|other| other.grouped > 0);
    let others: Vec<&Table> = others.map(|other| &other.table).collect();
    if !text.contains(',') {
        thousands::refuse(head, &best.table, &others)?;
        return Ok(best);
    }
    let shown: String = text.chars().take(60).collect();
    // 0,5 as two cells or with a decimal comma; headings with as many cells decide, or a comma that
    // nothing follows in any row.
    let separator = found
        .iter()
        .find(|f| f.table.dialect.delimiter == comma && f.rows == best.rows);
    let decimal = found.iter().find(|f| {
        f.table.dialect.decimal == b',' && f.table.dialect.delimiter != comma && f.rows == best.rows
    });
    if let (Some(separator), Some(_)) = (separator, decimal) {
        if separator.table.width > 1 && has_heading(head, &separator.table)
            || ends_in_commas(head, &separator.table)
        {
            return Ok(separator);
        }
        return Err(ErrorCode::TextUnclear
            .failed(format_args!(
                "\"{shown}\" can be read with the comma between cells or as a decimal \
                 mark; say which with --delimiter , or --decimal ,"
            ))
            .line(line));
    }
    thousands::refuse(head, &best.table, &others)?;
    Ok(best)
}

/// Whether every row ends in a comma.
fn ends_in_commas(head: &Head, table: &Table) -> bool {
    head.lines[table.first..]
        .iter()
        .filter(|line| !is_skipped(&line.text))
        .all(|line| line.text.trim_end().ends_with(','))
}

/// Whether a line above the table splits into as many texts as the table has columns.
fn has_heading(head: &Head, table: &Table) -> bool {
    head.lines[..table.first].iter().rev().take(6).any(|line| {
        let text = line.text.trim_start().trim_start_matches(['#', '%']);
        let cells = table.dialect.cells(text);
        cells.len() >= table.width
            && cells[..table.width].iter().all(|cell| {
                matches!(
                    Cell::read(cell, table.dialect.decimal),
                    Cell::Text | Cell::NonFinite
                )
            })
    })
}
