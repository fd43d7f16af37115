//! A stuck channel: constant for the whole record, or for a while.

use super::{Run, median, range, runs};

/// Minimum number of samples of a standstill.
pub(super) const SHORTEST: usize = 20;
/// Maximum fraction of repeated samples outside standstills; above it, repetition is normal for the
/// channel.
const LIVELY: f64 = 0.5;
/// Minimum number of samples outside standstills for that fraction.
const FEWEST: usize = 50;
/// Probability of an accidental standstill over the whole record.
const CHANCE: f64 = 1e-6;
/// Ratio of the typical to the smallest step of a channel that moves by many resolution steps.
const FINE: f64 = 4.0;
/// Step into or out of a standstill, relative to the typical one, above which it is abrupt.
const ABRUPT: f64 = 0.5;
/// Minimum number of samples of a drop-out.
const FEWEST_DROPPED: usize = 3;
/// Steps into and out of a drop-out, relative to the largest one elsewhere.
const FAR: f64 = 3.0;

/// The value of a constant channel; `None` if it has several values, or fewer than two samples.
/// Only the user knows whether that is a fault.
///
/// ```
/// use torqcomp_dsp::quality::stuck::constant;
/// assert_eq!(constant(&[2.0, 2.0, f64::NAN, 2.0]), Some(2.0));
/// assert_eq!(constant(&[2.0, 2.1]), None);
/// ```
#[must_use]
pub fn constant(samples: &[f64]) -> Option<f64> {
    let (low, high) = range(samples)?;
    (low == high && samples.len() > 1).then_some(low)
}

/// Finds standstills of an otherwise lively channel, in order.
///
/// In `n` samples that repeat the preceding one with probability `p` (outside runs of 20 and more), the expected number
/// of chance runs of `L` is `n pᴸ⁻¹`. A run is a standstill if that is below 10⁻⁶, `L ≥ 20`, the channel is lively
/// (`p < ½`, and the median of its nonzero steps is at least four times the smallest: a slow signal repeats values
/// wherever it is slowest), and the run begins or ends abruptly: with a step of at least half the median one. A drive
/// that comes to rest slows down first, so it is not reported; one in fourteen genuine standstills in noise is missed
/// for that reason.
///
/// A shorter run counts if the signal jumps to it and back again, each time at least three times as far as anywhere
/// else: a drop-out of a cable or recorder.
///
/// Runs at the channel's extreme values count too; the caller excludes those known to be clipping.
///
/// ```
/// use torqcomp_dsp::quality::stuck::standstills;
/// let mut samples: Vec<f64> = (0..500).map(|i| (1.7 * f64::from(i)).sin()).collect();
/// samples[200..260].fill(0.25);
/// let found = standstills(&samples);
/// assert_eq!((found[0].start, found[0].length), (200, 60));
/// assert_eq!(found.len(), 1);
/// ```
#[must_use]
pub fn standstills(samples: &[f64]) -> Vec<Run> {
    let mut candidates: Vec<Run> = runs(samples)
        .filter(|r| r.length >= SHORTEST || is_aside(samples, r))
        .collect();
    if candidates.is_empty() {
        return candidates;
    }
    let (count, repeated) = runs(samples)
        .filter(|r| r.length < SHORTEST)
        .fold((0, 0), |(all, rep), r| (all + r.length, rep + r.length - 1));
    if count < FEWEST || repeated as f64 > LIVELY * count as f64 {
        return Vec::new();
    }
    let chance = (repeated as f64 + 1.0) / (count as f64 + 1.0);
    let (usual, smallest) = usual_and_smallest_step(samples);
    if usual < FINE * smallest {
        return Vec::new();
    }
    candidates.retain(|r| samples.len() as f64 * chance.powi(r.length as i32 - 1) < CHANCE);
    let far = FAR * largest_step_between(&candidates, samples);
    candidates.retain(|r| match r.length >= SHORTEST {
        true => is_abrupt(samples, r, ABRUPT * usual),
        false => steps_beside(samples, r).all(|step| step.abs() >= far),
    });
    candidates
}

/// Whether the signal jumps to a short run and back to the same side.
fn is_aside(samples: &[f64], run: &Run) -> bool {
    let is_inside = run.start > 0 && run.end() < samples.len();
    let product: f64 = steps_beside(samples, run).product();
    run.length >= FEWEST_DROPPED && is_inside && product > 0.0
}

/// Largest step outside the runs, which are in order, and not adjacent to them.
fn largest_step_between(runs: &[Run], samples: &[f64]) -> f64 {
    let starts = runs.iter().map(|run| run.start).chain([samples.len()]);
    let ends = [0].into_iter().chain(runs.iter().map(Run::end));
    let parts = ends.zip(starts).map(|(from, to)| &samples[from..to]);
    let steps = parts.flat_map(|part| part.windows(2));
    steps.fold(0.0, |largest, pair| (pair[1] - pair[0]).abs().max(largest))
}

/// Median and smallest of the nonzero steps.
fn usual_and_smallest_step(samples: &[f64]) -> (f64, f64) {
    let mut steps: Vec<f64> = super::excerpts(samples)
        .iter()
        .flat_map(|part| part.windows(2))
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|step| *step > 0.0)
        .collect();
    let smallest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    (median(&mut steps).unwrap_or(0.0), smallest)
}

fn is_abrupt(samples: &[f64], run: &Run, least: f64) -> bool {
    steps_beside(samples, run).any(|step| step.abs() >= least)
}

/// Differences of the samples next to a run from its value.
fn steps_beside(samples: &[f64], run: &Run) -> impl Iterator<Item = f64> {
    let into = run.start.checked_sub(1).map(|i| samples[i]);
    let out = samples.get(run.end()).copied();
    let value = run.value;
    [into, out]
        .into_iter()
        .flatten()
        .map(move |beside| beside - value)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, rounded, sine, sum};
    use super::*;

    #[test]
    fn a_frozen_channel_is_found_and_a_slow_one_left_alone() {
        let mut lively = rounded(&sum(&sine(3.0, 300.0, 20_000), &noise(1, 20_000)), 0.01);
        assert_eq!(standstills(&lively), []);
        let value = lively[5000];
        lively[5000..5400].fill(value);
        let found = standstills(&lively);
        assert_eq!(found.len(), 1);
        assert!((399..=402).contains(&found[0].length), "{found:?}");
        // A slow signal in coarse steps repeats values all the time.
        assert_eq!(standstills(&rounded(&sine(1.0, 5000.0, 20_000), 0.01)), []);
        // A temperature in steps of its resolution, with a plateau.
        let slow: Vec<f64> = (0..2000)
            .map(|i| (0.3 * f64::from(i) + 60.0 * (f64::from(i) / 150.0).sin()).round())
            .collect();
        assert!(runs(&slow).any(|r| r.length > 12));
        assert_eq!(standstills(&slow), []);
        // A counter that moves now and then.
        let counter: Vec<f64> = (0..5000).map(|i| f64::from(i / 100)).collect();
        assert_eq!(standstills(&counter), []);
    }

    #[test]
    fn coming_to_rest_is_not_getting_stuck() {
        // A cosine that pauses at its maximum, where its speed is zero.
        let stop: Vec<f64> = (0..3000)
            .map(|i| match i {
                0..1000 => (std::f64::consts::TAU * f64::from(i) / 1000.0).cos(),
                1000..1400 => 1.0,
                _ => (std::f64::consts::TAU * f64::from(i - 1400) / 1000.0).cos(),
            })
            .collect();
        assert_eq!(standstills(&stop), []);
        assert!(runs(&stop).any(|r| r.length > 390));
    }

    #[test]
    fn a_short_drop_out_is_found_and_short_pulses_are_left_alone() {
        let good = rounded(&sum(&sine(2.0, 97.0, 20_000), &noise(4, 20_000)), 1e-4);
        assert_eq!(standstills(&good), []);
        let mut dropped: Vec<f64> = good.iter().map(|x| x + 50.0).collect();
        dropped[8000..8012].fill(0.0);
        dropped[9000..9007].fill(0.0);
        let found = standstills(&dropped);
        let places: Vec<(usize, usize)> = found.iter().map(|r| (r.start, r.length)).collect();
        assert_eq!(places, [(8000, 12), (9000, 7)]);
        // No farther than a typical step of the record.
        let mut near = good.clone();
        near[8000..8012].fill(0.0);
        assert_eq!(standstills(&near), []);
        // Steps between levels, as of a set point, are not drop-outs.
        let levels: Vec<f64> = (0..5000)
            .map(|i| if i % 100 < 6 { 5.0 } else { 0.0 })
            .collect();
        assert_eq!(standstills(&levels), []);
    }

    #[test]
    fn constant_channels() {
        assert_eq!(constant(&[1.0]), None);
        assert_eq!(constant(&[f64::NAN, f64::NAN]), None);
        assert_eq!(constant(&[0.0, -0.0]), Some(0.0));
    }
}
