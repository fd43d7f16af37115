//! Blocks of rows below each other: where one ends and the next begins.

use super::axes::Role;
use super::keys::{self, Entry, Topic};
use super::rows::{Column, Rows};
use crate::io::csv::Dialect;

/// Most blocks under the same headings.
const MOST: usize = 1000;
/// How near to its start time begins anew, as a part of the time since.
const NEAR: f64 = 0.1;

/// The rows at which time begins anew after lines that are no rows, such as empty ones or `# run 2`.
pub fn restarts(rows: &Rows, roles: &[Role]) -> Vec<usize> {
    let is_time = |(column, role): &(&Column, &Role)| {
        **role == Role::Time && column.first_clock.is_none() && column.first_ticks.is_none()
    };
    let Some((time, _)) = rows.columns.iter().zip(roles).find(is_time) else {
        return Vec::new();
    };
    let (mut starts, mut first) = (Vec::new(), 0);
    for row in rows
        .after_other_lines()
        .filter(|row| *row < time.values.len())
    {
        let [start, before, now] = [first, row - 1, row].map(|row| time.values[row]);
        if now < before && now - start <= NEAR * (before - start) {
            starts.push(row);
            first = row;
        }
    }
    starts.truncate(if starts.len() > MOST { 0 } else { MOST });
    starts
}

/// Whether a line among the rows repeats a key of the head that is about a channel or its rate: there a
/// block of its own begins, with a head of its own.
pub fn begins_anew(line: &str, entries: &[Entry], dialect: Dialect) -> bool {
    let is_of_block = |entry: &Entry| {
        use Topic::{Count, Interval, Name, Rate, Unit};
        matches!(entry.topic(), Some(Name | Unit | Rate | Interval | Count))
    };
    if entries.is_empty()
        || !line
            .trim_start()
            .starts_with(|c: char| c.is_alphabetic() || c == '"')
    {
        return false;
    }
    let mut found = keys::entries(0, line, dialect);
    found.truncate(1);
    found
        .iter()
        .filter(|entry| is_of_block(entry))
        .any(|entry| {
            entries
                .iter()
                .any(|other| other.key.eq_ignore_ascii_case(&entry.key))
        })
}
