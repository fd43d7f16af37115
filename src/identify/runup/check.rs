//! Rejection of records without a run.

use super::{FreeRun, LEAST_WINDOWS, SHORTEST_HALF};
use crate::failure::{ErrorCode, Failure};

/// Rejects records that are too short, have gaps, or are constant.
pub(super) fn check(run: &FreeRun) -> Result<(), Failure> {
    if run.motion.len() != run.effort.len() {
        return Err(Failure::failed(
            ErrorCode::RecordsDiffer,
            format_args!(
                "the motion has {} samples and the torque {}; both must come from one recording",
                run.motion.len(),
                run.effort.len()
            ),
        ));
    }
    let least = 2 * SHORTEST_HALF * LEAST_WINDOWS / 2;
    if run.motion.len() < least {
        return Err(Failure::failed(
            ErrorCode::TooFewSamples,
            format_args!(
                "{} samples are too few for a run-up; record at least {least}",
                run.motion.len()
            ),
        ));
    }
    for (what, samples) in [("motion", run.motion), ("torque", run.effort)] {
        if let Some(i) = samples.iter().position(|v| !v.is_finite()) {
            return Err(Failure::failed(
                ErrorCode::InvalidSample,
                format_args!(
                    "sample {} of the {what} is not a finite number; cut the record there",
                    i + 1
                ),
            ));
        }
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        if samples.iter().all(|v| *v == samples[0]) && (what == "motion" || mean == 0.0) {
            return Err(Failure::failed(
                ErrorCode::NotIdentifiable,
                format_args!(
                    "the {what} does not change; nothing is identifiable from this record"
                ),
            ));
        }
    }
    Ok(())
}
