//! Series and mountings of a table: groups of rows with a common deviation.

use std::collections::HashMap;

use super::{NONE, Point};
use crate::failure::{ErrorCode, Failure};

/// Minimum number of loaded rows of a series, on average, that tells its sensitivity.
const FEWEST_LOADED: usize = 2;
/// Maximum number of series or mountings open at any row.
const MOST_OPEN: usize = 100;

/// Groups of rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Groups {
    /// Group index of each row.
    pub of_row: Vec<usize>,
    /// First and last row of each group; empty for a single group, whose deviation cannot be separated.
    pub ranges: Vec<[usize; 2]>,
}

impl Groups {
    /// Groups of rows with the same number.
    pub fn of(numbers: impl Iterator<Item = usize>) -> Self {
        let mut found = HashMap::new();
        let mut groups = Self::default();
        for (i, number) in numbers.enumerate() {
            let group = *found.entry(number).or_insert(groups.ranges.len());
            match groups.ranges.get_mut(group) {
                Some(range) => range[1] = i,
                None => groups.ranges.push([i, i]),
            }
            groups.of_row.push(group);
        }
        if groups.ranges.len() < 2 {
            groups.ranges.clear();
        }
        groups
    }

    /// Groups that may differ in sensitivity: mountings, or series at a single one that have two loaded rows each on average,
    /// as a single row does not tell it from noise. Rows without load belong to the series before them, or to the first one,
    /// as they do not show it.
    pub fn of_sensitivity(points: &[Point], largest: f64) -> Self {
        let mountings = Self::of(points.iter().map(|p| p.position));
        if mountings.count() > 0 {
            return mountings;
        }
        let is_loaded = |p: &&Point| p.load.abs() > NONE * largest;
        let loaded: Vec<usize> = points.iter().filter(is_loaded).map(|p| p.series).collect();
        let series = loaded.chunk_by(|a, b| a == b).count();
        if loaded.len() < FEWEST_LOADED * series {
            return mountings;
        }
        let first = loaded.first().copied().unwrap_or(0);
        Self::of(points.iter().scan(first, |series, p| {
            *series = if is_loaded(&p) { p.series } else { *series };
            Some(*series)
        }))
    }

    /// Number of groups; 0 for a single one.
    pub fn count(&self) -> usize {
        self.ranges.len()
    }

    /// Largest number of groups open at any row.
    fn most_open(&self) -> usize {
        let mut changes: Vec<(usize, isize)> = Vec::with_capacity(2 * self.count());
        for [first, last] in &self.ranges {
            changes.extend([(*first, 1), (last + 1, -1)]);
        }
        changes.sort_unstable();
        let mut open = 0;
        let counts = changes.iter().map(|(_, change)| {
            open += change;
            open
        });
        counts.max().unwrap_or(0).unsigned_abs()
    }
}

/// Rejects tables with interleaved series or mountings: the computing time grows with the square of the number open at
/// once.
///
/// # Errors
/// If too many are open at once.
pub(super) fn refuse_mixed(points: &[Point]) -> Result<(), Failure> {
    let columns = [
        ("series", Groups::of(points.iter().map(|p| p.series))),
        ("position", Groups::of(points.iter().map(|p| p.position))),
    ];
    for (flag, groups) in columns {
        let open = groups.most_open();
        if open > MOST_OPEN {
            return Err(ErrorCode::UnsuitableRecord.failed(format_args!(
                "--{flag}: the rows of {open} different numbers are interleaved (at most {MOST_OPEN}); check that \
                 the column numbers the {}, and sort the rows in the order in which they were taken",
                if flag == "series" {
                    "series"
                } else {
                    "mountings"
                }
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_groups_are_counted() {
        let open = |numbers: &[usize]| Groups::of(numbers.iter().copied()).most_open();
        assert_eq!(open(&[1, 1, 1]), 0);
        assert_eq!(open(&[1, 1, 2, 2, 3]), 1);
        assert_eq!(open(&[1, 2, 1, 3, 2]), 2);
        assert_eq!(open(&[1, 2, 3, 1, 3]), 2);
    }
}
