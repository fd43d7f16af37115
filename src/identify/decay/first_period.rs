//! Start of a decay, where a filter of the recorder still responds to the hit, or the hammer is still in contact.

use super::modes::{ModesFit, Stretch};
use crate::identify::{Pole, rms};

/// Ratio of the residual in the first period to that in the next three, above which the decay is not free yet.
pub(super) const TOO_LARGE: f64 = 2.5;
/// The same if a line looks like a filter response.
pub(super) const LARGER: f64 = 1.2;
/// Number of periods that it is compared with.
const NEXT: usize = 3;
/// Minimum number of samples per period, and of periods in a decay.
const FEWEST: (usize, usize) = (6, 12);
/// Damping ratio, and decay exponent within a period of the neighbouring mode, above which a line is a transient rather
/// than a mode.
const TRANSIENT: (f64, f64) = (0.1, 3.0);

/// Whether a line next to a mode looks like a filter response, which decays within a period.
pub(super) fn is_transient(line: Pole, mode: Pole) -> bool {
    let decay = line.rate_per_s / mode.frequency_hz();
    let damping_ratio = line.rate_per_s / line.rate_per_s.hypot(line.omega_rad_per_s);
    line.omega_rad_per_s > mode.omega_rad_per_s
        && damping_ratio > TRANSIENT.0
        && decay > TRANSIENT.1
}

/// Removes the first period of the strongest mode from the segments in which the fit fails there; returns whether
/// there were any.
pub(super) fn cut_off(stretches: &mut [Stretch], found: &ModesFit, too_large: f64) -> bool {
    let order = found.by_strength(stretches.len());
    let Some(main) = order.first().map(|k| found.poles[*k]) else {
        return false;
    };
    let mut is_any = false;
    for (stretch, residuals) in stretches.iter_mut().zip(&found.residuals) {
        let period = (stretch.rate_hz() / main.frequency_hz()).ceil() as usize;
        let (least, periods) = FEWEST;
        // A line of almost no frequency has a period beyond any number of samples.
        let is_long = period >= least && residuals.len() / periods >= period;
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
