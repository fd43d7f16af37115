//! Columns with values in some rows only: channels slower than the others of their table.

use std::sync::Arc;

use super::rows::Column;
use crate::recording::{HoleKind, RateFrom, TimeAxis};

/// Minimum number of values of a slow channel.
const FEWEST: usize = 3;

/// Removes the empty cells of a column of which more than half are empty, and the corresponding stamps
/// of its axis: the remainder is a separate channel, slower than the rows. Without stamps the values
/// must be evenly spaced, and the rate is divided by the spacing.
pub fn thin(column: &mut Column, axis: &mut TimeAxis) {
    if !is_slow(column) {
        return;
    }
    let filled = filled(column);
    if filled.len() < FEWEST {
        return;
    }
    let every = spacing(&filled);
    // A rate given by the user applies to the rows.
    let stamps = axis
        .stamps_s
        .as_ref()
        .filter(|_| axis.rate_from != RateFrom::Given);
    let thinned = match (stamps, every) {
        (Some(stamps), _) => of_stamps(axis, stamps, &filled),
        (None, Some(every)) => of_rate(axis, filled[0], every),
        (None, None) => return,
    };
    let Some(thinned) = thinned else {
        return;
    };
    column.values = filled.iter().map(|row| column.values[*row]).collect();
    column.holes = Vec::new();
    *axis = thinned;
}

/// Whether a column has a value in some, but at most half of the rows.
pub fn is_slow(column: &Column) -> bool {
    let rows = column.values.len();
    let filled = rows.saturating_sub(column.holes.len());
    filled >= FEWEST && 2 * filled <= rows
}

/// Rows with a value, if all others are empty.
fn filled(column: &Column) -> Vec<usize> {
    if column.holes.iter().any(|hole| hole.what != HoleKind::Empty) {
        return Vec::new();
    }
    let mut holes = column.holes.iter().map(|hole| hole.index).peekable();
    (0..column.values.len())
        .filter(|row| holes.next_if_eq(row).is_none())
        .collect()
}

/// Distance between values in rows, if constant.
fn spacing(filled: &[usize]) -> Option<usize> {
    let every = filled[1] - filled[0];
    let even = filled.windows(2).all(|pair| pair[1] - pair[0] == every);
    even.then_some(every)
}

fn of_stamps(axis: &TimeAxis, stamps: &[f64], filled: &[usize]) -> Option<TimeAxis> {
    let own: Option<Vec<f64>> = filled.iter().map(|row| stamps.get(*row).copied()).collect();
    let heading = match &axis.rate_from {
        RateFrom::Stamps(heading) => heading.clone(),
        _ => "time".to_owned(),
    };
    Some(TimeAxis {
        start_text: axis.start_text.clone(),
        assumed: axis.assumed.clone(),
        ..TimeAxis::of_stamps_after(axis.origin_ns, &heading, Arc::new(own?))
    })
}

fn of_rate(axis: &TimeAxis, first: usize, every: usize) -> Option<TimeAxis> {
    let rows_hz = axis.rate_hz?;
    Some(TimeAxis {
        rate_hz: Some(crate::recording::without_rounding(rows_hz / every as f64)),
        start: axis.start.map(|start| start.later(first as f64 / rows_hz)),
        stamps_s: None,
        ..axis.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Hole;
    use crate::recording::moment::Moment;

    /// A value in each row for which the function is true.
    fn column(rows: usize, has: impl Fn(usize) -> bool) -> Column {
        let empty = |row: usize| Hole {
            index: row,
            line: row + 2,
            what: HoleKind::Empty,
        };
        let value = |row: usize| if has(row) { row as f64 } else { f64::NAN };
        Column {
            values: (0..rows).map(value).collect(),
            holes: (0..rows).filter(|row| !has(*row)).map(empty).collect(),
        }
    }

    #[test]
    fn every_fourth_row() {
        let mut slow = column(42, |row| row % 4 == 1);
        let mut axis = TimeAxis::of_header("rate", 100.0, Some(5.0));
        thin(&mut slow, &mut axis);
        assert_eq!(slow.values[..3], [1.0, 5.0, 9.0]);
        assert!(slow.holes.is_empty());
        assert_eq!(
            (axis.rate_hz, axis.start.map(Moment::seconds)),
            (Some(25.0), Some(5.01))
        );
    }

    #[test]
    fn now_and_then_with_stamps() {
        let rows = [0, 3, 10, 13, 20, 23, 29];
        let mut slow = column(30, |row| rows.contains(&row));
        let stamps = (0..30).map(|row| f64::from(row) * 0.5).collect();
        let mut axis = TimeAxis::of_stamps("t", Arc::new(stamps));
        thin(&mut slow, &mut axis);
        assert_eq!(slow.values.len(), rows.len());
        assert_eq!(axis.stamps_s.unwrap()[..3], [0.0, 1.5, 5.0]);
    }

    #[test]
    fn gaps_stay_gaps() {
        let mut gappy = column(30, |row| row != 7 && row != 8);
        let mut axis = TimeAxis::of_header("rate", 100.0, None);
        let (before, same) = (gappy.values.len(), axis.clone());
        thin(&mut gappy, &mut axis);
        assert_eq!((gappy.values.len(), gappy.holes.len()), (before, 2));
        assert_eq!(axis, same);
        // Uneven, and without times.
        let mut uneven = column(30, |row| [0, 3, 10, 13, 20].contains(&row));
        thin(&mut uneven, &mut axis);
        assert_eq!(uneven.values.len(), 30);
    }
}
