//! Load steps of a table: the rows of each, and whether they were reached by loading or unloading.

use super::{Point, SAME, rows};

/// The different loads of a table with their rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadSteps {
    /// The different loads except no load, ascending.
    pub loads: Vec<f64>,
    /// Rows at each load, in the order of the table.
    pub rows: Vec<Vec<usize>>,
    /// Whether each row was reached by increasing the magnitude of the load.
    pub is_rising: Vec<bool>,
    /// Largest magnitude of the loads.
    pub largest: f64,
    /// Whether the rows are sorted, so that their order in time is lost.
    pub is_sorted: bool,
    /// Whether they are ranges of a steadily changing load.
    pub is_ramp: bool,
    /// Standard uncertainty of a load; 0 for known loads.
    pub load_std: f64,
}

impl LoadSteps {
    /// The steps of the points.
    pub fn of(points: &[Point]) -> Self {
        let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.load.abs()));
        let mut loads: Vec<f64> = points.iter().map(|p| p.load).collect();
        loads.sort_by(f64::total_cmp);
        loads.dedup_by(|a, b| is_same_load(*a, *b, largest));
        Self {
            rows: rows_at(points, &loads, largest),
            is_rising: directions(points, largest),
            loads,
            largest,
            is_sorted: rows::is_sorted(points),
            is_ramp: false,
            load_std: 0.0,
        }
    }

    /// Loads and their rows.
    pub fn iter(&self) -> impl Iterator<Item = (f64, &[usize])> {
        let rows = self.rows.iter().map(Vec::as_slice);
        self.loads.iter().copied().zip(rows)
    }
}

/// Whether two loads are one step; `largest` is the largest of all.
pub(super) fn is_same_load(a: f64, b: f64, largest: f64) -> bool {
    (a - b).abs() <= SAME * largest
}

/// Rows at each of the ascending loads. A row between two loads that hardly differ belongs to both.
fn rows_at(points: &[Point], loads: &[f64], largest: f64) -> Vec<Vec<usize>> {
    let mut rows = vec![Vec::new(); loads.len()];
    let is_at = |point: &Point, load: f64| is_same_load(point.load, load, largest);
    for (i, point) in points.iter().enumerate() {
        let next = loads.partition_point(|load| *load <= point.load);
        let below = (0..next).rev().take_while(|k| is_at(point, loads[*k]));
        let above = (next..loads.len()).take_while(|k| is_at(point, loads[*k]));
        for k in below.chain(above) {
            rows[k].push(i);
        }
    }
    rows
}

/// Whether the magnitude of the load was increased to reach each point of its series. A return by less than the
/// distance of two steps is not a reversal: repeated rows at one load have the direction of the first of them.
fn directions(points: &[Point], largest: f64) -> Vec<bool> {
    let series = points.iter().map(|p| p.series + 1).max().unwrap_or(0);
    // Direction, and the extreme load since the last reversal.
    let mut last: Vec<Option<(bool, f64)>> = vec![None; series];
    let direction = |point: &Point| {
        let size = point.load.abs();
        let (was_rising, farthest) = last[point.series].unwrap_or((true, size));
        let back = if was_rising {
            farthest - size
        } else {
            size - farthest
        };
        let has_turned = back > SAME * largest;
        let is_rising = was_rising != has_turned;
        let farthest = match (has_turned, is_rising) {
            (true, _) => size,
            (false, true) => farthest.max(size),
            (false, false) => farthest.min(size),
        };
        last[point.series] = Some((is_rising, farthest));
        is_rising
    };
    points.iter().map(direction).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(loads: &[f64]) -> Vec<Point> {
        let point = |load: &f64| Point {
            load: *load,
            reading: 0.0,
            std: None,
            series: 0,
            position: 0,
        };
        loads.iter().map(point).collect()
    }

    #[test]
    fn rows_of_a_load_are_those_near_it() {
        let steps = LoadSteps::of(&points(&[0.0, 5.0, 10.0, 5.01, -0.01, 10.0]));
        assert_eq!(steps.loads, [-0.01, 5.0, 10.0]);
        assert_eq!(steps.rows, [vec![0, 4], vec![1, 3], vec![2, 5]]);
        assert_eq!(steps.largest, 10.0);
    }

    #[test]
    fn repeated_rows_have_the_direction_of_the_first() {
        let loads = [
            0.0, 5.0, 5.0, 10.0, 9.99, 10.0, 5.0, 5.0, 5.01, 0.0, 0.0, -5.0,
        ];
        let steps = LoadSteps::of(&points(&loads));
        let falling: Vec<usize> = (0..loads.len()).filter(|i| !steps.is_rising[*i]).collect();
        assert_eq!(falling, [6, 7, 8, 9, 10]);
    }
}
