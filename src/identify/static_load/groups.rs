//! Series and mountings of a table: groups of rows with a deviation in common.

use std::collections::HashMap;

use super::Point;
use crate::failure::{ErrorCode, Failure};

/// Most series or mountings that have begun and not ended at any row.
const MOST_OPEN: usize = 100;

/// Groups of rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Groups {
    /// Number of the group of each row.
    pub of_row: Vec<usize>,
    /// First and last row of each group; empty if there is only one group, whose deviation is not a deviation.
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

    /// Number of groups; 0 if there is only one.
    pub fn count(&self) -> usize {
        self.ranges.len()
    }

    /// Largest number of groups that have begun and not ended at any row.
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

/// Refuses tables whose series or mountings are mixed: the time taken grows with the square of those begun and not ended.
///
/// # Errors
/// If too many are.
pub(super) fn refuse_mixed(points: &[Point]) -> Result<(), Failure> {
    let columns = [
        ("series", Groups::of(points.iter().map(|p| p.series))),
        ("position", Groups::of(points.iter().map(|p| p.position))),
    ];
    for (flag, groups) in columns {
        let open = groups.most_open();
        if open > MOST_OPEN {
            return Err(Failure::failed(
                ErrorCode::UnsuitableRecord,
                format_args!(
                    "--{flag}: the rows of {open} different numbers are interleaved (at most {MOST_OPEN}); check that \
                     the column numbers the {}, and sort the rows in the order in which they were taken",
                    if flag == "series" {
                        "series"
                    } else {
                        "mountings"
                    }
                ),
            ));
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
