//! Angles that wrap, as from an absolute encoder that begins again after each turn.

use std::borrow::Cow;
use std::f64::consts::{PI, TAU};

use super::{Body, FreeRun, Motion};
use crate::failure::{ErrorCode, Failure};
use crate::print::{plural, rounded};

/// Maximum share of steps that are wraps; a body that turns by more than half a turn per sample is not one that wraps.
const SHARE: f64 = 1.0 / 3.0;
/// Largest step of a continuous angle in rad, of which the sign is certain.
const CONTINUOUS: f64 = 0.5 * PI;

/// A continuous angle, and the number of wraps; other motions are unchanged.
///
/// # Errors
/// If the angle jumps by other than whole turns.
pub(super) fn continuous<'a>(run: &FreeRun<'a>) -> Result<(Cow<'a, [f64]>, usize), Failure> {
    let is_angle = run.body == Body::Turning && run.kind == Motion::Displacement;
    let steps = || run.motion.windows(2).map(|pair| pair[1] - pair[0]);
    let jumps = steps().filter(|step| step.abs() > CONTINUOUS).count();
    if !is_angle || jumps == 0 || jumps as f64 > SHARE * run.motion.len() as f64 {
        return Ok((run.motion.into(), 0));
    }
    let mut turns = 0.0;
    let mut wraps = 0;
    let mut angles = vec![run.motion[0]];
    for (i, step) in steps().enumerate() {
        let whole = (step / TAU).round();
        if (step - TAU * whole).abs() > CONTINUOUS {
            return Err(ErrorCode::UnsuitableRecord.failed(format_args!(
                "the angle jumps by {} rad between samples {} and {}: it wraps and cannot be made continuous; \
                 record it continuously or at a higher rate, and without interpolation over the wraps",
                rounded(step, 4),
                i + 1,
                i + 2
            )));
        }
        if whole != 0.0 {
            (turns, wraps) = (turns - whole, wraps + 1);
        }
        angles.push(run.motion[i + 1] + TAU * turns);
    }
    Ok((angles.into(), wraps))
}

/// Describes the wraps.
pub(super) fn method(wraps: usize) -> Option<String> {
    (wraps > 0).then(|| {
        format!(
            "the angle wraps {}: whole turns were added there, so that it is continuous",
            plural(wraps, "time")
        )
    })
}
