//! Series or mountings whose sensitivities differ, as after a change of the gain.

use super::groups::Groups;
use super::linear::{LEAST_CHANGE, TWO_RANGES};
use super::mixed::last_digits;
use super::outlier::straight;
use super::{LoadUnits, NONE, Point};
use crate::failure::{ErrorCode, Failure};
use crate::print::rounded;

/// Minimum number of points of a line and its error.
const FEWEST: usize = 3;

/// A straight line through the points of one group.
struct GroupLine {
    /// Number of the group, from 1.
    number: usize,
    slope: f64,
    /// Sum of squared deviations of the loads from their mean.
    squares: f64,
    /// Sum of squared residuals.
    left: f64,
}

impl GroupLine {
    fn of(number: usize, points: &[Point]) -> Option<Self> {
        let count = points.len() as f64;
        let load = points.iter().map(|p| p.load).sum::<f64>() / count;
        let squares: f64 = points.iter().map(|p| (p.load - load).powi(2)).sum();
        let ([_, slope], left) = straight(points);
        (points.len() >= FEWEST && squares > 0.0).then_some(Self {
            number,
            slope,
            squares,
            left: count * left * left,
        })
    }
}

/// Rejects readings whose sensitivity changes from one series or mounting to another, each of which is a straight line.
///
/// # Errors
/// If it does.
pub(super) fn refuse(points: &[Point], largest: f64, units: &LoadUnits) -> Result<(), Failure> {
    let groups = Groups::of_sensitivity(points, largest);
    let mut members = vec![Vec::new(); groups.count().max(1)];
    // A gain changes the zero as well, and readings of it are of the series before or after.
    let rows = points.iter().zip(&groups.of_row);
    for (point, group) in rows.filter(|(point, _)| point.load.abs() > NONE * largest) {
        members[*group].push(*point);
    }
    let lines = (1..).zip(&members);
    let lines = lines.filter_map(|(number, points)| GroupLine::of(number, points));
    let lines: Vec<GroupLine> = lines.collect();
    let by_slope = |a: &&GroupLine, b: &&GroupLine| a.slope.total_cmp(&b.slope);
    let ends = lines
        .iter()
        .min_by(by_slope)
        .zip(lines.iter().max_by(by_slope));
    let Some((low, high)) = ends.filter(|_| lines.len() > 1) else {
        return Ok(());
    };
    let sum = |of: fn(&GroupLine) -> f64| lines.iter().map(of).sum::<f64>();
    let slope = sum(|line| line.slope * line.squares) / sum(|line| line.squares);
    let own = sum(|line| line.left);
    // With one slope for all, and a zero for each.
    let apart = lines
        .iter()
        .map(|line| line.squares * (line.slope - slope).powi(2));
    let common = own + apart.sum::<f64>();
    let change = (high.slope - low.slope) / low.slope.abs().max(high.slope.abs());
    let is_rounding = common < points.len() as f64 * last_digits(points).powi(2);
    // With loads or readings of one sign, the two directions are no two gains.
    let is_turned = low.slope * high.slope <= 0.0;
    if is_rounding || is_turned || own > TWO_RANGES.powi(2) * common || change < LEAST_CHANGE {
        return Ok(());
    }
    let [first, second] = match low.number < high.number {
        true => [low, high],
        false => [high, low],
    };
    let what = match points.iter().all(|p| p.position == points[0].position) {
        true => "series",
        false => "mounting",
    };
    let unit = format!("{}/({})", units.reading, units.load);
    Err(ErrorCode::UnsuitableRecord.failed(format_args!(
        "the sensitivity changes from one {what} to another: {} {unit} in {what} {} and {} {unit} in {what} {}, as after a \
         change of gain, range or bridge supply; evaluate the rows of each {what} in a table of its own, or scale the \
         readings to one gain",
        rounded(first.slope, 4),
        first.number,
        rounded(second.slope, 4),
        second.number,
    )))
}
