//! Classification of the curves of a surface by shape.

use super::SurfacePlace;
use super::line::clear_line;
use super::report::SurfacePoint;

/// Minimum fraction of a curve's weighted power that a named shape must explain.
const ALIKE: f64 = 0.75;
/// Minimum uncertainty of a point, relative to the largest torque of its curve.
const BLUR: f64 = 0.05;
/// Half-width of a gap, relative to the largest displacement, above which it is an end stop.
const STOP: f64 = 0.35;
/// Characteristic speeds tried for a drop of friction, relative to the largest speed.
const FALLS: [f64; 3] = [0.05, 0.1, 0.2];

/// Shape of part of a surface, and the closest effects and laws.
#[derive(Debug, Clone, PartialEq)]
pub struct Resemblance {
    pub words: String,
    pub nearest: &'static [&'static str],
}

impl Resemblance {
    fn new(words: impl Into<String>, nearest: &'static [&'static str]) -> Self {
        Self {
            words: words.into(),
            nearest,
        }
    }

    pub fn damping_over_displacement() -> Self {
        Self::new(
            "friction or damping that depends on the displacement",
            &["squeezed-damping", "coulomb-friction"],
        )
    }

    pub fn loop_of_history() -> Self {
        Self::new(
            "a loop: the torque depends on the path to a displacement",
            &["bouc-wen-hysteresis", "backlash"],
        )
    }
}

/// A curve to be compared with a shape.
struct Curve<'a> {
    points: &'a [SurfacePoint],
    weights: Vec<f64>,
    largest: f64,
}

impl<'a> Curve<'a> {
    fn of(points: &'a [SurfacePoint]) -> Self {
        let largest = |of: fn(&SurfacePoint) -> f64| points.iter().map(of).fold(0.0, f64::max);
        let blur = BLUR * largest(|p| p.torque.abs());
        let weight = |p: &SurfacePoint| 1.0 / (p.std.powi(2) + blur.powi(2)).max(1e-300);
        Self {
            points,
            weights: points.iter().map(weight).collect(),
            largest: largest(|p| p.at.abs()),
        }
    }

    /// Amount of a shape, and the fraction of the curve's power that it explains; both without straight lines.
    fn alike(&self, shape: impl Fn(f64) -> f64) -> (f64, f64) {
        let at: Vec<f64> = self.points.iter().map(|p| p.at).collect();
        let bent = |of: &dyn Fn(&SurfacePoint) -> f64| {
            let mut values: Vec<f64> = self.points.iter().map(of).collect();
            clear_line(&mut values, &at, |k| self.weights[k]);
            values
        };
        let (torque, shape) = (bent(&|p| p.torque), bent(&|p| shape(p.at)));
        let product = |a: &[f64], b: &[f64]| -> f64 {
            let all = self.weights.iter().zip(a).zip(b);
            all.map(|((w, a), b)| w * a * b).sum()
        };
        let own = product(&shape, &shape).max(1e-300);
        let along = product(&torque, &shape);
        let whole = product(&torque, &torque).max(1e-300);
        (along / own, along * along / (own * whole))
    }

    /// The shape that explains most, if any explains enough: its index, amount and corner.
    fn best(&self, shapes: &[CornerShape]) -> Option<(usize, f64, f64)> {
        let mut best = (0, 0.0, 0.0, ALIKE);
        for (k, (shape, corners)) in shapes.iter().enumerate() {
            for corner in corners.iter() {
                let (amount, share) = self.alike(|x| shape(x, *corner));
                if share > best.3 {
                    best = (k, amount, *corner, share);
                }
            }
        }
        (best.1 != 0.0).then_some((best.0, best.1, best.2))
    }
}

/// A curve with a corner, and the corners tried.
type CornerShape<'a> = (&'a dyn Fn(f64, f64) -> f64, &'a [f64]);

/// Resemblance of a torque over displacement.
pub fn of_displacement(points: &[SurfacePoint], place: SurfacePlace) -> Resemblance {
    let cube = |x: f64, _: f64| x.powi(3);
    let square = |x: f64, _: f64| x * x;
    let gap = |x: f64, g: f64| x - x.clamp(-g, g);
    let above = |x: f64, g: f64| (x - g).max(0.0);
    let below = |x: f64, g: f64| (x + g).min(0.0);
    let curve = Curve::of(points);
    let once: &[f64] = &[1.0];
    let corners: Vec<f64> = points.iter().map(|p| p.at.abs()).collect();
    let corners = corners.as_slice();
    let found = curve.best(&[
        (&cube, once),
        (&square, once),
        (&gap, corners),
        (&above, corners),
        (&below, corners),
    ]);
    let Some((shape, amount, corner)) = found else {
        return Resemblance::new("a torque with no simple dependence on displacement", &[]);
    };
    if place == SurfacePlace::Gage {
        let nearest: &[&str] = &["gage-nonlinearity", "saturation"];
        return Resemblance::new(
            "a nonlinear characteristic of the gage or its amplifier",
            nearest,
        );
    }
    let is_near = corner < STOP * curve.largest;
    let grows = amount > 0.0;
    match (shape, grows) {
        (0, true) => Resemblance::new(
            "a stiffness that grows with the displacement",
            &["cubic-stiffness", "quintic-stiffness"],
        ),
        (0, false) => Resemblance::new(
            "a stiffness that falls with the displacement",
            &["cubic-stiffness", "bouc-wen-hysteresis", "saturation"],
        ),
        (1, _) => Resemblance::new(
            "a stiffness that differs between the two directions",
            &["quadratic-stiffness"],
        ),
        (2, true) if is_near => Resemblance::new("a gap around zero", &["backlash"]),
        (2, true) => Resemblance::new("a stop in both directions", &["end-stop"]),
        (2, false) => Resemblance::new(
            "a torque that rises more slowly beyond some displacement",
            &["bouc-wen-hysteresis", "saturation"],
        ),
        (3, true) | (4, true) => Resemblance::new("a stop in one direction", &["end-stop"]),
        _ => Resemblance::new(
            "a stiffness that falls beyond some displacement in one direction",
            &["quadratic-stiffness", "saturation"],
        ),
    }
}

/// Resemblance of a torque over speed.
pub fn of_speed(points: &[SurfacePoint]) -> Resemblance {
    let direction = |v: f64, _: f64| if v == 0.0 { 0.0 } else { v.signum() };
    let square = |v: f64, _: f64| v * v.abs();
    let cube = |v: f64, _: f64| v.powi(3);
    let falling = |v: f64, s: f64| direction(v, s) * (-v.abs() / s).exp();
    let one_way = |v: f64, _: f64| v * v;
    let curve = Curve::of(points);
    let once: &[f64] = &[1.0];
    let falls = FALLS.map(|part| part * curve.largest);
    let found = curve.best(&[
        (&direction, once),
        (&square, once),
        (&cube, once),
        (&falling, &falls),
        (&one_way, once),
    ]);
    match found.map(|(shape, amount, _)| (shape, amount > 0.0)) {
        Some((0, true)) => Resemblance::new("dry friction", &["coulomb-friction"]),
        Some((3, true)) => {
            Resemblance::new("friction that falls with the speed", &["coulomb-friction"])
        }
        Some((1 | 2, true)) => Resemblance::new(
            "damping that grows with the speed",
            &["quadratic-damping", "cubic-damping"],
        ),
        Some((4, _)) => Resemblance::new(
            "damping that differs between the two directions",
            &["quadratic-damping"],
        ),
        Some((1 | 2, false)) => {
            Resemblance::new("damping that falls with the speed", &["coulomb-friction"])
        }
        _ => Resemblance::new("a torque with no simple dependence on speed", &[]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(torque: impl Fn(f64) -> f64) -> Vec<SurfacePoint> {
        let points = (-8..=8).map(|k| {
            let at = 0.25 * f64::from(k);
            SurfacePoint {
                at,
                torque: torque(at),
                std: 0.01,
            }
        });
        points.collect()
    }

    #[test]
    fn shapes_are_told_apart_by_their_bends() {
        let of = |torque: &dyn Fn(f64) -> f64| {
            of_displacement(&curve(torque), SurfacePlace::Stand).nearest[0]
        };
        // The straight line belongs to the stand's constants.
        assert_eq!(of(&|x| 0.1 * x.powi(3) - 3.0 * x), "cubic-stiffness");
        assert_eq!(of(&|x| 0.2 * x * x + x), "quadratic-stiffness");
        assert_eq!(of(&|x| x - x.clamp(-0.4, 0.4)), "backlash");
        assert_eq!(of(&|x| 2.0 * (x - x.clamp(-1.4, 1.4))), "end-stop");
        assert_eq!(of(&|x| 5.0 * (x - 1.2).max(0.0)), "end-stop");
        assert_eq!(of(&|x| x.clamp(-1.0, 1.0)), "bouc-wen-hysteresis");
        let wavy = of_displacement(&curve(|x| (7.0 * x).sin()), SurfacePlace::Stand);
        assert!(wavy.nearest.is_empty() && wavy.words.contains("no simple dependence"));
    }

    #[test]
    fn frictions_are_told_apart() {
        let of = |torque: &dyn Fn(f64) -> f64| of_speed(&curve(torque)).words;
        let sign = |v: f64| if v == 0.0 { 0.0 } else { v.signum() };
        assert_eq!(of(&|v| 0.3 * sign(v) + v), "dry friction");
        assert_eq!(of(&|v| v * v.abs()), "damping that grows with the speed");
        assert_eq!(
            of(&|v| sign(v) * (-4.0 * v.abs()).exp()),
            "friction that falls with the speed"
        );
    }
}
