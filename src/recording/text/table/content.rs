//! First row of a table, and the content of its columns.

use super::counts::Counts;
use crate::recording::text::cell::Cell;
use crate::recording::text::dialect::{Dialect, is_skipped};
use crate::recording::text::head::{self, Head, Table};
use crate::recording::text::header::Header;
use crate::recording::text::rows::{ColumnKind, Item, items};

/// Number of rows that determine the content of a column.
const SAMPLE: usize = 400;

/// Content of each column in the rows from a line on, and its first date or time.
pub(super) fn column_kinds(
    head: &Head,
    table: &Table,
    first: usize,
) -> Vec<(Option<ColumnKind>, Option<String>)> {
    let mut counts = vec![Counts::default(); table.width];
    let rows = head.lines[first..]
        .iter()
        .filter(|line| !is_skipped(&line.text))
        .take(SAMPLE);
    for line in rows {
        let cells = table.dialect.cells(&line.text);
        for (count, cell) in counts.iter_mut().zip(&cells) {
            count.add(cell, table.dialect.decimal);
        }
    }
    counts.into_iter().map(Counts::kind).collect()
}

/// Columns whose values are identified by names in other columns.
pub(super) fn named_items(
    head: &Head,
    header: &Header,
    first: usize,
    dialect: Dialect,
) -> Vec<Item> {
    let headings: Vec<&str> = header
        .fields
        .iter()
        .map(|field| field.heading.as_str())
        .collect();
    items(&headings, &dialect.cells(&head.lines[first].text))
}

/// The first row: a faulty row may be between the headings and the first good one; it belongs to the
/// table, so that the fault is reported. A single integer may be the number of rows.
pub(super) fn first_row(head: &Head, table: &Table, header: &Header) -> usize {
    let Some(names) = &header.names else {
        return table.first;
    };
    let from = head.lines[..table.first]
        .iter()
        .rposition(|line| line.text == *names);
    let from = from.map_or(table.first, |line| line + 1);
    (from..table.first)
        .rev()
        .filter(|line| !is_skipped(&head.lines[*line].text))
        .take_while(|line| {
            let cells = table.dialect.cells(&head.lines[*line].text);
            let read: Vec<Cell> = cells
                .iter()
                .map(|cell| Cell::read(cell, table.dialect.decimal))
                .collect();
            let numbers = read.iter().filter(|cell| cell.is_number()).count();
            numbers > 0
                && (read.len() >= table.width
                    || cells[0].contains(char::from(table.dialect.decimal)))
                && !cells[0].is_empty()
                && read[0] != Cell::Text
                && !head::is_numbering(&cells)
        })
        .last()
        .unwrap_or(table.first)
}
