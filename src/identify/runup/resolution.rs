//! Resolution of the channels: their noise, and how often they have a new value.

use torqcomp_dsp::quality::quantisation::quantisation;
use torqcomp_dsp::quality::repeats::repeats;
use torqcomp_dsp::quality::{median, runs};
use torqcomp_dsp::weak::white_noise_variance;

use super::SHORTEST_HALF;

/// Variance of the noise of a motion: that of its differences, at least that of rounding, which does not show in them
/// if most samples repeat the one before.
pub(super) fn noise_variance(motion: &[f64]) -> f64 {
    let step = quantisation(motion).map_or(0.0, |found| found.step);
    let white = white_noise_variance(motion).unwrap_or(0.0);
    white.max(step * step / 12.0)
}

/// Half of the shortest window tried: as many new values as it has samples if every sample is new. Within a step of a
/// coarse resolution, or a value that is held, the errors of neighbouring samples are the same and do not average out.
/// `moving` is the motion without rests.
pub(super) fn shortest_half(moving: &[f64], effort: &[f64]) -> usize {
    let every = stays(moving, effort).iter().map(|(_, every)| *every).max();
    SHORTEST_HALF * every.unwrap_or(1)
}

/// A channel with too few new values in a window.
pub(super) struct TooFew {
    /// `motion` or `torque`.
    pub channel: &'static str,
    /// Number of samples for which a value stays.
    pub every: usize,
    /// Whether the values are held, and not rounded.
    pub is_held: bool,
}

/// The channel with less than half as many new values in a window as it should have.
pub(super) fn too_few(moving: &[f64], effort: &[f64], half: usize) -> Option<TooFew> {
    let few = |every: usize| 2 * half < SHORTEST_HALF * every;
    let all = stays(moving, effort);
    let (channel, every) = all.into_iter().find(|(_, every)| few(*every))?;
    Some(TooFew {
        channel,
        every,
        is_held: channel == "torque" || is_held(moving),
    })
}

/// Number of samples for which most values stay, in each channel. A torque may be constant for long: it counts only if
/// its values are held.
fn stays(moving: &[f64], effort: &[f64]) -> [(&'static str, usize); 2] {
    let torque = if is_held(effort) { stay(effort) } else { 1 };
    [("motion", stay(moving)), ("torque", torque)]
}

/// Number of samples for which most values of a channel stay.
pub(super) fn stay(samples: &[f64]) -> usize {
    let mut lengths: Vec<f64> = runs(samples).map(|run| run.length as f64).collect();
    median(&mut lengths).map_or(1, |length| length as usize)
}

/// Whether values repeat more often than their resolution explains.
fn is_held(samples: &[f64]) -> bool {
    repeats(samples).is_some_and(|found| found.unexplained == Some(true))
}
