//! Plausibility of a record against the rated torque of a transducer.

use crate::print::{rounded, short};
use crate::warning::{Warning, WarningCode};

/// Torque relative to the rated one above which it is doubtful: about the safe overload of transducers.
const FAR_BEYOND: f64 = 1.5;
/// Torque relative to the rated one below which it is doubtful: about the error of a class 0.5 transducer.
const FAR_BELOW: f64 = 5e-3;

/// A warning if a torque is far above or below the rated one, both in the same unit.
pub fn off_rated(largest: f64, rated: Option<f64>, unit: &str) -> Option<Warning> {
    let rated = rated?;
    if largest > 0.0 && largest < FAR_BELOW * rated {
        return Some(WarningCode::BelowRatedTorque.warning(format!(
            "the torque stays within {} {unit}, {} % of the transducer's rated torque of {} {unit}, as if the \
             record were not amplified by the stand's gain, or in another unit: check unit and gain of the \
             channel",
            rounded(largest, 3),
            rounded(100.0 * largest / rated, 2),
            short(rated)
        )));
    }
    if !is_far_beyond_rated(largest, rated) {
        return None;
    }
    Some(WarningCode::BeyondRatedTorque.warning(format!(
        "the torque reaches {} {unit}, {} times the transducer's rated torque of {} {unit}: check unit, gain and \
         zero of the channel",
        short(largest),
        rounded(largest / rated, 3),
        short(rated)
    )))
}

/// Whether a torque is far above the rated one.
pub fn is_far_beyond_rated(largest: f64, rated: f64) -> bool {
    largest > FAR_BEYOND * rated
}
