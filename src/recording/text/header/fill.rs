//! Names and units from keys and values above a table.

use super::HeaderRow;
use super::field::{Field, without_name};
use super::labelled::is_name_label;
use crate::recording::text::keys::{HeaderEntry, Topic, topic};
use crate::recording::text::units;
use crate::unit::NamedUnit;

/// Names from a line such as `Source,CH1`, if no line above the table has them.
pub(super) fn fill_names(fields: &mut [Field], entries: &[HeaderEntry], used: &[bool]) {
    let places: Vec<usize> = (0..fields.len()).filter(|place| used[*place]).collect();
    let about = entries
        .iter()
        .find(|entry| entry.topic() == Some(Topic::Name));
    let Some(entry) = about else {
        return;
    };
    // The key may be repeated for each channel.
    let values: Vec<&String> = entry
        .values
        .iter()
        .filter(|v| !v.is_empty() && **v != entry.key)
        .collect();
    if values.len() == places.len() {
        for (place, name) in places.into_iter().zip(values) {
            fields[place] = Field::new(name, None);
        }
    }
}

/// Units from lines such as `Vertical Units,V,V`: one per column, or one for all.
pub(super) fn fill_units(fields: &mut [Field], entries: &[HeaderEntry], used: &[bool]) {
    let signals: Vec<usize> = (0..fields.len())
        .filter(|place| used[*place])
        .filter(|place| {
            let field = &fields[*place];
            !field.is_named_time()
                && !units::is_axis_name(&field.name)
                && !units::is_index_name(&field.name)
        })
        .collect();
    let about = |topic| {
        entries
            .iter()
            .find(move |entry| entry.topic() == Some(topic))
    };
    if let Some(entry) = about(Topic::Unit) {
        let values: Vec<&str> = entry
            .values
            .iter()
            .filter(|value| !value.is_empty())
            .flat_map(|value| of_channels(value))
            .collect();
        for (rank, place) in signals.iter().enumerate() {
            let text = match values.as_slice() {
                [one] => one,
                several if several.len() == signals.len() => several[rank],
                // One above each column, where the key is above the time.
                _ if entry.values.len() + 1 == fields.len() && *place > 0 => {
                    above(&entry.values, fields, *place)
                }
                _ => continue,
            };
            set_unit(&mut fields[*place], text);
        }
    }
}

/// Values for each channel, `CH1:V CH2:A`, or the value as it is.
fn of_channels(value: &str) -> Vec<&str> {
    let parts: Vec<&str> = value.split_whitespace().collect();
    let is_of_channel = |part: &&str| {
        let channel = part.split_once(':').map_or("", |(channel, _)| channel);
        channel.ends_with(|c: char| c.is_ascii_digit())
    };
    if parts.len() > 1 && parts.iter().all(is_of_channel) {
        parts
    } else {
        vec![value]
    }
}

/// The unit of the horizontal axis from a line such as `Horizontal Units,s`.
pub(super) fn fill_axis_unit(fields: &mut [Field], entries: &[HeaderEntry]) {
    let entry = entries
        .iter()
        .find(|entry| entry.topic() == Some(Topic::AxisUnit));
    if let Some(text) = entry.and_then(HeaderEntry::value) {
        let axis = fields
            .iter_mut()
            .find(|field| field.is_named_time() || units::is_axis_name(&field.name));
        if let Some(field) = axis {
            set_unit(field, if text == "S" { "s" } else { text });
        }
    }
}

/// The unit of a first column whose heading is only a unit of time, such as `min`.
pub(super) fn fill_time_unit(fields: &mut [Field]) {
    if let [first, _, ..] = fields
        && first.unit_text.is_none()
        && let Some(unit) = units::read(&first.heading).filter(NamedUnit::is_time)
    {
        first.unit_text = Some(unit.text.clone());
        first.unit = Some(unit);
    }
}

/// The value above a column, or above the preceding one of which this is another view:
/// `CH1 Peak Detect` after `CH1`.
fn above<'a>(values: &'a [String], fields: &[Field], place: usize) -> &'a str {
    let own = values[place - 1].as_str();
    let is_of_before = place > 1 && fields[place].name.starts_with(&fields[place - 1].name);
    match own {
        "" if is_of_before => &values[place - 2],
        own => own,
    }
}

/// Units, and the rate if it is common to all, from a list of channels such as
/// `Channel,Unit,Length,Increment` above `Force,N,300,0.001`.
pub(super) fn fill_from_list(fields: &mut [Field], rows: &[HeaderRow]) -> Vec<HeaderEntry> {
    let is_heading = |row: &HeaderRow| {
        is_name_label(&row.cells[0])
            && row
                .cells
                .iter()
                .skip(1)
                .any(|c| topic(c) == Some(Topic::Unit))
    };
    let Some(heading) = rows.iter().position(is_heading) else {
        return Vec::new();
    };
    let labels = &rows[heading].cells;
    let mut rates: Vec<HeaderEntry> = Vec::new();
    for (row, after) in rows[heading + 1..].iter().zip(1..) {
        let field = fields.iter_mut().find(|field| field.name == row.cells[0]);
        let Some(field) = field.filter(|_| row.line == rows[heading].line + after) else {
            break;
        };
        for (label, cell) in labels.iter().zip(&row.cells).skip(1) {
            match topic(label) {
                Some(Topic::Unit) => set_unit(field, cell),
                Some(Topic::Rate | Topic::Interval) => rates.push(HeaderEntry {
                    line: row.line,
                    key: label.clone(),
                    values: vec![cell.clone()],
                    is_number_split: false,
                }),
                _ => {}
            }
        }
    }
    let said = |entry: &HeaderEntry| (entry.key.clone(), entry.values.clone());
    let is_same = rates
        .windows(2)
        .all(|pair| said(&pair[0]) == said(&pair[1]));
    rates.truncate(usize::from(is_same));
    rates
}

fn set_unit(field: &mut Field, text: &str) {
    let text = without_name(text, &field.name);
    if field.unit.is_none() && field.unit_text.is_none() {
        field.unit = units::read(text);
        field.unit_text = units::as_written(text);
    }
}
