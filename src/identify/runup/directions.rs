//! Direction of motion at each sample, and where it is uncertain.

use statrs::distribution::{ContinuousCDF, Normal};
use torqcomp_dsp::weak::Window;

use super::resolution::{noise_variance, stay};
use super::turns::{Speeds, Turn};
use super::{FreeRun, LEAST_WINDOWS, SHORTEST_HALF};
use crate::failure::Failure;
use crate::identify::Motion;

/// Minimum fraction of a record that counts as motion in a direction.
const DIRECTION: f64 = 0.02;

/// Samples next to an uncertain interval whose direction smoothing may have changed.
const NEAR: usize = 2;

/// Speed and direction at every sample.
pub(in crate::identify) struct Directions {
    /// Speed; `None` for an acceleration, which gives it only up to a constant.
    pub speed: Option<Vec<f64>>,
    /// Mean sign of the speed over a sample's interval, −1 to 1; proportional to the speed where that is within the
    /// noise.
    pub sign: Vec<f64>,
    /// Whether the body stops, reverses or moves too slowly at a sample, or within the smoothing of the speed
    /// around it.
    pub unsure: Vec<bool>,
    /// Whether the body moves at a sample and within the smoothing around it, as far as the noise shows. At rest, dry
    /// friction balances whatever acts.
    pub moves: Vec<bool>,
    /// Variance of the noise of the motion while the body moves.
    pub noise_variance: f64,
    forward: bool,
    backward: bool,
}

impl Directions {
    /// Directions in a run.
    ///
    /// # Errors
    /// If the record is too short for the speed window.
    pub fn of(run: &FreeRun) -> Result<Self, Failure> {
        let count = run.motion.len();
        if run.kind == Motion::Acceleration {
            return Ok(Self {
                speed: None,
                sign: vec![1.0; count],
                unsure: vec![false; count],
                moves: vec![true; count],
                noise_variance: noise_variance(run.motion),
                forward: true,
                backward: false,
            });
        }
        let mut half = SHORTEST_HALF.max(count / 2000).min(20);
        if run.kind == Motion::Displacement {
            // Between two counts of an encoder, the angle stands still.
            let counts = SHORTEST_HALF / 2 * stay(run.motion);
            half = half.max(counts.min(count / (2 * LEAST_WINDOWS)));
        }
        let (speed, mut sign) = smoothed(run, half)?;
        let moves = sign.iter().filter(|v| v.abs() == 1.0).count() as f64;
        let share = |s: f64| sign.iter().filter(|v| **v == s).count() as f64 / moves;
        let (forward, backward) = (share(1.0) > DIRECTION, share(-1.0) > DIRECTION);
        let speeds = Speeds {
            motion: run.motion,
            is_position: run.kind == Motion::Displacement,
            reach: 2 * half,
        };
        let uncertain = uncertain(&sign);
        let (mut unsure, mut moves) = (vec![false; count], vec![true; count]);
        for (from, to) in uncertain {
            let (first, last) = (from.saturating_sub(half), (to + half).min(count - 1));
            unsure[first..=last].fill(true);
            // An opposite direction afterwards means that it reversed or stopped in between.
            let turns = from > 0 && to < count && sign[from - 1] * sign[to] < 0.0;
            let turn = turns.then(|| speeds.turn(from.saturating_sub(NEAR), to + NEAR));
            if let Some(Turn::At(place)) = turn {
                let way = sign[from - 1];
                step(&mut sign, way, place, first, last);
            } else if from < to {
                moves[first..=last].fill(false);
            }
        }
        let noise_variance = noise_variance(&chosen(run.motion, &moves));
        Ok(Self {
            unsure,
            moves,
            noise_variance,
            sign,
            speed: Some(speed),
            forward,
            backward,
        })
    }

    /// The samples at which the body moves, without what takes more memory.
    pub fn into_moves(self) -> Vec<bool> {
        self.moves
    }

    /// The samples in which the body moves.
    pub fn moving(&self, samples: &[f64]) -> Vec<f64> {
        chosen(samples, &self.moves)
    }

    /// Whether the body moved in both directions.
    pub fn both(&self) -> bool {
        self.forward && self.backward
    }
}

/// The chosen values.
pub(super) fn chosen(values: &[f64], which: &[bool]) -> Vec<f64> {
    let pairs = values.iter().zip(which);
    pairs.filter(|(_, is)| **is).map(|(v, _)| *v).collect()
}

/// Speed at every sample, and its sign, proportional to the speed within the noise.
fn smoothed(run: &FreeRun, half: usize) -> Result<(Vec<f64>, Vec<f64>), Failure> {
    let count = run.motion.len();
    let order = 1 - run.kind.order() as usize;
    let window = Window::new(half, run.rate_hz)?;
    let mut speed = window.slide(run.motion, order);
    let (first, last) = (speed[0], speed[speed.len() - 1]);
    speed.splice(0..0, vec![first; half]);
    speed.resize(count, last);
    let noise = (noise_variance(run.motion) * window.noise(order, order)).sqrt();
    let largest = speed.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let dead = (3.0 * noise).max(1e-9 * largest);
    let sign = signs(&speed, dead, chauvenet(count) * noise);
    Ok((speed, sign))
}

/// Sign of each speed, proportional to it below `dead`. Noise exceeds that now and then in a long rest, so a stretch
/// beyond it counts only if it reaches `least` somewhere.
fn signs(speed: &[f64], dead: f64, least: f64) -> Vec<f64> {
    let way = |v: f64| (v / dead).clamp(-1.0, 1.0).trunc();
    let stretches = speed.chunk_by(|a, b| way(*a) == way(*b));
    let of = |stretch: &[f64]| -> Vec<f64> {
        let most = stretch.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let full = if most < least { least.max(dead) } else { dead };
        stretch
            .iter()
            .map(|v| (v / full).clamp(-1.0, 1.0))
            .collect()
    };
    stretches.flat_map(of).collect()
}

/// Standard deviations beyond which half of one normal value in `count` is expected (W. Chauvenet, A Manual
/// of Spherical and Practical Astronomy, 1863, II, 558): 3 for 185, 3.5 for 1100.
pub(super) fn chauvenet(count: usize) -> f64 {
    Normal::standard().inverse_cdf(1.0 - 0.25 / count.max(1) as f64)
}

/// Intervals of uncertain direction: the first sample, and the first one after. Between two samples of opposite
/// direction the interval is empty.
fn uncertain(sign: &[f64]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut i = 0;
    while i < sign.len() {
        if sign[i].abs() < 1.0 {
            let to = (i..sign.len()).find(|k| sign[*k].abs() == 1.0);
            let to = to.unwrap_or(sign.len());
            found.push((i, to));
            i = to;
        } else if i > 0 && sign[i] * sign[i - 1] == -1.0 {
            found.push((i, i));
        }
        i += 1;
    }
    found
}

/// Writes a sign change at a position between two samples: averaged with the weights 1 − x and x of the neighbours,
/// with a fraction a of the interval before the step, it adds a − a²/2 − (½ − a + a²/2) to the one and a²/2 − (½ −
/// a²/2) to the other.
fn step(sign: &mut [f64], way: f64, place: f64, from: usize, to: usize) {
    for (i, s) in sign.iter_mut().enumerate().take(to + 1).skip(from) {
        *s = if (i as f64) <= place { way } else { -way };
    }
    let before = place.floor() as usize;
    if before + 1 < sign.len() {
        let a = place - before as f64;
        let early = 0.5 * a * a;
        sign[before] = way * (0.5 + (a - early) - (0.5 - a + early));
        sign[before + 1] = way * (early - (0.5 - early) - 0.5);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_between_two_samples_is_placed_where_it_is() {
        let mut sign = [1.0, 1.0, -1.0, -1.0];
        // A quarter of the way from sample 1 to sample 2.
        step(&mut sign, 1.0, 1.25, 0, 3);
        // Sample 1: ½ + (¼ − 1/32) − (½ − ¼ + 1/32) = 0.4375; sample 2: 1/32 − (½ − 1/32) − ½.
        assert_eq!(sign, [1.0, 0.4375, -0.9375, -1.0]);
        // The area is that of the step: 1.25 to the left, 1.75 to the right, of three intervals.
        assert!((sign[1] + sign[2] - (1.25 - 1.75)).abs() < 1e-15);
    }

    #[test]
    fn turns_and_stops_are_doubtful() {
        let signs = [1.0, 1.0, -1.0, -1.0, 0.0, 0.3, 1.0, 1.0, -0.5];
        assert_eq!(uncertain(&signs), [(2, 2), (4, 6), (8, 9)]);
        assert_eq!(uncertain(&[1.0; 5]), []);
    }
}
