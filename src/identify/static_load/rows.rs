//! Rows that are not settled readings in order of time: sorted tables, and data loggers whose reading still settles after each
//! change of the load.

use std::borrow::Cow;

use super::Point;
use super::steps::is_same_load;
use crate::identify::{Identification, rms};
use crate::print::plural;

/// Minimum number of loads of a sorted table, and of rows beyond one per load.
const SORTED: (usize, usize) = (3, 6);
/// Minimum number of rows at a load for settling to be detectable, and of loads that show it.
const RUN: usize = 8;
const LOADS: usize = 3;
/// Minimum fraction of rows at such loads.
const STEPWISE: f64 = 0.8;
/// Minimum lag of a first row, and maximum lag of a settled one, relative to the change of the reading.
const LAGS: f64 = 0.1;
const SETTLED: f64 = 0.01;
/// Minimum lag in standard deviations of the settled rows.
const NOISE: f64 = 5.0;

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
    result.warn(
        "rows-sorted",
        "the rows are sorted by load and reading, so the order in which they were taken is lost: drift of the zero, \
         hysteresis and repeatability are unknown; restore the order",
    );
}

/// The settled points, and the number of those in which the reading still settles after a change of the load.
pub(super) fn settled(points: &[Point]) -> (Cow<'_, [Point]>, usize) {
    let runs: Vec<LoadRun> = runs(points).map(LoadRun::of).collect();
    let lags: Vec<usize> = std::iter::once(0)
        .chain(
            runs.windows(2)
                .map(|pair| pair[1].unsettled_after(&pair[0])),
        )
        .collect();
    let long = || runs.iter().filter(|run| run.points.len() >= RUN);
    let lagging = lags.iter().filter(|rows| **rows > 0).count();
    // Where a load changes steadily, few rows are at one load.
    let at_loads = long().map(|run| run.points.len()).sum::<usize>() as f64;
    let is_stepwise = at_loads > STEPWISE * points.len() as f64;
    if lagging < LOADS || 2 * lagging < long().count() || !is_stepwise {
        return (points.into(), 0);
    }
    let kept = runs.iter().zip(&lags);
    let kept = kept.flat_map(|(run, rows)| run.points[*rows..].iter().copied());
    (kept.collect(), lags.iter().sum())
}

/// Warns about unsettled rows.
pub(super) fn warn_unsettled(result: &mut Identification, count: usize) {
    if count > 0 {
        result.warn(
            "unsettled-left-out",
            format!(
                "{} right after changes of the load {} left out, because the reading still settles there; let it settle \
                 before it is taken, or give one row per load",
                plural(count, "row"),
                if count == 1 { "is" } else { "are" }
            ),
        );
    }
}

/// Consecutive points at one load.
fn runs(points: &[Point]) -> impl Iterator<Item = &[Point]> {
    let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.load.abs()));
    points.chunk_by(move |a, b| is_same_load(a.load, b.load, largest))
}

/// Consecutive points at one load, with level and noise of their last third.
struct LoadRun<'a> {
    points: &'a [Point],
    level: f64,
    noise: f64,
}

impl<'a> LoadRun<'a> {
    fn of(points: &'a [Point]) -> Self {
        let last = &points[points.len() - points.len().div_ceil(3)..];
        let level = last.iter().map(|p| p.reading).sum::<f64>() / last.len() as f64;
        let about: Vec<f64> = last.iter().map(|p| p.reading - level).collect();
        Self {
            points,
            level,
            noise: rms(&about),
        }
    }

    /// Number of first rows in which the reading still settles from the previous level; 0 if the first is settled.
    fn unsettled_after(&self, before: &LoadRun) -> usize {
        let count = self.points.len();
        let jump = self.level - before.level;
        let lag = |p: &Point| (self.level - p.reading) / jump;
        let is_clear = |p: &Point| (self.level - p.reading).abs() > NOISE * self.noise;
        if count < RUN || jump == 0.0 || lag(&self.points[0]) < LAGS || !is_clear(&self.points[0]) {
            return 0;
        }
        let first = self
            .points
            .iter()
            .position(|p| lag(p) < SETTLED || !is_clear(p));
        // The rest of the lag is hidden by noise for about as long.
        (2 * first.unwrap_or(count)).min(count - count / 3)
    }
}
