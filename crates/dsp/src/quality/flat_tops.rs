//! Peaks of a ringing that an amplifier cut off before its filter rounded them again.

use super::clipping::{Clipping, Rail};
use super::median;

/// Fewest samples of a half cycle that is judged.
const SHORTEST: usize = 8;
/// Part of the peak above which its breadth is taken.
const HIGH: f64 = 0.9;
/// Least part of a half cycle above it that is flat: of a sine `1 − 2 arcsin(0.9)/π` = 0.287 are, of a square all.
const FLAT: f64 = 0.42;
/// Most of it that is a peak as it should be.
const ROUND: f64 = 0.36;
/// Largest relative difference of the levels of flat peaks.
const LEVEL: f64 = 0.03;
/// Fewest flat peaks of a side.
const FEWEST: usize = 2;
/// Part below the level from which on a peak was not cut off.
const BELOW: f64 = 0.15;

/// A half cycle of a ringing.
struct HalfCycle {
    start: usize,
    length: usize,
    peak: f64,
    /// Part of its samples above 0.9 of the peak.
    breadth: f64,
}

impl HalfCycle {
    fn of(start: usize, samples: &[f64]) -> Self {
        let peak = samples.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let high = samples.iter().filter(|x| x.abs() > HIGH * peak).count();
        Self {
            start,
            length: samples.len(),
            peak,
            breadth: high as f64 / samples.len() as f64,
        }
    }
}

/// Tells whether the first peaks of a ringing were cut off at a level below the recorder's limit, with a filter behind.
///
/// From its largest peak on, the half cycles of a side about the median are taken one after the other: the first ones are cut
/// off if two or more have the same height within 3 % and more than 42 % of their time above 0.9 of it, and
/// all further ones are lower and as round as a sine. What lies within 15 % of the level counts as cut off, since the
/// filter smears that.
///
/// ```
/// use torqcomp_dsp::quality::flat_tops::flat_tops;
/// let ring = |i: i32| (-0.002 * f64::from(i)).exp() * (0.1 * f64::from(i)).sin();
/// let whole: Vec<f64> = (0..4000).map(ring).collect();
/// assert_eq!(flat_tops(&whole), None);
/// let mut before = 0.0;
/// let cut: Vec<f64> = whole.iter().map(|x| { before += 0.3 * (x.clamp(-0.5, 0.5) - before); before }).collect();
/// let found = flat_tops(&cut).unwrap();
/// assert!((found.high.unwrap().value - 0.5).abs() < 0.01 && found.holds(-0.49));
/// ```
#[must_use]
pub fn flat_tops(samples: &[f64]) -> Option<Clipping> {
    let middle = median(&mut samples.to_vec())?;
    let centred: Vec<f64> = samples.iter().map(|x| x - middle).collect();
    let largest = |a: &usize, b: &usize| centred[*a].abs().total_cmp(&centred[*b].abs());
    let top = (0..centred.len()).max_by(largest)?;
    let is_above = |x: &f64| *x > 0.0;
    let mut cycles = [Vec::new(), Vec::new()];
    let mut start = 0;
    for half in centred.chunk_by(|a, b| is_above(a) == is_above(b)) {
        if start + half.len() > top && half.len() >= SHORTEST {
            cycles[usize::from(is_above(&half[0]))].push(HalfCycle::of(start, half));
        }
        start += half.len();
    }
    let [low, high] = cycles.map(|side| rail(&side));
    let placed = |rail: Rail, sign: f64| Rail {
        value: middle + sign * rail.value,
        ..rail
    };
    let found = Clipping {
        low: low.map(|rail| placed(rail, -1.0)),
        high: high.map(|rail| placed(rail, 1.0)),
    };
    (found.low.is_some() || found.high.is_some()).then_some(found)
}

/// The level of the first half cycles of a side, about the middle, if they are cut off.
fn rail(side: &[HalfCycle]) -> Option<Rail> {
    let level = side.iter().fold(0.0_f64, |most, half| most.max(half.peak));
    let is_flat = |half: &&HalfCycle| half.breadth > FLAT && half.peak > (1.0 - LEVEL) * level;
    let flat: Vec<&HalfCycle> = side.iter().take_while(is_flat).collect();
    // Between flat and round the filter hides the level.
    let further = &side[flat.len()..];
    let lower = further
        .iter()
        .find(|half| half.peak < (1.0 - BELOW) * level)?;
    let are_lower = further.iter().all(|half| half.peak <= level) && lower.breadth < ROUND;
    (flat.len() >= FEWEST && are_lower).then(|| Rail {
        value: level,
        spread: BELOW * level,
        samples: flat.iter().map(|half| half.length).sum(),
        runs: flat.len(),
        longest: flat.iter().map(|half| half.length).max().unwrap_or(0),
        first: flat[0].start,
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, sum};
    use super::*;

    fn ring(omega: f64, ratio: f64, phase: f64) -> Vec<f64> {
        let at = |i: usize| (-ratio * omega * i as f64).exp() * (omega * i as f64 + phase).sin();
        (0..6000).map(at).collect()
    }

    /// Cut off at a level, then through a low-pass of second order.
    fn cut(samples: &[f64], level: f64, pass: f64) -> Vec<f64> {
        let mut state = [0.0; 2];
        let next = |x: &f64| {
            state[0] += pass * (x.clamp(-level, level) - state[0]);
            state[1] += pass * (state[0] - state[1]);
            state[1]
        };
        samples.iter().map(next).collect()
    }

    #[test]
    fn whole_decays_are_left_alone_and_overdriven_ones_found() {
        for omega in [0.03, 0.1, 0.2] {
            for ratio in [0.003, 0.01, 0.03] {
                for phase in [0.0, 0.7, 1.6] {
                    let whole = ring(omega, ratio, phase);
                    let what = format!("{omega} {ratio} {phase}");
                    let noisy = sum(
                        &whole,
                        &noise(3, 6000).iter().map(|x| 0.01 * x).collect::<Vec<_>>(),
                    );
                    assert_eq!(flat_tops(&whole), None, "{what}");
                    assert_eq!(flat_tops(&noisy), None, "{what}");
                    let second = ring(6.3 * omega, ratio, 0.4);
                    let two: Vec<f64> = second.iter().map(|x| 0.3 * x).collect();
                    assert_eq!(flat_tops(&sum(&whole, &two)), None, "{what}");
                    // Cut off to the end, nothing shows how it would have gone on.
                    let left = (-ratio * omega * 6000.0).exp();
                    // Of few cycles above the level, not two are flat enough.
                    let cycles = |level: f64| -level.ln() / (std::f64::consts::TAU * ratio);
                    let is_seen = |level: &f64| left < 0.5 * level && cycles(*level) > 5.0;
                    for level in [0.3, 0.5].into_iter().filter(is_seen) {
                        let found = flat_tops(&cut(&noisy, level, 4.0 * omega.min(0.2)));
                        let found = found.unwrap_or_else(|| panic!("{what} {level}"));
                        let rail = found.high.or(found.low).unwrap();
                        let off = (rail.value.abs() / level - 1.0).abs();
                        assert!(off < 0.05, "{what} {level}: {rail:?}");
                    }
                }
            }
        }
    }
}
