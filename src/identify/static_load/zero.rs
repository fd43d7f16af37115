//! Zero of the readings without load.

use super::mixed::LoadCurve;
use super::{NONE, Point};
use crate::identify::{Identification, rms};
use crate::print::{self, rounded};
use crate::student::student;
use crate::warning::WarningCode;

/// Standard uncertainties beyond which the zero of the curve contradicts the readings without load.
const CONTRADICTS: f64 = 2.0;

/// Limits the uncertainty of the zero from below by what the readings without load show: that of their mean if the zero
/// drifts randomly, as it is known only while it is read, and their difference from the curve if they contradict it, as
/// with a hysteresis that closes without load.
pub(super) fn limit_std(fit: &mut LoadCurve, points: &[Point], largest: f64) {
    let Some(mut std) = fit.std[0] else {
        return;
    };
    let readings: Vec<f64> = without_load(points, largest).map(|p| p.reading).collect();
    let count = readings.len() as f64;
    let mean = readings.iter().sum::<f64>() / count;
    let about: Vec<f64> = readings.iter().map(|r| r - mean).collect();
    if fit.spreads.drift > 0.0 {
        std = std.max(match readings.len() {
            0 | 1 => fit.spreads.drift,
            _ => rms(&about) / (count - 1.0).sqrt() * student(count - 1.0),
        });
    }
    let off = (fit.values[0] - mean).abs();
    if readings.len() > 1 && off > CONTRADICTS * std {
        std = off;
    }
    fit.std[0] = Some(std);
}

/// Minimum reported drift of the reading without load, relative to the largest deflection.
const DRIFTS: f64 = 5e-3;

/// Warns about a zero that differs at the end of the test.
pub(super) fn drifting(
    result: &mut Identification,
    fit: &LoadCurve,
    points: &[Point],
    (largest, unit): (f64, &str),
) {
    let mut empty = without_load(points, largest);
    let Some((first, last)) = empty.next().zip(empty.next_back()) else {
        return;
    };
    let deflection = points.iter().map(|p| (p.reading - first.reading).abs());
    let part = (last.reading - first.reading).abs() / deflection.fold(0.0, f64::max);
    let is_walk = fit.has_even_drift || fit.spreads.drift > 0.0;
    if is_walk && part > DRIFTS {
        result.warn(WarningCode::ZeroDrifts.warning(format!(
            "the zero reading drifted from {} to {} {unit} over the test, by {} of the largest deflection: the \
             fitted zero is that of the middle of the test and does not apply to other records; allow a longer \
             warm-up, and read the zero of each record",
            rounded(first.reading, 4),
            rounded(last.reading, 4),
            print::relative(part, 2)
        )));
    }
}

/// The points without load, in the order in which they were read.
pub(super) fn without_load(
    points: &[Point],
    largest: f64,
) -> impl DoubleEndedIterator<Item = &Point> {
    points
        .iter()
        .filter(move |p| p.load.abs() <= NONE * largest)
}
