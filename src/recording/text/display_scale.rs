//! The common factor above a table that MATLAB and Octave display, `1.0e+03 *`.

use super::head::{Head, Table};
use crate::failure::{ErrorCode, Failure};

/// Number of lines above the first row that are examined.
const LINES: usize = 6;

/// Rejects a table below a common factor: it multiplies all columns, times included.
///
/// # Errors
/// If there is one other than 1.
pub(super) fn refuse(head: &Head, table: &Table) -> Result<(), Failure> {
    let above = (table.first.saturating_sub(LINES)..table.first).rev();
    let Some(line) = above.into_iter().find(|k| is_scale(&head.lines[*k].text)) else {
        return Ok(());
    };
    Err(ErrorCode::UnitUnclear.failed(format_args!(
        "\"{}\" is the common factor of a displayed matrix (MATLAB, Octave), which multiplies all columns and leaves \
         few digits of them; export the numbers themselves with writematrix([t y], \"run.csv\") or dlmwrite, or multiply \
         all columns by it and remove the line",
        head.lines[line].text.trim()
    ))
    .line(head.number(line)))
}

/// Whether a line is a power of ten and an asterisk.
fn is_scale(line: &str) -> bool {
    let number = line.trim().strip_suffix('*').map(str::trim_end);
    let number = number.filter(|number| number.contains(['e', 'E']));
    number.is_some_and(|number| number.parse::<f64>().is_ok_and(|factor| factor != 1.0))
}
