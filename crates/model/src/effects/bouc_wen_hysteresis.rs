//! Smooth hysteresis of joints and clamps.
//!
//! `n = k z`, `z' = x' − (b |x'| z + c x' |z|)` (`linear`; `shown`: the gage shows it), or with exponent `m` instead of
//! 1 (`exponent`): `z' = x' − |s z|^m (b |x'| sgn z + c x')/s`, `s = b + |c|`. In `part` and `exponent-part` a share of
//! the stand's own stiffness is hysteretic, `n = k (z − x)`: the record is then the whole stiffness times the
//! displacement. Y. K. Wen, *Method for random vibration of hysteretic systems*, J. Eng. Mech. Div. 102 (1976), 249.
//! **Valid without drift of the loops**; does not close small inner loops as metals do. Mistaken for `coulomb-friction`
//! (its limit for a stiff joint), `structural-damping` at one level.
//!
//! The law is rate-independent: `z` follows the steps of `x`, to second order.

use super::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque};

const PART: EffectParameter = EffectParameter::number("stiffness_ratio", 0.0, 50.0);
/// Without loss the loops are closed, and only a nonlinear spring remains.
const LOSS: EffectParameter = EffectParameter::motion("loss", -1, 0, 0.0, 100.0).essential();
const SHAPE: EffectParameter = EffectParameter::motion("shape", -1, 0, -100.0, 100.0);
const SHARE: EffectParameter = EffectParameter::number("stiffness_share", 0.0, 1.0);
const EXPONENT: EffectParameter = EffectParameter::number("exponent", 1.0, 5.0);
const CURVED: &[&[f64]] = &[
    &[0.1, 0.5, 0.1, 1.5],
    &[0.5, 0.7, 0.3, 2.0],
    &[0.2, 1.0, 0.3, 2.0],
];
const STARTS: &[&[f64]] = &[
    &[0.02, 0.5, 0.0],
    &[0.1, 0.5, 0.0],
    &[0.5, 1.0, 0.5],
    &[1.0, 0.5, -0.5],
    &[1.0, 0.5, 0.2],
];

pub(super) static EFFECT: Effect = Effect {
    name: "bouc-wen-hysteresis",
    equation: "n = k z, z' = x' - b |x'| z - c x' |z|",
    meaning: "A joint or clamp slips slightly at each reversal, and its torque depends on the history of the motion.",
    remedy: "Clean and tighten clamps and bolts, or weld or glue the joint that slips.",
    source: "Y. K. Wen, J. Eng. Mech. Div. 102 (1976), 249",
    validity: "for loops that do not drift",
    mistaken_for: &["coulomb-friction", "backlash", "structural-damping"],
    experiment: "slow loading and unloading with inner loops, at two rates",
    forms: &[
        Form {
            name: "linear",
            law: "n = k z, z' = x' - b |x'| z - c x' |z|",
            stage: Stage::Stand,
            parameters: &[PART, LOSS, SHAPE],
            starts: STARTS,
            build: |p| Action::beside(BoucWen::of(p)),
        },
        Form {
            name: "shown",
            law: "n = k z as in linear; the gage shows x + n",
            stage: Stage::Stand,
            parameters: &[PART, LOSS, SHAPE],
            starts: STARTS,
            build: |p| Action::in_gage_path(BoucWen::of(p)),
        },
        Form {
            name: "part",
            law: "n = k (z - x), z as in linear: a share k of the stand's own stiffness",
            stage: Stage::Stand,
            parameters: &[SHARE, LOSS, SHAPE],
            starts: STARTS,
            build: |p| Action::beside(StiffnessShare::of(p)),
        },
        Form {
            name: "exponent-part",
            law: "n = k (z - x), z as in exponent",
            stage: Stage::Stand,
            parameters: &[SHARE, LOSS, SHAPE, EXPONENT],
            starts: CURVED,
            build: |p| Action::beside(StiffnessShare::of(p)),
        },
        Form {
            name: "exponent",
            law: "n = k z, z' = x' - |s z|^m (b |x'| sgn z + c x')/s, s = b + |c|",
            stage: Stage::Stand,
            parameters: &[PART, LOSS, SHAPE, EXPONENT],
            starts: CURVED,
            build: |p| Action::beside(BoucWen::of(p)),
        },
        Form {
            name: "exponent-shown",
            law: "n = k z as in exponent; the gage shows x + n",
            stage: Stage::Stand,
            parameters: &[PART, LOSS, SHAPE, EXPONENT],
            starts: CURVED,
            build: |p| Action::in_gage_path(BoucWen::of(p)),
        },
    ],
};

struct BoucWen {
    ratio: f64,
    loss: f64,
    shape: f64,
    exponent: f64,
}

impl BoucWen {
    fn of(p: &[f64]) -> Self {
        Self {
            ratio: p[0],
            loss: p[1],
            shape: p[2],
            exponent: p.get(3).copied().unwrap_or(1.0),
        }
    }

    /// `f = dz/dx = 1 − |s z|^m g/s` for a step of that sign, with `g = b sgn(x' z) + c`, and
    /// `df/dz = −m |s z|^(m−1) g sgn z`.
    fn slope(&self, z: f64, step: f64) -> [f64; 2] {
        let sum = self.loss.copysign(step * z) + self.shape;
        // A common scale of z for loss and shape keeps the two comparable for any exponent.
        let power = match self.exponent == 1.0 {
            true => 1.0,
            false => (z.abs() * (self.loss + self.shape.abs())).powf(self.exponent - 1.0),
        };
        let bend = power * sum;
        [1.0 - bend * z.abs(), -self.exponent * bend * z.signum()]
    }

    /// `z` after a step of `x`, to second order: by its Taylor series, or by the midpoint rule if it changes its sign,
    /// where `f` has a bend.
    fn after(&self, z: f64, step: f64) -> f64 {
        let [slope, change] = self.slope(z, step);
        let next = z + step * slope * (1.0 + 0.5 * step * change);
        if next * z > 0.0 {
            return next;
        }
        let middle = z + 0.5 * step * slope;
        z + step * self.slope(middle, step)[0]
    }
}

impl Torque for BoucWen {
    fn value(&self, memory: &mut Memory, x: f64, _: f64) -> f64 {
        let [z, last] = *memory;
        *memory = [self.after(z, x - last), x];
        self.ratio * memory[0]
    }

    fn stiffness(&self) -> f64 {
        self.ratio
    }

    fn begin(&self, x: f64) -> Memory {
        [0.0, x]
    }
}

/// A share of the stand's own stiffness is hysteretic: `n = k (z − x)`.
struct StiffnessShare {
    whole: BoucWen,
}

impl StiffnessShare {
    fn of(p: &[f64]) -> Self {
        Self {
            whole: BoucWen::of(p),
        }
    }
}

impl Torque for StiffnessShare {
    fn value(&self, memory: &mut Memory, x: f64, speed: f64) -> f64 {
        self.whole.value(memory, x, speed) - self.whole.ratio * x
    }

    fn begin(&self, x: f64) -> Memory {
        // The joint has not slipped yet.
        [x, x]
    }
}
