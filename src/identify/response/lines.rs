//! The lines of a response that are fitted, and their weights.

use std::f64::consts::TAU;

use torqcomp_dsp::frf::{Estimator, Powers};

use super::blocks::Set;
use super::{Data, ResponseOptions};
use crate::failure::{ErrorCode, Failure};
use crate::print::{plural, short};

/// Lines of a band.
pub(super) type Lines = std::ops::Range<usize>;

/// Power of an excited line, over that of the strongest.
const EXCITES: f64 = 1e-3;

/// The given band, or the excited lines.
pub(super) fn band(set: &Set, options: &ResponseOptions) -> Result<Lines, Failure> {
    let lines = set.blocks[0].applied.len();
    let frf = set.powers.response(Estimator::H1);
    let (from, to) = match options.band_hz {
        Some((from, to)) => (
            (from / set.step_hz).ceil() as usize,
            (to / set.step_hz).floor() as usize + 1,
        ),
        None => {
            let top = frf.applied_power[1..]
                .iter()
                .fold(0.0_f64, |m, p| m.max(*p));
            let on = |k: &usize| frf.applied_power[*k] > EXCITES * top;
            (
                (1..lines).find(on).unwrap_or(1),
                (1..lines).rev().find(on).unwrap_or(1) + 1,
            )
        }
    };
    let range = from.max(1)..to.min(lines - 1);
    if range.len() < 12 {
        return Err(Failure::failed(
            ErrorCode::TooFewSamples,
            format_args!(
                "only {} in the band, {} Hz apart: too few to fit modes; widen --band or record longer",
                plural(range.len(), "line"),
                short(set.step_hz)
            ),
        ));
    }
    Ok(range)
}

/// Most lines that are fitted.
pub(super) const MOST_LINES: usize = 6000;

/// Lines of the band that is suggested: fewer than are fitted, as its limits are rounded.
const SUGGESTED: usize = 5800;

/// The band of [`SUGGESTED`] lines in which the measured signal has most power, in Hz.
pub(super) fn strongest(set: &Set, lines: &Lines) -> (f64, f64) {
    let power = |k: usize| -> f64 { set.blocks.iter().map(|b| b.measured[k].norm_sqr()).sum() };
    let powers: Vec<f64> = lines.clone().map(power).collect();
    let mut sum: f64 = powers[..SUGGESTED].iter().sum();
    let mut best = (sum, 0);
    for from in 1..=powers.len() - SUGGESTED {
        sum += powers[from + SUGGESTED - 1] - powers[from - 1];
        if sum > best.0 {
            best = (sum, from);
        }
    }
    let first = lines.start + best.1;
    let hz = |line: usize| line as f64 * set.step_hz;
    (hz(first), hz(first + SUGGESTED))
}

/// H1, each line weighted with the root of its applied power.
pub(super) fn data(powers: &Powers, set: &Set, lines: &Lines, options: &ResponseOptions) -> Data {
    let frf = powers.response(Estimator::H1);
    let response = frf.response[lines.clone()].to_vec();
    let powers = &frf.applied_power[lines.clone()];
    let mean = powers.iter().sum::<f64>() / powers.len() as f64;
    Data {
        omega: lines
            .clone()
            .map(|k| TAU * k as f64 * set.step_hz)
            .collect(),
        weight: powers.iter().map(|p| (p / mean).sqrt()).collect(),
        response,
        order: options.order,
        added_rate: set.added_rate,
        with_delay: options.with_delay,
        below: !(options.grounded && options.modes.is_some_and(|modes| modes > 1)),
    }
}
