//! Warnings, method and charts of a decay.

use super::anew::Beginning;
use super::modes::{ModesFit, Stretch};
use crate::chart::{Chart, Series};
use crate::failure::{ErrorCode, Failure};
use crate::identify::hum::{SteadyLine, listed};
use crate::identify::{self, Identification, Pole};
use crate::print::{plural, rounded};
use crate::warning::{Warning, WarningCode};

/// Warns about reasons to doubt the fit.
pub(super) fn fit_warnings(result: &mut Identification, fit: &ModesFit) {
    if let Some(frequency_hz) = fit.close_hz {
        result.warn(WarningCode::CloseLines.warning(format!(
            "the residual has a line within 3 % of {} Hz: a second mode close by (then give --modes), or frequency \
             or damping that changes with amplitude or time",
            rounded(frequency_hz, 4)
        )));
    }
    for (k, pole) in fit.poles.iter().enumerate() {
        if fit.fit.at_bound[2 * k] {
            result.warn(WarningCode::AtBound.warning(format!(
                "the damping of mode {} at {} Hz is not identifiable from this record (fitted: 0)",
                k + 1,
                rounded(pole.frequency_hz(), 5)
            )));
        }
    }
    if !fit.fit.stop.converged() {
        result.warn(WarningCode::NotConverged.warning("the fit did not converge"));
    }
}

/// Error for a record without a mode.
pub(super) fn no_mode(lines: &[SteadyLine]) -> Failure {
    let but = match lines {
        [] => String::new(),
        _ => format!(
            " beside the steady lines of the mains at {}; if one of them is the stand's own, record for longer, until it \
             has decayed",
            listed(lines)
        ),
    };
    ErrorCode::NotIdentifiable.failed(format_args!(
        "no decaying sine stands out from the noise{but}; check the channel, or cut the record to the decay with \
         --range (a stand that is damped so much that it does not swing gives no decay: use identify response)"
    ))
}

/// Maximum number of restarts listed.
const NAMED: usize = 5;

/// Warning about decays that restart, and the consequence.
pub(super) fn restart(times_s: &[f64], consequence: &str) -> Option<Warning> {
    if times_s.is_empty() {
        return None;
    }
    let named = times_s.iter().take(NAMED).map(|t| rounded(*t, 5));
    let named: Vec<String> = named.collect();
    let more = match times_s.len() > NAMED {
        true => " and later",
        false => "",
    };
    Some(WarningCode::RestartInDecay.warning(format!(
        "the ringing starts again at {} s{more}: a second hit, lost samples, or the end of an overload; {consequence}",
        named.join(", ")
    )))
}

/// Warnings about decays that begin anew, and what follows from each kind.
pub(super) fn beginnings(all: &[Beginning], [restarted, driven]: [&str; 2]) -> Vec<Warning> {
    let times = |rings: bool| {
        let of_kind = all.iter().filter(move |b| b.rings_before == rings);
        of_kind.map(|b| b.time_s).collect::<Vec<_>>()
    };
    let driven = times(false).last().map(|last_s| {
        WarningCode::DrivenAtFirst.warning(format!(
            "up to {} s the motion is not the free decay that follows, but driven (by a soft push, a hand, or a load that \
             is let go slowly); {driven}",
            rounded(*last_s, 5)
        ))
    });
    restart(&times(true), restarted)
        .into_iter()
        .chain(driven)
        .collect()
}

/// Relative frequency difference of modes that may be one mode of two stands.
const NEAR: f64 = 0.25;
/// Amplitude of a mode in a decay in which another one rings in its place, relative to that where
/// it rings.
pub(super) const ABSENT: f64 = 0.1;

/// Warns if decays show different modes in place of one.
pub(super) fn apart(result: &mut Identification, fit: &ModesFit, stretches: usize) {
    let modes = 0..fit.poles.len();
    let rings =
        |k: usize, s: usize, other: usize| fit.amplitude(k, other) < ABSENT * fit.amplitude(k, s);
    let hz = |k: usize| fit.poles[k].frequency_hz();
    let is_apart = |(k, l): &(usize, usize)| {
        let is_near = (hz(*k) / hz(*l) - 1.0).abs() < NEAR;
        let decays = (0..stretches).flat_map(|s| (0..stretches).map(move |t| (s, t)));
        is_near
            && decays
                .into_iter()
                .any(|(s, t)| rings(*k, s, t) && rings(*l, t, s))
    };
    let mut pairs = modes
        .clone()
        .flat_map(|k| modes.clone().map(move |l| (k, l)));
    if let Some((k, l)) = pairs.find(|pair| pair.0 < pair.1 && is_apart(pair)) {
        result.warn(WarningCode::DecaysApart.warning(format!(
            "some decays ring at {} Hz and others at {} Hz, none at both: the stand was changed between them, or \
             they are of different stands; identify them one by one",
            rounded(hz(k), 5),
            rounded(hz(l), 5)
        )));
    }
}

/// Relative distance from the strongest mode within which a stand has few others, and their minimum number.
const CROWD: (f64, usize) = (0.3, 4);

/// Warns about more modes about the strongest one than a stand has.
pub(super) fn crowded(result: &mut Identification, fit: &ModesFit, main: usize) {
    let hz = fit.poles[main].frequency_hz();
    let (distance, least) = CROWD;
    let is_near = |pole: &&Pole| (pole.frequency_hz() / hz - 1.0).abs() < distance;
    let others = fit.poles.iter().filter(is_near).count() - 1;
    if others >= least {
        result.warn(WarningCode::CrowdedModes.warning(format!(
            "{others} modes lie within {} % of the strongest one at {} Hz: a single mode that is stopped by dry friction \
             looks like this where another mode rings beside it; filter that out with the upper end of --band",
            rounded(100.0 * distance, 2),
            rounded(hz, 5)
        )));
    }
}

/// Residual of a free decay, relative to its oscillation in the first time constant, above which
/// the fit is poor.
const POOR: f64 = 0.3;
/// The same where the residual falls with the oscillation, and ratio of the residual during the decay to
/// that after it.
const FALLING: (f64, f64) = (0.03, 4.0);
/// The same with a removed baseline.
const FALLING_BESIDE: (f64, f64) = (0.0, 1.3);
/// Time constants after which a decay has ended, and minimum duration of a longer one.
const RUNG: f64 = 3.0;

/// Warns if the record does not look like a decay of those modes.
pub(super) fn poor(
    result: &mut Identification,
    fit: &ModesFit,
    stretches: &[Stretch],
    (main, has_baseline): (usize, bool),
) {
    let relative = while_ringing(fit, stretches, main);
    let told = ["not-viscous", "amplitude-dependent", "close-lines"];
    let is_told = result.warnings.iter().any(|w| told.contains(&w.code));
    let falls = falls(fit, stretches, main);
    let least = if has_baseline {
        FALLING_BESIDE
    } else {
        FALLING
    };
    if relative > POOR {
        result.warn(WarningCode::PoorFit.warning(format!(
            "the residual is {} % of the decay: this is hardly free ringing; select a part where nothing drives \
             the stand with --range, or choose another --channel",
            rounded(100.0 * relative, 2)
        )));
    } else if relative > least.0 && falls > least.1 && !is_told {
        result.warn(WarningCode::PoorFit.warning(format!(
            "the residual, {} % of the decay, is {} times as large while the stand rings as afterwards: it is not \
             noise, but something else set off by the hit (an amplifier that is AC coupled or near its limit, a \
             part that rattles), and frequency and damping are less certain than their std says",
            rounded(100.0 * relative, 2),
            rounded(falls, 2)
        )));
    }
}

/// Residual relative to the oscillation in the first time constant of the segments; afterwards there is only
/// noise.
fn while_ringing(fit: &ModesFit, stretches: &[Stretch], main: usize) -> f64 {
    let rung_s = 1.0 / fit.poles[main].rate_per_s.max(f64::MIN_POSITIVE);
    let (mut residual, mut swing) = (Vec::new(), Vec::new());
    for (s, stretch) in stretches.iter().enumerate() {
        let rung = stretch.times_s.partition_point(|t| *t < rung_s);
        residual.extend_from_slice(&fit.residuals[s][..rung]);
        swing.extend_from_slice(&fit.swing(stretches, s)[..rung]);
    }
    identify::rms(&residual) / identify::rms(&swing)
}

/// Ratio of the residual of the first segment during the decay to that after it; 0 if the segment
/// ends before.
fn falls(fit: &ModesFit, stretches: &[Stretch], main: usize) -> f64 {
    let rung_s = RUNG / fit.poles[main].rate_per_s.max(f64::MIN_POSITIVE);
    let ratio = |(stretch, residuals): (&Stretch, &Vec<f64>)| {
        let rung = stretch.times_s.partition_point(|t| *t < rung_s);
        let (early, late) = residuals.split_at(rung);
        match late.len() > rung {
            true => identify::rms(early) / identify::rms(late).max(f64::MIN_POSITIVE),
            false => 0.0,
        }
    };
    let pairs = stretches.iter().zip(&fit.residuals);
    pairs.map(ratio).fold(0.0, f64::max)
}

pub(super) fn method(fit: &ModesFit, stretches: usize) -> String {
    let motion = match fit.has_friction {
        true => "one mode with viscous damping and dry friction".to_owned(),
        false => plural(fit.poles.len(), "decaying sine"),
    };
    format!(
        "nonlinear least squares: {motion} over {}, {} samples, each stretch with its own offset and drift",
        plural(stretches, "stretch"),
        fit.fit.residuals.len()
    )
}

/// Note about samples after the stop.
pub(super) fn stops(recorded: &[Stretch], moving: &[Stretch]) -> Option<String> {
    let pairs = recorded.iter().zip(moving);
    let stopped: Vec<String> = pairs
        .filter(|(all, moving)| moving.end_s() < all.end_s())
        .map(|(_, moving)| rounded(moving.end_s(), 5))
        .take(NAMED)
        .collect();
    (!stopped.is_empty()).then(|| {
        format!(
            "the stand is stopped by dry friction at {} s; samples of the rest after it are excluded",
            stopped.join(", ")
        )
    })
}

/// Note about a removed baseline.
pub(super) const BASELINE: &str = "the zero moves during the decay (an amplifier that is AC coupled or settles, a part \
    that warms up): it was fitted with a smooth curve and subtracted";

/// Reports strongly correlated decay rates and frequencies.
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

/// Plots the longest segment with its fit, and the residual.
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
