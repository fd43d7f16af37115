//! Tables sorted by load and reading, so that the order in which their rows were taken is lost.

use super::Point;
use super::steps::is_same_load;
use crate::identify::Identification;
use crate::warning::WarningCode;

/// Minimum number of loads of a sorted table, and of rows beyond one per load.
const SORTED: (usize, usize) = (3, 6);

/// Whether the rows are sorted by load and, at each load, by reading, so that their order in time is lost.
pub(super) fn is_sorted(points: &[Point]) -> bool {
    let runs: Vec<&[Point]> = runs(points).collect();
    let rises = |run: &&[Point]| {
        run.windows(2)
            .all(|pair| pair[0].reading <= pair[1].reading)
    };
    let falls = |run: &&[Point]| {
        run.windows(2)
            .all(|pair| pair[0].reading >= pair[1].reading)
    };
    let (count, more) = SORTED;
    runs.len() >= count
        && points.len() >= runs.len() + more
        && points.windows(2).all(|pair| pair[0].load <= pair[1].load)
        && (runs.iter().all(rises) || runs.iter().all(falls))
}

/// Warns about sorted rows.
pub(super) fn warn_sorted(result: &mut Identification) {
    result.warn(WarningCode::RowsSorted.warning(
        "the rows are sorted by load and reading, so the order in which they were taken is lost: drift of the zero, \
         hysteresis and repeatability are unknown; restore the order",
    ));
}

/// Consecutive points at one load.
fn runs(points: &[Point]) -> impl Iterator<Item = &[Point]> {
    let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.load.abs()));
    points.chunk_by(move |a, b| is_same_load(a.load, b.load, largest))
}
