//! The start of a decay, where a filter of the recorder still follows the hit, or the hammer is still in contact.

use super::modes::{ModesFit, Stretch};
use crate::identify::{Pole, rms};

/// Residual in the first period of a decay, over that in the next three, above which it is not free ringing yet.
pub(super) const TOO_LARGE: f64 = 2.5;
/// The same where a line is there that looks like the answer of a filter.
pub(super) const LARGER: f64 = 1.2;
/// Periods that it is compared with.
const NEXT: usize = 3;
/// Fewest samples in a period, and periods in a decay, with which it is looked at.
const FEWEST: (usize, usize) = (6, 12);
/// Damping ratio and decay within a period of the mode beside it, as an exponent, above which a line is no mode, but this.
const TRANSIENT: (f64, f64) = (0.1, 3.0);

/// Whether a line beside a mode looks like the answer of a filter, which is gone within a period.
pub(super) fn is_transient(line: Pole, mode: Pole) -> bool {
    let decay = line.rate_per_s / mode.frequency_hz();
    let damping_ratio = line.rate_per_s / line.rate_per_s.hypot(line.omega_rad_per_s);
    line.omega_rad_per_s > mode.omega_rad_per_s
        && damping_ratio > TRANSIENT.0
        && decay > TRANSIENT.1
}

/// Cuts the first period of the strongest mode off the stretches in which the fit fails there. Whether there were any.
pub(super) fn cut_off(stretches: &mut [Stretch], found: &ModesFit, too_large: f64) -> bool {
    let order = found.by_strength(stretches.len());
    let Some(main) = order.first().map(|k| found.poles[*k]) else {
        return false;
    };
    let mut is_any = false;
    for (stretch, residuals) in stretches.iter_mut().zip(&found.residuals) {
        let period = (stretch.rate_hz() / main.frequency_hz()).ceil() as usize;
        let (least, periods) = FEWEST;
        let is_long = period >= least && residuals.len() >= periods * period;
        let fails = || {
            let next = rms(&residuals[period..(1 + NEXT) * period]);
            rms(&residuals[..period]) > too_large * next
        };
        if is_long && stretch.bands_hz.is_empty() && fails() {
            *stretch = stretch.later(period);
            is_any = true;
        }
    }
    is_any
}
