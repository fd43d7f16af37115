//! Rows that are not samples: their number above them; largest, least and mean values and totals
//! below.

use super::axes::Role;
use super::rows::{Column, Rows};
use crate::print::plural;
use crate::recording::HoleKind;
use crate::warning::{Warning, WarningCode};

/// Maximum number of summary rows, plus one for each [`PART`] samples.
const ROWS: usize = 10;
/// Number of samples per additional row.
const PART: usize = 10;
/// Number of samples per missing stamp allowed.
const DENSE: usize = 100;

/// Removes a first row with the number of following rows, in each of several columns or next to an empty
/// time cell: it is not a sample. With the first rows only (not `is_all`), it may be one.
pub fn leave_out_count(rows: &mut Rows, is_all: bool) -> Option<Warning> {
    let below = rows.count.checked_sub(1).filter(|count| *count >= ROWS)? as f64;
    let mut first = rows
        .columns
        .iter()
        .filter_map(|column| column.values.first())
        .filter(|value| !value.is_nan())
        .peekable();
    let is_one_of_many = rows.columns.len() > 1;
    let said = **first.peek()?;
    let may_be = said == below || !is_all && said > below && said.fract() == 0.0;
    if !is_one_of_many || !may_be || !first.all(|value| *value == said) {
        return None;
    }
    let line = rows.line_of(0);
    rows.drop_first();
    Some(WarningCode::LinesSkipped.warning(format!(
        "line {line} gives the number of rows that follow, {below}; it was skipped"
    )))
}

/// Removes the rows after the last time stamp whose time cells contain texts or nothing: they are not
/// samples. Time columns with only occasional stamps are ignored here.
pub fn leave_out(rows: &mut Rows, roles: &[Role]) -> Option<Warning> {
    let times = || {
        let all = rows.columns.iter().zip(roles);
        all.filter(|(_, role)| **role == Role::Time)
            .map(|(column, _)| column)
    };
    let samples = times().filter_map(stamped).max()?;
    let filled = rows
        .columns
        .iter()
        .map(|column| column.values.len())
        .max()?;
    let behind = filled.checked_sub(samples).filter(|count| *count > 0)?;
    let is_dense = |column: &Column| {
        let missing = column.holes.partition_point(|hole| hole.index < samples);
        stamped(column) == Some(samples) && DENSE * missing <= samples
    };
    let is_no_stamp = |column: &Column| {
        let from = column.holes.partition_point(|hole| hole.index < samples);
        column.holes[from..].iter().all(|hole| {
            matches!(
                hole.what,
                HoleKind::Empty | HoleKind::Missing | HoleKind::Text
            )
        })
    };
    let is_summary = times().any(is_dense) && times().all(is_no_stamp);
    if !is_summary || behind > ROWS + samples / PART {
        return None;
    }
    let line = rows.line_of(samples);
    rows.truncate(samples);
    rows.notes.too_wide = rows.notes.too_wide.filter(|wide| *wide < line);
    Some(WarningCode::LinesSkipped.warning(format!(
        "{} skipped below the last time stamp, from line {line} on: no time stamp, like sums and means below a \
         table",
        plural(behind, "row")
    )))
}

/// Number of rows up to the last stamp.
fn stamped(column: &Column) -> Option<usize> {
    let last = column.values.iter().rposition(|value| value.is_finite())?;
    Some(last + 1)
}
