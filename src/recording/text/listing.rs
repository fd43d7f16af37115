//! Lists of settings and of results, which look like tables but are not recordings.

use super::cell::Cell;
use super::clock::EPOCH_S;
use super::head::{Head, Table};
use super::header::Field;
use super::rows::ColumnKind;
use super::vocabulary::has;
use crate::failure::{ErrorCode, Failure};
use crate::recording::choice::transposed;
use crate::recording::text::dialect::is_skipped;

/// Maximum fraction of text columns in a table that is a recording.
const TEXTS: f64 = 0.34;
/// Number of rows used to detect a list.
const LISTED: usize = 200;
/// Maximum number of states of a switch.
const STATES: usize = 3;
/// Maximum number of rows of a list of results.
const FEW_RESULTS: usize = 50;

/// Rejects a list of settings or results, in which most columns contain texts.
///
/// # Errors
/// If it is one.
pub fn refuse(head: &Head, table: &Table) -> Result<(), Failure> {
    let rows = first_cells(head, table);
    let read: Vec<Vec<Cell>> = rows
        .iter()
        .map(|row| {
            row.iter()
                .map(|cell| Cell::read(cell, table.dialect.decimal))
                .collect()
        })
        .collect();
    let names: Vec<String> = rows.iter().filter_map(|row| row.first().cloned()).collect();
    if is_list_of_results(&read, &names) {
        if let Some(question) = transposed(table.width, Some(rows.len())) {
            return Err(question);
        }
        return Err(ErrorCode::NotARecording.failed(format_args!(
            "the file is a list of results, not a recording: each of its {} rows from line {} on has its own name \
             in the first column; expected rows of numbers, one per sample",
            rows.len(),
            head.number(table.first)
        )));
    }
    // With a time for each row, states such as alarms are consistent with a recording.
    let has_time = (0..table.width).any(|place| is_clock(&read, place)) || begins_with_epoch(&read);
    let texts = (0..table.width)
        .filter(|place| is_text(&read, *place) && !(has_time && is_state(&rows, *place)))
        .count();
    // A single signal may have one or two columns of remarks.
    if texts > 2 && texts as f64 > TEXTS * table.width as f64 {
        return Err(ErrorCode::NotARecording.failed(format_args!(
            "the file is a list of settings or results, not a recording: {texts} of the {} columns from line {} on \
             contain text; expected rows of numbers, one per sample",
            table.width,
            head.number(table.first)
        )));
    }
    Ok(())
}

/// Rejects a table whose rows name one variable after the other: their values would be read as one channel.
///
/// # Errors
/// If it is one.
pub fn refuse_variables(
    head: &Head,
    table: &Table,
    kinds: &[ColumnKind],
    fields: &[Field],
) -> Result<(), Failure> {
    let rows = first_cells(head, table);
    let is_number = |place: usize| {
        let is_filled = rows.first().and_then(|row| row.get(place));
        matches!(kinds[place], ColumnKind::Numbers | ColumnKind::Offset(_))
            && is_filled.is_some_and(|cell| !cell.is_empty())
    };
    let numbers: Vec<usize> = (0..kinds.len()).filter(|place| is_number(*place)).collect();
    let is_clock = |place: &usize| matches!(kinds[*place], ColumnKind::Clock(_));
    let mut places = 0..kinds.len();
    let listed = places.find_map(|place| {
        let is_id = has("signal numbers", &fields[place].name.to_lowercase());
        let (count, is_cycle) = match kinds[place] {
            // Not numbers with units.
            ColumnKind::Nothing if is_id || !starts_with_digit(&rows, place) => {
                variables(&rows, place)?
            }
            ColumnKind::Numbers if is_id => variables(&rows, place)?,
            _ => return None,
        };
        let same = |time: usize| {
            rows.chunks_exact(count)
                .all(|cycle| cycle.iter().all(|row| row.get(time) == cycle[0].get(time)))
        };
        let is_same_time = || is_cycle && (0..kinds.len()).filter(is_clock).any(same);
        // One value, and perhaps the time.
        let of_time = usize::from(!(0..kinds.len()).any(|place| is_clock(&place)));
        let values = numbers.iter().filter(|number| **number != place).count();
        ((1..=1 + of_time).contains(&values) || is_same_time()).then_some((count, place))
    });
    match listed {
        Some((count, place)) => Err(ErrorCode::NotARecording.failed(format_args!(
            "the rows name {count} variables in turn, first \"{}\" in \"{}\"; expected a column for each variable: \
             rewrite the file that way, or keep only the rows of one variable, without that column",
            rows[0][place], fields[place].heading
        ))
        .line(head.number(table.first))),
        None => Ok(()),
    }
}

/// Whether the first column contains whole seconds since 1970, like a stamp without a heading.
fn begins_with_epoch(rows: &[Vec<Cell>]) -> bool {
    let is_epoch = |row: &Vec<Cell>| match row.first() {
        Some(Cell::Number(s)) => s.fract() == 0.0 && EPOCH_S.contains(s),
        _ => false,
    };
    rows.len() > 1 && rows.iter().all(is_epoch)
}

/// Number of variables that the texts of a column name, of which most rows name another one than the row before, and
/// whether they always come in the same order.
fn variables(rows: &[Vec<String>], place: usize) -> Option<(usize, bool)> {
    let texts: Vec<&String> = rows.iter().filter_map(|row| row.get(place)).collect();
    let mut names: Vec<&String> = texts.clone();
    names.sort_unstable();
    names.dedup();
    let count = names.len();
    let changes = texts.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let is_list = count > 1
        && texts.len() == rows.len()
        && texts.len() >= 3 * count
        && 2 * changes >= texts.len()
        && !names[0].is_empty();
    let comes_again = || texts.iter().zip(&texts[count..]).all(|(a, b)| a == b);
    is_list.then(|| (count, comes_again()))
}

fn starts_with_digit(rows: &[Vec<String>], place: usize) -> bool {
    let first = rows.first().and_then(|row| row.get(place));
    first.is_some_and(|text| {
        text.trim_start_matches(['-', '+', '\'', '='])
            .starts_with(|c: char| c.is_ascii_digit())
    })
}

/// The cells of the first rows.
fn first_cells(head: &Head, table: &Table) -> Vec<Vec<String>> {
    head.lines[table.first..]
        .iter()
        .filter(|line| !is_skipped(&line.text))
        .take(LISTED)
        .map(|line| table.dialect.cells(&line.text))
        .collect()
}

/// Whether a column contains more texts than data.
fn is_text(rows: &[Vec<Cell>], place: usize) -> bool {
    let (mut texts, mut data) = (0, 0);
    for cell in rows.iter().filter_map(|row| row.get(place)) {
        texts += usize::from(*cell == Cell::Text);
        data += usize::from(cell.is_datum());
    }
    texts > data
}

/// Whether a column contains only dates and times.
fn is_clock(rows: &[Vec<Cell>], place: usize) -> bool {
    rows.len() > 1
        && rows
            .iter()
            .all(|row| matches!(row.get(place), Some(Cell::Clock(_))))
}

/// Whether a column contains few different texts, as for switches and alarms.
fn is_state(rows: &[Vec<String>], place: usize) -> bool {
    let mut states: Vec<&String> = rows.iter().filter_map(|row| row.get(place)).collect();
    states.sort_unstable();
    states.dedup();
    states.len() <= STATES
}

/// Whether a few rows have distinct names in the first column, none of them a time.
fn is_list_of_results(rows: &[Vec<Cell>], names: &[String]) -> bool {
    let is_name = |name: &&String| name.bytes().all(|byte| !byte.is_ascii_digit());
    let distinct = || {
        names
            .iter()
            .enumerate()
            .all(|(place, name)| !names[..place].contains(name))
    };
    rows.len() <= FEW_RESULTS
        && rows.iter().all(|row| row.first() == Some(&Cell::Text))
        && names.iter().filter(is_name).count() == names.len()
        && distinct()
}
