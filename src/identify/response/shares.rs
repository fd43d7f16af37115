//! Contribution of each mode to the response of a stand: residues relative to the static response.
//!
//! ```text
//! R/(s − p) + R*/(s − p*) = (r + q s/ω_n) ω_n²/(s² + 2σ s + ω_n²),   r = −2 Re(R/p),   q = 2 Re R/ω_n
//! ```
//!
//! and `r` and `q` are divided by the static response, the sum of all `r` and of `c₁`.

use std::f64::consts::TAU;

use torqcomp_model::{Estimate, Estimates};

use super::{FinalFit, foreign};
use crate::identify::{MODE_NUMBERS, ModalShares, NamedEstimates};

/// Units of the numbers of a mode.
const UNITS: [&str; 4] = ["Hz", "", "", ""];

/// Contributions of all modes, in ascending order of frequency; `None` if the static response is
/// zero.
pub(super) fn of(found: &FinalFit, order: i32) -> Option<ModalShares> {
    let modal = &found.modal;
    let at_rest = modal.at_rest();
    if at_rest == 0.0 || !at_rest.is_finite() || !foreign::has_rest(modal) {
        return None;
    }
    let mut numbers = vec![0.0; found.linear + modal.linear().len()];
    for (k, pole) in modal.poles.iter().enumerate() {
        numbers[2 * k] = pole.rate_per_s;
        numbers[2 * k + 1] = pole.omega_rad_per_s;
    }
    numbers[found.linear..].copy_from_slice(modal.linear());
    let numbers = Estimates::new(numbers, found.covariance.clone());
    let named: Vec<(&str, &str)> = MODE_NUMBERS.into_iter().zip(UNITS).collect();
    let mode = |k: usize| {
        let (values, gradients) = of_mode(found, k, numbers.values().len());
        NamedEstimates::new(&named, &numbers.derive_by(values.to_vec(), &gradients))
    };
    let scale = modal.scale().powi(-order);
    Some(ModalShares {
        modes: modal.of_stand().into_iter().map(mode).collect(),
        gain: Estimate::of(
            "",
            at_rest * scale,
            found.static_gain_std.map(|std| std * scale),
        ),
    })
}

/// The numbers of a mode, and their gradients with respect to poles, delay and linear parameters.
fn of_mode(found: &FinalFit, k: usize, count: usize) -> ([f64; 4], [Vec<f64>; 4]) {
    let modal = &found.modal;
    let at_rest = modal.at_rest();
    let (p, residue) = modal.pole_and_residue(k);
    let (size, scale) = (p.norm(), modal.scale());
    let natural = size * scale;
    let ratio = -p.re / size;
    let r = -2.0 * (residue / p).re / at_rest;
    let q = 2.0 * residue.re / size / at_rest;
    let (of_poles, of_linear) = modal.slopes_at_rest();
    let (sigma, omega) = (-p.re / size, p.im / size);
    let (pole, linear) = (2 * k, found.linear + 2 * k);
    let mut rows = [const { Vec::new() }; 4].map(|_: Vec<f64>| vec![0.0; count]);
    rows[0][pole] = sigma / TAU;
    rows[0][pole + 1] = omega / TAU;
    rows[1][pole] = omega * omega / natural;
    rows[1][pole + 1] = -sigma * omega / natural;
    // Both residues are divided by the static response.
    for (row, share) in [(2, r), (3, q)] {
        for (to, slope) in rows[row].iter_mut().zip(&of_poles) {
            *to = -share * slope / at_rest;
        }
        for (to, slope) in rows[row][found.linear..].iter_mut().zip(&of_linear) {
            *to = -share * slope / at_rest;
        }
    }
    for i in 0..2 {
        rows[2][pole + i] += of_poles[2 * k + i] / at_rest;
        rows[2][linear + i] += of_linear[2 * k + i] / at_rest;
    }
    rows[3][pole] -= q * sigma / natural;
    rows[3][pole + 1] -= q * omega / natural;
    rows[3][linear] += 2.0 / size / at_rest;
    ([natural / TAU, ratio, r, q], rows)
}
