//! Fitted modes that do not belong to the stand: from drift, AC coupling or steady tones, or outside the frequency
//! range of the records.
//!
//! A record AC-coupled through a high-pass s/(s + a) has the response H(s) − H(s) a/(s + a): that of the stand, and one
//! more pole far below. Drift next to a hit looks the same. Such a pole is needed in the fit, but does not belong to
//! the static response of the stand.

use std::f64::consts::TAU;

use torqcomp_model::Covariance;

use super::blocks::Set;
use super::modal::{ABOVE, Modal};
use crate::failure::{ErrorCode, Failure};
use crate::identify::{Identification, Pole, overtone};
use crate::print::rounded;
use crate::warning::WarningCode;

/// Damping ratio above which a mode far below the others does not ring.
const RINGS: f64 = 0.3;
/// Natural frequency of such a mode, relative to the strongest, below which it is coupling or drift.
const FAR_BELOW: f64 = 0.1;
/// Number of lines of a block up to which a mode counts as such.
const SLOW: f64 = 10.0;
/// Minimum distance of a mode's decay rate from zero in standard uncertainties, and minimum decay exponent within a
/// block; either is sufficient.
const DECAYS: (f64, f64) = (2.0, 0.3);

/// Reason why a mode does not belong to the stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Foreign {
    /// Slower than a block resolves, or much slower than the others without ringing.
    Drift,
    /// Above all frequencies of the records.
    OutOfReach,
    /// Without identifiable damping.
    Steady,
}

/// Natural frequency in Hz.
pub(super) fn natural_hz(pole: &Pole) -> f64 {
    pole.rate_per_s.hypot(pole.omega_rad_per_s) / TAU
}

/// Damping ratio above which a mode above the fitted band does not ring in it.
const OVERDAMPED: f64 = 0.95;
/// Fraction of the highest frequency of the search from which a mode is at its end.
const AT_END: f64 = 0.999;

/// Whether a mode lies above the fitted band and does not ring: what is left of a delay or a filter.
fn is_out_of_band(modal: &Modal, pole: &Pole) -> bool {
    let natural = TAU * natural_hz(pole);
    natural > modal.highest_rad_per_s && pole.rate_per_s > OVERDAMPED * natural
}

/// Largest standard uncertainty of decay rate and frequency of a mode above the fitted band, relative to its natural
/// frequency.
const KNOWN: f64 = 0.1;

/// Whether a mode lies above the fitted band and does not follow from it: at the end of the search, without damping, or
/// without ringing in the band.
pub(super) fn is_beyond(modal: &Modal, pole: &Pole) -> bool {
    let omega = pole.omega_rad_per_s;
    let is_at_end = omega > AT_END * ABOVE * modal.highest_rad_per_s;
    let is_undamped = omega > modal.highest_rad_per_s && pole.rate_per_s == 0.0;
    is_at_end || is_undamped || is_out_of_band(modal, pole)
}

/// Whether no mode belongs to the stand, and one is out of reach.
pub(super) fn is_none_reached(modal: &Modal, covariance: &Covariance, set: &Set) -> bool {
    let found = kinds(modal, covariance, set);
    !found.contains(&None) && found.contains(&Some(Foreign::OutOfReach))
}

/// Whether a model has such a mode.
pub(super) fn has_out_of_band(modal: &Modal) -> bool {
    modal.poles.iter().any(|pole| is_out_of_band(modal, pole))
}

/// Whether a mode has no damping and is not drift.
pub(super) fn is_undamped(pole: &Pole, set: &Set) -> bool {
    pole.rate_per_s == 0.0 && natural_hz(pole) >= set.step_hz
}

/// Marks the modes that do not belong to the stand, unless none would be left.
pub(super) fn mark(modal: &mut Modal, covariance: &Covariance, set: &Set) {
    let found = kinds(modal, covariance, set);
    if found.contains(&None) {
        modal.foreign = found;
    }
}

/// The mode with the largest resonance; one that rings, if any does.
pub(super) fn strongest(modal: &Modal) -> Option<usize> {
    (0..modal.poles.len()).max_by(|a, b| {
        let size = |k: usize| modal.residue(k).0.norm() / modal.poles[k].rate_per_s.max(1e-12);
        let rings =
            |k: usize| modal.poles[k].rate_per_s < RINGS * TAU * natural_hz(&modal.poles[k]);
        (rings(*a), size(*a))
            .partial_cmp(&(rings(*b), size(*b)))
            .unwrap_or(std::cmp::Ordering::Equal)
    })
}

fn kinds(modal: &Modal, covariance: &Covariance, set: &Set) -> Vec<Option<Foreign>> {
    let highest_hz = set.step_hz * (set.lines - 1) as f64;
    let strongest_hz = strongest(modal).map_or(0.0, |k| natural_hz(&modal.poles[k]));
    let one = |(k, pole): (usize, &Pole)| {
        let natural_hz = natural_hz(pole);
        let is_slow = natural_hz < FAR_BELOW * strongest_hz
            && natural_hz < SLOW * set.step_hz
            && pole.rate_per_s > RINGS * TAU * natural_hz;
        let is_uncertain = covariance
            .std(2 * k)
            .is_some_and(|std| pole.rate_per_s < DECAYS.0 * std);
        let is_steady = is_uncertain && pole.rate_per_s < DECAYS.1 * set.step_hz;
        let natural = TAU * natural_hz;
        let is_above = natural > modal.highest_rad_per_s;
        let mut stds = [2 * k, 2 * k + 1]
            .into_iter()
            .filter_map(|i| covariance.std(i));
        let is_unknown = stds.any(|std| std > KNOWN * natural);
        if natural_hz < set.step_hz || is_slow {
            Some(Foreign::Drift)
        } else if natural_hz > highest_hz || is_beyond(modal, pole) || is_above && is_unknown {
            Some(Foreign::OutOfReach)
        } else if pole.rate_per_s == 0.0 || is_steady {
            Some(Foreign::Steady)
        } else {
            None
        }
    };
    modal.poles.iter().enumerate().map(one).collect()
}

/// Whether the fit determines the static response: a mode out of reach may take any part of it.
pub(super) fn has_rest(modal: &Modal) -> bool {
    !modal.foreign.contains(&Some(Foreign::OutOfReach))
}

/// Warns about the excluded modes.
///
/// # Errors
/// If a stand file is to be written and no mode is damped.
pub(super) fn warn(
    result: &mut Identification,
    modal: &Modal,
    is_written: bool,
) -> Result<(), Failure> {
    if is_written && modal.poles.iter().all(|pole| pole.rate_per_s == 0.0) {
        return Err(ErrorCode::NotIdentifiable.failed(NONE));
    }
    let of_kind = |kind: Foreign| -> Vec<String> {
        let all = modal.poles.iter().zip(&modal.foreign);
        let chosen = all.filter(|(_, found)| **found == Some(kind));
        chosen
            .map(|(pole, _)| rounded(natural_hz(pole), 5))
            .collect()
    };
    let drift = of_kind(Foreign::Drift);
    if !drift.is_empty() {
        result.warn(WarningCode::AcCoupledOrDrift.warning(format!(
            "the fit needs a slow component, at {} Hz: a channel drifts or is AC coupled; it is excluded from the \
             modes and from the static gain, which then rests on the modes alone; record both channels with DC \
             coupling, or check the static gain with a weight",
            drift.join(", ")
        )));
    }
    let beyond = of_kind(Foreign::OutOfReach);
    if !beyond.is_empty() {
        result.warn(WarningCode::ModeOutOfReach.warning(format!(
            "the fit has a mode at {} Hz, above all frequencies of the records: it is dropped, and the static gain \
             is not determined; narrow the --band, or choose fewer --modes",
            beyond.join(", ")
        )));
    }
    undamped(result, &of_kind(Foreign::Steady));
    Ok(())
}

/// Warns about modes without damping, by their frequencies.
pub(super) fn undamped(result: &mut Identification, frequencies_hz: &[String]) {
    if !frequencies_hz.is_empty() {
        result.warn(WarningCode::UndampedLeftOut.warning(format!(
            "the modes at {} Hz have no measurable damping in these data and are dropped: a steady tone (mains, a \
             fan), noise or a nonlinear stand causes such modes; switch off the source, choose fewer --modes, or \
             record at one level and for longer",
            frequencies_hz.join(", ")
        )));
    }
}

/// Warns about modes that are distortion of the strongest.
pub(super) fn tell_overtones(result: &mut Identification, modal: &Modal) {
    let Some(main) = strongest(modal) else {
        return;
    };
    let size = |k: usize| modal.residue(k).0.norm();
    let shares: Vec<f64> = (0..modal.poles.len())
        .map(|k| size(k) / size(main))
        .collect();
    let advice = "excite the stand less, or set the amplifier to a wider range";
    overtone::warn(result, &modal.poles, main, &shares, advice);
}

/// Note if no mode belongs to the stand.
pub(super) const NONE: &str =
    "no mode has measurable damping in these records; record for longer, or choose another --band";
