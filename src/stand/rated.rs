//! What the rated torque of a transducer says against a record.

use crate::print::{rounded, short};
use crate::warning::Warning;

/// Part of the rated torque from which a torque is doubtful: it is about what transducers stand without damage.
const FAR_BEYOND: f64 = 1.5;
/// Part of the rated torque below which a torque is doubtful: it is about the error of a transducer of class 0.5.
const FAR_BELOW: f64 = 5e-3;

/// A warning if a torque lies far beyond what the transducer is rated for, or far below, both in a unit.
pub fn off_rated(largest: f64, rated: Option<f64>, unit: &str) -> Option<Warning> {
    let rated = rated?;
    if largest > 0.0 && largest < FAR_BELOW * rated {
        return Some(Warning::new(
            "below-rated-torque",
            format!(
                "the torque stays within {} {unit}, {} % of the transducer's rated torque of {} {unit}, as if the \
                 record were not amplified by the stand's gain, or in another unit: check unit and gain of the \
                 channel",
                rounded(largest, 3),
                rounded(100.0 * largest / rated, 2),
                short(rated)
            ),
        ));
    }
    if largest <= FAR_BEYOND * rated {
        return None;
    }
    Some(Warning::new(
        "beyond-rated-torque",
        format!(
            "the torque reaches {} {unit}, {} times the transducer's rated torque of {} {unit}: check unit, gain and \
             zero of the channel",
            short(largest),
            rounded(largest / rated, 3),
            short(rated)
        ),
    ))
}
