//! Orders indistinguishable from mains lines.

use torqcomp_dsp::Error;
use torqcomp_dsp::harmonics::{Fundamental, fit, refine_fundamental};
use torqcomp_dsp::store::SampleStore;

use super::speed::is_sure;
use super::{ComponentTorque, named};
use crate::print::short;
use crate::warning::{Warning, WarningCode};

/// Mains orders checked.
const MAINS_LINES: f64 = 5.0;
/// Largest relative difference of a frequency from that of the mains for both to be called the same.
const OFF: f64 = 0.01;
/// Mains frequencies.
const GRIDS_HZ: [f64; 2] = [50.0, 60.0];

/// The mains of which a line is at a frequency, as far as a record of that duration shows it.
fn grids_with_a_line_at(frequency_hz: f64, duration_s: f64) -> impl Iterator<Item = f64> {
    GRIDS_HZ.into_iter().filter(move |grid_hz| {
        let line_hz = (frequency_hz / grid_hz).round().clamp(1.0, MAINS_LINES) * grid_hz;
        (frequency_hz - line_hz).abs() < 1.0 / duration_s
    })
}

/// Whether such a line is at a frequency.
pub(super) fn is_at_mains(frequency_hz: f64, duration_s: f64) -> bool {
    grids_with_a_line_at(frequency_hz, duration_s)
        .next()
        .is_some()
}

/// The fundamental within a relative range around a given one. If only orders that mains lines may be show it, it is that
/// by the other orders: a strong line of the mains near the highest order would decide it alone.
///
/// # Errors
/// As for [`refine_fundamental`].
pub(super) fn refine(
    samples: &(impl SampleStore + ?Sized),
    rate_hz: f64,
    (start_hz, span): (f64, f64),
    orders: &[f64],
) -> Result<Fundamental, Error> {
    let of_all = refine_fundamental(samples, rate_hz, start_hz, span, orders);
    let may_be_mains = |order: &f64| {
        let lines = (1..=MAINS_LINES as u32).map(f64::from);
        let mut lines = lines.flat_map(|k| GRIDS_HZ.map(|grid_hz| k * grid_hz));
        lines.any(|line_hz| (line_hz / (order * start_hz) - 1.0).abs() < span + OFF)
    };
    let (mains, others): (Vec<f64>, Vec<f64>) = orders.iter().partition(|o| may_be_mains(o));
    if mains.is_empty() || others.is_empty() {
        return of_all;
    }
    let duration_s = samples.count() as f64 / rate_hz;
    let is_shown = |found: &Fundamental| {
        let fitted = fit(samples, rate_hz, 0.0, *found, orders);
        fitted.is_ok_and(|fitted| {
            let mut components = fitted.components.iter();
            components.any(|c| is_sure(c) && !is_at_mains(c.frequency_hz, duration_s))
        })
    };
    if of_all.as_ref().is_ok_and(is_shown) {
        return of_all;
    }
    match refine_fundamental(samples, rate_hz, start_hz, span, &others) {
        Ok(found) if is_shown(&found) => Ok(found),
        _ => of_all,
    }
}

/// Orders at the frequencies of mains lines, indistinguishable in one record. If the fundamental is that of the mains,
/// one warning is given.
pub(super) fn warning(components: &[ComponentTorque], duration_s: f64) -> Option<Warning> {
    let fundamental_hz = components.first().map(|c| c.frequency_hz / c.order)?;
    let of_grid = |grid_hz: &f64| (fundamental_hz - grid_hz).abs() < 1.0 / duration_s;
    if let Some(grid_hz) = GRIDS_HZ.into_iter().find(of_grid) {
        let which = match (fundamental_hz - grid_hz).abs() < OFF * grid_hz {
            true => format!("the fundamental is that of {grid_hz} Hz mains"),
            false => format!(
                "{} s do not separate the fundamental of {} Hz from {grid_hz} Hz mains",
                short(duration_s),
                short(fundamental_hz)
            ),
        };
        return Some(WarningCode::OrderOrMains.warning(format!(
            "{which}, so any order may contain mains pickup: record once with the motor off and the supply on, and \
             subtract its lines"
        )));
    }
    let doubtful: Vec<String> = components
        .iter()
        .filter(|c| c.order > 1.0 && c.torque > 5.0 * c.std)
        .filter(|c| {
            let is_slower = |grid_hz: f64| c.frequency_hz / c.order < 0.9 * grid_hz;
            grids_with_a_line_at(c.frequency_hz, duration_s).any(is_slower)
        })
        .map(|c| format!("{} ({:.2} Hz)", short(c.order), c.frequency_hz))
        .collect();
    (!doubtful.is_empty()).then(|| {
        WarningCode::OrderOrMains.warning(format!(
            "mains lines coincide with {} and cannot be separated at a single speed: record at another speed, \
             which moves the orders but not the mains lines",
            named(&doubtful)
        ))
    })
}
