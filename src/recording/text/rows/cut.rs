//! Splitting of parsed rows.

use super::{Column, Rows};

impl Rows {
    /// Removes the rows from `count` on.
    pub fn truncate(&mut self, count: usize) {
        for column in &mut self.columns {
            column.values.truncate(count);
            column.holes.retain(|hole| hole.index < count);
        }
        self.count = self.count.min(count);
    }

    /// Removes the first row.
    pub fn drop_first(&mut self) {
        for column in &mut self.columns {
            if !column.values.is_empty() {
                column.values.remove(0);
            }
            column.holes.retain(|hole| hole.index > 0);
            column.holes.iter_mut().for_each(|hole| hole.index -= 1);
        }
        for (row, line) in &mut self.breaks {
            match row {
                0 => *line += 1,
                row => *row -= 1,
            }
        }
        self.count = self.count.saturating_sub(1);
    }

    /// The rows preceded by a line that is not a row: a comment, an empty line, a text.
    pub fn after_other_lines(&self) -> impl Iterator<Item = usize> {
        self.breaks
            .iter()
            .map(|(row, _)| *row)
            .filter(|row| *row > 0 && *row < self.count)
    }

    /// Splits the rows from one on off as separate rows.
    pub fn split_off(&mut self, row: usize) -> Self {
        let columns = self.columns.iter_mut().map(|column| {
            let values = column.values.split_off(row.min(column.values.len()));
            let kept = column.holes.partition_point(|hole| hole.index < row);
            let mut holes = column.holes.split_off(kept);
            holes.iter_mut().for_each(|hole| hole.index -= row);
            Column { values, holes }
        });
        let further = Self {
            columns: columns.collect(),
            count: self.count - row,
            ..Self::default()
        };
        self.count = row;
        further
    }

    /// Number of the line of a row.
    pub fn line_of(&self, row: usize) -> usize {
        line_of(&self.breaks, row)
    }
}

/// Line number of a row, from the rows and lines at which counting continued.
pub(super) fn line_of(breaks: &[(usize, usize)], row: usize) -> usize {
    let place = breaks.partition_point(|(first, _)| *first <= row);
    place
        .checked_sub(1)
        .map_or(0, |place| breaks[place].1 + (row - breaks[place].0))
}
