//! How a stand was excited, by the applied signal.

use torqcomp_dsp::frf;

use super::Excitation;
use super::blocks::{END, mean};
use crate::identify::rms;

/// Fraction of the samples at rest above which the excitation is a hammer.
const AT_REST: f64 = 0.95;

/// The kind of excitation that a signal shows.
pub(super) fn guess(applied: &[f64]) -> Excitation {
    if is_of_two_levels(applied) || is_switched(applied) {
        return Excitation::Transient;
    }
    let largest = applied.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let quiet = applied.iter().filter(|v| v.abs() < 0.1 * largest).count();
    if quiet as f64 > AT_REST * applied.len() as f64 {
        Excitation::Impact
    } else if is_step(applied) {
        Excitation::Transient
    } else if frf::find_period(applied).is_some() {
        Excitation::Periodic
    } else {
        Excitation::Random
    }
}

/// Spread of a signal within either end, relative to the difference of their levels, below which it is
/// a step.
const STEADY: f64 = 0.1;

/// Whether a signal goes from one steady level to another.
fn is_step(samples: &[f64]) -> bool {
    let count = (samples.len() / END).max(1);
    let ends = [&samples[..count], &samples[samples.len() - count..]];
    let levels = ends.map(mean);
    let spread = |(end, level): (&[f64], f64)| -> f64 {
        rms(&end.iter().map(|v| v - level).collect::<Vec<f64>>())
    };
    let step = (levels[1] - levels[0]).abs();
    step > 0.0
        && ends
            .into_iter()
            .zip(levels)
            .all(|e| spread(e) < STEADY * step)
}

/// Divisor of the record length for the ends of a step that comes early or late, and fraction of the samples that
/// must lie at either level.
const SHORT_END: usize = 50;
const AT_LEVELS: f64 = 0.95;
/// Minimum difference of the levels, relative to the range of the signal.
const MOST_OF_IT: f64 = 0.5;

/// Whether a signal stays at one level, then at another, with little in between.
fn is_of_two_levels(samples: &[f64]) -> bool {
    let count = (samples.len() / SHORT_END).max(1);
    let [from, to] = [&samples[..count], &samples[samples.len() - count..]].map(mean);
    let range = samples.iter().fold(0.0_f64, |m, v| m.max((v - from).abs()));
    if (to - from).abs() < MOST_OF_IT * range {
        return false;
    }
    let near = |v: &f64, level: f64| (v - level).abs() < STEADY * (to - from).abs();
    let middle = samples.iter().position(|v| !near(v, from)).unwrap_or(0);
    let (first, rest) = samples.split_at(middle);
    let at_levels = first.len() + rest.iter().filter(|v| near(v, to)).count();
    at_levels as f64 > AT_LEVELS * samples.len() as f64
}

/// Maximum number of changes between two levels that are a single transient rather than a signal of its own.
const MOST_CHANGES: usize = 8;

/// Whether a signal is switched between two levels a few times.
fn is_switched(samples: &[f64]) -> bool {
    let count = (samples.len() / SHORT_END).max(1);
    let from = mean(&samples[..count]);
    let range = samples.iter().fold(0.0_f64, |m, v| m.max((v - from).abs()));
    let is_far = |v: &&f64| (**v - from).abs() > 0.5 * range;
    let far: Vec<f64> = samples.iter().filter(is_far).copied().collect();
    if far.is_empty() {
        return false;
    }
    let to = mean(&far);
    let near = |v: &f64, level: f64| (v - level).abs() < STEADY * (to - from).abs();
    let level = |v: &f64| match (near(v, from), near(v, to)) {
        (false, false) => None,
        (_, is_other) => Some(is_other),
    };
    let levels: Vec<bool> = samples.iter().filter_map(level).collect();
    let changes = levels.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let others = levels.iter().filter(|is_other| **is_other).count();
    levels.len() as f64 > AT_LEVELS * samples.len() as f64
        && others as f64 > (1.0 - AT_LEVELS) * samples.len() as f64
        && (1..=MOST_CHANGES).contains(&changes)
}
