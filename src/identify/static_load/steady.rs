//! Readings of a data logger that are not steady after each change of the load: a weight that swings, or a load that was
//! entered some rows too late or too early.
//!
//! Row by row, a swing would count as a drift of the zero, and the changes of the load, exactly where the weight swings
//! most, would determine the sensitivity. Such rows are left out, and the mean of the others counts as one reading.

use super::Point;
use super::mixed::last_digits;
use super::plateaus::mean;
use super::settling::RUN;
use crate::identify::Identification;
use crate::print::{plural, rounded};
use crate::warning::WarningCode;

/// Parts of the rows at each load that are tried, the longest first: from and to.
const PARTS: [[f64; 2]; 11] = [
    [0.0, 1.0],
    [1.0 / 6.0, 1.0],
    [0.0, 5.0 / 6.0],
    [1.0 / 6.0, 5.0 / 6.0],
    [1.0 / 3.0, 1.0],
    [0.0, 2.0 / 3.0],
    [1.0 / 3.0, 5.0 / 6.0],
    [1.0 / 2.0, 1.0],
    [0.0, 1.0 / 2.0],
    [1.0 / 2.0, 5.0 / 6.0],
    [2.0 / 3.0, 1.0],
];
/// Largest part left out at the beginning for which a load entered early is as likely as a slow settling.
const SHORT: f64 = 0.2;
/// Minimum number of rows at a load, and of loads.
const ROWS: usize = 3 * RUN;
const LOADS: usize = 4;
/// Ratio of variances up to which a part is as steady as the steadiest, beyond what chance explains in standard
/// deviations.
const AS_STEADY: f64 = 1.1;
const CHANCE: f64 = 4.0;
/// Correlation of neighbouring rows, in standard deviations, above which they are no independent readings.
const CORRELATED: f64 = 6.0;

/// One reading for each time that a load was applied.
pub(super) struct SteadyReadings {
    pub points: Vec<Point>,
    /// The part of the rows at each load that is used.
    part: [f64; 2],
    /// Number of rows left out, and of all.
    left_out: usize,
    rows: usize,
    /// Whether the rows used are independent readings.
    is_white: bool,
}

impl SteadyReadings {
    /// From the runs of a data logger; `None` if they are few or short, or all rows are steady and independent.
    pub fn of(runs: &[&[Point]]) -> Option<Self> {
        if runs.len() < LOADS || runs.iter().any(|run| run.len() < ROWS) {
            return None;
        }
        let digit = last_digits(&runs.concat());
        if runs.iter().all(|run| range(run) < digit) {
            return None;
        }
        let parts: Vec<Scatter> = PARTS.iter().map(|part| Scatter::of(runs, *part)).collect();
        let least = parts
            .iter()
            .min_by(|a, b| a.variance.total_cmp(&b.variance))?;
        let is_steady = |scatter: &&Scatter| {
            let chance = (2.0 / scatter.freedom + 2.0 / least.freedom).sqrt();
            scatter.variance <= least.variance * (AS_STEADY + CHANCE * chance)
        };
        let used = parts.iter().find(is_steady)?;
        let is_white = used.correlation < CORRELATED / used.freedom.sqrt();
        if used.part == PARTS[0] && is_white {
            return None;
        }
        let parts: Vec<&[Point]> = runs.iter().map(|run| within(run, used.part)).collect();
        let rows = runs.iter().map(|run| run.len()).sum::<usize>();
        Some(Self {
            points: parts.iter().map(|rows| mean(rows)).collect(),
            part: used.part,
            left_out: rows - parts.iter().map(|rows| rows.len()).sum::<usize>(),
            rows,
            is_white,
        })
    }

    /// Whether few or none of the first rows at a load are left out, which rules out a slow settling, and those used are
    /// independent readings.
    pub fn is_at_once(&self) -> bool {
        self.is_white && self.part[0] < SHORT
    }

    /// Describes how the rows are used.
    pub fn warn(&self, result: &mut Identification) {
        if self.left_out == 0 {
            result.method.push(format!(
                "the readings of neighbouring rows depend on each other: {} at {}, one reading each",
                plural(self.rows, "row"),
                plural(self.points.len(), "load")
            ));
            return;
        }
        let [first, last] = [self.part[0], 1.0 - self.part[1]].map(|part| rounded(100.0 * part, 2));
        let where_ = match (self.part[0] > 0.0, self.part[1] < 1.0) {
            (true, false) => format!("first {first} %"),
            (false, _) => format!("last {last} %"),
            (true, true) => format!("first {first} % and the last {last} %"),
        };
        result.warn(WarningCode::UnsettledLeftOut.warning(format!(
            "the reading is not steady in the {where_} of the rows at each load (the weight still swings, or the load \
             was entered late or early): {} of {} are left out, and each load counts once, with the mean of the others; \
             let the reading settle before it is taken",
            self.left_out,
            plural(self.rows, "row"),
        )));
    }
}

/// Range of the readings of a run.
fn range(run: &[Point]) -> f64 {
    let readings = run.iter().map(|p| p.reading);
    readings.clone().fold(f64::MIN, f64::max) - readings.fold(f64::MAX, f64::min)
}

/// The rows of a load from one fraction of them to another.
fn within(run: &[Point], [from, to]: [f64; 2]) -> &[Point] {
    let place = |part: f64| (part * run.len() as f64).ceil() as usize;
    &run[place(from)..place(to).min(run.len())]
}

/// Scatter of readings about the mean of each load.
struct Scatter {
    part: [f64; 2],
    variance: f64,
    freedom: f64,
    /// Correlation of neighbouring rows.
    correlation: f64,
}

impl Scatter {
    fn of(runs: &[&[Point]], part: [f64; 2]) -> Self {
        let (mut squares, mut products, mut freedom) = (0.0, 0.0, 0.0);
        for run in runs {
            let rows = within(run, part);
            let mean = rows.iter().map(|p| p.reading).sum::<f64>() / rows.len() as f64;
            let off: Vec<f64> = rows.iter().map(|p| p.reading - mean).collect();
            squares += off.iter().map(|v| v * v).sum::<f64>();
            products += off.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>();
            freedom += (rows.len() - 1) as f64;
        }
        Self {
            part,
            variance: squares / freedom,
            freedom,
            correlation: products / squares.max(f64::MIN_POSITIVE),
        }
    }
}
