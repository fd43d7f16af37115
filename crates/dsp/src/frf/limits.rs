//! Limits of the amplifiers and converters of a hammer test.

use std::f64::consts::FRAC_PI_3;
use std::ops::Range;

use crate::quality;
use crate::quality::quantisation::quantisation;
use crate::quality::repeats::repeats;

/// Relative distance from the extreme value within which a sample counts as clipped.
const LEVEL: f64 = 0.01;
/// The same in standard deviations of the noise, and its upper limit: noise spreads a limit this far.
const NOISE: (f64, f64) = (6.0, 0.06);
/// Consecutive samples at the extreme, relative to those beyond half of it: 0.13 for a half-sine and 0.12 for a bell;
/// more means that an amplifier saturated.
const STANDING: f64 = 0.3;
/// The same, relative to that of a half-sine.
const LONGER: f64 = 1.5;
/// Smallest extreme of the opposite sign, relative to the largest, that can be a limit.
const OTHER_SIDE: f64 = 0.1;
/// Minimum number of such samples; one less if none is a little lower, which a round top has: beside three samples within
/// `w` of its peak, the next are within `4w`.
const LEAST_STANDING: usize = 4;
const ROUND: f64 = 6.0;
/// Number of equal consecutive samples that means clipping.
const FLAT: usize = 3;
/// Smallest ratio of the samples at the extreme to those one step below it that is no round top, where it is at most
/// `1/(√2 − 1)`.
const NEXT: usize = 3;
/// Samples by which the ratio is off, as both are whole numbers.
const UNEVEN: usize = 2;
/// Largest number of samples at the extreme of a round top that has none one step below.
const MOST_BARE: usize = 4;

/// Relative distance from a limit within which its noise leaves samples that are at it.
pub(super) fn near(noise: f64, limit: f64) -> f64 {
    (NOISE.0 * noise / limit).clamp(LEVEL, NOISE.1)
}

/// Noise and resolution of a channel.
#[derive(Clone, Copy)]
pub(super) struct Grain {
    /// Standard deviation of its noise.
    pub noise: f64,
    /// Distance of its levels; 0 if it shows none.
    step: f64,
    /// Number of samples for which each value is held.
    hold: usize,
}

impl Grain {
    pub fn of(samples: &[f64], noise: f64) -> Self {
        let held = repeats(samples).and_then(|found| found.hold);
        Self {
            noise,
            step: quantisation(samples).map_or(0.0, |found| found.step),
            hold: held.unwrap_or(1),
        }
    }
}

/// Whether part of a channel is clipped.
pub(super) fn is_clipped(samples: &[f64], rest: f64, grain: Grain) -> bool {
    let fresh: Vec<f64> = samples.iter().step_by(grain.hold).copied().collect();
    flat(&fresh, rest, grain.step) || stands(&fresh, rest, grain)
}

/// Whether the largest or smallest value occurs several times in a row, more often than on a round top in steps of the
/// channel's resolution.
fn flat(samples: &[f64], rest: f64, step: f64) -> bool {
    let far = |v: f64| (v - rest).abs();
    [f64::max as fn(f64, f64) -> f64, f64::min]
        .into_iter()
        .any(|pick| {
            let extreme = samples.iter().copied().fold(rest, pick);
            let at_extreme = quality::runs(samples).filter(|run| run.value == extreme);
            let longest = at_extreme.max_by_key(|run| run.length);
            let longest = longest.filter(|run| far(extreme) > 0.0 && run.length >= FLAT);
            longest.is_some_and(|run| !is_round(samples, run.start..run.end(), step))
        })
}

/// Whether equal samples are the top of a parabola in steps: of its samples within two steps of the peak, at least
/// `1 − 1/√2` are in the second one. Where there is none, the next sample is no farther below than on a parabola that
/// falls by one step from the middle to the ends of the top.
fn is_round(samples: &[f64], top: Range<usize>, step: f64) -> bool {
    let extreme = samples[top.start];
    let below = |v: &f64| (v - extreme).abs();
    let is_next = |v: &&f64| below(v) < 1.5 * step;
    let (before, after) = (&samples[..top.start], &samples[top.end..]);
    let next =
        before.iter().rev().take_while(is_next).count() + after.iter().take_while(is_next).count();
    let count = top.len();
    if next > 0 {
        return NEXT * next + UNEVEN >= count;
    }
    let neighbours = before.last().into_iter().chain(after.first());
    let fall = neighbours.map(below).fold(f64::INFINITY, f64::min);
    let farther = (count + 2) as f64 / count as f64;
    count <= MOST_BARE && fall < (1.0 + farther * farther) * step
}

/// Whether a signal stays near its largest or smallest value longer than a pulse or oscillation does: with an amplifier
/// that saturates before the converter, the limit is noisy. In each half cycle beyond half of the extreme, the samples
/// near the extreme are counted; for a half-sine, the fraction `arccos(1 − w)/(π/3)` lies within `w` of its peak.
fn stands(samples: &[f64], rest: f64, grain: Grain) -> bool {
    let extreme = |side: f64| {
        samples
            .iter()
            .map(|v| side * (v - rest))
            .fold(0.0, f64::max)
    };
    let extremes = [1.0, -1.0].map(extreme);
    let largest = extremes[0].max(extremes[1]);
    let sides = [1.0, -1.0].into_iter().zip(extremes);
    // With AC coupling, a pulse is followed by a low and long swing of the opposite sign.
    let mut limits = sides.filter(|(_, extreme)| *extreme > OTHER_SIDE * largest);
    limits.any(|(side, extreme)| {
        let size = |v: &f64| side * (v - rest);
        let near = near(grain.noise, extreme);
        let top = (near + grain.step / extreme).min(0.5);
        let usual = (1.0 - top).acos() / FRAC_PI_3;
        let least = STANDING.max(LONGER * usual);
        let is_high = |v: &f64| size(v) >= 0.5 * extreme;
        let mut swings = samples.chunk_by(|a, b| is_high(a) == is_high(b));
        swings.any(|swing| {
            let within = |part: f64| {
                swing
                    .iter()
                    .filter(|v| size(v) >= (1.0 - part) * extreme)
                    .count()
            };
            let standing = within(near);
            let is_sharp = standing + 1 == LEAST_STANDING && within(ROUND * near) == standing;
            (standing >= LEAST_STANDING || is_sharp) && standing as f64 > least * swing.len() as f64
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::hits::tests::{pulse, quiet};
    use super::super::hits::{HitFault, find_hits};

    #[test]
    fn a_limit_with_noise_on_it_is_named() {
        let swing = |limit: f64| -> Vec<f64> {
            let one = |i: i32| {
                let t = f64::from(i - 500).max(0.0);
                let free = 10.0 * (-0.004 * t).exp() * (0.1 * t).sin();
                free.clamp(-limit, limit) + 0.01 * quiet(i)
            };
            (0..4000).map(one).collect()
        };
        for (force_limit, swing_limit, want) in [
            (f64::INFINITY, 50.0, vec![]),
            (7.0, 50.0, vec![HitFault::ForceClipped]),
            (f64::INFINITY, 6.0, vec![HitFault::MeasuredClipped]),
            (
                8.0,
                7.0,
                vec![HitFault::ForceClipped, HitFault::MeasuredClipped],
            ),
        ] {
            let mut force: Vec<f64> = (0..4000).map(|i| 0.005 * quiet(3 * i)).collect();
            pulse(500, 10.0, force_limit, &mut force);
            let hits = find_hits(&force, &swing(swing_limit), 1000);
            assert_eq!(
                hits[0].faults, want,
                "limits {force_limit} and {swing_limit}"
            );
        }
    }

    /// A converter of few steps, or a slow one, repeats the values of a round top.
    #[test]
    fn coarse_and_held_responses_are_not_clipped() {
        for seed in 0..40 {
            let cycle = 20.0 + 1.7 * f64::from(seed);
            let limited = |limit: f64| -> Vec<f64> {
                let one = |i: i32| {
                    let t = f64::from(i - 500).max(0.0);
                    let free = 10.0 * (-0.2 / cycle * t).exp();
                    (free * (std::f64::consts::TAU * t / cycle).sin()).clamp(-limit, limit)
                };
                (0..4000).map(one).collect()
            };
            let mut force = vec![0.0; 4000];
            pulse(500, 10.0, f64::INFINITY, &mut force);
            let faults = |measured: &[f64]| find_hits(&force, measured, 1000)[0].faults.clone();
            let (whole, cut) = (limited(f64::INFINITY), limited(5.5));
            for steps in [20.0, 30.0, 60.0, 250.0] {
                let coarse = |samples: &[f64]| -> Vec<f64> {
                    let step = 20.0 / steps;
                    samples.iter().map(|v| (v / step).round() * step).collect()
                };
                assert!(faults(&coarse(&whole)).is_empty(), "{cycle} {steps}");
                assert_eq!(
                    faults(&coarse(&cut)),
                    [HitFault::MeasuredClipped],
                    "{cycle} {steps}"
                );
            }
            let held: Vec<f64> = (0..4000).map(|i| whole[i - i % 3]).collect();
            assert!(faults(&held).is_empty(), "{cycle}");
        }
    }

    /// Strokes of seven samples: three stand at the limit, or fewer where another hit shows it.
    #[test]
    fn short_strokes_at_a_noisy_limit_are_named() {
        let stroke = |at: f64, height: f64, limit: f64, force: &mut [f64]| {
            for (i, value) in force.iter_mut().enumerate() {
                let u = (i as f64 - at) / 8.0;
                if (0.0..1.0).contains(&u) {
                    *value += (height * (std::f64::consts::PI * u).sin().powi(2)).min(limit);
                }
            }
        };
        let faults = |limit: f64| {
            let mut force: Vec<f64> = (0..6000).map(|i| 0.005 * quiet(3 * i)).collect();
            stroke(500.3, 16.0, limit, &mut force);
            stroke(2500.1, 10.2, limit, &mut force);
            stroke(4500.4, 7.0, limit, &mut force);
            let ring = |i: i32| {
                let t = f64::from((i + 1500) % 2000);
                (-0.01 * t).exp() * (0.37 * t).sin()
            };
            let measured: Vec<f64> = (0..6000).map(ring).collect();
            let hits = find_hits(&force, &measured, 1000);
            hits.into_iter().map(|hit| hit.faults).collect::<Vec<_>>()
        };
        let clipped = vec![HitFault::ForceClipped];
        assert_eq!(faults(f64::INFINITY), [vec![], vec![], vec![]]);
        assert_eq!(faults(9.0), [clipped.clone(), clipped, vec![]]);
    }
}
