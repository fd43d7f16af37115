//! A channel that lags the other by so much that no fit of a delay can start from zero: from a quarter of a period of the
//! strongest line on, as with two recorders.

use std::cmp::Ordering;
use std::f64::consts::PI;

use num_complex::Complex64;
use torqcomp_dsp::frf::Estimator;

use super::blocks::Set;
use super::{Driven, shift};
use crate::failure::Failure;
use crate::identify::{Identification, NamedEstimate};

/// Part of the largest envelope of the impulse response at which it begins.
const BEGINS: f64 = 0.5;
/// Lag in periods of the strongest line from which the channels are aligned first.
const PERIODS: f64 = 0.25;
/// Ratio of residuals up to which they are equal. A lag is believed if it saves modes with an equal residual, or gives a
/// smaller one: a square wave is the same half a period later with the other sign.
const AS_GOOD: f64 = 1.02;

/// Samples by which the measured channel lags, negative if it leads; 0 for less than a fit of a delay finds.
///
/// The impulse response `h(τ) = Σ H(f) e^{j2πfτ}` of the band begins there. Its envelope is that of the analytic signal,
/// from the same sum with `−jH`.
pub(super) fn lag(set: &Set) -> isize {
    let frf = set.powers.response(Estimator::H1);
    let count = 2 * (set.lines - 1);
    let share = |k: usize| (k - set.band.start) as f64 / set.band.len() as f64;
    // Tapered towards the top of the band, so that it does not ring.
    let weight = |k: usize| frf.coherence[k] * (0.5 * PI * share(k)).cos().powi(2);
    let inverse = torqcomp_fourier::inverse(count);
    let transformed = |turn: Complex64| {
        let mut spectrum = inverse.make_input_vec();
        for k in set.band.clone() {
            spectrum[k] = turn * weight(k) * frf.response[k];
        }
        let mut impulse = inverse.make_output_vec();
        let done = inverse.process(&mut spectrum, &mut impulse);
        done.expect("lengths match, and neither end of the spectrum is set");
        impulse
    };
    let [impulse, turned] = [Complex64::ONE, -Complex64::I].map(transformed);
    let envelope: Vec<f64> = impulse
        .iter()
        .zip(&turned)
        .map(|(a, b)| a.hypot(*b))
        .collect();
    let largest = |a: &usize, b: &usize| envelope[*a].total_cmp(&envelope[*b]);
    let peak = (0..count).max_by(largest).unwrap_or(0);
    let least = BEGINS * envelope[peak];
    let is_before = |back: &usize| envelope[(peak + count - back) % count] < least;
    let back = (0..count).find(is_before).unwrap_or(0);
    let begins = peak as isize - back as isize;
    let lag = match begins > (count / 2) as isize {
        true => begins - count as isize,
        false => begins,
    };
    let size = |k: &usize| weight(*k) * frf.response[*k].norm();
    let strongest = set.band.clone().max_by(|a, b| size(a).total_cmp(&size(b)));
    let period = count as f64 / strongest.unwrap_or(set.band.start) as f64;
    match (lag.unsigned_abs() as f64) < PERIODS * period {
        true => 0,
        false => lag,
    }
}

/// The records with the later channel moved forward.
pub(super) fn aligned<'a>(records: &[Driven<'a>], lag: isize) -> Vec<Driven<'a>> {
    let late = lag.unsigned_abs();
    let moved = |record: &Driven<'a>| {
        let count = record.applied.len().saturating_sub(late);
        let [applied, measured] = match lag < 0 {
            true => [late, 0],
            false => [0, late],
        };
        Driven {
            applied: &record.applied[applied..applied + count],
            measured: &record.measured[measured..measured + count],
            ..*record
        }
    };
    records.iter().map(moved).collect()
}

/// What explains the records better: as they are, or aligned and with a delay, to which the lag is added.
pub(super) fn better(
    as_recorded: Result<Identification, Failure>,
    aligned: Result<Identification, Failure>,
    lag_s: f64,
) -> Result<Identification, Failure> {
    let Ok(mut aligned) = aligned else {
        return as_recorded;
    };
    let count = |found: &Identification| found.modes.len();
    let is_better = |as_recorded: &Identification| explains_more(&aligned, as_recorded, count);
    if !as_recorded.as_ref().map_or(true, is_better) {
        return as_recorded;
    }
    if aligned.get("delay").is_none() {
        // The rest is a low-pass.
        let none = NamedEstimate::new("delay", "s", 0.0, None);
        aligned.parameters.push(none);
    }
    let delay_s = add_delay(&mut aligned, lag_s);
    shift::shifted(&mut aligned, delay_s);
    Ok(aligned)
}

/// Whether a model explains the records better than another one, with fewer parts and an equal residual, or with as many
/// and a smaller one.
fn explains_more(
    found: &Identification,
    other: &Identification,
    parts: fn(&Identification) -> usize,
) -> bool {
    let left =
        |found: &Identification| found.fit.as_ref().map_or(f64::INFINITY, |fit| fit.relative);
    match parts(found).cmp(&parts(other)) {
        Ordering::Less => left(found) <= AS_GOOD * left(other),
        Ordering::Equal => AS_GOOD * left(found) <= left(other),
        Ordering::Greater => false,
    }
}

/// Adds to a fitted delay; returns the sum.
fn add_delay(result: &mut Identification, by_s: f64) -> f64 {
    let mut delay_s = by_s;
    let all = result.parameters.iter_mut();
    for delay in all.filter(|parameter| parameter.name == "delay") {
        delay_s += delay.value();
        *delay = NamedEstimate::new("delay", "s", delay_s, delay.std());
    }
    delay_s
}

/// What explains the records better: a declared recorder in the measured channel, or in both, where it cancels. A fitted
/// delay comes on top of the declared one.
pub(super) fn behind_recorder(
    measured: Result<Identification, Failure>,
    both: Result<Identification, Failure>,
    declared_s: f64,
) -> Result<Identification, Failure> {
    let parts = |found: &Identification| {
        let has_lag = ["delay", "low_pass"]
            .iter()
            .any(|name| found.get(name).is_some());
        2 * found.modes.len() + usize::from(has_lag)
    };
    let is_both = match (&measured, &both) {
        (Ok(measured), Ok(both)) => explains_more(both, measured, parts),
        (measured, _) => measured.is_err(),
    };
    let (mut result, how) = match is_both && both.is_ok() {
        true => (both?, "is in both channels, so that it cancels"),
        false => (measured?, "of the measured channel is part of the model"),
    };
    result
        .method
        .push(format!("the [recorder] of the stand file {how}"));
    add_delay(&mut result, declared_s);
    Ok(result)
}
