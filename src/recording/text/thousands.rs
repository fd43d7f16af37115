//! Thousands separators that are also valid as decimal marks: `1,234` and `1.234`.

use super::cell::Cell;
use super::dialect::{Dialect, is_skipped};
use super::head::{Head, Table};
use crate::failure::{ErrorCode, Failure};

/// Digits per group.
const GROUP: usize = 3;

/// Rejects a table whose decimal mark may be a thousands separator: a comma that is ambiguous in all rows, or a point
/// in a column with integers of up to three digits, or with ambiguous commas. `others` are the tables that read as many
/// rows, with thousands separators.
///
/// # Errors
/// If the table is such a one.
pub(super) fn refuse(head: &Head, table: &Table, others: &[&Table]) -> Result<(), Failure> {
    let dialect = table.dialect;
    let Some(other) = others
        .iter()
        .map(|other| other.dialect)
        .find(|other| other.delimiter == dialect.delimiter && other.decimal != dialect.decimal)
    else {
        return Ok(());
    };
    let found = if dialect.decimal == b',' {
        Some((table.first, "comma"))
    } else {
        let point = grouped_place(head, table, other).map(|place| (place, "point"));
        point.or_else(|| comma_place(head, table).map(|place| (place, "comma")))
    };
    let Some((place, name)) = found else {
        return Ok(());
    };
    Err(unclear(head, place, |shown| {
        format!(
            "the {name} in \"{shown}\" can be a decimal mark or stand between thousands; say which with --decimal , or \
             --decimal ."
        )
    }))
}

/// The error that a line can be read in two ways.
fn unclear(head: &Head, place: usize, why: impl Fn(&str) -> String) -> Failure {
    let shown: String = head.lines[place].text.trim().chars().take(60).collect();
    ErrorCode::TextUnclear
        .failed(why(&shown))
        .line(head.number(place))
}

/// Rejects a table with a column in which every number has the mark that is not the decimal mark of the others, before
/// three digits: `10.271` beside `0,001`.
///
/// # Errors
/// If the table is such a one.
pub(super) fn refuse_mixed(head: &Head, table: &Table) -> Result<(), Failure> {
    let decimal = table.dialect.decimal;
    let columns = marked_columns(head, table, decimal).into_iter();
    let mut mixed = columns.filter(|c| !c.has_plain && !c.has_others);
    let Some(place) = mixed.find_map(|column| column.grouped) else {
        return Ok(());
    };
    let (mark, decimal) = match decimal {
        b',' => ("point", "comma"),
        _ => ("comma", "point"),
    };
    Err(unclear(head, place, |shown| {
        format!(
            "the {mark} in \"{shown}\" stands before three digits in every row of its column, while others have a \
             decimal {decimal}: it can be a decimal mark or stand between thousands. If it stands between thousands, \
             say so with --decimal {}; otherwise write the same decimal mark in all columns",
            char::from(table.dialect.decimal)
        )
    }))
}

/// Location of the first number of a column whose points look like thousands separators: each is followed by three
/// digits and not preceded by a zero, and the numbers without one are integers of at most three digits. Numbers with
/// a fixed number of decimals have a point in all of them, and those with as many as needed have other counts.
fn grouped_place(head: &Head, table: &Table, other: Dialect) -> Option<usize> {
    let mut columns = marked_columns(head, table, other.decimal).into_iter();
    columns.find_map(|c| c.grouped.filter(|_| c.has_plain && !c.has_others))
}

fn marked_columns(head: &Head, table: &Table, decimal: u8) -> Vec<MarkedColumn> {
    let mut columns = vec![MarkedColumn::default(); table.width];
    for (place, line) in head.lines.iter().enumerate().skip(table.first) {
        if is_skipped(&line.text) {
            continue;
        }
        for (column, text) in columns.iter_mut().zip(table.dialect.cells(&line.text)) {
            column.add(place, &text, decimal);
        }
    }
    columns
}

/// Location of the first number with commas as thousands separators.
fn comma_place(head: &Head, table: &Table) -> Option<usize> {
    let has_comma = |text: &str| {
        text.contains(',') && matches!(Cell::read(text, table.dialect.decimal), Cell::Grouped(_))
    };
    let rows = head.lines.iter().enumerate().skip(table.first);
    let mut rows = rows.filter(|(_, line)| !is_skipped(&line.text));
    let found = rows.find(|(_, line)| table.dialect.cells(&line.text).iter().any(|c| has_comma(c)));
    found.map(|(place, _)| place)
}

/// Format of the numbers of a column.
#[derive(Default, Clone)]
struct MarkedColumn {
    /// The line of the first one with a mark before three digits.
    grouped: Option<usize>,
    /// Whether some are integers too small for a separator.
    has_plain: bool,
    /// Whether there is anything else.
    has_others: bool,
}

impl MarkedColumn {
    fn add(&mut self, place: usize, text: &str, decimal: u8) {
        let digits = text.trim_start_matches(['+', '-']);
        let is_plain = digits.len() <= GROUP && digits.bytes().all(|b| b.is_ascii_digit());
        let other = if decimal == b',' { '.' } else { ',' };
        let has_one_mark = || text.contains(other) && text.matches(['.', ',']).count() == 1;
        match Cell::read(text, decimal) {
            Cell::Empty | Cell::NonFinite => {}
            Cell::Grouped(_) if has_one_mark() => self.grouped = self.grouped.or(Some(place)),
            Cell::Number(_) if is_plain => self.has_plain = true,
            _ => self.has_others = true,
        }
    }
}
