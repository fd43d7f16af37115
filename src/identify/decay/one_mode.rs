//! Whether one mode with dry friction describes decays as well as several modes, or as decays that begin anew.
//!
//! Dry friction widens the line of a mode and ends its decay. A sum of decaying sines follows this only with several modes
//! about the true one, or piece by piece; [`super::friction`] does with one more parameter.

use num_complex::Complex64;
use torqcomp_model::fit::FitError;

use super::anew::{AS_GOOD, BETTER};
use super::attempt::{self, Attempt, COMPARABLE};
use super::friction::{self, OF_STRETCH, SlidingMotion};
use super::modes::{self, ModesFit, Stretch};
use super::search::{ModeSearch, largest, next_pole, physical, search};
use crate::identify::hum::SteadyLine;
use crate::identify::{Pole, rms};

/// Minimum share of the power explained by several modes, beyond that of one decaying sine, that dry friction explains, too.
/// A weak second mode is not dry friction.
const EXPLAINED: f64 = 0.95;
/// Minimum number of samples, and of periods, of a decay up to its stop.
const LEAST: (usize, f64) = (40, 2.0);
/// Residual in the first half period, in standard deviations of the rest, of samples that precede the free decay: the last
/// ones of a preload, or of the contact with the hammer.
const NOT_FREE: f64 = 5.0;

/// Number of periods after which a segment is tried to begin: samples of a preload before its release are not those of a free
/// decay.
const LATER: [f64; 2] = [0.0, 1.0];

/// One mode with dry friction, and the segments up to the stop.
type Moving = (ModesFit, Vec<Stretch>);

/// Number of modes from which a decay may be one mode with dry friction.
pub(super) const SEVERAL: usize = 2;

/// One mode with dry friction, if it describes the recorded segments as well as this fit of as few modes, which a search
/// was limited to, and leaves only noise.
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn at_once(
    several: (&ModesFit, &[Stretch]),
    recorded: &[Stretch],
    few: &ModeSearch,
) -> Result<Option<Moving>, FitError> {
    let Some((one, moving)) = instead(several, recorded, few)? else {
        return Ok(None);
    };
    let is_noise = attempt::leaves_noise(&one, &moving, few)?;
    Ok(is_noise.then_some((one, moving)))
}

/// Two modes in place of one with dry friction, and their segments, if they leave a clearly smaller residual, which is
/// noise: two modes close together beat, and their envelope may fall to zero like that of a stand that stops.
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn two_instead<'a>(
    (one, moving): (&ModesFit, &[Stretch]),
    recorded: &[Stretch],
    (wanted, lines): (&ModeSearch, &'a [SteadyLine]),
) -> Result<Option<(Attempt<'a>, Vec<Stretch>)>, FitError> {
    let two = ModeSearch {
        count: Some(SEVERAL),
        ..*wanted
    };
    let mut stretches = recorded.to_vec();
    let found = search(&mut stretches, &two, lines)?;
    let sizes = [0, 1].map(|k| match k < found.fit.poles.len() {
        true => largest(&found.fit, k, &stretches),
        false => 0.0,
    });
    let is_better = while_moving((&found.fit, &stretches), moving) < BETTER * one.fit.rms;
    let is_taken = is_better
        && sizes[0].min(sizes[1]) > COMPARABLE * sizes[0].max(sizes[1])
        && physical(&found.fit, &stretches, &[])
        && attempt::leaves_noise(&found.fit, &stretches, wanted)?;
    Ok(is_taken.then_some((found, stretches)))
}

/// One mode with dry friction, if it describes the recorded segments as well as a fit of several modes or of later parts.
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn instead(
    several: (&ModesFit, &[Stretch]),
    recorded: &[Stretch],
    wanted: &ModeSearch,
) -> Result<Option<Moving>, FitError> {
    if recorded.iter().any(|stretch| !stretch.bands_hz.is_empty()) {
        return Ok(None);
    }
    let Some(line) = next_pole(recorded, &modes::fit(recorded, &[])?, wanted.band_hz) else {
        return Ok(None);
    };
    for periods in LATER {
        let lead_s = periods / line.frequency_hz();
        let first = |stretch: &Stretch| stretch.times_s.partition_point(|t| *t < lead_s);
        if recorded.iter().any(|s| first(s) + LEAST.0 > s.values.len()) {
            break;
        }
        let later: Vec<Stretch> = recorded.iter().map(|s| s.later(first(s))).collect();
        let found = of_friction(&later, line)?;
        if let Some((one, free, sine)) = found
            && is_as_good(&one, &sine, while_moving(several, &free))
            && rests(recorded, &one, &free)?
        {
            return Ok(Some((one, free)));
        }
    }
    Ok(None)
}

/// One mode with dry friction, its segments, and a decaying sine fitted to these, near a line; `None` if there are too few
/// samples.
fn of_friction(
    recorded: &[Stretch],
    line: Pole,
) -> Result<Option<(ModesFit, Vec<Stretch>, ModesFit)>, FitError> {
    let sine = modes::fit(recorded, &[line])?;
    let start = (sine.poles[0], &sine.fit.values[2..]);
    let Ok(first) = friction::fit(recorded, start, true) else {
        return Ok(None);
    };
    let Some(moving) = moving(recorded, &first.values) else {
        return Ok(None);
    };
    let mut one = friction::continued(&moving, &first.values)?;
    let free = free(&moving, &one);
    if free != moving {
        one = friction::continued(&free, &later(&one, (&moving, &free)))?;
    }
    let sine = modes::fit(&free, &sine.poles)?;
    Ok(Some((one, free, sine)))
}

/// Whether dry friction explains as much as several modes with this residual.
fn is_as_good(one: &ModesFit, sine: &ModesFit, several: f64) -> bool {
    let explained = sine.fit.rms.powi(2) - one.fit.rms.powi(2);
    let by_several = sine.fit.rms.powi(2) - several.powi(2);
    let is_dry = one
        .fit
        .values
        .last()
        .is_some_and(|friction| *friction > 0.0);
    is_dry && one.fit.rms < AS_GOOD * several && explained > EXPLAINED * by_several
}

/// The segments up to the stop; `None` if one is too short.
fn moving(stretches: &[Stretch], parameters: &[f64]) -> Option<Vec<Stretch>> {
    let until_stop = |(s, stretch): (usize, &Stretch)| {
        let end_s = stretch.times_s.last()?;
        let stop_s = SlidingMotion::of(parameters, s)
            .stop_s(*end_s)
            .unwrap_or(*end_s);
        let part = stretch.until(stop_s);
        let periods = stop_s * parameters[1] / std::f64::consts::TAU;
        (part.values.len() >= LEAST.0 && periods >= LEAST.1).then_some(part)
    };
    stretches.iter().enumerate().map(until_stop).collect()
}

/// The segments without first samples that do not belong to the free decay.
fn free(moving: &[Stretch], one: &ModesFit) -> Vec<Stretch> {
    let half_s = std::f64::consts::PI / one.poles[0].omega_rad_per_s;
    let of_each = |(stretch, residuals): (&Stretch, &Vec<f64>)| {
        let half = stretch.times_s.partition_point(|t| *t < half_s);
        let (first, rest) = residuals.split_at(half);
        let least = NOT_FREE * rms(rest);
        let last = first.iter().rposition(|residual| residual.abs() > least);
        last.map_or_else(|| stretch.clone(), |last| stretch.later(last + 1))
    };
    moving.iter().zip(&one.residuals).map(of_each).collect()
}

/// The parameters of a fit, with the displacement and quadrature at the start of later segments.
fn later(one: &ModesFit, (before, after): (&[Stretch], &[Stretch])) -> Vec<f64> {
    let mut values = one.fit.values.clone();
    let pole = one.poles[0];
    let of_each = values[2..]
        .chunks_exact_mut(OF_STRETCH)
        .zip(before.iter().zip(after));
    for (own, (before, after)) in of_each {
        let passed_s = after.start_s - before.start_s;
        let turn = Complex64::new(-pole.rate_per_s, pole.omega_rad_per_s) * passed_s;
        let phasor = Complex64::new(own[0], -own[1]) * turn.exp();
        (own[0], own[1]) = (phasor.re, -phasor.im);
    }
    values
}

/// Rms residual of a fit at the times of these segments; of all if it has none of them.
fn while_moving((found, kept): (&ModesFit, &[Stretch]), moving: &[Stretch]) -> f64 {
    let moves = |time_s: f64| {
        let mut all = moving.iter();
        all.any(|stretch| (stretch.start_s..stretch.end_s()).contains(&time_s))
    };
    let pairs = kept.iter().zip(&found.residuals);
    let within = pairs.flat_map(|(stretch, residuals)| {
        let pairs = stretch.times_s.iter().zip(residuals);
        pairs
            .filter(|(t, _)| moves(stretch.start_s + **t))
            .map(|(_, residual)| *residual)
    });
    let within: Vec<f64> = within.collect();
    match within.len() < LEAST.0 {
        true => found.fit.rms,
        false => rms(&within),
    }
}

/// Whether the stand no longer swings by more than the friction after the stop.
///
/// # Errors
/// [`FitError`] if the rest has too few samples.
fn rests(recorded: &[Stretch], one: &ModesFit, moving: &[Stretch]) -> Result<bool, FitError> {
    let friction = one.fit.values.last().copied().unwrap_or(0.0);
    let reach = (AS_GOOD * one.fit.rms).hypot(friction);
    for (recorded, moving) in recorded.iter().zip(moving) {
        let stop_s = moving.end_s();
        let stop = recorded
            .times_s
            .partition_point(|t| recorded.start_s + t <= stop_s);
        let after = stop..recorded.values.len();
        // About offset and drift of its own.
        if after.len() >= LEAST.0 && modes::fit(&[recorded.part(after)], &[])?.fit.rms > reach {
            return Ok(false);
        }
    }
    Ok(true)
}
