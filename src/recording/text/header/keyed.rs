//! Detection of rows above a table that are keys with values rather than headings.

use super::positional::is_units;
use super::{Field, HeaderRow, after_definition};
use crate::recording::text::cell::Cell;
use crate::recording::text::keys::{self, Topic};
use crate::recording::text::units;
use crate::unit::inside_brackets;

/// Whether all cells give the same key a value: `Rate: 50 Hz`, `Rate: 50 Hz`.
pub(super) fn repeats_a_key(cells: &[String]) -> bool {
    let key = |cell: &String| -> Option<String> {
        let (key, value) = cell.split_once([':', '='])?;
        keys::quantity(value, b'.').map(|_| key.trim().to_owned())
    };
    let mut keys = cells.iter().filter(|cell| !cell.is_empty()).map(key);
    let first = keys.next().flatten();
    first.is_some() && keys.clone().count() > 0 && keys.all(|key| key == first)
}

/// Rows of one key and value each above a table of two columns are not headings.
pub(super) fn is_key_block(fitting: &[&HeaderRow], used: &[bool]) -> bool {
    let two = used.iter().filter(|used| **used).count() == 2;
    let Some(nearest) = fitting.first() else {
        return false;
    };
    // CASSY marks the line of the names.
    if after_definition(nearest.text).is_some() {
        return false;
    }
    let is_time = nearest.cells.iter().any(|cell| {
        let field = Field::new(cell, None);
        field.is_named_time()
            || field.has_time_unit()
            || units::is_axis_name(cell)
            || units::is_weak_time_name(cell)
            || units::is_index_name(cell)
    });
    let (key, values) = (&nearest.cells[0], &nearest.cells[1..]);
    let topic = keys::topic(key);
    // Frequency (Hz),Torque (Nm) and Start,Stop are headings: no value is a number, a date or a unit.
    let is_value = |v: &String| {
        keys::quantity(v, b'.').is_some()
            || matches!(Cell::read(v, b'.'), Cell::Clock(_))
            || units::read(v).is_some()
    };
    let is_known = topic.is_some_and(is_of_axis) && values.iter().any(is_value)
        || topic.is_some_and(|topic| !is_of_axis(topic))
            && values.iter().all(|v| units::read(v).is_none());
    // An empty line separates headings from keys.
    let in_block = fitting.len() > 2 && fitting[1].line + 1 == nearest.line;
    two && !is_time && !is_units(&nearest.cells) && (in_block || is_known)
}

/// Whether a topic concerns rates or units, which never are headings.
fn is_of_axis(topic: Topic) -> bool {
    !matches!(topic, Topic::Date | Topic::Name)
}

/// Whether cells are a key about the time axis and its values: `Time interval,0.01(ms),0.01(ms)`.
pub(super) fn is_key_with_values(cells: &[String]) -> bool {
    let Some((key, values)) = cells.split_first() else {
        return false;
    };
    let is_quantity = |v: &String| keys::quantity(v, b'.').is_some();
    let mut filled = values.iter().filter(|v| !v.is_empty()).peekable();
    keys::topic(key).is_some_and(is_of_axis) && filled.peek().is_some() && filled.all(is_quantity)
}

/// Whether cells are a key and a measured quantity for each channel: `Period:,T=1.000mS,T=?` or
/// `Vpp,3.2V,?`.
pub(super) fn is_list_of_quantities(cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty());
    let Some(key) = filled.next() else {
        return false;
    };
    let values: Vec<&String> = filled.collect();
    let is_marked = |cell: &String| cell.ends_with([':', '=']);
    let value_of = |cell: &str| {
        cell.split_once('=')
            .map_or(cell, |(_, value)| value)
            .to_owned()
    };
    // 1 (V) and 0° (mV/V) are names of channels, 1/min is a unit, and so are 0° and 90° beside a column of time.
    let is_time = units::is_time_name(&units::heading(key).name);
    let is_name = |value: &str, unit: &str| {
        let bracketed = inside_brackets(unit).and_then(|(_, inside)| units::read(inside));
        bracketed.is_some()
            || value.starts_with("1/")
            || is_time && units::read(unit).is_some_and(|unit| !unit.is_time())
    };
    let is_quantity = |cell: &&&String| {
        let value = value_of(cell);
        value.starts_with(|c: char| c.is_ascii_digit() || c == '-')
            && keys::quantity(&value, b'.')
                .is_some_and(|(_, unit)| !is_name(&value, &unit) && is_unit_or_rate(&unit))
    };
    let is_unknown = |cell: &&&String| value_of(cell).chars().all(|c| !c.is_alphanumeric());
    let quantities = values.iter().filter(is_quantity).count();
    let unknown = values.iter().filter(is_unknown).count();
    is_marked(key) && values.iter().any(|cell| !is_marked(cell))
        || quantities > 0 && quantities + unknown == values.len()
}

/// Whether a text is a unit, possibly in capitals: `KHz`, `mS`.
fn is_unit_or_rate(text: &str) -> bool {
    let lower = text.to_lowercase();
    units::read(text).is_some() || units::read(&lower).is_some() || lower.ends_with("hz")
}
