//! Test of linearity of the readings.
//!
//! The mean readings at each load are compared with the curve and with the scatter about these means: repeating a load
//! has that error, whatever the characteristic (lack of fit; N. R. Draper, H. Smith, Applied Regression Analysis, 3rd
//! ed., 1998, 2.1).

use super::mixed::{last_digits, resolution};
use super::steps::LoadSteps;
use super::{NONE, Point, SAME, value_of};
use crate::failure::{ErrorCode, Failure};
use crate::identify::{Identification, rms};
use crate::print::rounded;
use crate::warning::WarningCode;
use torqcomp_dsp::sort_by_number;

/// Distance of a mean from the curve, relative to what their scatter explains and to the deflection at the largest
/// load, above which a warning is given.
const OFF: (f64, f64) = (5.0, 1e-3);
/// Step of the mean between the two largest loads, relative to that of the curve, below which the reading
/// saturates.
const STANDS: f64 = 0.2;
/// Minimum number of loads.
const LEAST: usize = 3;

/// Ratio of the error with two ranges to that with one, up to which there are two, and minimum change of the
/// sensitivity between them.
pub(super) const TWO_RANGES: f64 = 0.1;
pub(super) const LEAST_CHANGE: f64 = 0.02;
/// Minimum number of loads in a range.
const FEWEST: usize = 2;

/// Rejects readings whose sensitivity jumps from one load to the next: each range of an amplifier has its own.
///
/// # Errors
/// If it does.
pub(super) fn refuse_two_ranges(points: &[Point], steps: &LoadSteps) -> Result<(), Failure> {
    let largest = steps.largest;
    let (empty, mut loaded): (Vec<&Point>, Vec<&Point>) =
        points.iter().partition(|p| p.load.abs() <= NONE * largest);
    if empty.is_empty() {
        return Ok(());
    }
    let zero = empty.iter().map(|p| p.reading).sum::<f64>() / empty.len() as f64;
    // The sensitivity from that zero on, and the residual sum of squares.
    let through_zero = |of: &[&Point]| {
        let squares: f64 = of.iter().map(|p| p.load * p.load).sum();
        let products: f64 = of.iter().map(|p| p.load * (p.reading - zero)).sum();
        let slope = products / squares;
        let left = of
            .iter()
            .map(|p| (p.reading - zero - slope * p.load).powi(2));
        (slope, left.sum::<f64>())
    };
    // So that the points below and above a load are those before and after it.
    sort_by_number(&mut loaded, |point| point.load.abs());
    let mut sizes: Vec<f64> = steps.loads.iter().map(|step| step.abs()).collect();
    sizes.retain(|size| *size > NONE * largest);
    sizes.sort_by(f64::total_cmp);
    sizes.dedup_by(|a, b| (*a - *b).abs() <= SAME * largest);
    let (slope, one_range) = through_zero(&loaded);
    let off = loaded
        .iter()
        .map(|p| (p.reading - zero - slope * p.load).abs());
    if off.fold(0.0, f64::max) < last_digits(points) {
        return Ok(());
    }
    let last = sizes.len().saturating_sub(FEWEST);
    let splits = sizes.get(FEWEST..=last).unwrap_or_default().iter();
    let with_split = |from: &f64| {
        let below = loaded.partition_point(|p| p.load.abs() < from - SAME * largest);
        let (below, above) = loaded.split_at(below);
        let ((low, left), (high, more)) = (through_zero(below), through_zero(above));
        (*from, high / low, left + more)
    };
    let best = splits.map(with_split).min_by(|a, b| a.2.total_cmp(&b.2));
    let Some((from, ratio, two_ranges)) = best else {
        return Ok(());
    };
    if two_ranges > TWO_RANGES.powi(2) * one_range || (ratio - 1.0).abs() < LEAST_CHANGE {
        return Ok(());
    }
    Err(ErrorCode::UnsuitableRecord.failed(format_args!(
        "the sensitivity jumps: at loads of {} and above it is {} times that at smaller loads, as with two ranges \
         of an amplifier; record all loads in one range, or evaluate the rows of each range separately",
        rounded(from, 4),
        rounded(ratio, 3)
    )))
}

/// Warns about readings that deviate from a curve of this degree.
pub(super) fn warn(
    result: &mut Identification,
    points: &[Point],
    curve: &[f64],
    steps: &LoadSteps,
) {
    let left = |i: &usize| points[*i].reading - value_of(curve, points[*i].load);
    let groups: Vec<Vec<f64>> = steps
        .iter()
        .map(|(_, rows)| rows.iter().map(left).collect())
        .collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let means: Vec<f64> = groups.iter().map(|group| mean(group)).collect();
    let about: Vec<f64> = groups
        .iter()
        .zip(&means)
        .flat_map(|(group, mean)| group.iter().map(move |v| v - mean))
        .collect();
    let count = steps.loads.len();
    let freedom = points.len().saturating_sub(count);
    if freedom == 0 || count < LEAST {
        return;
    }
    let scatter = rms(&about) * (about.len() as f64 / freedom as f64).sqrt();
    let deflection = (value_of(curve, steps.largest) - curve[0]).abs();
    let readings: Vec<f64> = points.iter().map(|p| p.reading).collect();
    // Rounding of equal readings is no scatter.
    let rounding = resolution(&readings).unwrap_or(0.0) / 12.0_f64.sqrt();
    let of_load = curve[1].abs() * steps.load_std;
    let expected = |rows: usize| (scatter / (rows as f64).sqrt()).max(rounding).max(of_load);
    let each = means.iter().zip(&groups);
    let off = each.map(|(mean, group)| (mean.abs(), expected(group.len())));
    let beyond = off.filter(|(off, expected)| *off > OFF.0 * expected && *off > OFF.1 * deflection);
    let Some((off, expected)) = beyond.max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return;
    };
    let why = match limit(&means, curve, steps) {
        Some(load) => format!(
            "the reading hardly rises beyond load {}: amplifier or recorder is at its limit; omit the loads beyond it, \
             and choose a larger range",
            rounded(load, 4)
        ),
        None => "the characteristic is nonlinear, or a load or reading is wrong: inspect the residual (--html), and \
            use --degree 3 if it is a smooth curve"
            .to_owned(),
    };
    result.warn(WarningCode::NotLinear.warning(format!(
        "a mean reading deviates from the curve by {} % of the deflection, {} what its scatter explains: {why}",
        rounded(100.0 * off / deflection, 2),
        match expected > 0.0 {
            true => format!("{} times", rounded(off / expected, 2)),
            false => "more than".to_owned(),
        }
    )));
}

/// The load above which the reading hardly rises, if it saturates; `means` are those of the residual.
fn limit(means: &[f64], curve: &[f64], steps: &LoadSteps) -> Option<f64> {
    let loads = &steps.loads;
    let rises = |from: usize, to: usize| {
        let rise = value_of(curve, loads[to]) - value_of(curve, loads[from]);
        (means[to] - means[from]) / rise + 1.0
    };
    let count = loads.len();
    let ends = [(count - 2, count - 1), (1, 0)];
    let mut loaded = ends
        .into_iter()
        .filter(|(_, to)| loads[*to].abs() > 0.5 * steps.largest);
    let (from, _) = loaded.find(|(from, to)| rises(*from, *to) < STANDS)?;
    Some(loads[from])
}
