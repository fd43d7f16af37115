//! Loads that were measured themselves, with noise: a reference cell beside the gage, logged while weights are changed.
//!
//! A regression on each row would take the noise of the load for changes that the reading does not follow (errors in
//! variables: W. A. Fuller, Measurement Error Models (1987), 1.1). The rows between two changes of the load therefore
//! count as one reading at their mean load, whose noise is smaller by the square root of their number.

use std::ops::Range;

use super::settling::{RUN, is_stepwise};
use super::{Point, std_of_mean};
use crate::print::{plural, rounded};
use torqcomp_dsp::quality::median;

/// Largest deviation of a row from the mean of its plateau, and of two means of the same load, in standard deviations.
const SCATTER: f64 = 5.0;
const SAME_LOAD: f64 = 3.0;
/// Minimum number of plateaus.
const PLATEAUS: usize = 3;
/// Maximum change within a plateau, relative to those between them: a ramp changes as much within.
const WITHIN: f64 = 0.25;
/// Ratio of a normal variable's standard deviation to the median magnitude of differences of two.
const NORMAL: f64 = 1.0 / (0.6745 * std::f64::consts::SQRT_2);

/// Loads without their noise.
#[derive(Debug, Clone, PartialEq)]
pub struct PlateauLoads {
    /// In each row the mean of its plateau, or zero where that is within its uncertainty.
    pub loads: Vec<f64>,
    /// Whether each row is of a plateau; the others have the load of one beside them.
    pub is_steady: Vec<bool>,
    /// Standard deviation of the noise.
    pub noise: f64,
}

impl PlateauLoads {
    /// `None` if the loads are exact, or do not stay at plateaus.
    pub fn of(loads: &[f64]) -> Option<Self> {
        let mut steps: Vec<f64> = loads.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        let noise = NORMAL * median(&mut steps).filter(|step| *step > 0.0)?;
        let plateaus = plateaus(loads, noise);
        let largest = loads.iter().fold(0.0_f64, |m, l| m.max(l.abs()));
        let rows: usize = plateaus.iter().map(|p| p.rows.len()).sum();
        let between = plateaus.windows(2).map(|p| (p[1].mean - p[0].mean).abs());
        let between = median(&mut between.collect::<Vec<_>>())?;
        let within = plateaus.iter().map(|p| p.change(loads));
        let within = median(&mut within.collect::<Vec<_>>())?;
        let is_plateau = plateaus.len() >= PLATEAUS
            && is_stepwise(rows, loads.len(), between, largest)
            && within < WITHIN * between;
        if !is_plateau {
            return None;
        }
        let mut found = Self {
            loads: Vec::with_capacity(loads.len()),
            is_steady: vec![false; loads.len()],
            noise,
        };
        for plateau in &plateaus {
            // A series begins and ends with no load at all.
            let is_zero = plateau.mean.abs() < SAME_LOAD * plateau.std(noise);
            let load = if is_zero { 0.0 } else { plateau.mean };
            found.loads.resize(plateau.rows.end, load);
            found.is_steady[plateau.rows.clone()].fill(true);
        }
        let last = found.loads.last().copied()?;
        found.loads.resize(loads.len(), last);
        Some(found)
    }
}

/// Readings at such loads.
pub(super) struct PlateauReadings {
    /// The rows of the plateaus, with the means of the loads.
    pub rows: Vec<Point>,
    /// One reading for each plateau, the mean of its rows.
    pub means: Vec<Point>,
    noise: f64,
}

impl PlateauReadings {
    /// `None` if the loads are exact, or do not stay at plateaus.
    pub fn of(points: &[Point]) -> Option<Self> {
        let loads: Vec<f64> = points.iter().map(|p| p.load).collect();
        let found = PlateauLoads::of(&loads)?;
        let steady = (0..points.len()).filter(|i| found.is_steady[*i]);
        let with_mean = |i: usize| Point {
            load: found.loads[i],
            ..points[i]
        };
        let rows: Vec<Point> = steady.map(with_mean).collect();
        let is_same = |a: &Point, b: &Point| {
            a.load == b.load && a.series == b.series && a.position == b.position
        };
        let plateaus = rows.chunk_by(is_same).filter(|rows| rows.len() >= RUN);
        let means = plateaus.map(mean).collect();
        let noise = found.noise;
        Some(Self { rows, means, noise })
    }

    /// Standard uncertainty of a plateau's load.
    pub fn load_std(&self) -> f64 {
        self.noise * (self.means.len() as f64 / self.rows.len() as f64).sqrt()
    }

    /// Describes how the rows are used.
    pub fn method(&self, unit: &str) -> String {
        format!(
            "the load was measured with noise of {} {unit} (standard deviation): {} at {}, one reading each",
            rounded(self.noise, 2),
            plural(self.rows.len(), "row"),
            plural(self.means.len(), "plateau")
        )
    }
}

/// Mean reading of rows at one load.
pub(super) fn mean(rows: &[Point]) -> Point {
    let sum: f64 = rows.iter().map(|p| p.reading).sum();
    Point {
        reading: sum / rows.len() as f64,
        std: std_of_mean(rows),
        ..rows[0]
    }
}

/// Consecutive rows at one load.
struct Plateau {
    rows: Range<usize>,
    mean: f64,
}

impl Plateau {
    fn of(loads: &[f64], rows: Range<usize>) -> Self {
        let sum: f64 = loads[rows.clone()].iter().sum();
        Self {
            mean: sum / rows.len() as f64,
            rows,
        }
    }

    /// Without the first and last rows while they are more than the noise away from the mean: a load that is applied
    /// slowly is still changing there.
    fn without_changes(&self, loads: &[f64], noise: f64) -> Option<Self> {
        let is_steady = |i: &usize| (loads[*i] - self.mean).abs() < noise;
        let mut rows = self.rows.clone();
        let (start, last) = (rows.find(is_steady)?, self.rows.clone().rfind(is_steady)?);
        Some(Self::of(loads, start..last + 1))
    }

    /// Adds rows at the same load, and what is between.
    fn join(&mut self, next: &Self) {
        let [count, more] = [&self.rows, &next.rows].map(|rows| rows.len() as f64);
        self.mean = (count * self.mean + more * next.mean) / (count + more);
        self.rows.end = next.rows.end;
    }

    /// Standard uncertainty of its mean.
    fn std(&self, noise: f64) -> f64 {
        noise / (self.rows.len() as f64).sqrt()
    }

    /// Magnitude of the change from its first to its last row, along a straight line.
    fn change(&self, loads: &[f64]) -> f64 {
        let middle = 0.5 * (self.rows.len() as f64 - 1.0);
        let rows = loads[self.rows.clone()].iter().enumerate();
        let (mut products, mut squares) = (0.0, 0.0);
        for (i, load) in rows {
            let place = i as f64 - middle;
            products += place * (load - self.mean);
            squares += place * place;
        }
        (2.0 * middle * products / squares).abs()
    }
}

/// The plateaus of at least [`RUN`] rows. A row that is far off does not end a plateau.
fn plateaus(loads: &[f64], noise: f64) -> Vec<Plateau> {
    let mut found: Vec<Plateau> = Vec::new();
    let mut first = 0;
    while first < loads.len() {
        let (mut sum, mut end) = (loads[first], first + 1);
        while end < loads.len() {
            let count = (end - first) as f64;
            let limit = SCATTER * noise * (1.0 + 1.0 / count).sqrt();
            if (loads[end] - sum / count).abs() > limit {
                break;
            }
            sum += loads[end];
            end += 1;
        }
        let next = Plateau::of(loads, first..end);
        first = end;
        let Some(next) = next
            .without_changes(loads, noise)
            .filter(|p| p.rows.len() >= RUN)
        else {
            continue;
        };
        let goes_on = |last: &&mut Plateau| {
            let std = last.std(noise).hypot(next.std(noise));
            next.rows.start <= last.rows.end + RUN
                && (last.mean - next.mean).abs() < SAME_LOAD * std
        };
        match found.last_mut().filter(goes_on) {
            Some(last) => last.join(&next),
            None => found.push(next),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise without a generator: from −1 to 1, with a standard deviation of 1/√3.
    fn noise(i: usize) -> f64 {
        2.0 * (i as f64 * 0.618_033_988_75).fract() - 1.0
    }

    #[test]
    fn the_mean_of_a_plateau_takes_the_place_of_its_rows() {
        let level = |i: usize| [0.0, 10.0, 30.0, 10.0, 0.0][i / 50];
        let mut loads: Vec<f64> = (0..250).map(|i| level(i) + noise(i)).collect();
        loads[70] = 500.0;
        let found = PlateauLoads::of(&loads).unwrap();
        assert_eq!([found.loads[0], found.loads[249]], [0.0, 0.0]);
        assert_eq!(found.loads[50], found.loads[99]);
        assert!((found.loads[60] - 10.0).abs() < 0.1, "{}", found.loads[60]);
        assert!((found.loads[120] - 30.0).abs() < 0.1);
    }

    #[test]
    fn exact_loads_and_ramps_have_no_plateaus() {
        let exact: Vec<f64> = (0..250).map(|i| (i / 50) as f64).collect();
        assert_eq!(PlateauLoads::of(&exact), None);
        for slope in [0.01, 0.1, 1.0] {
            let ramp: Vec<f64> = (0..2000).map(|i| slope * i as f64 + noise(i)).collect();
            assert_eq!(PlateauLoads::of(&ramp), None, "{slope}");
        }
    }
}
