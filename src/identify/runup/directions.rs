//! Which way a body moves at each sample, and where that is not known.

use torqcomp_dsp::weak::{Window, white_noise_variance};

use super::{Motion, Run, SHORTEST_HALF};
use crate::failure::Failure;

/// Part of a record that goes one way before it counts as a direction.
const DIRECTION: f64 = 0.02;

/// Speed at every sample and its direction.
pub(in crate::identify) struct Directions {
    /// Speed, if the motion tells it absolutely.
    pub speed: Option<Vec<f64>>,
    /// −1 to 1 at each sample: the sign of the speed over the sample's share of time, with a slope
    /// where it drowns in noise.
    pub sign: Vec<f64>,
    /// Whether the body stands, turns round or moves too slowly to tell at a sample or so near to it
    /// that the smoothing of the speed cannot tell.
    pub unsure: Vec<bool>,
    forward: bool,
    backward: bool,
}

impl Directions {
    /// Directions in a run.
    ///
    /// # Errors
    /// If the window of the speed cannot be made.
    pub fn of(run: &Run) -> Result<Self, Failure> {
        let count = run.motion.len();
        if run.kind == Motion::Acceleration {
            return Ok(Self {
                speed: None,
                sign: vec![1.0; count],
                unsure: vec![false; count],
                forward: true,
                backward: false,
            });
        }
        let order = run.kind.to_acceleration() - 1;
        let half = SHORTEST_HALF.max(count / 2000).min(20);
        let window = Window::new(half, run.rate_hz)?;
        let mut speed = window.slide(run.motion, order);
        let (first, last) = (speed[0], speed[speed.len() - 1]);
        speed.splice(0..0, vec![first; half]);
        speed.resize(count, last);
        let variance = white_noise_variance(run.motion).unwrap_or(0.0);
        let noise = (variance * window.noise(order, order)).sqrt();
        let largest = speed.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let dead = (3.0 * noise).max(1e-9 * largest);
        let clamped: Vec<f64> = speed.iter().map(|v| (v / dead).clamp(-1.0, 1.0)).collect();
        let share = |s: f64| clamped.iter().filter(|v| **v == s).count() as f64 / count as f64;
        let (forward, backward) = (share(1.0) > DIRECTION, share(-1.0) > DIRECTION);
        Ok(Self {
            unsure: unsure(&clamped, half),
            sign: over_cells(&clamped, &speed),
            speed: Some(speed),
            forward,
            backward,
        })
    }

    /// Whether the body moved both ways.
    pub fn both(&self) -> bool {
        self.forward && self.backward
    }
}

/// Samples within `margin` of one whose direction is not certain or is another than the one before.
fn unsure(clamped: &[f64], margin: usize) -> Vec<bool> {
    let count = clamped.len();
    let mut unsure = vec![false; count];
    // Everything up to here is marked already.
    let mut done = 0;
    for i in 0..count {
        let turns = i > 0 && clamped[i] != clamped[i - 1];
        if turns || clamped[i].abs() < 1.0 {
            let (from, to) = (
                i.saturating_sub(margin).max(done),
                (i + margin + 1).min(count),
            );
            unsure[from.min(to)..to].fill(true);
            done = to;
        }
    }
    unsure
}

/// Signs averaged over the time that belongs to each sample, a straight line between neighbours
/// telling when the speed goes through zero: with a = |v₀|/(|v₀| + |v₁|) the weights 1 − x and x of
/// the two samples give s₀(a − a²/2) + s₁(½ − a + a²/2) and s₀a²/2 + s₁(½ − a²/2).
fn over_cells(clamped: &[f64], speed: &[f64]) -> Vec<f64> {
    let last = clamped.len() - 1;
    let mut out = vec![0.0; clamped.len()];
    out[0] += 0.5 * clamped[0];
    out[last] += 0.5 * clamped[last];
    for i in 0..last {
        let (s, t) = (clamped[i], clamped[i + 1]);
        if s * t < 0.0 {
            let a = speed[i].abs() / (speed[i].abs() + speed[i + 1].abs());
            let early = 0.5 * a * a;
            out[i] += s * (a - early) + t * (0.5 - a + early);
            out[i + 1] += s * early + t * (0.5 - early);
        } else {
            out[i] += 0.5 * s;
            out[i + 1] += 0.5 * t;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_between_two_samples_is_placed_where_it_is() {
        // Through zero a quarter of the way from sample 1 to sample 2.
        let signs = over_cells(&[1.0, 1.0, -1.0, -1.0], &[5.0, 1.0, -3.0, -7.0]);
        // Sample 1: ½ + (¼ − 1/32) − (½ − ¼ + 1/32) = 0.4375; sample 2: 1/32 − (½ − 1/32) − ½.
        assert_eq!(signs, [1.0, 0.4375, -0.9375, -1.0]);
        // The area is that of the step: 1.25 to the left, 1.75 to the right, of three intervals.
        assert!((signs[1] + signs[2] - (1.25 - 1.75)).abs() < 1e-15);
    }

    #[test]
    fn what_lies_near_a_turn_or_a_stop_is_unsure() {
        let signs = [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 0.0, 1.0, 1.0, 1.0];
        let got: Vec<usize> = (0..12).filter(|i| unsure(&signs, 1)[*i]).collect();
        assert_eq!(got, [3, 4, 5, 7, 8, 9, 10]);
        assert!(unsure(&[1.0; 9], 3).iter().all(|u| !u));
    }
}
