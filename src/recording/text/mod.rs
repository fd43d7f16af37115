//! Recordings in text: decoding the bytes, telling the dialect, reading every column.
//!
//! `decode` brings the bytes to lines; `makers` knows who writes how; `head` finds the table and
//! `header` reads what stands above it, with the help of `keys` and `units`; `rows` reads the
//! numbers and `axes` finds the time.

mod axes;
mod axis_names;
mod blocks;
mod cell;
mod clock;
mod decode;
mod encoding;
mod head;
mod header;
mod keys;
mod listing;
mod makers;
mod rows;
mod sparse;
mod summary;
mod table;
mod units;

use super::{Recording, Segment};
use crate::failure::Failure;
use crate::io::csv::{self, Options};

pub use clock::Clock;
use decode::Text;
use head::Head;
use keys::Entry;
use table::Hints;

/// Bytes that a maker is told from.
const FOR_MAKER: usize = 1 << 14;
/// Fewest numbers in a text of one line that are the samples of one channel.
const ONE_LINE: usize = 32;
/// Most tables below each other.
const MOST_TABLES: usize = 1000;
/// Most details that are kept.
const DETAILS: usize = 100;

/// Reads a text file of any dialect; `source` is its name for people.
///
/// # Errors
/// If it is no recording, or leaves open how it is to be read.
pub fn read(source: &str, bytes: Vec<u8>, options: &Options) -> Result<Recording, Failure> {
    let text = decode::decode(bytes)?;
    let head = Head::of(&text.bytes, 0, 1, FOR_MAKER);
    let maker = makers::recognise(&head);
    let mut recording = match maker.and_then(|maker| maker.read) {
        Some(read) => read(&text, options)?,
        None => general(
            &text,
            maker.map_or(Hints::default(), |maker| maker.hints),
            options,
        )?,
    };
    if recording.channels.is_empty() {
        return Err(Failure::failed(
            "there is no column besides the time; expected one with the signal",
        ));
    }
    source.clone_into(&mut recording.source);
    let mut words: Vec<String> = maker.iter().map(|maker| maker.name.to_owned()).collect();
    words.extend(text.oddities.iter().map(|word| (*word).to_owned()));
    words.push(recording.dialect);
    if recording.segments.len() > 1 {
        words.push(format!("{} segments", recording.segments.len()));
    }
    recording.dialect = words.join(", ");
    recording.warnings.splice(0..0, text.warnings);
    Ok(recording)
}

/// Whether the quick reader of plain tables ([`crate::io::csv::Table`]) sees in a file what this one
/// sees: by its encoding and line ends, no maker's reader is needed, and both find the same table with
/// the same headings, units and at most one column of time, which holds numbers. `head` are the first
/// bytes of the file, `complete` says that there are no more.
#[must_use]
pub fn is_plain(head: &[u8], complete: bool, options: &Options) -> bool {
    let Ok(text) = decode::decode(head.to_vec()) else {
        return false;
    };
    // Only a mark at the start is taken away from a plain table.
    let mark = if head.starts_with(b"\xEF\xBB\xBF") {
        3
    } else {
        0
    };
    if text.bytes != head[mark..] || !text.oddities.is_empty() {
        return false;
    }
    let lines = Head::of(&text.bytes, 0, 1, FOR_MAKER);
    let is_special =
        |maker: &makers::Maker| maker.read.is_some() || maker.hints != Hints::default();
    if makers::recognise(&lines).is_some_and(is_special) {
        return false;
    }
    let Ok(layout) = csv::find_layout_in(head, complete, &options.dialect) else {
        return false;
    };
    let Ok((head, table)) = head::find(&text.bytes, 0, 1, &options.dialect) else {
        return false;
    };
    let wanted = table::wanted(&head, &table);
    let used: Vec<bool> = wanted.iter().map(Option::is_some).collect();
    let header = header::read(&head, &table, &used);
    let same_columns = layout.columns.len() == header.fields.len()
        && layout.columns.iter().zip(&header.fields).all(is_same);
    let times = header
        .fields
        .iter()
        .filter(|field| field.is_named_time())
        .count();
    let first_row = head.number(table::first_row(&head, &table, &header));
    same_columns
        && !has_marks(&head, &table)
        && !has_slow_column(&head, &table)
        && !summary::may_be_count(&head, &table)
        && layout.dialect == table.dialect
        && (layout.data_line == first_row || begins_with_number(&layout, &text.bytes))
        && wanted
            .iter()
            .all(|kind| *kind == Some(rows::Wanted::Numbers))
        && times <= 1
        // What their values say is not looked at there.
        && !header
            .fields
            .iter()
            .any(|field| units::is_weak_time_name(&field.name))
}

/// Whether both readers take a column for the same.
fn is_same((column, field): (&csv::Column, &header::Field)) -> bool {
    column.heading == field.heading && column.name == field.name && column.unit == field.unit
}

/// Whether numbers have marks between their thousands.
fn has_marks(head: &Head, table: &head::Table) -> bool {
    head.lines[table.first..].iter().any(|line| {
        let cells = table.dialect.cells(&line.text);
        let read = |cell: &String| cell::Cell::read(cell, table.dialect.decimal);
        cells
            .iter()
            .any(|cell| matches!(read(cell), cell::Cell::Grouped(_)))
    })
}

/// Whether a column has a value in fewer than half of the first rows, but in some.
fn has_slow_column(head: &Head, table: &head::Table) -> bool {
    let mut filled = vec![0_usize; table.width];
    let mut rows = 0;
    for line in &head.lines[table.first..] {
        let cells = table.dialect.cells(&line.text);
        rows += 1;
        for (count, cell) in filled.iter_mut().zip(&cells) {
            *count += usize::from(!cell.is_empty());
        }
    }
    filled.iter().any(|count| *count > 0 && 2 * count < rows)
}

/// Whether the first row that the quick reader sees begins as a row does: with something wrong behind
/// that, it refuses the row, while this reader would begin after it.
fn begins_with_number(layout: &csv::Layout, text: &[u8]) -> bool {
    let line = text.split(|byte| *byte == b'\n').nth(layout.data_line - 1);
    let line = csv::decode_line(line.unwrap_or(&[]));
    let cells = layout.dialect.cells(&line);
    cells
        .first()
        .is_some_and(|cell| crate::io::number::cell(cell, layout.dialect.decimal).is_some())
}

/// A table, or several below each other under the same headings.
fn general(text: &Text, hints: Hints, options: &Options) -> Result<Recording, Failure> {
    let mut parts = Vec::new();
    let (mut from, mut number, mut begins_anew) = (0, 1, false);
    if let Some(column) = one_line(&text.bytes, options) {
        let part = table::read(&column, 0, 1, hints, options, &|_| false)?;
        return Ok(recording_of(vec![part]));
    }
    loop {
        let part = match table::read(&text.bytes, from, number, hints, options, &|_| false) {
            Ok(part) => part,
            Err(failure) if begins_anew => {
                return Err(Failure::failed(format_args!(
                    "line {number}: a block of its own begins here, and cannot be read: {failure}; split \
                     the file"
                )));
            }
            // What follows the last table need not be one.
            Err(_) if !parts.is_empty() => break,
            Err(failure) => return Err(failure),
        };
        let is_last = part.end >= text.bytes.len()
            || part.end <= from
            || head::is_end(&csv::decode_line(line_at(&text.bytes, part.end)));
        (from, number) = (part.end, part.next_line);
        begins_anew = part.begins_anew;
        parts.push(part);
        if is_last {
            break;
        }
        if parts.len() > MOST_TABLES {
            return Err(Failure::failed(format_args!(
                "line {number}: there are more than {MOST_TABLES} tables below each other; split the \
                 file"
            )));
        }
    }
    Ok(recording_of(parts))
}

/// The line that begins at an offset.
fn line_at(text: &[u8], offset: usize) -> &[u8] {
    let rest = &text[offset..];
    &rest[..memchr::memchr(b'\n', rest).unwrap_or(rest.len())]
}

/// The numbers of a text that is one line of them, each in a line of its own: some oscilloscopes write
/// the samples so.
fn one_line(text: &[u8], options: &Options) -> Option<Vec<u8>> {
    let line = text.trim_ascii();
    if line.contains(&b'\n') || options.dialect.delimiter.is_some() {
        return None;
    }
    let mark = *[b'\t', b';', b',', b' ']
        .iter()
        .find(|mark| line.contains(mark))?;
    let decimal = options.dialect.decimal.unwrap_or(b'.');
    let cells = line.split(|byte| *byte == mark);
    let numbers = cells.clone().filter(|cell| !cell.is_empty()).all(|cell| {
        std::str::from_utf8(cell).is_ok_and(|cell| crate::io::number::cell(cell, decimal).is_some())
    });
    let is_long = cells.count() >= ONE_LINE;
    (numbers && is_long).then(|| {
        line.iter()
            .map(|byte| if *byte == mark { b'\n' } else { *byte })
            .collect()
    })
}

/// Puts tables together as the segments of a recording.
fn recording_of(parts: Vec<table::Part>) -> Recording {
    let blocks: usize = parts.iter().map(|part| part.blocks.len()).sum();
    let mut recording = Recording::empty("csv", String::new());
    for (place, part) in parts.into_iter().enumerate() {
        if place == 0 {
            recording.dialect = part.dialect.describe();
            recording.details = details(&part.entries);
        }
        for channels in part.blocks {
            let segment = recording.segments.len();
            if blocks > 1 {
                recording.segments.push(Segment {
                    name: format!("segment {}", segment + 1),
                    start_s: None,
                    start_text: keys::date_text(&part.entries),
                });
            }
            for mut channel in channels {
                channel.segment = (blocks > 1).then_some(segment);
                recording.channels.push(channel);
            }
        }
        recording.warnings.extend(part.warnings);
        recording.lost = recording.lost.or(part.lost);
    }
    recording
}

/// Keys and values for people.
fn details(entries: &[Entry]) -> Vec<(String, String)> {
    entries
        .iter()
        .filter(|entry| entry.value().is_some())
        .take(DETAILS)
        .map(|entry| {
            let values: Vec<&str> = entry
                .values
                .iter()
                .map(String::as_str)
                .filter(|v| !v.is_empty())
                .collect();
            (entry.key.clone(), values.join(", "))
        })
        .collect()
}

#[cfg(test)]
mod tests;
