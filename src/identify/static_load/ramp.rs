//! A load that changes steadily, as in a slow ramp up and down.
//!
//! Its rows are no independent readings: hysteresis changes smoothly along the ramp. The rows of each range of the
//! load therefore count as one reading at the middle of the range, as in a test with load steps. Where hysteresis
//! closes at the ends of the ramp, it looks like a random walk of the zero, with which the sensitivity would be
//! that between the ends: it counts in the uncertainty only.

use super::mixed::MOST_LOOPS;
use super::solve::Mixed;
use super::steps::LoadSteps;
use super::{Point, std_of_mean, value_of};
use crate::print::plural;
use crate::student::student;

/// Number of ranges between the ends of the loads, the first and the last of which are halves.
const RANGES: f64 = 16.0;
/// Part of a range by which the load leaves it before the next one begins, so that noise does not.
const BEYOND: f64 = 0.1;
/// Minimum mean number of rows of a range, and of rows in it for a slope of its own.
const ROWS: usize = 3;
const OWN_SLOPE: usize = 4;

/// Readings in the ranges of a ramp.
pub(super) struct RampReadings {
    pub points: Vec<Point>,
    rows: usize,
}

/// The readings in the ranges of a ramp; `None` if the loads are no ramp.
pub(super) fn ranges(points: &[Point]) -> Option<RampReadings> {
    let steps = LoadSteps::of(points);
    if steps.loads.len() <= MOST_LOOPS || steps.is_sorted {
        return None;
    }
    let first = steps.loads[0];
    let width = (steps.loads[steps.loads.len() - 1] - first) / RANGES;
    let line = line(points);
    let middle = |range: f64| first + width * range;
    let mut range = 0.0;
    let of_row = |point: &Point| {
        if (point.load - middle(range)).abs() > (0.5 + BEYOND) * width {
            range = ((point.load - first) / width).round();
        }
        range
    };
    let of_rows: Vec<f64> = points.iter().map(of_row).collect();
    let rows: Vec<usize> = (0..points.len()).collect();
    let same = |a: &usize, b: &usize| {
        let (first, second) = (&points[*a], &points[*b]);
        of_rows[*a] == of_rows[*b]
            && first.series == second.series
            && first.position == second.position
    };
    let found: Vec<Point> = rows
        .chunk_by(same)
        .map(|rows| {
            reading(
                &points[rows[0]..=rows[rows.len() - 1]],
                middle(of_rows[rows[0]]),
                &line,
            )
        })
        .collect();
    (points.len() >= ROWS * found.len()).then_some(RampReadings {
        points: found,
        rows: points.len(),
    })
}

/// Reading of the points at a load, by their own line or, if they are few, one parallel to the line of all.
fn reading(points: &[Point], load: f64, all: &[f64; 2]) -> Point {
    let count = points.len() as f64;
    let mean = |of: &dyn Fn(&Point) -> f64| points.iter().map(of).sum::<f64>() / count;
    let own = line(points);
    let line = match points.len() >= OWN_SLOPE && own[1].is_finite() {
        true => own,
        false => *all,
    };
    Point {
        load,
        reading: mean(&|p| p.reading - value_of(&line, p.load)) + value_of(&line, load),
        std: std_of_mean(points),
        ..points[0]
    }
}

/// Zero and slope of the straight line through all points.
pub(super) fn line(points: &[Point]) -> [f64; 2] {
    let count = points.len() as f64;
    let load = points.iter().map(|p| p.load).sum::<f64>() / count;
    let reading = points.iter().map(|p| p.reading).sum::<f64>() / count;
    let products = points
        .iter()
        .map(|p| (p.load - load) * (p.reading - reading));
    let squares = points.iter().map(|p| (p.load - load).powi(2));
    let slope = products.sum::<f64>() / squares.sum::<f64>();
    [reading - slope * load, slope]
}

impl RampReadings {
    /// Limits the standard uncertainties of the curve's coefficients from below by those from the mean readings at the
    /// loads: the ends of a hysteresis deviate from the curve alike in every cycle.
    pub fn widen(&self, std: &mut [Option<f64>], largest: f64) {
        let steps = LoadSteps::of(&self.points);
        let mean = |(load, rows): (f64, &[usize])| Point {
            load,
            reading: rows.iter().map(|i| self.points[*i].reading).sum::<f64>() / rows.len() as f64,
            std: None,
            series: 0,
            position: 0,
        };
        let means: Vec<Point> = steps.iter().map(mean).collect();
        let model = Mixed::of(&means, std.len() - 1, largest, &[]);
        let Some(solved) = model.solve([0.0; 3]) else {
            return;
        };
        for (k, std) in std.iter_mut().enumerate() {
            let of_means = (solved.variance * solved.covariance[(k, k)]).sqrt();
            *std = std.map(|std| std.max(of_means * student(model.freedom() as f64)));
        }
    }

    /// Describes how the rows are used.
    pub fn method(&self) -> String {
        format!(
            "the load changes steadily: {} in {} of the load, one reading each",
            plural(self.rows, "row"),
            plural(self.points.len(), "range")
        )
    }
}
