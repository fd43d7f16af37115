//! Telling from the first bytes of a text file how its table is laid out.
//!
//! Every way to split the lines into numbers is tried; the one that explains the most lines wins.
//! Where two ways explain the same lines differently, the file cannot be told for sure and the
//! user is asked.

use super::names::{Column, NamedUnit};
use crate::failure::Failure;
use crate::io::number;

/// Most lines above the data that are looked at for headings and units.
const LINES_FOR_HEADINGS: usize = 6;
/// Fewest rows in a row that make a table, unless the file holds fewer.
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

/// What the user said about the file.
#[derive(Debug, Clone, Default)]
pub struct Told {
    /// Cell separator.
    pub delimiter: Option<Delimiter>,
    /// Decimal mark.
    pub decimal: Option<u8>,
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
pub fn find(head: &[u8], complete: bool, told: &Told) -> Result<Layout, Failure> {
    let lines = Lines::of(head, complete);
    let mut best: Vec<(Dialect, Table)> = Vec::new();
    for dialect in candidates(told) {
        let Some(table) = Table::find(&lines, dialect) else {
            continue;
        };
        match best.first().map(|(_, other)| other.rows) {
            Some(rows) if rows > table.rows => {}
            Some(rows) if rows == table.rows => best.push((dialect, table)),
            _ => best = vec![(dialect, table)],
        }
    }
    let (dialect, table) = choose(&lines, &best)?;
    let (heading_line, columns) = headings(&lines, dialect, &table);
    Ok(Layout {
        dialect,
        columns,
        heading_line,
        data_line: table.first + 1,
        data_offset: lines.0[table.first].0,
    })
}

/// Dialects in the order of preference between equals.
fn candidates(told: &Told) -> Vec<Dialect> {
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
            if delimiter != Delimiter::Byte(decimal) {
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
                lines.push((start, decode(piece)));
            }
            start += piece.len();
        }
        Self(lines)
    }
}

/// UTF-8, or else the Latin-1 of older recorders, in which any byte is a character.
fn decode(bytes: &[u8]) -> String {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}

/// A run of rows with the same number of numeric cells.
#[derive(Debug, Clone, PartialEq)]
struct Table {
    /// Index of the first line.
    first: usize,
    /// Number of rows.
    rows: usize,
    /// Cells of a row, empty ones at its end left out.
    width: usize,
}

impl Table {
    /// The longest run under a dialect.
    fn find(lines: &Lines, dialect: Dialect) -> Option<Self> {
        let mut best: Option<Self> = None;
        let mut current: Option<Self> = None;
        for (index, (_, line)) in lines.0.iter().enumerate() {
            if is_skipped(line) {
                continue;
            }
            match (numeric_width(line, dialect), &mut current) {
                (Some(width), Some(table)) if table.width == width => table.rows += 1,
                (Some(width), _) => {
                    current = Some(Self {
                        first: index,
                        rows: 1,
                        width,
                    });
                }
                (None, _) => current = None,
            }
            if let Some(table) = &current
                && best.as_ref().is_none_or(|b| table.rows > b.rows)
            {
                best.clone_from(&current);
            }
        }
        let several = lines.0.len() > FEWEST_ROWS;
        best.filter(|table| table.rows >= FEWEST_ROWS || !several)
    }
}

/// Number of cells if they are all numbers (or say that they are none), those at the end may be
/// empty.
fn numeric_width(line: &str, dialect: Dialect) -> Option<usize> {
    let cells = dialect.cells(line);
    let width = cells.iter().rposition(|cell| !cell.is_empty())? + 1;
    let numeric =
        |cell: &String| number::cell(cell, dialect.decimal).is_some() || is_not_a_number(cell);
    let numbers = cells[..width]
        .iter()
        .filter(|cell| number::cell(cell, dialect.decimal).is_some())
        .count();
    let good = cells[..width].iter().all(|c| numeric(c) || c.is_empty());
    (good && numbers > 0).then_some(width)
}

/// Whether a cell says that there is no number: NaN, infinity and their Windows spellings.
#[must_use]
pub fn is_not_a_number(cell: &str) -> bool {
    let text = cell.trim_start_matches(['+', '-']).to_lowercase();
    matches!(
        text.as_str(),
        "nan" | "inf" | "infinity" | "1.#qnan" | "1.#ind" | "1.#inf"
    )
}

fn choose(lines: &Lines, best: &[(Dialect, Table)]) -> Result<(Dialect, Table), Failure> {
    let Some((dialect, table)) = best.first() else {
        return Err(Failure::failed(no_table(lines)));
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
    let (heading_line, _) = headings(lines, separator.0, &separator.1);
    if heading_line.is_some() && separator.1.width > 1 {
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

fn no_table(lines: &Lines) -> String {
    if lines.0.iter().all(|(_, line)| line.trim().is_empty()) {
        return "the file is empty; expected rows of numbers".to_owned();
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

/// Line of the headings and the columns they name.
fn headings(lines: &Lines, dialect: Dialect, table: &Table) -> (Option<usize>, Vec<Column>) {
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
        units > 0
            && cells
                .iter()
                .any(|cell| cells.iter().filter(|c| *c == cell).count() > 1)
            || units == cells.iter().filter(|c| !c.is_empty()).count()
    };
    let (heading, units) = match rows.as_slice() {
        [] => return (None, (0..table.width).map(Column::unnamed).collect()),
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
    (Some(heading.0 + 1), columns)
}

/// Headings may stand in a comment: `# time_s,bridge_V`.
fn uncommented(line: &str) -> &str {
    line.trim_start()
        .trim_start_matches(['#', '%'])
        .trim_start()
}

/// Whether cells can be headings: one for each column (all but empty ones at the end), no number.
fn is_heading(cells: &[String], width: usize, dialect: Dialect) -> bool {
    let filled = cells
        .iter()
        .rposition(|c| !c.is_empty())
        .map_or(0, |p| p + 1);
    // A single text above a single column is a heading only if it is not a sentence.
    let fits = if width == 1 {
        filled == 1 && cells[0].split_whitespace().count() <= 4
    } else {
        filled == width && cells[..width].iter().filter(|c| !c.is_empty()).count() + 1 >= width
    };
    fits && cells[..filled]
        .iter()
        .all(|cell| number::cell(cell, dialect.decimal).is_none())
}

#[cfg(test)]
mod tests;
