//! Reversals of a body, located from the motion on either side.
//!
//! Dry friction, and with it the acceleration, jumps at a zero crossing of the speed: the speed has a kink there, which
//! smoothing would shift. So one parabola is fitted to the speed before and another to the speed after; both reach zero
//! at the same moment if the body reverses, and at two if it stops in between.

use nalgebra::{DMatrix, DVector};

/// Motion of a body where the sign of its speed is uncertain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Turn {
    /// It reverses at this position, in samples.
    At(f64),
    /// It stops, or moves too slowly to locate a reversal.
    Stands,
}

/// Distance of both zeros, in samples and beyond what noise explains, above which the body stops.
const APART: f64 = 0.2;
/// Number of standard deviations explained by noise.
const CERTAIN: f64 = 4.0;

/// Speeds of a record near a reversal.
pub(super) struct Speeds<'a> {
    /// Position, or speed itself.
    pub motion: &'a [f64],
    /// Whether the motion is a position.
    pub is_position: bool,
    /// Number of samples on each side for a parabola.
    pub reach: usize,
}

impl Speeds<'_> {
    /// Speed in units of the motion per sample (or as given), and its position in samples.
    fn at(&self, i: usize) -> (f64, f64) {
        if self.is_position {
            (i as f64 + 0.5, self.motion[i + 1] - self.motion[i])
        } else {
            (i as f64, self.motion[i])
        }
    }

    /// Motion between samples `from` and `to`, before and after which the direction is certain.
    pub fn turn(&self, from: usize, to: usize) -> Turn {
        let last = self.motion.len() - 1 - usize::from(self.is_position);
        let before: Vec<usize> = (from.saturating_sub(self.reach)..from).collect();
        let after: Vec<usize> = (to..(to + self.reach).min(last + 1)).collect();
        let (Some(left), Some(right)) = (self.zero(&before, from), self.zero(&after, to)) else {
            return Turn::Stands;
        };
        let noise = CERTAIN * left.1.hypot(right.1);
        if (left.0 - right.0).abs() > APART + noise {
            return Turn::Stands;
        }
        // Weighted by their uncertainties.
        let floor = 1e-9;
        let (a, b) = ((left.1 + floor).powi(-2), (right.1 + floor).powi(-2));
        Turn::At((a * left.0 + b * right.0) / (a + b))
    }

    /// Zero, near a position, of a parabola fitted to these speeds, and its standard uncertainty.
    fn zero(&self, samples: &[usize], near: usize) -> Option<(f64, f64)> {
        if samples.len() < 6 {
            return None;
        }
        let origin = near as f64;
        let points: Vec<(f64, f64)> = samples.iter().map(|i| self.at(*i)).collect();
        let design = DMatrix::from_fn(points.len(), 3, |r, c| {
            (points[r].0 - origin).powi(c as i32)
        });
        let right = DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
        let inverse = design.tr_mul(&design).try_inverse()?;
        let c = &inverse * design.tr_mul(&right);
        let left = (&design * &c - right).norm_squared() / (points.len() - 3) as f64;
        let mut x = 0.0;
        for _ in 0..8 {
            let slope = c[1] + 2.0 * c[2] * x;
            x -= (c[0] + c[1] * x + c[2] * x * x) / slope;
        }
        let slope = c[1] + 2.0 * c[2] * x;
        let there = DVector::from_column_slice(&[1.0, x, x * x]);
        let std = (left * there.dot(&(inverse * &there))).sqrt() / slope.abs();
        (x.is_finite() && x.abs() < 2.0 * self.reach as f64).then_some((origin + x, std))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Acceleration of 4 units per sample² before the moment and 2 after, with a stop of `stop`
    /// samples.
    fn position(moment: f64, stop: f64) -> Vec<f64> {
        let one = |i: i32| {
            let t = f64::from(i) - moment;
            if t < 0.0 {
                -2.0 * t * t
            } else {
                -(t - stop).max(0.0).powi(2)
            }
        };
        (0..80).map(one).collect()
    }

    #[test]
    fn a_kink_is_placed_where_it_is_and_a_stop_is_told() {
        let speeds = |motion| Speeds {
            motion,
            is_position: true,
            reach: 16,
        };
        let motion = position(40.3, 0.0);
        let Turn::At(place) = speeds(&motion).turn(38, 43) else {
            panic!("it turns");
        };
        assert!((place - 40.3).abs() < 1e-9, "{place}");
        let motion = position(40.3, 3.0);
        assert_eq!(speeds(&motion).turn(38, 46), Turn::Stands);
    }
}
