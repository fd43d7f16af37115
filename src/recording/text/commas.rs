//! Decimal commas with comma separators: `0,001,5,998` for 0,001 and 5,998, which splits all numbers.

use super::cell::Cell;
use super::dialect::is_skipped;
use super::head::{Head, Table};
use crate::failure::{ErrorCode, Failure};
use crate::io::Delimiter;

/// Number of rows examined.
const ROWS: usize = 400;
/// Number of characters of headings and rows shown.
const SHOWN: usize = 60;

/// Rejects rows of decimal commas with comma-separated cells: twice as many cells as headings, with integers
/// alternating with digits that are not numbers of their own.
///
/// # Errors
/// If the rows look like that.
pub(super) fn refuse(head: &Head, table: &Table) -> Result<(), Failure> {
    let is_comma =
        table.dialect.delimiter == Delimiter::Byte(b',') && table.dialect.decimal == b'.';
    if !is_comma || table.width < 2 || table.width % 2 == 1 {
        return Ok(());
    }
    let all = head.lines[table.first..].iter().map(|line| &line.text);
    let lines: Vec<&String> = all.filter(|line| !is_skipped(line)).take(ROWS).collect();
    let rows: Vec<Vec<String>> = lines.iter().map(|line| table.dialect.cells(line)).collect();
    let pairs = table.width / 2;
    let fits = match headings(head, table) {
        Some(count) => count == pairs,
        None => pairs > 1,
    };
    if !fits
        || !rows
            .iter()
            .all(|row| row.len() == table.width && is_in_pieces(row))
        || !are_fractions(&rows)
    {
        return Ok(());
    }
    let shown: String = lines[0].trim().chars().take(SHOWN).collect();
    if pairs == 1 {
        return Err(ErrorCode::TextUnclear.failed(format_args!(
            "is \"{shown}\" one number with a decimal comma, or two whole numbers? Say so with --decimal , or with \
             --delimiter ,"
        ))
        .line(head.number(table.first)));
    }
    Err(ErrorCode::TextUnclear.failed(format_args!(
        "is \"{shown}\" {pairs} numbers with decimal commas? Commas part its cells as well, so that each number \
         is in two pieces: {} cells, whole numbers and digits by turns. Export the file with decimal points, or \
         with semicolons between the cells; if the cells are whole numbers, say so with --delimiter ,",
        table.width
    ))
    .line(head.number(table.first)))
}

/// Number of texts in the line just above the table, if it contains nothing else.
fn headings(head: &Head, table: &Table) -> Option<usize> {
    let above = head.lines[..table.first].iter().rev();
    let line = above
        .map(|line| &line.text)
        .find(|line| !line.trim().is_empty())?;
    let cells = table
        .dialect
        .cells(line.trim_start_matches(['#', '%', ' ']));
    let is_text = |cell: &String| {
        matches!(
            Cell::read(cell, table.dialect.decimal),
            Cell::Text | Cell::NonFinite
        )
    };
    cells.iter().all(is_text).then_some(cells.len())
}

/// Whether cells alternate between integers and digits.
fn is_in_pieces(row: &[String]) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let is_pair = |pair: &[String]| {
        let fraction = pair[1].split(['e', 'E']).next().unwrap_or_default();
        digits(pair[0].trim_start_matches(['+', '-'])) && digits(fraction)
    };
    row.chunks_exact(2).all(is_pair)
}

/// Whether each second column contains digits after a decimal mark: always the same number of them,
/// some with leading zeros.
fn are_fractions(rows: &[Vec<String>]) -> bool {
    let Some(first) = rows.first() else {
        return false;
    };
    let has_zeros = |place: usize| {
        let begins = |row: &Vec<String>| row[place].len() > 1 && row[place].starts_with('0');
        rows.iter().any(begins)
    };
    let is_fraction = |place: usize| {
        let digits = first[place].len();
        digits > 1 && rows.iter().all(|row| row[place].len() == digits) || has_zeros(place)
    };
    let mut places = (1..first.len()).step_by(2);
    places.clone().all(is_fraction) && places.any(has_zeros)
}
