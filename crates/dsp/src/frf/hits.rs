//! Hits of a hammer in a record, and what is wrong with them.

use std::fmt;
use std::ops::Range;

/// A hit.
#[derive(Debug, Clone, PartialEq)]
pub struct Hit {
    /// Its samples: from a little before the force rises to the next hit or the end.
    pub range: Range<usize>,
    /// Sample with the largest force.
    pub peak: usize,
    /// Why it should not be used.
    pub faults: Vec<HitFault>,
}

/// What is wrong with a hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HitFault {
    /// The force stays at its largest value: the input was overdriven.
    ForceClipped,
    /// The measured signal stays at its largest or smallest value.
    MeasuredClipped,
    /// The hammer struck twice.
    Doubled,
    /// The record ends soon after it.
    CutShort,
}

impl fmt::Display for HitFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ForceClipped => "its force is clipped",
            Self::MeasuredClipped => "its response is clipped",
            Self::Doubled => "the hammer struck twice",
            Self::CutShort => "the record ends soon after it",
        })
    }
}

/// Force of a hit over the largest one.
const STRONG: f64 = 0.3;
/// Force of a second stroke over the first that makes a hit useless: the spectrum of the force then has
/// deep notches. A weaker bounce is part of the recorded force and does no harm.
const SECOND: f64 = 0.3;
/// Samples in a row of one value that mean clipping.
const FLAT: usize = 3;
/// Samples kept before the force rises.
const BEFORE: usize = 16;

/// Finds the hits. A second stroke that comes within `apart` samples belongs to the first hit, as its
/// fault; later ones are hits of their own.
#[must_use]
pub fn find_hits(force: &[f64], measured: &[f64], apart: usize) -> Vec<Hit> {
    let rest = median(force);
    let size = |i: usize| (force[i] - rest).abs();
    let largest = (0..force.len()).map(size).fold(0.0, f64::max);
    if largest == 0.0 {
        return Vec::new();
    }
    let mut peaks: Vec<usize> = Vec::new();
    let mut i = 0;
    while i < force.len() {
        if size(i) < STRONG * largest {
            i += 1;
            continue;
        }
        // The whole pulse, until the force has nearly gone.
        let end = (i..force.len())
            .find(|k| size(*k) < 0.05 * largest)
            .unwrap_or(force.len());
        let top = (i..end)
            .max_by(|a, b| size(*a).total_cmp(&size(*b)))
            .unwrap_or(i);
        match peaks.last() {
            Some(last) if top - last < apart => {}
            _ => peaks.push(top),
        }
        i = end.max(i + 1);
    }
    let starts: Vec<usize> = peaks.iter().map(|p| start_of(&size, *p, largest)).collect();
    let lengths = |k: usize| starts.get(k + 1).copied().unwrap_or(force.len()) - starts[k];
    let longest = (0..starts.len()).map(lengths).max().unwrap_or(0);
    (0..peaks.len())
        .map(|k| {
            let range = starts[k]..starts[k] + lengths(k);
            let mut faults = Vec::new();
            let pulse =
                range.start..(peaks[k] + (peaks[k] - range.start).max(BEFORE) * 2).min(range.end);
            if flat(&force[pulse], rest) {
                faults.push(HitFault::ForceClipped);
            }
            if flat(&measured[range.clone()], median(&measured[range.clone()])) {
                faults.push(HitFault::MeasuredClipped);
            }
            if doubled(&size, peaks[k], range.end) {
                faults.push(HitFault::Doubled);
            }
            if range.len() < longest / 2 {
                faults.push(HitFault::CutShort);
            }
            Hit {
                range,
                peak: peaks[k],
                faults,
            }
        })
        .collect()
}

/// Where the pulse with that peak begins.
fn start_of(size: &impl Fn(usize) -> f64, peak: usize, largest: f64) -> usize {
    let quiet = (0..peak)
        .rev()
        .find(|i| size(*i) < 0.02 * largest)
        .unwrap_or(0);
    quiet.saturating_sub(BEFORE)
}

/// Whether the largest or smallest value stands several times in a row.
fn flat(samples: &[f64], rest: f64) -> bool {
    let far = |v: f64| (v - rest).abs();
    [f64::max as fn(f64, f64) -> f64, f64::min]
        .into_iter()
        .any(|pick| {
            let extreme = samples.iter().copied().fold(rest, pick);
            let run = samples
                .chunk_by(|a, b| a == b)
                .filter(|c| c[0] == extreme)
                .map(<[f64]>::len)
                .max();
            far(extreme) > 0.0 && run.is_some_and(|n| n >= FLAT)
        })
}

/// Whether the force comes back after it had gone.
fn doubled(size: &impl Fn(usize) -> f64, peak: usize, end: usize) -> bool {
    let top = size(peak);
    let gone = (peak..end).find(|i| size(*i) < 0.2 * SECOND * top);
    gone.is_some_and(|gone| (gone..end).any(|i| size(i) > SECOND * top))
}

fn median(samples: &[f64]) -> f64 {
    let mut sorted = samples.to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() {
        return 0.0;
    }
    *sorted.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pulse(at: usize, height: f64, limit: f64, force: &mut [f64]) {
        for k in 0..21 {
            let value = height * (std::f64::consts::PI * k as f64 / 20.0).sin();
            force[at + k] += value.min(limit);
        }
    }

    #[test]
    fn good_hits_pass_and_bad_ones_are_named() {
        let mut force = vec![0.0; 8000];
        pulse(500, 10.0, f64::INFINITY, &mut force);
        pulse(2500, 10.0, 7.0, &mut force);
        pulse(4500, 10.0, f64::INFINITY, &mut force);
        pulse(4700, 4.0, f64::INFINITY, &mut force);
        pulse(6500, 9.0, f64::INFINITY, &mut force);
        let measured: Vec<f64> = (0..8000).map(|i| (f64::from(i) * 0.37).sin()).collect();
        let hits = find_hits(&force, &measured, 1000);
        assert_eq!(hits.len(), 4, "{hits:?}");
        let faults: Vec<&[HitFault]> = hits.iter().map(|h| &h.faults[..]).collect();
        assert_eq!(faults[0], []);
        assert_eq!(faults[1], [HitFault::ForceClipped]);
        assert_eq!(faults[2], [HitFault::Doubled]);
        assert_eq!(faults[3], []);
        assert!(hits[0].range.start < 500 && hits[0].range.end < 2500);
        let mut flat = measured.clone();
        flat[600..604].fill(3.0);
        assert_eq!(
            find_hits(&force, &flat, 1000)[0].faults,
            [HitFault::MeasuredClipped]
        );
        assert!(find_hits(&[0.0; 10], &[0.0; 10], 5).is_empty());
    }
}
