//! Keys and values in the lines above a table: rate, start, date, number of samples.

mod commas;
mod values;
mod words;

use crate::recording::text::dialect::{Delimiter, Dialect};
pub use values::{date_text, has_unit, quantity, rate_hz, seconds};
pub use words::{is_of_others, is_thinning, is_vague, topic};

/// A line with a key and values.
#[derive(Debug, Clone, PartialEq)]
pub struct HeaderEntry {
    /// Number of the line in the file.
    pub line: usize,
    /// The key, without colon, equals sign and quotes.
    pub key: String,
    /// Cells after it, including empty ones.
    pub values: Vec<String>,
    /// Whether the comma between the first two may be a mark within one number.
    pub is_number_split: bool,
}

/// Topic of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topic {
    /// Sampling rate.
    Rate,
    /// Time between samples.
    Interval,
    /// Time of the first sample.
    Start,
    /// Date or time of day of the record.
    Date,
    /// Number of samples.
    Count,
    /// Unit of the channels.
    Unit,
    /// Unit of the horizontal axis.
    AxisUnit,
    /// Names of the channels.
    Name,
}

impl Topic {
    /// From its name in the vocabulary.
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "rate" => Self::Rate,
            "interval" => Self::Interval,
            "start" => Self::Start,
            "date" => Self::Date,
            "count" => Self::Count,
            "unit" => Self::Unit,
            "axis unit" => Self::AxisUnit,
            "name" => Self::Name,
            _ => return None,
        })
    }
}

impl HeaderEntry {
    /// Topic of its key.
    pub fn topic(&self) -> Option<Topic> {
        topic(&self.key)
    }

    /// Its first nonempty value.
    pub fn value(&self) -> Option<&str> {
        self.values
            .iter()
            .map(String::as_str)
            .find(|v| !v.is_empty())
    }
}

/// Entries of a line: one for its key and values, or one for each cell `key = value`.
pub fn entries(line: usize, text: &str, dialect: Dialect) -> Vec<HeaderEntry> {
    let text = text
        .trim()
        .trim_start_matches(['#', '%', '!', '*', ';', '/'])
        .trim();
    // `Abtastrate = 2,5 kHz` is one value, whatever the table's separator.
    if let Some(entry) = one_cell(line, text).filter(is_quantity) {
        return vec![entry];
    }
    if let Some(entry) = bare_rate(line, text, dialect.decimal) {
        return vec![entry];
    }
    let (cells, mark) = split(text, dialect);
    // `CH1V,CH2V,t0 =-5e-05, tInc = 1e-09,`: separate cells.
    let assignments: Vec<HeaderEntry> = cells
        .iter()
        .filter_map(|cell| {
            let (key, value) = cell.split_once('=').or_else(|| cell.split_once(": "))?;
            entry(line, key, vec![value.trim().to_owned()])
        })
        .collect();
    if assignments
        .iter()
        .filter(|entry| entry.value().is_some())
        .count()
        > 0
        && (assignments.len() > 1
            || cells.iter().filter(|c| !c.is_empty()).count() == 1
            || !cells[0].contains(['=', ':']))
    {
        return assignments;
    }
    if let Some(entry) = before_comma(line, text, dialect).filter(|_| assignments.len() < 2) {
        return vec![entry];
    }
    match cells.split_first() {
        Some((key, values)) if values.iter().any(|value| !value.is_empty()) => {
            let entry = entry(line, key, values.to_vec());
            let entry = entry.map(|entry| match mark {
                Some(b',') => commas::joined(entry),
                _ => entry,
            });
            entry.into_iter().collect()
        }
        _ => one_cell(line, text).into_iter().collect(),
    }
}

/// A rate or an interval without a key: `0.5 msec/sample`, `2000 samples/s`.
fn bare_rate(line: usize, text: &str, decimal: u8) -> Option<HeaderEntry> {
    let (_, unit) = quantity(text, decimal)?;
    let lower = unit.to_lowercase();
    let is_rate = lower.ends_with("sec/sample") || lower.starts_with("samples/s");
    let value = text.strip_suffix("/sample").unwrap_or(text);
    entry(line, &unit, vec![value.to_owned()]).filter(|_| is_rate)
}

/// A key and its value separated by the first colon or equals sign, before a comma that belongs to the
/// value, as the table has another separator: `Date : 24.11.2011, 09:07:38`.
fn before_comma(line: usize, text: &str, dialect: Dialect) -> Option<HeaderEntry> {
    let place = text.find([':', '='])?;
    let is_first = text.find(',').is_some_and(|comma| place < comma);
    if !is_first || dialect.delimiter == Delimiter::Byte(b',') || text.contains(['\t', ';']) {
        return None;
    }
    let value = text[place + 1..].trim().trim_end_matches(',');
    let is_path = value.starts_with(['\\', '/']);
    entry(line, &text[..place], vec![value.to_owned()]).filter(|_| !is_path)
}

/// Whether the value is only a number, with or without a unit.
fn is_quantity(entry: &HeaderEntry) -> bool {
    let Some(text) = entry.value() else {
        return false;
    };
    let is_unit = |c: char| c.is_alphabetic() || matches!(c, '/' | '%' | ' ' | '°' | '²');
    text.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+')
        && quantity(text, b'.').is_some_and(|(_, unit)| unit.chars().all(is_unit))
}

/// `Sampling Frequency - 5000`, `Date: 1.2.2024`, `T0 = 5`.
fn one_cell(line: usize, text: &str) -> Option<HeaderEntry> {
    let marks = ["=", ":", " - ", "\t"];
    let (key, value) = marks.iter().find_map(|mark| {
        let (key, value) = text.split_once(mark)?;
        // A path is not a key: C:\data\test.txt.
        let is_path = *mark == ":" && (value.starts_with('\\') || value.starts_with('/'));
        (!is_path && !value.trim().is_empty()).then_some((key, value))
    })?;
    entry(
        line,
        key,
        vec![
            value
                .trim()
                .trim_end_matches([':', ';', ','])
                .trim()
                .to_owned(),
        ],
    )
}

fn entry(line: usize, key: &str, values: Vec<String>) -> Option<HeaderEntry> {
    let key = key
        .trim()
        .trim_matches('"')
        .trim()
        .trim_end_matches([':', '=', ' '])
        .trim();
    let has_letters = key.chars().any(char::is_alphabetic);
    (has_letters && key.chars().count() <= 80).then(|| HeaderEntry {
        line,
        key: key.to_owned(),
        values: values
            .iter()
            .map(|value| {
                value
                    .trim()
                    .trim_matches('"')
                    .trim_start_matches(':')
                    .trim()
                    .to_owned()
            })
            .collect(),
        is_number_split: false,
    })
}

/// Cells of a line above a table, whose separator may differ from that of the table, and that separator.
fn split(text: &str, dialect: Dialect) -> (Vec<String>, Option<u8>) {
    let table = match dialect.delimiter {
        Delimiter::Byte(byte) => Some(byte),
        Delimiter::Spaces | Delimiter::None => None,
    };
    let marks = [table, Some(b'\t'), Some(b';'), Some(b',')];
    for mark in marks.into_iter().flatten() {
        let is_decimal = table.is_none() && dialect.decimal == mark
            || table != Some(mark) && is_within_number(text, mark);
        if text.contains(char::from(mark)) && !is_decimal {
            let delimiter = Delimiter::Byte(mark);
            let dialect = Dialect {
                delimiter,
                ..dialect
            };
            return (dialect.cells(text), Some(mark));
        }
    }
    (vec![text.to_owned()], None)
}

/// Whether the first of these marks is in a number behind a word: `Abtastintervall 0,2 ms`.
fn is_within_number(text: &str, mark: u8) -> bool {
    let is_digit = |c: char| c.is_ascii_digit();
    let parts = text.split_once(char::from(mark));
    parts.is_some_and(|(before, behind)| {
        let word = before.rsplit_once(' ').map_or("", |(_, word)| word);
        !word.is_empty() && word.chars().all(is_digit) && behind.starts_with(is_digit)
    })
}

#[cfg(test)]
mod tests;
