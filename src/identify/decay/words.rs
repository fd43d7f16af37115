//! Names of what a decay tells, and its drawings.

use std::f64::consts::TAU;

use super::modes::{ModesFit, Stretch};
use crate::identify::{Correlated, Found, Outcome, STRONG};
use crate::print::rounded;
use crate::report::chart::{Chart, Series};

/// Frequency, damping and natural frequency of a mode with their uncertainties, (C7) to (C14).
pub(super) fn name_mode(
    outcome: &mut Outcome,
    fit: &ModesFit,
    k: usize,
    place: usize,
    count: usize,
) {
    let pole = fit.poles[k];
    let (sigma, omega) = (pole.rate_per_s, pole.omega_rad_per_s);
    let natural = sigma.hypot(omega);
    let covariance = &fit.fit.covariance;
    let std = |by_sigma: f64, by_omega: f64| {
        let mut gradient = vec![0.0; fit.fit.values.len()];
        gradient[2 * k] = by_sigma;
        gradient[2 * k + 1] = by_omega;
        covariance.std_of(&gradient)
    };
    let name = |text: &str| match count {
        1 => text.to_owned(),
        _ => format!("mode_{}_{text}", place + 1),
    };
    // ζ = σ/ω_n: ∂ζ/∂σ = ω²/ω_n³, ∂ζ/∂ω = −σω/ω_n³.
    let cube = natural.powi(3);
    let rows = [
        ("damped_frequency", omega / TAU, std(0.0, 1.0 / TAU), "Hz"),
        ("decay_rate", sigma, std(1.0, 0.0), "1/s"),
        (
            "damping_ratio",
            sigma / natural,
            std(omega * omega / cube, -sigma * omega / cube),
            "",
        ),
        (
            "natural_frequency",
            natural / TAU,
            std(sigma / natural / TAU, omega / natural / TAU),
            "Hz",
        ),
    ];
    for (text, value, std, unit) in rows {
        outcome.found.push(Found::new(name(text), value, std, unit));
    }
}

/// What makes the numbers doubtful.
pub(super) fn doubts(outcome: &mut Outcome, fit: &ModesFit) {
    if let Some(frequency_hz) = fit.close_hz {
        outcome.warn(
            "close-lines",
            format!(
                "what is left holds a line within 3 % of {} Hz: a second mode close by (then give --modes), \
                 or a frequency or damping that changes with amplitude or time",
                rounded(frequency_hz, 4)
            ),
        );
    }
    for (k, pole) in fit.poles.iter().enumerate() {
        if fit.fit.at_bound[2 * k] {
            outcome.warn(
                "at-bound",
                format!(
                    "mode {} at {} Hz does not decay in this record: its damping is not told",
                    k + 1,
                    rounded(pole.omega_rad_per_s / TAU, 5)
                ),
            );
        }
    }
    if !fit.fit.stop.converged() {
        outcome.warn(
            "not-converged",
            "the fit stopped before it reached its minimum",
        );
    }
}

/// Part of the swing that a free decay may leave.
const POOR: f64 = 0.3;

/// Says if the record is hardly a decay of those modes.
pub(super) fn poor(outcome: &mut Outcome, relative: f64) {
    if relative > POOR {
        outcome.warn(
            "poor-fit",
            format!(
                "{} % of the swing is left: this is hardly a free decay; cut the record to where nothing drives the \
                 stand with --range, or look at another --channel",
                rounded(100.0 * relative, 2)
            ),
        );
    }
}

/// Says which numbers are hard to tell apart.
pub(super) fn correlations(outcome: &mut Outcome, fit: &ModesFit) {
    let count = 2 * fit.poles.len();
    let name = |i: usize| {
        let what = if i.is_multiple_of(2) {
            "decay rate"
        } else {
            "frequency"
        };
        format!(
            "{what} at {} Hz",
            rounded(fit.poles[i / 2].omega_rad_per_s / TAU, 5)
        )
    };
    for i in 0..count {
        for j in i + 1..count {
            if let Some(coefficient) = fit.fit.correlation(i, j).filter(|c| c.abs() >= STRONG) {
                outcome.correlated.push(Correlated {
                    first: name(i),
                    second: name(j),
                    coefficient,
                });
            }
        }
    }
}

/// The longest stretch with its fit, and what is left.
pub(super) fn draw(outcome: &mut Outcome, fit: &ModesFit, stretches: &[Stretch], starts_s: &[f64]) {
    let Some(s) = (0..stretches.len()).max_by_key(|s| stretches[*s].values.len()) else {
        return;
    };
    let times: Vec<f64> = stretches[s]
        .times_s
        .iter()
        .map(|t| t + starts_s[s])
        .collect();
    let left: Vec<f64> = fit.residuals[s].iter().map(|r| -r).collect();
    let both = vec![
        Series::line("data", &times, &stretches[s].values),
        Series::line("fit", &times, &fit.curve(stretches, s)),
    ];
    outcome
        .charts
        .push(Chart::new("Decay and fit", "time, s", "signal", both));
    let rest = vec![Series::line("data less fit", &times, &left)];
    outcome
        .charts
        .push(Chart::new("Residual", "time, s", "signal", rest));
}
