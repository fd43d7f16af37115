//! Telling from the first bytes of a text file how its table is laid out.
//!
//! Every way to split the lines into numbers is tried; the one that explains the most lines wins.
//! Where two ways explain the same lines differently, the file cannot be told for sure and the
//! user is asked.

use std::collections::BTreeMap;

use super::names::Column;
use crate::failure::Failure;
use crate::io::DialectOverride;
use crate::io::number;
use crate::unit::NamedUnit;

/// Most lines above the data that are looked at for headings and units.
const LINES_FOR_HEADINGS: usize = 6;
/// UTF-8 byte order mark.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
/// Fewest rows that make a table, unless the file holds fewer.
const FEWEST_ROWS: usize = 2;

/// How cells are separated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// By one such byte.
    Byte(u8),
    /// By any number of spaces or tabs.
    Spaces,
    /// Not at all: one column.
    None,
}

/// How numbers and cells are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dialect {
    /// What separates cells.
    pub delimiter: Delimiter,
    /// Decimal mark: `.` or `,`.
    pub decimal: u8,
}

/// Where the table is and what its columns are.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// How it is written.
    pub dialect: Dialect,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Line of the headings, from 1, if there is one.
    pub heading_line: Option<usize>,
    /// Line of the first row of numbers, from 1.
    pub data_line: usize,
    /// Byte of the first row of numbers.
    pub data_offset: usize,
}

impl Dialect {
    /// Cells of a line, spaces around them taken off; quoted cells are unquoted.
    #[must_use]
    pub fn cells(self, line: &str) -> Vec<String> {
        let line = line.trim_end_matches(['\r', '\n']);
        match self.delimiter {
            Delimiter::None => vec![line.trim().to_owned()],
            Delimiter::Spaces => line.split_whitespace().map(str::to_owned).collect(),
            Delimiter::Byte(byte) if line.contains('"') => quoted_cells(line, byte),
            Delimiter::Byte(byte) => line
                .split(char::from(byte))
                .map(|cell| cell.trim().to_owned())
                .collect(),
        }
    }

    /// Name for people.
    #[must_use]
    pub fn describe(self) -> String {
        let delimiter = match self.delimiter {
            Delimiter::Byte(b'\t') => "tab-separated".to_owned(),
            Delimiter::Byte(b',') => "comma-separated".to_owned(),
            Delimiter::Byte(b';') => "semicolon-separated".to_owned(),
            Delimiter::Byte(byte) => format!("separated by \"{}\"", char::from(byte)),
            Delimiter::Spaces => "separated by spaces".to_owned(),
            Delimiter::None => "one column".to_owned(),
        };
        let decimal = if self.decimal == b',' {
            "comma"
        } else {
            "point"
        };
        format!("{delimiter}, decimal {decimal}")
    }
}

/// Cells of a line with quotes, as the `csv` crate reads them.
fn quoted_cells(line: &str, delimiter: u8) -> Vec<String> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .from_reader(line.as_bytes());
    let mut record = csv::StringRecord::new();
    match reader.read_record(&mut record) {
        Ok(true) => record.iter().map(|cell| cell.trim().to_owned()).collect(),
        _ => Vec::new(),
    }
}

/// Whether a line is empty, a comment, or has nothing but separators.
#[must_use]
pub fn is_skipped(line: &str) -> bool {
    let text = line.trim();
    text.starts_with(['#', '%', '!'])
        || text.starts_with("//")
        || text.chars().all(|c| matches!(c, ',' | ';' | '\t' | ' '))
}

/// Finds the table in the head of a file. `complete` says that the head is the whole file.
///
/// # Errors
/// If there is no table of numbers, or more than one way to read it.
pub fn find(head: &[u8], complete: bool, told: &DialectOverride) -> Result<Layout, Failure> {
    let lines = Lines::of(head, complete);
    let dialects = dialects(told, head.contains(&b'"'));
    // Columns of text beside the numbers are looked for only if there is no table without.
    let mut best = best_tables(&lines, &dialects, numeric_width);
    if best.is_empty() {
        best = best_tables(&lines, &dialects, partly_numeric_width);
    }
    let (dialect, table) = choose(&lines, &best, head)?;
    let heading = headings(&lines, dialect, &table);
    let first = first_row(&lines, dialect, &table, heading.line);
    let mark = if first == 0 { byte_order_mark(head) } else { 0 };
    Ok(Layout {
        dialect,
        columns: heading.columns,
        heading_line: heading.line.map(|line| line + 1),
        data_line: first + 1,
        data_offset: lines.0[first].0 + mark,
    })
}

/// The tables with the most rows, by dialect.
fn best_tables(
    lines: &Lines,
    dialects: &[Dialect],
    width: fn(&str, Dialect) -> Option<usize>,
) -> Vec<(Dialect, Table)> {
    let mut best: Vec<(Dialect, Table)> = Vec::new();
    for &dialect in dialects {
        let Some(table) = Table::find(lines, dialect, width) else {
            continue;
        };
        match best.first().map(|(_, other)| other.rows) {
            Some(rows) if rows > table.rows => {}
            Some(rows) if rows == table.rows => best.push((dialect, table)),
            _ => best = vec![(dialect, table)],
        }
    }
    best
}

/// The first row of the table. A row that is wrong stands between the headings and the first good
/// row: it belongs to the table, so that it is found wrong and not passed over.
fn first_row(lines: &Lines, dialect: Dialect, table: &Table, heading: Option<usize>) -> usize {
    let from = heading.map_or(0, |line| line + 1);
    (from..table.first)
        .rev()
        .take_while(|index| {
            let line = &lines.0[*index].1;
            let cells = dialect.cells(line);
            let numbers = cells
                .iter()
                .filter(|cell| number::cell(cell, dialect.decimal).is_some())
                .count();
            // Without headings, only a row of nothing but numbers.
            is_skipped(line)
                || numbers > 0 && (heading.is_some() || numeric_width(line, dialect).is_some())
        })
        .filter(|index| !is_skipped(&lines.0[*index].1))
        .last()
        .unwrap_or(table.first)
}

/// Length of a UTF-8 byte order mark at the start of a file.
fn byte_order_mark(head: &[u8]) -> usize {
    if head.starts_with(BYTE_ORDER_MARK) {
        BYTE_ORDER_MARK.len()
    } else {
        0
    }
}

/// Dialects in the order of preference between equals. A decimal comma between commas needs quotes.
pub fn dialects(told: &DialectOverride, quoted: bool) -> Vec<Dialect> {
    let delimiters = match told.delimiter {
        Some(delimiter) => vec![delimiter],
        None => vec![
            Delimiter::Byte(b'\t'),
            Delimiter::Byte(b';'),
            Delimiter::Byte(b','),
            Delimiter::Byte(b'|'),
            Delimiter::Spaces,
            Delimiter::None,
        ],
    };
    let decimals = match told.decimal {
        Some(decimal) => vec![decimal],
        None => vec![b'.', b','],
    };
    let mut all = Vec::new();
    for delimiter in delimiters {
        for &decimal in &decimals {
            if delimiter != Delimiter::Byte(decimal) || quoted {
                all.push(Dialect { delimiter, decimal });
            }
        }
    }
    all
}

/// Lines of a head with their byte offsets.
struct Lines(Vec<(usize, String)>);

impl Lines {
    fn of(head: &[u8], complete: bool) -> Self {
        let mut lines = Vec::new();
        let mut start = 0;
        for piece in head.split_inclusive(|byte| *byte == b'\n') {
            // A line that goes on after the head says nothing for sure.
            if complete || piece.ends_with(b"\n") {
                let marked = piece.strip_prefix(BYTE_ORDER_MARK);
                lines.push((start, decode_line(marked.unwrap_or(piece))));
            }
            start += piece.len();
        }
        Self(lines)
    }
}

/// UTF-8, or else the Windows-1252 of older recorders (Latin-1 with quotation marks and dashes), in
/// which any byte is a character.
#[must_use]
pub fn decode_line(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => encoding_rs::WINDOWS_1252
            .decode_without_bom_handling(bytes)
            .0
            .into_owned(),
    }
}

/// Rows of numbers, most of them of one width.
#[derive(Debug, Clone, PartialEq)]
struct Table {
    /// Index of the first line.
    first: usize,
    /// Number of rows of the usual width.
    rows: usize,
    /// Cells of the widest row, empty ones at its end left out.
    width: usize,
}

impl Table {
    /// The rows under a dialect: from the first one that is as wide as most are. Rows that end
    /// earlier, or that are wrong, may stand among them.
    fn find(
        lines: &Lines,
        dialect: Dialect,
        width_of: fn(&str, Dialect) -> Option<usize>,
    ) -> Option<Self> {
        let widths: Vec<Option<usize>> = lines
            .0
            .iter()
            .map(|(_, line)| {
                if is_skipped(line) {
                    None
                } else {
                    width_of(line, dialect)
                }
            })
            .collect();
        let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
        for width in widths.iter().flatten() {
            *counts.entry(*width).or_default() += 1;
        }
        // Between equals the wider.
        let (&usual, &rows) = counts
            .iter()
            .max_by_key(|(width, count)| (**count, **width))?;
        let several = lines.0.len() > FEWEST_ROWS;
        if rows < FEWEST_ROWS && several {
            return None;
        }
        let first = widths.iter().position(|w| w.is_some_and(|w| w >= usual))?;
        let width = widths[first..].iter().flatten().copied().max()?;
        Some(Self { first, rows, width })
    }
}

/// Number of cells if they are all numbers (or say that they are none), those at the end may be
/// empty.
fn numeric_width(line: &str, dialect: Dialect) -> Option<usize> {
    let cells = dialect.cells(line);
    let width = cells.iter().rposition(|cell| !cell.is_empty())? + 1;
    let mut numbers = 0;
    for cell in &cells[..width] {
        if number::cell(cell, dialect.decimal).is_some() {
            numbers += 1;
        } else if !cell.is_empty() && !is_not_a_number(cell) {
            return None;
        }
    }
    (numbers > 0).then_some(width)
}

/// Number of cells of a row that may hold texts beside its numbers.
fn partly_numeric_width(line: &str, dialect: Dialect) -> Option<usize> {
    let cells = dialect.cells(line);
    let width = cells.iter().rposition(|cell| !cell.is_empty())? + 1;
    let numbers = cells[..width]
        .iter()
        .filter(|cell| number::cell(cell, dialect.decimal).is_some())
        .count();
    // At least as many numbers as texts: a remark with one number in it is no row.
    (width > 1 && 2 * numbers >= width).then_some(width)
}

/// Whether a cell says that there is no number: NaN, infinity and their Windows spellings.
#[must_use]
pub fn is_not_a_number(cell: &str) -> bool {
    const WORDS: [&str; 6] = ["nan", "inf", "infinity", "1.#qnan", "1.#ind", "1.#inf"];
    let text = cell.trim_start_matches(['+', '-']);
    WORDS.iter().any(|word| text.eq_ignore_ascii_case(word))
}

fn choose(
    lines: &Lines,
    best: &[(Dialect, Table)],
    head: &[u8],
) -> Result<(Dialect, Table), Failure> {
    let Some((dialect, table)) = best.first() else {
        return Err(Failure::failed(no_table(lines, head)));
    };
    let comma = Delimiter::Byte(b',');
    let as_separator = best.iter().find(|(d, _)| d.delimiter == comma);
    let as_decimal = best
        .iter()
        .find(|(d, t)| d.decimal == b',' && uses_comma(lines, t));
    let (Some(separator), Some(_)) = (as_separator, as_decimal) else {
        return Ok((*dialect, table.clone()));
    };
    // `0,5` is one number or two; headings with as many cells settle it.
    let heading = headings(lines, separator.0, &separator.1);
    if heading.line.is_some() && separator.1.width > 1 {
        return Ok(separator.clone());
    }
    let (_, line) = &lines.0[table.first];
    Err(Failure::failed(format_args!(
        "line {}: \"{}\" can be read with the comma between cells or as a decimal mark; say which \
         with --delimiter , or --decimal ,",
        table.first + 1,
        line.trim()
    )))
}

fn uses_comma(lines: &Lines, table: &Table) -> bool {
    lines.0[table.first].1.contains(',')
}

fn no_table(lines: &Lines, head: &[u8]) -> String {
    if head.iter().all(u8::is_ascii_whitespace) {
        return "the file is empty; expected rows of numbers".to_owned();
    }
    if !head.contains(&b'\n') && head.contains(&b'\r') {
        return "the lines end with CR alone; change them to LF: tr '\\r' '\\n' < FILE".to_owned();
    }
    if lines.0.is_empty() {
        return "the first line does not end within a megabyte; expected rows of numbers"
            .to_owned();
    }
    let first = lines
        .0
        .iter()
        .find(|(_, line)| !is_skipped(line))
        .map_or("", |(_, line)| line.trim());
    let shown: String = first.chars().take(60).collect();
    format!(
        "no table of numbers found (the first line reads \"{shown}\"); expected at least two rows \
         of numbers, with or without headings above. Say how the cells are separated with \
         --delimiter and --decimal if they are unusual"
    )
}

/// The headings of a table: their line, from 0, and the columns they name.
struct Headings {
    line: Option<usize>,
    columns: Vec<Column>,
}

fn headings(lines: &Lines, dialect: Dialect, table: &Table) -> Headings {
    let from = table.first.saturating_sub(LINES_FOR_HEADINGS);
    let rows: Vec<(usize, Vec<String>)> = (from..table.first)
        .map(|index| (index, dialect.cells(uncommented(&lines.0[index].1))))
        .filter(|(_, cells)| is_heading(cells, table.width, dialect))
        .collect();
    let is_units = |cells: &[String]| {
        let units = cells
            .iter()
            .filter(|c| NamedUnit::parse(c).is_some())
            .count();
        let repeats = |cell| cells.iter().filter(|c| *c == cell).count() > 1;
        units > 0 && cells.iter().any(repeats)
            || units == cells.iter().filter(|c| !c.is_empty()).count()
    };
    let (heading, units) = match rows.as_slice() {
        [] => {
            return Headings {
                line: None,
                columns: (0..table.width).map(Column::unnamed).collect(),
            };
        }
        [.., above, below] if is_units(&below.1) => (above, Some(&below.1)),
        [.., last] => (last, None),
    };
    let columns = (0..table.width)
        .map(|place| match heading.1.get(place) {
            Some(name) if !name.is_empty() => {
                Column::read(name, units.and_then(|u| u.get(place)).map(String::as_str))
            }
            _ => Column::unnamed(place),
        })
        .collect();
    Headings {
        line: Some(heading.0),
        columns,
    }
}

/// Headings may stand in a comment: `# time_s,bridge_V`.
fn uncommented(line: &str) -> &str {
    line.trim_start()
        .trim_start_matches(['#', '%'])
        .trim_start()
}

/// Whether cells can be headings: at least one for each column (one may be empty), no number. There
/// may be more, such as that of a column of comments which no row fills.
fn is_heading(cells: &[String], width: usize, dialect: Dialect) -> bool {
    let filled = cells
        .iter()
        .rposition(|c| !c.is_empty())
        .map_or(0, |p| p + 1);
    // A single text above a single column is a heading only if it is not a sentence.
    let fits = if width == 1 {
        filled == 1 && cells[0].split_whitespace().count() <= 4
    } else {
        filled >= width && cells[..width].iter().filter(|c| !c.is_empty()).count() + 1 >= width
    };
    fits && cells[..filled]
        .iter()
        .all(|cell| number::cell(cell, dialect.decimal).is_none())
}

#[cfg(test)]
mod tests;
