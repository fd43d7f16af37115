//! Peaks of a decay clipped by an amplifier and rounded again by the filter after it.

use super::clipping::{Clipping, Rail};
use super::median;

/// Minimum number of samples of a half cycle that is judged.
const SHORTEST: usize = 8;
/// Fraction of the peak above which its width is measured.
const HIGH: f64 = 0.9;
/// Minimum fraction of a half cycle above `HIGH` for a flat top; a sine has `1 − 2 arcsin(0.9)/π` = 0.287, a
/// square wave 1.
const FLAT: f64 = 0.42;
/// Maximum of that fraction for a normal peak.
const ROUND: f64 = 0.36;
/// Largest relative difference between the levels of flat peaks.
const LEVEL: f64 = 0.03;
/// Minimum number of flat peaks on one side.
const FEWEST: usize = 2;
/// Relative distance below the level from which a peak was not clipped.
const BELOW: f64 = 0.15;

/// A half cycle of a decay.
struct HalfCycle {
    start: usize,
    length: usize,
    peak: f64,
    /// Fraction of its samples above 0.9 of the peak.
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

/// Detects clipping of the first peaks of a decay at a level below the recorder's limit, followed by a filter.
///
/// From the largest peak on, the half cycles on one side of the median are examined in order: the first ones are
/// clipped if two or more have the same height within 3 % and more than 42 % of their time above 0.9 of it, and all
/// later ones are lower and as round as a sine. Samples within 15 % of the level count as clipped, since the filter
/// smears that.
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

/// The level of the first half cycles on one side of the median, if they are clipped.
fn rail(side: &[HalfCycle]) -> Option<Rail> {
    let level = side.iter().fold(0.0_f64, |most, half| most.max(half.peak));
    let is_flat = |half: &&HalfCycle| half.breadth > FLAT && half.peak > (1.0 - LEVEL) * level;
    let flat: Vec<&HalfCycle> = side.iter().take_while(is_flat).collect();
    // Between flat and round peaks the filter hides the level.
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

    /// Clipped at a level, then low-pass filtered, second order.
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
                    // If all peaks are clipped, the continuation is unknown.
                    let left = (-ratio * omega * 6000.0).exp();
                    // With few cycles above the level, fewer than two are flat enough.
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
