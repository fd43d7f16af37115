//! Modes that the fitted lines determine: those within their reach, and with a measurable damping.

use std::f64::consts::TAU;

use super::blocks::Set;
use super::{Data, Effort, FinalFit, Modal, foreign};
use crate::failure::{ErrorCode, Failure};
use crate::identify::{Identification, Pole};
use crate::print::rounded;
use crate::warning::WarningCode;

/// The fit with the modes that are determined: within reach, and for a stand file (`is_grounded`) damped.
///
/// # Errors
/// If no mode is left.
pub(super) fn determined(
    (set, data): (&Set, &Data),
    coarse: Modal,
    (leads, is_grounded, is_given): (bool, bool, bool),
    result: &mut Identification,
) -> Result<Modal, Failure> {
    let reached = reached(data, coarse, (leads, is_given), result)?;
    match is_grounded {
        true => damped(set, data, reached, result),
        false => Ok(reached),
    }
}

/// Rejects a fit that has modes out of reach only.
///
/// # Errors
/// If it has.
pub(super) fn must_reach(
    (set, data): (&Set, &Data),
    fitted: &FinalFit,
    is_given: bool,
) -> Result<(), Failure> {
    match foreign::is_none_reached(&fitted.modal, &fitted.covariance, set) {
        true => Err(none(data, fitted.modal.poles.first(), is_given)),
        false => Ok(()),
    }
}

/// The fit without modes above the fitted lines that these do not determine: a response without a resonance bends
/// upwards as below any resonance, at whatever frequency. `leads` records have wrong channels, which is reported later.
///
/// # Errors
/// If no mode is left.
fn reached(
    data: &Data,
    coarse: Modal,
    (leads, is_given): (bool, bool),
    result: &mut Identification,
) -> Result<Modal, Failure> {
    let (_, highest) = data.band_rad_per_s();
    let is_above = |pole: &Pole| pole.rate_per_s.hypot(pole.omega_rad_per_s) > highest;
    if leads || !coarse.poles.iter().any(is_above) {
        return Ok(coarse);
    }
    let mut kept = data.fit(&coarse.poles, coarse.delay_s, Effort::Fine)?;
    let mut left_out = Vec::new();
    while let Some(k) = kept.poles.iter().position(|p| foreign::is_beyond(&kept, p)) {
        let mut starts = kept.poles.clone();
        let pole = starts.remove(k);
        if starts.is_empty() {
            return Err(none(data, Some(&pole), is_given));
        }
        left_out.push(rounded(foreign::natural_hz(&pole), 5));
        kept = data.fit(&starts, kept.delay_s, Effort::Fine)?;
    }
    if left_out.is_empty() {
        return Ok(coarse);
    }
    result.warn(WarningCode::ModeOutOfReach.warning(format!(
        "the fit had modes at {} Hz, above the fitted lines, which end at {} Hz and do not determine them: they are \
         dropped; excite higher frequencies, or choose fewer --modes",
        left_out.join(", "),
        rounded(highest / TAU, 3)
    )));
    Ok(kept)
}

/// The failure if the fitted lines reach no resonance, with the mode that the fit put above them.
pub(super) fn none(data: &Data, above: Option<&Pole>, is_given: bool) -> Failure {
    let fitted = above.map_or_else(String::new, |pole| {
        let hz = rounded(foreign::natural_hz(pole), 3);
        format!(" (the fit put one at {hz} Hz, above the fitted lines, which do not determine it)")
    });
    let band = match is_given {
        true => "raise the upper end of --band, ",
        false => "",
    };
    ErrorCode::NotIdentifiable.failed(format_args!(
        "the response shows no resonance up to {} Hz, where the excitation or the band ends{fitted}: only the static \
         gain is in these data; {band}excite higher frequencies (a harder hammer tip, faster steps, a sweep to above \
         the resonance), or take natural frequency and damping from a free decay (identify decay) and the \
         calibration from known loads (identify static)",
        rounded(data.band_rad_per_s().1 / TAU, 3)
    ))
}

/// The fit without modes whose damping is not identifiable from these records: they are caused by noise and
/// nonlinearity, and in a stand file they would ring forever.
fn damped(
    set: &Set,
    data: &Data,
    coarse: Modal,
    result: &mut Identification,
) -> Result<Modal, Failure> {
    let (mut starts, delay_s) = (coarse.poles, coarse.delay_s);
    let mut left_out = Vec::new();
    loop {
        let fitted = data.fit(&starts, delay_s, Effort::Fine)?;
        let undamped = fitted
            .poles
            .iter()
            .position(|pole| foreign::is_undamped(pole, set));
        let Some(undamped) = undamped else {
            foreign::undamped(result, &left_out);
            return Ok(fitted);
        };
        if starts.len() == 1 {
            return Err(ErrorCode::NotIdentifiable.failed(foreign::NONE));
        }
        starts = fitted.poles;
        left_out.push(rounded(starts.remove(undamped).frequency_hz(), 5));
    }
}
