//! A large residual: of a single row that is off the line of all others, as with a mistyped load, or of all.

use super::mixed::last_digits;
use super::ramp::line;
use super::{LoadUnits, Point, value_of};
use crate::identify::{Identification, rms};
use crate::print::{self, rounded};
use crate::warning::WarningCode;

/// Minimum number of points.
const LEAST: usize = 6;
/// Residual without the point, relative to that with it, below which it is off, and its smallest distance in residuals
/// of the others and in deflections at the largest load.
const WITHOUT: f64 = 0.2;
const FAR: (f64, f64) = (10.0, 2e-3);

/// Residual of a calibration, relative to the range of the readings, above which the fit is poor.
const POOR: f64 = 0.05;

fn poor(result: &mut Identification, relative: f64) {
    if relative > POOR {
        result.warn(WarningCode::PoorFit.warning(format!(
            "the residual is {} of the range of the readings: check the columns, the load and reading of each row, and \
             that the rows are in the order in which they were taken; --degree 3 helps only if the readings follow a \
             smooth curve (--html)",
            print::relative(relative, 2)
        )));
    }
}

/// Warns about a large residual, relative to the range of the readings, or about the one point that causes it. Points are
/// rows of the table, or means of them.
pub(super) fn warn(
    result: &mut Identification,
    points: &[Point],
    (of_rows, relative): ((usize, bool), f64),
    units: &LoadUnits,
) {
    match off_line(points, of_rows, units) {
        Some(off) => {
            result.warn(WarningCode::RowOffLine.warning(format!("{off}; the constants include it")))
        }
        None => poor(result, relative),
    }
}

/// Text about the point without which all others lie on a line, if there is one.
pub(super) fn off_line(
    points: &[Point],
    (degree, is_by_rows): (usize, bool),
    units: &LoadUnits,
) -> Option<String> {
    if points.len() < LEAST || degree != 1 {
        return None;
    }
    let without = |left_out: usize| {
        let others = points.iter().enumerate().filter(|(i, _)| *i != left_out);
        straight(&others.map(|(_, point)| *point).collect::<Vec<_>>())
    };
    let (_, all) = straight(points);
    let lines = (0..points.len()).map(|i| (i, without(i)));
    let (place, (line, rest)) = lines.min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let point = points[place];
    let off = (point.reading - value_of(&line, point.load)).abs();
    let largest = points.iter().fold(0.0_f64, |m, p| m.max(p.load.abs()));
    let is_off = rest < WITHOUT * all
        && off > FAR.0 * rest
        && off > FAR.1 * (line[1] * largest).abs()
        && off > last_digits(points);
    if !is_off {
        return None;
    }
    let which = match is_by_rows {
        true => format!("row {}, ", place + 1),
        false => String::new(),
    };
    Some(format!(
        "{which}load {} {}, reading {} {}, is {} {} off the line of all others, which lie within {} {} (rms): check its \
         load and reading",
        rounded(point.load, 5),
        units.load,
        rounded(point.reading, 5),
        units.reading,
        rounded(off, 2),
        units.reading,
        rounded(rest, 1),
        units.reading
    ))
}

/// Zero and slope of the straight line through points, and its residual; not a number where all loads are the same.
pub(super) fn straight(points: &[Point]) -> ([f64; 2], f64) {
    let line = line(points);
    let left: Vec<f64> = points
        .iter()
        .map(|p| p.reading - value_of(&line, p.load))
        .collect();
    (line, rms(&left))
}
