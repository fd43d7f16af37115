//! Readings of a data logger that settle after each change of the load.
//!
//! ```text
//! y_i = L_j + A_j e^(-i/τ)
//! ```
//!
//! i: row since the change to load j; L_j: settled reading; τ: common time constant in rows. For given τ, L_j and A_j
//! follow from linear least squares, so that only τ is searched (G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10
//! (1973), 413). A reading that settles differently at first, as with two time constants or a load that is let down
//! slowly, is fitted from a later row on.

use super::mixed::is_significant;
use super::solve::Mixed;
use super::steps::is_same_load;
use super::{Point, rows};
use crate::identify::Identification;
use crate::print::{plural, relative, rounded};
use crate::warning::WarningCode;
use torqcomp_dsp::quality::median;

/// Minimum number of rows at a load for its settling to be fitted, and minimum fraction of rows at such loads.
pub(super) const RUN: usize = 4;
const STEPWISE: f64 = 0.8;
/// Minimum number of changes of the load, and their minimum size relative to the largest load: a slow ramp has smaller
/// ones.
const CHANGES: usize = 2;
const STEP: f64 = 0.01;
/// Minimum part of a change that the first row lacks, and its minimum in standard uncertainties.
const LAG: f64 = 0.01;
const CLEAR: f64 = 5.0;
/// Minimum correlation of the lags with the changes of the reading.
const ALIKE: f64 = 0.95;
/// Limits of the time constant: in rows, and in rows of the longest run.
const TIME_CONSTANT: (f64, f64) = (0.2, 2.0);
/// Ratio between the time constants tried first, and halvings of its logarithm afterwards.
const TRIED: f64 = 1.3;
const HALVINGS: usize = 24;
/// Fractions of each run left out before the fit, if the rest does not follow one exponential.
const LEFT_OUT: [f64; 4] = [0.0, 0.1, 0.25, 0.5];
/// Factor to the usual uncertainty of a settled reading above which it is not used.
const VAGUE: f64 = 5.0;
/// Part of a change still missing in the last row, and change of the sensitivity between two fits, above which the
/// result depends on the extrapolation.
const MISSING: f64 = 0.01;
const APART: f64 = 1e-3;

/// The runs at one load of a data logger whose loads change in clear steps; `None` for other tables.
pub(super) fn logged(points: &[Point]) -> Option<Vec<&[Point]>> {
    // Sorted readings rise at each load as settling ones do.
    if rows::is_sorted(points) {
        return None;
    }
    let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.load.abs()));
    let runs = runs(points, largest);
    let rows = runs.iter().map(|run| run.len()).sum::<usize>();
    let mut changes: Vec<f64> = runs
        .windows(2)
        .map(|pair| (pair[1][0].load - pair[0][0].load).abs())
        .collect();
    let change = median(&mut changes)?;
    let is_logged = runs.len() > CHANGES && is_stepwise(rows, points.len(), change, largest);
    is_logged.then_some(runs)
}

/// Long runs of consecutive points at one load. Each point is compared with the first one, as all neighbours in a slow
/// ramp are at the same load.
fn runs(points: &[Point], largest: f64) -> Vec<&[Point]> {
    let mut runs = Vec::new();
    let mut rest = points;
    while let Some(first) = rest.first() {
        let is_same =
            |p: &Point| p.series == first.series && is_same_load(p.load, first.load, largest);
        let length = rest.iter().position(|p| !is_same(p)).unwrap_or(rest.len());
        let (run, more) = rest.split_at(length);
        if run.len() >= RUN {
            runs.push(run);
        }
        rest = more;
    }
    runs
}

/// Whether most rows are at loads that change in clear steps.
pub(super) fn is_stepwise(rows_at_loads: usize, rows: usize, change: f64, largest: f64) -> bool {
    rows_at_loads as f64 > STEPWISE * rows as f64 && change > STEP * largest
}

/// Settled readings, one for each time that a load was applied.
pub(super) struct SettledReadings {
    pub points: Vec<Point>,
    /// The same points, with the differences of other readings that explain the rows as well.
    doubts: Vec<Vec<Point>>,
    /// Number of rows that still settle.
    unsettled: usize,
    /// Time constant in rows, and the part of a change that is missing in the last row of a load.
    time_constant: f64,
    missing: f64,
    /// Whether the rows follow one exponential.
    is_exponential: bool,
}

/// The settled readings of a data logger; `None` if no settling is found.
pub(super) fn settled(runs: &[&[Point]]) -> Option<SettledReadings> {
    let first = Settling::fit(runs, LEFT_OUT[0])?;
    let lag = first.lag(runs)?;
    let mut fits = vec![first];
    for part in &LEFT_OUT[1..] {
        let later = Settling::fit(runs, *part);
        match later.filter(|later| later.is_better(&fits[fits.len() - 1], runs)) {
            Some(later) => fits.push(later),
            None => break,
        }
    }
    let is_exponential = fits.len() < LEFT_OUT.len();
    let best = fits.pop()?;
    let mut others: Vec<Settling> = best.neighbour(runs).into_iter().collect();
    others.extend(fits.pop().filter(|_| !is_exponential));
    let mut factors: Vec<f64> = best.runs.iter().map(|run| run.factor).collect();
    let typical = median(&mut factors)?;
    let kept: Vec<usize> = (0..runs.len())
        .filter(|j| best.runs[*j].factor <= VAGUE * typical)
        .collect();
    let difference = |other: &Settling| {
        let point = |j: &usize| Point {
            reading: other.runs[*j].level - best.runs[*j].level,
            ..runs[*j][0]
        };
        kept.iter().map(point).collect()
    };
    let shortest = runs.iter().map(|run| run.len()).min()? as f64;
    let missing = |row: f64| lag * (-row / best.time_constant).exp();
    Some(SettledReadings {
        points: kept.iter().map(|j| best.point(runs[*j], *j)).collect(),
        doubts: others.iter().map(difference).collect(),
        unsettled: runs
            .iter()
            .map(|run| {
                (0..run.len())
                    .filter(|i| missing(*i as f64) > APART)
                    .count()
            })
            .sum(),
        time_constant: best.time_constant,
        missing: missing(shortest - 1.0),
        is_exponential,
    })
}

impl SettledReadings {
    /// Enlarges standard uncertainties of the curve's coefficients by those that all settled readings share; returns
    /// that of the sensitivity.
    pub fn widen(&self, std: &mut [Option<f64>], largest: f64) -> f64 {
        let degree = std.len() - 1;
        let of_points = |points: &Vec<Point>| {
            let points: Vec<Point> = points.iter().map(|p| Point { std: None, ..*p }).collect();
            Mixed::of(&points, degree, largest, &[]).solve([0.0; 3])
        };
        let mut of_slope = 0.0_f64;
        for found in self.doubts.iter().filter_map(of_points) {
            of_slope = of_slope.hypot(found.values[1]);
            for (std, shift) in std.iter_mut().zip(found.values.iter()) {
                *std = std.map(|std| std.hypot(*shift));
            }
        }
        of_slope
    }

    /// Warns about the readings that still settle; `shared` is the relative uncertainty of the sensitivity from
    /// [`Self::widen`].
    pub fn warn(&self, result: &mut Identification, shared: f64) {
        let rows = rounded(self.time_constant, 2);
        result.warn(WarningCode::UnsettledLeftOut.warning(format!(
            "the reading settles after each change of the load, with a time constant of {rows} rows: {} {} not settled, \
             and each load counts once, with the value to which its rows settle; let the reading settle before it \
             is taken",
            plural(self.unsettled, "row"),
            if self.unsettled == 1 { "is" } else { "are" }
        )));
        if self.missing > MISSING || (!self.is_exponential && shared > APART) {
            let enough = (self.time_constant * (1.0 / APART).ln()).ceil();
            result.warn(WarningCode::StillSettling.warning(format!(
                "the reading was still settling when the load was changed, {} of a change was missing: the settled \
                 values are extrapolated{}; keep each load for {enough} rows or more",
                relative(self.missing, 2),
                match self.is_exponential {
                    true => "",
                    false => ", and the rows do not follow one exponential",
                },
            )));
        }
    }
}

/// Settled reading of a run, and amplitude of its settling at the first row.
struct LoadLevel {
    level: f64,
    amplitude: f64,
    /// Their standard uncertainties over that of a row.
    factor: f64,
    of_amplitude: f64,
}

/// The fit of all runs with one time constant.
struct Settling {
    /// In rows.
    time_constant: f64,
    runs: Vec<LoadLevel>,
    /// Fraction of each run left out.
    left_out: f64,
    squares: f64,
    freedom: f64,
}

/// Index of the first row of a run that is used.
fn start(run: &[Point], left_out: f64) -> usize {
    ((left_out * run.len() as f64).ceil() as usize).min(run.len() - RUN + 1)
}

impl Settling {
    /// The fit without a fraction of each run; `None` without degrees of freedom.
    fn fit(runs: &[&[Point]], left_out: f64) -> Option<Self> {
        let longest = runs.iter().map(|run| run.len()).max()? as f64;
        let limits = (TIME_CONSTANT.0, TIME_CONSTANT.1 * longest);
        let with = |time_constant: f64| Self::with(runs, left_out, time_constant);
        let mut best = with(limits.0);
        let mut tried = limits.0;
        while tried < limits.1 {
            tried = (tried * TRIED).min(limits.1);
            let next = with(tried);
            if next.squares < best.squares {
                best = next;
            }
        }
        let mut step = TRIED.sqrt();
        for _ in 0..HALVINGS {
            for factor in [step, 1.0 / step] {
                let next = with((best.time_constant * factor).clamp(limits.0, limits.1));
                if next.squares < best.squares {
                    best = next;
                }
            }
            step = step.sqrt();
        }
        (best.freedom > 0.0).then_some(best)
    }

    fn with(runs: &[&[Point]], left_out: f64, time_constant: f64) -> Self {
        let ratio = (-1.0 / time_constant).exp();
        let mut found = Self {
            time_constant,
            runs: Vec::with_capacity(runs.len()),
            left_out,
            squares: 0.0,
            freedom: -1.0,
        };
        for run in runs {
            let first = start(run, left_out);
            let rows = &run[first..];
            let count = rows.len() as f64;
            // From 1 at the first row used, so that no short time constant makes all of them 0.
            let decay = || std::iter::successors(Some(1.0), |e| Some(e * ratio)).zip(rows);
            let mean = decay().map(|(e, _)| e).sum::<f64>() / count;
            let reading = rows.iter().map(|p| p.reading).sum::<f64>() / count;
            let spread: f64 = decay().map(|(e, _)| (e - mean).powi(2)).sum();
            let products: f64 = decay()
                .map(|(e, p)| (e - mean) * (p.reading - reading))
                .sum();
            let amplitude = products / spread;
            let level = reading - amplitude * mean;
            let left = decay().map(|(e, p)| (p.reading - level - amplitude * e).powi(2));
            found.squares += left.sum::<f64>();
            found.freedom += count - 2.0;
            let to_first = ratio.powi(first as i32).recip();
            found.runs.push(LoadLevel {
                level,
                amplitude: amplitude * to_first,
                factor: (1.0 / count + mean * mean / spread).sqrt(),
                of_amplitude: to_first / spread.sqrt(),
            });
        }
        found
    }

    fn variance(&self) -> f64 {
        self.squares / self.freedom
    }

    /// Fitted reading at a row.
    fn at(&self, run: usize, row: usize) -> f64 {
        let LoadLevel {
            level, amplitude, ..
        } = self.runs[run];
        level + amplitude * (-(row as f64) / self.time_constant).exp()
    }

    /// Part of each change of the reading that the first row lacks, if it is significant and the same for all changes.
    fn lag(&self, runs: &[&[Point]]) -> Option<f64> {
        let (mut jumps, mut amplitudes, mut products, mut variance) = (0.0, 0.0, 0.0, 0.0);
        for j in 1..runs.len() {
            let jump = self.runs[j].level - self.at(j - 1, runs[j - 1].len() - 1);
            let amplitude = self.runs[j].amplitude;
            jumps += jump * jump;
            amplitudes += amplitude * amplitude;
            products -= jump * amplitude;
            variance += (jump * self.runs[j].of_amplitude).powi(2) * self.variance();
        }
        let is_clear = products > CLEAR * variance.sqrt() && products > LAG * jumps;
        let is_alike = products > ALIKE * (jumps * amplitudes).sqrt();
        (is_clear && is_alike).then(|| products / jumps)
    }

    /// Whether this fit of later rows explains them significantly better than one of more rows.
    fn is_better(&self, other: &Self, runs: &[&[Point]]) -> bool {
        let mut others = 0.0;
        for (j, run) in runs.iter().enumerate() {
            for (i, point) in run.iter().enumerate().skip(start(run, self.left_out)) {
                others += (point.reading - other.at(j, i)).powi(2);
            }
        }
        is_significant(
            (others, self.squares),
            2.0 * runs.len() as f64 + 1.0,
            self.freedom,
        )
    }

    /// The fit with a time constant that is longer by its standard uncertainty.
    fn neighbour(&self, runs: &[&[Point]]) -> Option<Self> {
        let with = |factor: f64| Self::with(runs, self.left_out, self.time_constant * factor);
        let curvature = |step: f64| {
            let sides = with(step.exp()).squares + with((-step).exp()).squares;
            (sides - 2.0 * self.squares) / (step * step)
        };
        let std = (2.0 * self.variance() / curvature(1e-2)).sqrt();
        // At a limit of the time constant, the rows do not determine it.
        let std = if std.is_finite() { std.min(0.5) } else { 0.5 };
        (self.squares > 0.0).then(|| with(std.exp()))
    }

    fn point(&self, run: &[Point], j: usize) -> Point {
        let factor = self.runs[j].factor;
        let count = run.len() as f64;
        Point {
            load: run.iter().map(|p| p.load).sum::<f64>() / count,
            reading: self.runs[j].level,
            std: run[0].std.map(|std| std * factor),
            ..run[0]
        }
    }
}
