//! Consecutive blocks of rows: detection of their ends.

use super::axes::Role;
use super::cell::Cell;
use super::head::is_end;
use super::header::Header;
use super::keys::{self, HeaderEntry, Topic};
use super::rows::{ColumnKind, Rows};
use super::units;
use crate::recording::text::dialect::Dialect;

/// Maximum number of blocks under the same headings.
const MOST: usize = 1000;
/// Distance from its start at which time restarts, relative to the elapsed time.
const NEAR: f64 = 0.1;

/// What ends a table before the end of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct TableEnd {
    /// The line of its headings, if repeated.
    pub names: Option<String>,
    /// Header keys about channels or their rate, any of which starts another table.
    pub keys: Vec<String>,
    /// Starts of lines that end it.
    pub marks: &'static [&'static str],
    /// Whether it has a single column, so that any heading with a unit begins another table.
    pub is_single: bool,
    /// Separation of keys and values.
    pub dialect: Dialect,
}

impl TableEnd {
    /// What ends a table under a header.
    pub fn of(header: &Header, kinds: &[ColumnKind], dialect: Dialect) -> Self {
        let mut entries = header.entries.clone();
        if let Some(names) = &header.names {
            entries.extend(keys::entries(0, names, dialect));
        }
        // Rows that begin with text look like keys themselves.
        let is_named = kinds.first() == Some(&ColumnKind::Nothing);
        entries.retain(|entry| is_of_block(entry) && !is_named);
        Self {
            names: header.names.clone(),
            keys: entries.into_iter().map(|entry| entry.key).collect(),
            marks: &[],
            is_single: kinds.len() == 1,
            dialect,
        }
    }

    /// A maker's marks.
    pub fn of_marks(marks: &'static [&'static str], dialect: Dialect) -> Self {
        Self {
            names: None,
            keys: Vec::new(),
            marks,
            is_single: false,
            dialect,
        }
    }

    /// Whether a table ends before a line that is not a plain row.
    pub fn is_at(&self, line: &str) -> bool {
        is_end(line)
            || self.are_names(line)
            || self.marks.iter().any(|mark| line.starts_with(mark))
            || self.begins_anew(line)
    }

    /// Whether a line repeats the column headings, possibly with other units: as many cells, the first of them equal.
    fn are_names(&self, line: &str) -> bool {
        let Some(names) = self.names.as_deref() else {
            return false;
        };
        if names == line {
            return true;
        }
        if self.is_single {
            let is_word = line.starts_with(char::is_alphabetic);
            return is_word && units::heading(line).unit.is_some();
        }
        let [names, cells] = [names, line].map(|line| self.dialect.cells(line));
        let is_text = |cell: &String| Cell::read(cell, self.dialect.decimal) == Cell::Text;
        names.len() > 1
            && names.len() == cells.len()
            && names[0] == cells[0]
            && cells.iter().all(is_text)
    }

    /// Whether a line repeats a key of the header, so that a separate block with its own header
    /// begins.
    pub fn begins_anew(&self, line: &str) -> bool {
        let is_text = |c: char| c.is_alphabetic() || c == '"';
        if self.keys.is_empty() || !line.trim_start().starts_with(is_text) {
            return false;
        }
        let found = keys::entries(0, line, self.dialect);
        found
            .first()
            .filter(|entry| is_of_block(entry))
            .is_some_and(|entry| {
                self.keys
                    .iter()
                    .any(|key| key.eq_ignore_ascii_case(&entry.key))
            })
    }
}

fn is_of_block(entry: &HeaderEntry) -> bool {
    use Topic::{Count, Interval, Name, Rate, Unit};
    matches!(entry.topic(), Some(Name | Unit | Rate | Interval | Count))
}

/// Rows at which time restarts after lines that are not rows, such as empty ones or `# run 2`.
pub fn restarts(rows: &Rows, kinds: &[ColumnKind], roles: &[Role]) -> Vec<usize> {
    let is_time = |place: &usize| {
        roles[*place] == Role::Time
            && matches!(kinds[*place], ColumnKind::Numbers | ColumnKind::Offset(_))
    };
    let Some(place) = (0..roles.len()).find(is_time) else {
        return Vec::new();
    };
    let values = &rows.columns[place].values;
    let (mut starts, mut first) = (Vec::new(), 0);
    for row in rows.after_other_lines().filter(|row| *row < values.len()) {
        let [start, before, now] = [first, row - 1, row].map(|row| values[row]);
        if now < before && now - start <= NEAR * (before - start) {
            starts.push(row);
            first = row;
        }
    }
    starts.truncate(if starts.len() > MOST { 0 } else { MOST });
    starts
}
