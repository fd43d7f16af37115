//! Warnings, method and charts of a decay.

use super::modes::{ModesFit, Stretch};
use super::search::SteadyLine;
use crate::chart::{Chart, Series};
use crate::failure::Failure;
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

fn listed(lines: &[SteadyLine]) -> String {
    let each = |line: &SteadyLine| {
        let [frequency, amplitude] =
            [(line.frequency_hz, 5), (line.amplitude, 2)].map(|(v, digits)| rounded(v, digits));
        format!("{frequency} Hz (amplitude {amplitude})")
    };
    // What is left of a line after the first fit is the same line.
    let is_same = |a: &SteadyLine, b: &SteadyLine| (a.frequency_hz - b.frequency_hz).abs() < 0.5;
    let first = |(i, line): &(usize, &SteadyLine)| !lines[..*i].iter().any(|l| is_same(l, line));
    let different = lines.iter().enumerate().filter(first);
    let each: Vec<String> = different.map(|(_, line)| each(line)).collect();
    each.join(", ")
}

/// Why a record has no mode.
pub(super) fn no_mode(lines: &[SteadyLine]) -> Failure {
    let but = match lines {
        [] => String::new(),
        _ => format!(" beside the steady lines of the mains at {}", listed(lines)),
    };
    Failure::failed(format_args!(
        "no decaying sine stands out of the noise{but}; check the channel, or cut the record to the decay with --range (a \
         stand that is damped so much that it does not swing gives no decay: use identify response)"
    ))
}

/// Warns about lines of the mains, which were taken off.
pub(super) fn lines(result: &mut Identification, lines: &[SteadyLine]) {
    if !lines.is_empty() {
        result.warn(
            "mains-taken-off",
            format!(
                "steady lines of the mains were fitted and taken off: {}; if one of them is the stand's own, record for \
                 longer, until it has decayed",
                listed(lines)
            ),
        );
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
