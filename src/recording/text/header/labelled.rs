//! Headers whose rows are labelled in the first column.

use super::HeaderRow;
use super::field::Field;
use super::positional::is_nothing_but_units;
use crate::recording::text::keys::{self, Topic};
use crate::recording::text::units;
use crate::recording::text::vocabulary::has;

/// Whether a cell labels the row of names.
pub(super) fn is_name_label(cell: &str) -> bool {
    let cell = cell
        .trim()
        .trim_end_matches([':', '='])
        .trim()
        .to_lowercase();
    has("names of rows", &cell)
}

/// A header with row labels in the first column (repeated above every further time column): the
/// columns, and the line of the names.
pub(super) fn labelled(rows: &[HeaderRow], used: &[bool]) -> Option<(Vec<Field>, usize)> {
    let names = rows
        .iter()
        .rev()
        .filter(|row| is_wide(row, used.len()))
        .find(|row| is_name_label(&row.cells[0]))?;
    let block = block_around(rows, names.line);
    let others: Vec<&HeaderRow> = rows
        .iter()
        .filter(|row| row.line != names.line && block.contains(&row.line))
        .filter(|row| row.cells.len() > 1 && !row.cells[0].is_empty())
        .filter(|row| row.cells.len() + 1 >= used.len())
        .collect();
    let about = |topic: Topic| {
        let key = |row: &&&HeaderRow| row.cells[0].trim_end_matches([':', '=']).trim().to_owned();
        others
            .iter()
            .find(|row| keys::topic(&key(row)) == Some(topic))
    };
    // Headings just above the data that begin with the time are better names.
    let has_headings = rows.last().is_some_and(|last| {
        last.line > names.line && last.cells.len() >= used.len() && is_headings(&last.cells)
    });
    if has_headings {
        return None;
    }
    let named = names.cells.iter().filter(|cell| !cell.is_empty()).count();
    let units = about(Topic::Unit)
        .copied()
        .filter(|row| row.cells.len() >= named);
    // Without a further informative row, the label must be above several columns.
    let is_alone = others.is_empty()
        || units.is_none() && about(Topic::Interval).is_none() && about(Topic::Rate).is_none();
    let is_repeated = names.cells[1..].iter().any(|cell| *cell == names.cells[0]);
    if is_alone && !is_repeated && !is_last_and_apart(rows, names.line) {
        return None;
    }
    // Second,Volt just above the data.
    let under = rows
        .last()
        .filter(|last| last.line > names.line && is_nothing_but_units(&last.cells));
    let fields = match is_beside_data(names, used) {
        true => fields_beside(names, units, used.len()),
        false => fields_below(names, units, under, &others, used),
    };
    Some((fields, names.line))
}

/// Whether a line is the last above the data and separated from the rest by an empty one, so that
/// it is not a key among others.
fn is_last_and_apart(rows: &[HeaderRow], line: usize) -> bool {
    let [.., above, last] = rows else {
        return false;
    };
    last.line == line && above.line + 1 < line
}

/// Whether cells are a time name and channel names, rather than a key with values or units.
fn is_headings(cells: &[String]) -> bool {
    let is_name = |cell: &String| {
        !cell.is_empty() && units::read(cell).is_none() && keys::quantity(cell, b'.').is_none()
    };
    let time = Field::new(&cells[0], None);
    (time.is_named_time() || units::is_index_name(&cells[0]))
        && cells.len() > 1
        && cells[1..].iter().all(is_name)
}

/// Whether most columns have a cell, none of them between a key and its value.
fn is_wide(row: &HeaderRow, columns: usize) -> bool {
    let filled = row.cells.iter().filter(|cell| !cell.is_empty()).count();
    row.cells.len() >= columns
        && filled > 1
        && 10 * filled >= 6 * columns
        && !row.cells.iter().any(|cell| cell == ":" || cell == "=")
}

/// Whether the data rows have no cell under the labels, so that the names begin one cell later.
fn is_beside_data(names: &HeaderRow, used: &[bool]) -> bool {
    let filled = names.cells.iter().filter(|cell| !cell.is_empty()).count();
    filled == used.len() + 1 && names.cells.len() >= filled && used.iter().all(|used| *used)
}

fn cell<'a>(row: Option<&'a HeaderRow>, place: usize) -> Option<&'a str> {
    row?.cells.get(place).map(String::as_str)
}

fn fields_beside(names: &HeaderRow, units: Option<&HeaderRow>, columns: usize) -> Vec<Field> {
    (1..=columns)
        .map(|place| match cell(units, place) {
            Some(unit) => Field::with_unit(&names.cells[place], Some(unit)),
            None => Field::new(&names.cells[place], None),
        })
        .collect()
}

/// Columns under their names. `under` are units just above the data, if any.
fn fields_below(
    names: &HeaderRow,
    units: Option<&HeaderRow>,
    under: Option<&HeaderRow>,
    others: &[&HeaderRow],
    used: &[bool],
) -> Vec<Field> {
    let is_label = |place: usize| {
        let repeats = |row: &HeaderRow| row.cells.get(place) == row.cells.first();
        repeats(names)
            && others
                .iter()
                .all(|row| repeats(row) || row.cells.len() <= place)
    };
    // The values of each channel may be under the labels, with nothing under the names.
    let shifts = |place: usize| {
        let columns = used.iter().enumerate().filter(|(_, used)| **used);
        columns.clone().count() > 0 && columns.clone().all(|(place, _)| is_label(place)) && {
            !used.get(place + 1).copied().unwrap_or(false)
        }
    };
    // The first column may have its own heading below: `Time [ms]`.
    let is_heading = |row: &&&HeaderRow| row.cells[1..].iter().all(String::is_empty);
    let time = others
        .iter()
        .filter(is_heading)
        .map(|row| Field::new(&row.cells[0], None))
        .find(|field| field.is_named_time() && field.has_time_unit())
        .unwrap_or_else(|| Field::new("time", cell(under, 0)));
    let named = |place: usize| match cell(Some(names), place) {
        Some(name) if !name.is_empty() && units.or(under).is_some() => {
            Field::with_unit(name, cell(units.or(under), place))
        }
        Some(name) if !name.is_empty() => Field::new(name, None),
        _ => Field::unnamed(place),
    };
    let field = |place: usize| {
        if !is_label(place) {
            return named(place);
        }
        if shifts(place) {
            return named(place + 1);
        }
        Field {
            is_label: true,
            ..time.clone()
        }
    };
    (0..used.len()).map(field).collect()
}

/// The lines adjacent to one without an empty line between.
fn block_around(rows: &[HeaderRow], line: usize) -> std::ops::RangeInclusive<usize> {
    let (mut first, mut last) = (line, line);
    for row in rows {
        if row.line == last + 1 {
            last = row.line;
        }
    }
    for row in rows.iter().rev() {
        if row.line + 1 == first {
            first = row.line;
        }
    }
    first..=last
}
