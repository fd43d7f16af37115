//! A channel that stands still: for the whole record, or for a while.

use super::{Run, median, range, runs};

/// Fewest samples of a standstill.
const SHORTEST: usize = 20;
/// Part of the samples outside standstills that may repeat the one before; above it, standing still
/// is what the channel does.
const LIVELY: f64 = 0.5;
/// Fewest samples outside standstills from which that part is told.
const FEWEST: usize = 50;
/// Chance, over the whole record, of a standstill by accident.
const CHANCE: f64 = 1e-6;
/// Usual step, over the smallest, of a channel that moves by many steps of its resolution.
const FINE: f64 = 4.0;
/// Step into or out of a standstill, over the usual one, from which it is abrupt.
const ABRUPT: f64 = 0.5;

/// The value of a channel that has only one; `None` if it has several, or fewer than two samples.
/// That is a fact; whether it is a fault, the user knows.
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

/// Finds where a lively channel stands still, in order.
///
/// In `n` samples that repeat the one before with probability `p` (counted outside runs of 20 and
/// more), a run of `L` happens by chance `n pᴸ⁻¹` times. A run is a standstill if that is below
/// 10⁻⁶, `L ≥ 20`, the channel is lively (`p < ½`, and the median of its steps other than zero is at
/// least four times the smallest: a slow signal repeats values wherever it is slowest), and the run begins or ends abruptly: with a step
/// of at least half the median one. A drive that comes to rest slows down first, so that it is not
/// reported; of real standstills in noise, one in fourteen is missed for that.
///
/// Runs at the channel's extreme values count too: a caller that knows them to be clipping leaves
/// them out.
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
    let candidates: Vec<Run> = runs(samples).filter(|r| r.length >= SHORTEST).collect();
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
    candidates
        .into_iter()
        .filter(|r| samples.len() as f64 * chance.powi(r.length as i32 - 1) < CHANCE)
        .filter(|r| is_abrupt(samples, r, ABRUPT * usual))
        .collect()
}

/// Median and smallest of the steps that are not zero.
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
    let into = run.start.checked_sub(1).map(|i| samples[i]);
    let out = samples.get(run.end()).copied();
    [into, out]
        .into_iter()
        .flatten()
        .any(|beside| (beside - run.value).abs() >= least)
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
        // A cosine that stops for a while at its top, where its speed is zero.
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
    fn constant_channels() {
        assert_eq!(constant(&[1.0]), None);
        assert_eq!(constant(&[f64::NAN, f64::NAN]), None);
        assert_eq!(constant(&[0.0, -0.0]), Some(0.0));
    }
}
