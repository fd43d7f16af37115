//! Columns named by the closest rows above the data.

use std::collections::HashSet;

use super::field::Field;
use super::keyed::{is_key_block, is_key_with_values, is_list_of_quantities, repeats_a_key};
use super::{HeaderRow, WORDS, is_split_at_words};
use crate::recording::text::cell::Cell;
use crate::recording::text::head::Table;
use crate::recording::text::units;
use crate::recording::text::vocabulary::has;
use crate::unit::NamedUnit;

/// Number of lines above a table that are searched for its headings.
const LINES_FOR_HEADINGS: usize = 10;

/// Columns named by the closest rows above the data, and the numbers of those lines.
pub(super) struct Positional {
    pub(super) fields: Vec<Field>,
    pub(super) lines: Vec<usize>,
    pub(super) names: Option<usize>,
}

pub(super) fn positional(rows: &[HeaderRow], table: &Table, used: &[bool]) -> Positional {
    let near = rows.len().saturating_sub(LINES_FOR_HEADINGS);
    let fitting: Vec<&HeaderRow> = rows[near..]
        .iter()
        .filter(|row| is_heading(&row.cells, table, used) && !is_split_at_words(&row.cells, table))
        .filter(|row| !is_process_row(&row.cells) && !repeats_a_key(&row.cells))
        .filter(|row| !is_key_with_values(&row.cells) && !is_list_of_quantities(&row.cells))
        .rev()
        .collect();
    if is_key_block(&fitting, used) {
        return Positional::unnamed(table.width);
    }
    let Some(found) = Headings::of(&fitting) else {
        return Positional::unnamed(table.width);
    };
    let upper = upper_names(found.names, &fitting, used);
    let mut lines = vec![found.names.line];
    lines.extend(
        [found.units, found.symbols, upper]
            .iter()
            .flatten()
            .map(|row| row.line),
    );
    let repeated = fitting
        .iter()
        .find(|row| row.line + 1 == found.names.line)
        .copied();
    let fields = (0..table.width)
        .map(|place| with_unit_above(found.field(place, upper), filled(repeated, place)))
        .collect();
    Positional {
        fields,
        lines,
        names: Some(found.names.line),
    }
}

/// A column with the unit next to its name in the row above the names, as for `INTERVAL` below
/// `INTERVAL[us]`.
fn with_unit_above(mut field: Field, above: Option<&str>) -> Field {
    let above = above.map(|above| Field::new(above, None));
    if let Some(above) = above.filter(|above| above.name == field.name)
        && field.unit_text.is_none()
    {
        (field.unit, field.unit_text) = (above.unit, above.unit_text);
    }
    field
}

impl Positional {
    fn unnamed(width: usize) -> Self {
        Self {
            fields: (0..width).map(Field::unnamed).collect(),
            lines: Vec::new(),
            names: None,
        }
    }
}

/// The rows above the data by content.
struct Headings<'a> {
    names: &'a HeaderRow<'a>,
    units: Option<&'a HeaderRow<'a>>,
    /// The row of units, if it contains remarks as well.
    remarks: Option<&'a HeaderRow<'a>>,
    /// Short symbols between the names and their units.
    symbols: Option<&'a HeaderRow<'a>>,
}

impl<'a> Headings<'a> {
    /// From the matching rows, lowest first.
    fn of(fitting: &[&'a HeaderRow<'a>]) -> Option<Self> {
        let fitting = above_remarks(fitting);
        let (names, units, remarks) = match fitting {
            [] => return None,
            [below, above, ..] if is_mixed(&below.cells, &above.cells) => {
                (*above, Some(*below), Some(*below))
            }
            [below, above, ..] if is_units(&below.cells) || is_units_under(below, above) => {
                (*above, Some(*below), None)
            }
            [only, ..] if is_nothing_but_units(&only.cells) => (*only, Some(*only), None),
            [names, ..] => (*names, None, None),
        };
        let above = fitting.get(2).copied();
        let longer = above.filter(|above| units.is_some() && is_symbols_of(names, above));
        Some(Self {
            names: longer.unwrap_or(names),
            units,
            remarks,
            symbols: longer.map(|_| names),
        })
    }

    /// A column; `upper` distinguishes columns of the same name.
    fn field(&self, place: usize, upper: Option<&HeaderRow>) -> Field {
        let Some(name) = filled(Some(self.names), place) else {
            return Field::unnamed(place);
        };
        let below = filled(self.units, place);
        let is_unit = below.is_some_and(|below| units::read(below).is_some());
        let mut field = Field::new(name, below.filter(|_| self.remarks.is_none() || is_unit));
        if let Some(remark) = filled(self.remarks, place).filter(|_| !is_unit) {
            // The unit may follow: Analog 1 above Servo motor speed [r/min].
            let remark = Field::new(remark, None);
            field.name = format!("{}: {}", field.name, remark.name);
            if field.unit_text.is_none() {
                (field.unit, field.unit_text) = (remark.unit, remark.unit_text);
            }
        }
        if let Some(upper) = filled(upper, place).filter(|_| place > 0) {
            field.name = format!("{upper} {}", field.name);
        }
        field
    }
}

/// The rows starting with those that have time above its unit, if they are above rows of other
/// kinds: `Time,Force` and `s,N` above the names of devices or their inputs.
fn above_remarks<'a, 'b>(fitting: &'b [&'a HeaderRow<'a>]) -> &'b [&'a HeaderRow<'a>] {
    let is_time_above_unit = |pair: &[&HeaderRow]| {
        let (below, above) = (pair[0], pair[1]);
        let is_time = |(name, unit): (&String, &String)| {
            units::is_time_name(name) && units::read(unit).is_some_and(|unit| unit.is_time())
        };
        above.line + 1 == below.line
            && is_units(&below.cells)
            && above.cells.iter().zip(&below.cells).any(is_time)
    };
    let is_settled = |row: &HeaderRow| {
        row.cells.iter().any(|cell| {
            let field = Field::new(cell, None);
            field.is_named_time() || field.has_time_unit()
        })
    };
    match fitting.windows(2).position(is_time_above_unit) {
        Some(place) if !fitting[..place].iter().any(|row| is_settled(row)) => &fitting[place..],
        _ => fitting,
    }
}

/// The text of a nonempty cell.
fn filled<'a>(row: Option<&'a HeaderRow>, place: usize) -> Option<&'a str> {
    let cell = row?.cells.get(place)?;
    (!cell.is_empty()).then_some(cell.as_str())
}

/// Whether a row contains the symbols of the names just above it: `t`, `F` below `Time`, `Force`.
fn is_symbols_of(symbols: &HeaderRow, names: &HeaderRow) -> bool {
    let is_name = |name: &String, symbol: &String| {
        symbol.chars().count() <= 3 && name.chars().count() > symbol.chars().count()
    };
    names.line + 1 == symbols.line
        && names.cells.len() == symbols.cells.len()
        && names.cells.iter().any(|cell| units::is_time_name(cell))
        && names
            .cells
            .iter()
            .zip(&symbols.cells)
            .all(|(name, symbol)| is_name(name, symbol) || name == symbol)
}

/// Whether cells can be headings: one for (nearly) each column with data, and no numbers except
/// channel numbers after a text.
fn is_heading(cells: &[String], table: &Table, used: &[bool]) -> bool {
    let places: Vec<usize> = (0..used.len()).filter(|place| used[*place]).collect();
    let filled = places
        .iter()
        .filter(|place| cells.get(**place).is_some_and(|cell| !cell.is_empty()))
        .count();
    let fits = if places.len() < 2 {
        let words = |cell: &String| cell.split_whitespace().count();
        filled == places.len()
            && cells.iter().filter(|cell| !cell.is_empty()).count() == 1
            && cells
                .iter()
                .all(|cell| words(cell) <= WORDS && !cell.contains(['=', ':']))
    } else {
        let last_is_there = cells.len() > *places.last().unwrap_or(&0);
        filled == places.len()
            || places.len() > 2 && filled + 1 >= places.len() && last_is_there
            || is_units_with_gaps(cells)
            // An index column often has no heading.
            || cells.len() == 2 && filled == 1 && cells[0].is_empty()
            || places.len() > 5 && 10 * filled >= 7 * places.len()
    };
    let mut texts = 0;
    fits && cells.iter().filter(|cell| !cell.is_empty()).all(|cell| {
        match Cell::read(cell, table.dialect.decimal) {
            Cell::Text | Cell::NonFinite => {
                texts += 1;
                true
            }
            Cell::Number(value) => {
                texts > 0 && value.fract() == 0.0 && (0.0..1000.0).contains(&value)
            }
            _ => false,
        }
    })
}

/// Whether a row under column names contains their units next to words that it repeats: `NO.`,
/// `Time`, `ms`, `V`, `N` under `Number`, `Time`, `ms`, `CH1`, `CH2`.
fn is_units_under(below: &HeaderRow, above: &HeaderRow) -> bool {
    let pairs = || below.cells.iter().zip(&above.cells);
    let repeats_unit = pairs().any(|(below, above)| below == above && units::read(below).is_some());
    let says_more = |(below, above): &(&String, &String)| {
        below != above
            && !below.is_empty()
            && !units::is_time_name(below)
            && !units::is_index_name(below)
    };
    let new: Vec<&String> = pairs().filter(says_more).map(|(below, _)| below).collect();
    let like = |cell: &&&String| units::read(cell).is_some() || units::is_bracketed(cell);
    repeats_unit
        && below.line == above.line + 1
        && !new.is_empty()
        && 2 * new.iter().filter(like).count() >= new.len()
}

/// Whether cells are units, or empty for channels without one: `s,Nm,,`.
fn is_units_with_gaps(cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
    let has_gap = cells.iter().any(String::is_empty);
    cells.len() > 1
        && has_gap
        && filled.peek().is_some()
        && filled.all(|cell| NamedUnit::parse(cell).is_some())
}

/// Whether cells are units: all of them, or some if others repeat, or most are in brackets.
pub(super) fn is_units(cells: &[String]) -> bool {
    let filled: Vec<&String> = cells.iter().filter(|cell| !cell.is_empty()).collect();
    let known = filled
        .iter()
        .filter(|cell| units::read(cell).is_some() || units::is_clock_format(cell))
        .count();
    let bracketed = filled
        .iter()
        .filter(|cell| units::is_bracketed(cell))
        .count();
    let like = filled
        .iter()
        .filter(|cell| {
            units::read(cell).is_some()
                || units::is_bracketed(cell)
                || units::as_written(cell).is_none()
        })
        .count();
    let repeats = !all_differ(filled.iter().copied());
    known > 0 && (repeats || 2 * like > filled.len()) || bracketed > 0 && bracketed == filled.len()
}

/// Whether a single line above the data names its columns by their units: `s,V`.
pub(super) fn is_nothing_but_units(cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
    filled.peek().is_some() && filled.all(|cell| NamedUnit::parse(cell).is_some())
}

/// Whether the first cell is a unit of time under the name of time, and the others are remarks:
/// `ms,Servo motor speed,Torque` under `Time,Analog 1,Analog 2`.
fn is_mixed(below: &[String], above: &[String]) -> bool {
    let (Some(unit), Some(name)) = (below.first(), above.first()) else {
        return false;
    };
    units::read(unit).is_some_and(|unit| unit.is_time())
        && units::is_time_name(name)
        && below.len() > 1
        && below[1..]
            .iter()
            .all(|cell| units::read(cell).is_none() && !units::is_bracketed(cell))
        && below[1..]
            .iter()
            .any(|cell| units::as_written(cell).is_some_and(|c| c.len() > 3))
}

/// Rows under the units with the kind of value, `Avg`, `Smp`, or the storage type, `Double`,
/// `REAL32`.
fn is_process_row(cells: &[String]) -> bool {
    let is_type = |cell: &str| {
        let stem = cell
            .trim_start_matches("dt_")
            .trim_end_matches(|c: char| c.is_ascii_digit());
        has("number types", stem)
    };
    let filled: Vec<String> = cells
        .iter()
        .filter(|cell| !cell.is_empty())
        .map(|cell| cell.to_lowercase())
        .collect();
    let is_process = filled.iter().all(|cell| has("kinds of value", cell));
    !filled.is_empty() && (is_process || filled.iter().all(|cell| is_type(cell)))
}

/// Whether a row numbers the channels of its cells: `Channel Data`, `CH 1`, `CH 2`.
fn is_of_channels(row: &HeaderRow) -> bool {
    let counts = |cell: &String| cell.ends_with(|c: char| c.is_ascii_digit());
    row.cells.len() > 1 && row.cells[1..].iter().all(counts)
}

fn all_differ<'a>(cells: impl IntoIterator<Item = &'a String>) -> bool {
    let mut seen = HashSet::new();
    cells.into_iter().all(|cell| seen.insert(cell))
}

/// A row above the names that distinguishes columns of the same name: `CH 1`, `CH 2` above
/// `Voltage`.
fn upper_names<'a>(
    names: &HeaderRow,
    fitting: &[&'a HeaderRow<'a>],
    used: &[bool],
) -> Option<&'a HeaderRow<'a>> {
    let cells = |row: &HeaderRow| -> Vec<String> {
        (1..used.len())
            .filter_map(|place| row.cells.get(place).cloned())
            .collect()
    };
    let is_distinct =
        |cells: &[String]| cells.iter().all(|cell| !cell.is_empty()) && all_differ(cells);
    let own = cells(names);
    if own.len() < 2 || is_distinct(&own) {
        return None;
    }
    fitting
        .iter()
        .copied()
        .filter(|row| row.line + 1 == names.line || row.line < names.line && is_of_channels(row))
        .find(|row| {
            let cells = cells(row);
            let is_text = |cell: &String| Cell::read(cell, b'.') == Cell::Text;
            is_distinct(&cells) && cells.iter().all(is_text)
        })
}
