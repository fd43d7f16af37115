//! Fitted lines of a response, and their weights.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use torqcomp_dsp::frf::{Estimator, Powers};

use super::blocks::Set;
use super::{Data, ResponseOptions};
use crate::failure::{ErrorCode, Failure};
use crate::print::{plural, short};

/// Minimum power of an excited line, relative to the strongest.
const EXCITES: f64 = 1e-3;

/// The blocks with the band that is fitted.
pub(super) fn in_band(mut set: Set, options: &ResponseOptions) -> Result<Set, Failure> {
    set.band = band(&set, options)?;
    set.drop_lines_above();
    Ok(set)
}

/// The given band, or the excited lines. A step has most of its power at the lowest lines, whatever it excites; so for
/// transients the power of their differences counts, and at most as many lines as can be fitted.
fn band(set: &Set, options: &ResponseOptions) -> Result<Range<usize>, Failure> {
    let lines = set.lines;
    let frf = set.powers.response(Estimator::H1);
    let (from, to) = match options.band_hz {
        Some((from, to)) => (
            (from / set.step_hz).ceil() as usize,
            (to / set.step_hz).floor() as usize + 1,
        ),
        None => {
            let turn = PI / (lines - 1) as f64;
            let difference = |k: usize| 2.0 * (1.0 - (turn * k as f64).cos());
            let power = |k: usize| match set.of_differences {
                true => frf.applied_power[k] * difference(k),
                false => frf.applied_power[k],
            };
            let top = (1..lines).map(power).fold(0.0, f64::max);
            let on = |k: &usize| power(*k) > EXCITES * top;
            let first = (1..lines).find(on).unwrap_or(1);
            let last = (1..lines).rev().find(on).unwrap_or(1);
            let last = last.max(last_answered(set, &frf.coherence));
            let excited = first..(last + 1).min(lines - 1);
            match set.of_differences && excited.len() > MOST_LINES {
                true => strongest(set, &excited),
                false => (excited.start, excited.end),
            }
        }
    };
    let range = from.max(1)..to.min(lines - 1);
    if range.len() < 12 {
        return Err(ErrorCode::TooFewSamples.failed(format_args!(
            "only {} in the band, {} Hz apart: too few to fit modes; widen --band or record longer",
            plural(range.len(), "line"),
            short(set.step_hz)
        )));
    }
    Ok(range)
}

/// Minimum coherence of a line of a periodic excitation that counts because of its response.
const COHERENT: f64 = 0.9;

/// The last line of several periods whose response is strong and coherent: the lines of a square wave are weak at a
/// resonance far above its fundamental, but excite it.
fn last_answered(set: &Set, coherence: &[f64]) -> usize {
    if !set.is_periodic || set.blocks.len() < 3 {
        return 0;
    }
    let lines = coherence.len();
    let power = |k: usize| measured_power(set, k);
    let top = (1..lines).map(power).fold(0.0, f64::max);
    let is_answered = |k: &usize| power(*k) > EXCITES * top && coherence[*k] > COHERENT;
    (1..lines).rev().find(is_answered).unwrap_or(0)
}

/// Power of the measured signal at a line, summed over the blocks.
fn measured_power(set: &Set, line: usize) -> f64 {
    let blocks = set.blocks.iter();
    blocks.map(|block| block.measured[line].norm_sqr()).sum()
}

/// Maximum number of fitted lines.
pub(super) const MOST_LINES: usize = 6000;

/// Number of lines in the suggested band, less than the maximum because its limits are rounded.
const SUGGESTED: usize = 5800;

/// The band of [`SUGGESTED`] lines in which the measured signal has most power.
pub(super) fn strongest(set: &Set, lines: &Range<usize>) -> (usize, usize) {
    let powers: Vec<f64> = lines.clone().map(|k| measured_power(set, k)).collect();
    let mut sum: f64 = powers[..SUGGESTED].iter().sum();
    let mut best = (sum, 0);
    for from in 1..=powers.len() - SUGGESTED {
        sum += powers[from + SUGGESTED - 1] - powers[from - 1];
        if sum > best.0 {
            best = (sum, from);
        }
    }
    let first = lines.start + best.1;
    (first, first + SUGGESTED)
}

/// H1, with each line weighted by the square root of its applied power.
pub(super) fn data(powers: &Powers, set: &Set, options: &ResponseOptions) -> Data {
    let frf = powers.response(Estimator::H1);
    let response = frf.response[set.band.clone()].to_vec();
    let powers = &frf.applied_power[set.band.clone()];
    let mean = powers.iter().sum::<f64>() / powers.len() as f64;
    Data {
        omega: set
            .band
            .clone()
            .map(|k| TAU * k as f64 * set.step_hz)
            .collect(),
        weight: powers
            .iter()
            .map(|p| match mean > 0.0 {
                true => (p / mean).sqrt(),
                false => 0.0,
            })
            .collect(),
        response,
        order: options.order,
        added_rate: set.added_rate,
        lag: options.lag,
        recorder: options.recorder,
        below: !(options.grounded && options.modes.is_some_and(|modes| modes > 1)),
    }
}
