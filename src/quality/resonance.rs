//! Whether a record rings as a stand file says.

use std::cell::LazyCell;
use std::f64::consts::TAU;

use torqcomp_dsp::peaks::without_steady;
use torqcomp_dsp::quality::resonance::{dominant_resonance, other_damping, other_resonance};
use torqcomp_dsp::quality::ringing::ringing_elsewhere;

use crate::print::rounded;
use crate::warning::{Warning, WarningCode};

/// A warning if a record rings elsewhere than at the declared natural frequencies in Hz, or there with another damping
/// ratio.
pub(crate) fn warning(samples: &[f64], rate_hz: f64, modes: &[(f64, f64)]) -> Option<Warning> {
    let declared_hz = modes.first()?.0;
    // The orders of a machine hide what rings between its steps.
    let steady = LazyCell::new(|| without_steady(samples, rate_hz));
    let rings = |samples: &[f64]| {
        other_resonance(samples, rate_hz, modes)
            .or_else(|| ringing_elsewhere(samples, rate_hz, modes))
    };
    let elsewhere = rings(samples)
        .or_else(|| dominant_resonance(samples, rate_hz, modes))
        .or_else(|| rings(steady.as_deref()?));
    if let Some(found) = elsewhere {
        return Some(WarningCode::ResonanceElsewhere.warning(format!(
            "the record has a resonance at {} Hz (damping ratio about {}) and none at {} Hz, the natural frequency in \
             the stand file{}: if it is the stand's, the result is wrong. Record a tap on the stand as it is and \
             determine its constants with identify decay; if it is the machine's, ignore this",
            rounded(found.frequency_hz, 3),
            rounded(found.damping_ratio, 1),
            rounded(declared_hz, 4),
            of_turns(declared_hz, found.frequency_hz).unwrap_or_default()
        )));
    }
    let &[declared] = modes else {
        return None;
    };
    let damped = |samples: &[f64]| other_damping(samples, rate_hz, declared);
    let found = damped(samples).or_else(|| damped(steady.as_deref()?))?;
    Some(WarningCode::DampingDiffers.warning(format!(
        "the resonance of the record at {} Hz has a damping ratio of about {}, {} in the stand file: if it is the \
         stand's, the result is wrong by up to their ratio near that frequency. Record a tap on the stand as it is \
         and determine its constants with identify decay",
        rounded(found.frequency_hz, 3),
        rounded(found.damping_ratio, 1),
        rounded(declared.1, 3)
    )))
}

/// Largest relative deviation of the ratio of two frequencies from 2π.
const TURNS: f64 = 0.05;

/// Note if rad/s and Hz seem to be confused.
fn of_turns(declared_hz: f64, found_hz: f64) -> Option<String> {
    let is_turn = |ratio: f64| (ratio / TAU - 1.0).abs() < TURNS;
    let [declared, found] = [declared_hz, found_hz].map(|hz| rounded(hz, 4));
    if is_turn(declared_hz / found_hz) {
        Some(format!(
            ", which is about 2 pi times as high ({declared} rad/s is {} Hz; was it written in Hz?)",
            rounded(declared_hz / TAU, 4)
        ))
    } else if is_turn(found_hz / declared_hz) {
        Some(format!(
            ", which is about 2 pi times as low ({found} rad/s is {} Hz; was it divided by 2 pi twice?)",
            rounded(found_hz / TAU, 4)
        ))
    } else {
        None
    }
}
