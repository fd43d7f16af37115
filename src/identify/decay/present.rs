//! Warnings, method and charts of a decay.

use super::modes::{ModesFit, Stretch};
use crate::chart::{Chart, Series};
use crate::identify::{self, Identification};
use crate::print::{plural, rounded};

/// Warns about what makes the fit doubtful.
pub(super) fn fit_warnings(result: &mut Identification, fit: &ModesFit) {
    if let Some(frequency_hz) = fit.close_hz {
        result.warn(
            "close-lines",
            format!(
                "the residual has a line within 3 % of {} Hz: a second mode close by (then give --modes), or a \
                 frequency or damping that changes with amplitude or time",
                rounded(frequency_hz, 4)
            ),
        );
    }
    for (k, pole) in fit.poles.iter().enumerate() {
        if fit.fit.at_bound[2 * k] {
            result.warn(
                "at-bound",
                format!(
                    "the damping of mode {} at {} Hz is not identifiable from this record (fitted: 0)",
                    k + 1,
                    rounded(pole.frequency_hz(), 5)
                ),
            );
        }
    }
    if !fit.fit.stop.converged() {
        result.warn("not-converged", "the fit did not converge");
    }
}

/// Residual of a free decay, over its swing, above which the fit is poor.
const POOR: f64 = 0.3;

/// Warns if the record is hardly a decay of those modes.
pub(super) fn poor(result: &mut Identification, relative: f64) {
    if relative > POOR {
        result.warn(
            "poor-fit",
            format!(
                "the residual is {} % of the swing: this is hardly a free decay; cut the record with --range to where \
                 nothing drives the stand, or choose another --channel",
                rounded(100.0 * relative, 2)
            ),
        );
    }
}

pub(super) fn method(fit: &ModesFit, stretches: usize) -> String {
    format!(
        "nonlinear least squares: {} over {}, {} samples, each stretch with an offset and a drift of its own",
        plural(fit.poles.len(), "decaying sine"),
        plural(stretches, "stretch"),
        fit.fit.residuals.len()
    )
}

/// Names the decay rates and frequencies that are strongly correlated.
pub(super) fn correlations(result: &mut Identification, fit: &ModesFit) {
    let name = |i: usize| {
        let what = ["decay rate", "frequency"][i % 2];
        let frequency = rounded(fit.poles[i / 2].frequency_hz(), 5);
        format!("{what} at {frequency} Hz")
    };
    let names: Vec<String> = (0..2 * fit.poles.len()).map(name).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let strong = identify::correlations(&names, &fit.fit.covariance);
    result.correlations.extend(strong);
}

/// The longest stretch with its fit, and the residual.
pub(super) fn draw(result: &mut Identification, fit: &ModesFit, stretches: &[Stretch]) {
    let Some(s) = (0..stretches.len()).max_by_key(|s| stretches[*s].values.len()) else {
        return;
    };
    let stretch = &stretches[s];
    let times: Vec<f64> = stretch
        .times_s
        .iter()
        .map(|t| t + stretch.start_s)
        .collect();
    let residual: Vec<f64> = fit.residuals[s].iter().map(|r| -r).collect();
    let both = vec![
        Series::line("data", &times, &stretch.values),
        Series::line("fit", &times, &fit.curve(stretches, s)),
    ];
    let rest = vec![Series::line("data − fit", &times, &residual)];
    result.charts.extend([
        Chart::new("Decay and fit", "time, s", "signal", both),
        Chart::new("Residual", "time, s", "signal", rest),
    ]);
}
