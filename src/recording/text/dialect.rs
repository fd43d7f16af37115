//! Format of cells and numbers, and splitting of a line into cells.

use std::cell::RefCell;

pub use crate::io::Delimiter;
use crate::io::DialectOverride;

/// Format of numbers and cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dialect {
    /// What separates cells.
    pub delimiter: Delimiter,
    /// Decimal mark: `.` or `,`.
    pub decimal: u8,
}

impl Dialect {
    /// Cells of a line without surrounding spaces; quoted cells are unquoted.
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

    /// Name for messages.
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

thread_local! {
    /// Parsers of quoted cells by delimiter. Making one takes as long as parsing a hundred lines.
    static PARSERS: RefCell<Vec<(u8, csv_core::Reader)>> = const { RefCell::new(Vec::new()) };
}

/// Cells of a line with quotes.
fn quoted_cells(line: &str, delimiter: u8) -> Vec<String> {
    PARSERS.with_borrow_mut(|parsers| {
        let made = parsers.iter().position(|(mark, _)| *mark == delimiter);
        let place = made.unwrap_or_else(|| {
            let parser = csv_core::ReaderBuilder::new().delimiter(delimiter).build();
            parsers.push((delimiter, parser));
            parsers.len() - 1
        });
        cells_by(&mut parsers[place].1, line)
    })
}

fn cells_by(parser: &mut csv_core::Reader, line: &str) -> Vec<String> {
    parser.reset();
    let (mut text, mut ends) = (vec![0; line.len()], vec![0; line.len() + 1]);
    let (result, _, written, mut count) = parser.read_record(line.as_bytes(), &mut text, &mut ends);
    if result == csv_core::ReadRecordResult::InputEmpty {
        // The end of the line ends the last cell.
        let (_, _, _, last) = parser.read_record(&[], &mut text[written..], &mut ends[count..]);
        count += last;
    }
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let cells = starts
        .zip(&ends[..count])
        .map(|(from, to)| &text[from..*to]);
    let cells = cells.map(|cell| String::from_utf8_lossy(cell).trim().to_owned());
    cells.collect()
}

/// Whether a line is empty, a comment, or contains only separators.
pub fn is_skipped(line: &str) -> bool {
    let text = line.trim();
    is_comment(text) || text.chars().all(|c| matches!(c, ',' | ';' | '\t' | ' '))
}

/// Whether a line is a comment.
pub fn is_comment(line: &str) -> bool {
    let text = line.trim_start();
    text.starts_with(['#', '%', '!']) || text.starts_with("//")
}

/// UTF-8, otherwise the Windows-1252 of older recorders (Latin-1 with quotation marks and dashes),
/// in which any byte is a character.
pub fn decode_line(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => encoding_rs::WINDOWS_1252
            .decode_without_bom_handling(bytes)
            .0
            .into_owned(),
    }
}

/// Dialects in the order of preference among equals. A decimal comma with comma separators requires
/// quotes.
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
