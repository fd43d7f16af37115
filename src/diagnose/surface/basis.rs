//! Basis functions of a surface: of displacement, speed and history.

use super::motion::MeasuredMotion;

/// Number of knots over displacement and over speed.
pub const KNOTS: [usize; 2] = [33, 17];
/// Powers of displacement and speed in product terms.
const PRODUCTS: [[i32; 2]; 6] = [[1, 1], [1, 2], [2, 1], [1, 3], [2, 2], [3, 1]];
/// Number of knots over displacement of terms that change sign with the direction of motion.
const TURNING: usize = 11;
/// Speed, relative to the largest, above which the direction of motion counts in full.
const TURNED: f64 = 1.0 / 64.0;
/// Fraction of the samples beyond the outer knots at each end, and their minimum number.
const OUTSIDE: f64 = 1e-3;
const FEWEST: usize = 16;
/// Thresholds of slipping elements, relative to the largest displacement.
const SLIPS: [f64; 3] = [0.05, 0.15, 0.4];
/// Corner of a slow memory, relative to the natural frequency.
const SLOW: f64 = 0.1;

/// Knots of displacement and speed, common to all records.
pub struct Grid {
    pub x: Knots,
    pub speed: Knots,
    largest: [f64; 2],
}

/// Knots along an axis, and the density of the motion near each.
pub struct Knots {
    pub at: Vec<f64>,
    pub share: Vec<f64>,
}

/// The part of a surface to which a function belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfacePart {
    Displacement,
    Speed,
    Both,
    History,
}

impl SurfacePart {
    pub const ALL: [Self; 4] = [Self::Displacement, Self::Speed, Self::Both, Self::History];
}

impl Grid {
    pub fn of(motions: &[MeasuredMotion]) -> Self {
        let [low, high] = reached(motions, |m| &m.x);
        let [slow, fast] = reached(motions, |m| &m.speed);
        let place = |k: usize, count: usize| k as f64 / (count - 1) as f64;
        let fastest = fast.max(-slow);
        // Friction varies at low speed.
        let curved = |u: f64| fastest * u * u.abs();
        let [many, few] = KNOTS;
        let x = (0..many).map(|k| low + (high - low) * place(k, many));
        let speed = (0..few).map(|k| curved(2.0 * place(k, few) - 1.0));
        Self {
            x: Knots::of(x.collect(), motions.iter().map(|m| m.x.as_slice())),
            speed: Knots::of(speed.collect(), motions.iter().map(|m| m.speed.as_slice())),
            largest: [high.max(-low), fastest],
        }
    }

    /// Scale of the functions, in units of displacement.
    pub fn size(&self) -> f64 {
        self.largest[0]
    }

    /// Part of the surface of each function, in the order of [`Grid::functions`].
    pub fn parts() -> Vec<SurfacePart> {
        let [displacements, speeds] = KNOTS;
        let mut parts = vec![SurfacePart::Displacement; displacements];
        parts.extend(vec![SurfacePart::Speed; speeds]);
        parts.extend([SurfacePart::Both; PRODUCTS.len() + TURNING]);
        parts.extend([SurfacePart::History; SLIPS.len() + 1]);
        parts
    }

    /// Values of each function along a motion, in units of displacement; `step` is the natural angular frequency over
    /// the rate.
    pub fn functions<'a>(
        &self,
        motion: &'a MeasuredMotion,
        step: f64,
    ) -> impl Iterator<Item = Vec<f64>> + use<'a> {
        let [largest, fastest] = self.largest;
        let of_x = hats(self.x.at.clone(), &motion.x, largest);
        let of_speed = hats(self.speed.at.clone(), &motion.speed, largest);
        let products = PRODUCTS.into_iter().map(move |[i, j]| {
            let pairs = motion.x.iter().zip(&motion.speed);
            let part = |value: &f64, largest: f64| (value / largest).clamp(-1.0, 1.0);
            let product = |(x, v): (&f64, &f64)| {
                largest * part(x, largest).powi(i) * part(v, fastest).powi(j)
            };
            pairs.map(product).collect()
        });
        let slips = SLIPS.into_iter();
        let slips = slips.map(move |slip| slipping(&motion.x, slip * largest));
        let slow = std::iter::once_with(move || relaxing(&motion.x, SLOW * step));
        let of_both = products.chain(self.turning(motion));
        of_x.chain(of_speed).chain(of_both).chain(slips).chain(slow)
    }

    /// Functions of displacement that change sign with the direction of motion: position-dependent friction.
    fn turning<'a>(&self, motion: &'a MeasuredMotion) -> impl Iterator<Item = Vec<f64>> + use<'a> {
        let [largest, fastest] = self.largest;
        let (first, last) = (self.x.at[0], self.x.at[self.x.at.len() - 1]);
        let knot = |k: usize| first + (last - first) * k as f64 / (TURNING - 1) as f64;
        let knots = (0..TURNING).map(knot).collect();
        hats(knots, &motion.x, largest).map(move |mut hat| {
            for (value, speed) in hat.iter_mut().zip(&motion.speed) {
                *value *= (speed / (TURNED * fastest)).clamp(-1.0, 1.0);
            }
            hat
        })
    }
}

/// The range of a motion without its outermost values: what few samples determine beyond must not be extrapolated to
/// where another record goes.
fn reached(motions: &[MeasuredMotion], of: fn(&MeasuredMotion) -> &[f64]) -> [f64; 2] {
    let mut all: Vec<f64> = motions.iter().flat_map(of).copied().collect();
    let outside = (OUTSIDE * all.len() as f64).ceil() as usize;
    let outside = outside.max(FEWEST).min((all.len() - 1) / 2);
    let last = all.len() - 1 - outside;
    let low = *all.select_nth_unstable_by(outside, f64::total_cmp).1;
    let high = *all.select_nth_unstable_by(last, f64::total_cmp).1;
    [low, high]
}

impl Knots {
    fn of<'a>(at: Vec<f64>, motions: impl Iterator<Item = &'a [f64]>) -> Self {
        let mut share = vec![0.0; at.len()];
        let mut whole = 0.0;
        for motion in motions {
            for (share, hat) in share.iter_mut().zip(hats(at.clone(), motion, 1.0)) {
                *share += hat.iter().sum::<f64>();
            }
            whole += motion.len() as f64;
        }
        share.iter_mut().for_each(|s| *s /= whole);
        Self { at, share }
    }
}

/// Piecewise linear functions that are `size` at one knot and zero at all others; linearly extrapolated beyond the
/// outer knots.
fn hats(knots: Vec<f64>, at: &[f64], size: f64) -> impl Iterator<Item = Vec<f64>> {
    (0..knots.len()).map(move |k| {
        let value = |x: &f64| {
            let right = knots.partition_point(|k| k < x).clamp(1, knots.len() - 1);
            let (low, high) = (knots[right - 1], knots[right]);
            let part = (x - low) / (high - low);
            match k {
                k if k + 1 == right => size * (1.0 - part),
                k if k == right => size * part,
                _ => 0.0,
            }
        };
        at.iter().map(value).collect()
    })
}

/// A spring that slips where its force would exceed a threshold (Jenkins element).
fn slipping(x: &[f64], threshold: f64) -> Vec<f64> {
    let (mut force, mut last) = (0.0, x.first().copied().unwrap_or(0.0));
    let next = |x: &f64| {
        force = (force + x - last).clamp(-threshold, threshold);
        last = *x;
        force
    };
    x.iter().map(next).collect()
}

/// A displacement through a slow lag: `z' = ω (x − z)`, `step = ω/f_s`.
fn relaxing(x: &[f64], step: f64) -> Vec<f64> {
    let share = 1.0 - (-step).exp();
    let mut z = 0.0;
    let next = |x: &f64| {
        z += share * (x - z);
        z
    };
    x.iter().map(next).collect()
}
