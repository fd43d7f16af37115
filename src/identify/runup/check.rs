//! Rejection of records without a run.

use std::borrow::Cow;

use super::{FreeRun, LEAST_WINDOWS, SHORTEST_HALF};
use crate::failure::{ErrorCode, Failure};
use crate::identify::{Motion, rms};
use crate::print::{rounded, short};
use torqcomp_dsp::quality::median;

/// Rejects records that are too short, have gaps, or are constant.
pub(super) fn check(run: &FreeRun) -> Result<(), Failure> {
    if run.motion.len() != run.effort.len() {
        return Err(ErrorCode::RecordsDiffer.failed(format_args!(
            "the motion has {} samples and the torque {}; both must come from one recording",
            run.motion.len(),
            run.effort.len()
        )));
    }
    let least = 2 * SHORTEST_HALF * LEAST_WINDOWS / 2;
    if run.motion.len() < least {
        return Err(ErrorCode::TooFewSamples.failed(format_args!(
            "{} samples are too few for a run-up; record at least {least}",
            run.motion.len()
        )));
    }
    for (what, samples) in [("motion", run.motion), ("torque", run.effort)] {
        if let Some(i) = samples.iter().position(|v| !v.is_finite()) {
            return Err(ErrorCode::InvalidSample.failed(format_args!(
                "sample {} of the {what} is not a finite number; cut the record there",
                i + 1
            )));
        }
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        if samples.iter().all(|v| *v == samples[0]) && (what == "motion" || mean == 0.0) {
            return Err(ErrorCode::NotIdentifiable.failed(format_args!(
                "the {what} does not change; nothing is identifiable from this record"
            )));
        }
    }
    Ok(())
}

/// Part of the rms speed that counts as motion in a direction.
const MOVES: f64 = 0.1;
/// Minimum number of samples between reversals: the shortest window, twice.
const LEAST_SWING: usize = 4 * SHORTEST_HALF;
/// Number from which the speed is resolved well.
const GOOD_SWING: usize = 2 * LEAST_SWING;
/// Minimum number of reversals with a typical distance.
const REVERSALS: usize = 3;

/// Median number of samples between reversals, if there are some and they are known.
fn samples_per_swing(run: &FreeRun) -> Option<usize> {
    let speed = match run.kind {
        Motion::Speed => Cow::Borrowed(run.motion),
        Motion::Displacement => {
            let steps = run.motion.windows(2);
            steps.map(|pair| pair[1] - pair[0]).collect()
        }
        Motion::Acceleration => return None,
    };
    let least = MOVES * rms(&speed);
    let (mut turns, mut before) = (Vec::new(), 0.0);
    for (i, v) in speed.iter().enumerate().filter(|(_, v)| v.abs() > least) {
        if v * before < 0.0 {
            turns.push(i);
        }
        before = *v;
    }
    let mut swings: Vec<f64> = turns
        .windows(2)
        .map(|pair| (pair[1] - pair[0]) as f64)
        .collect();
    match swings.len() + 1 >= REVERSALS {
        true => median(&mut swings).map(|median| median as usize),
        false => None,
    }
}

/// Rejects runs that reverse within so few samples that the averages span several reversals; returns a warning about those
/// whose reversals are barely resolved.
pub(super) fn swings(run: &FreeRun) -> Result<Option<String>, Failure> {
    let Some(samples) = samples_per_swing(run).filter(|samples| *samples < GOOD_SWING) else {
        return Ok(None);
    };
    let message = format!(
        "the body reverses about every {samples} samples, which does not show when, so that dry and viscous friction cannot be \
         told apart; record at {} Hz or more instead of {} Hz, or reverse less often",
        rounded(run.rate_hz * GOOD_SWING as f64 / samples as f64, 2),
        short(run.rate_hz)
    );
    match samples < LEAST_SWING {
        true => Err(ErrorCode::UnsuitableRecord.failed(message)),
        false => Ok(Some(message)),
    }
}
