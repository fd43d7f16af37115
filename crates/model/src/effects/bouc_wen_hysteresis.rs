//! Hysteresis with memory, smooth, of joints and clamps.
//!
//! `n = k z`, `z' = x' − (b |x'| z |z|^{m−1} + c x' |z|^m)`, `m = 1` or `2`. Y. K. Wen, *Method for random vibration of
//! hysteretic systems*, J. Eng. Mech. Div. 102 (1976), 249. **Valid without drift of the loops**; does
//! not close small inner loops as metals do. Mistaken for `coulomb-friction` (its limit for a stiff joint),
//! `structural-damping` at one level.
//!
//! The law does not depend on rate: `z` follows the steps of `x`, by the midpoint rule.

use super::{Action, Effect, Form, Memory, Parameter, Place, Torque};

const PART: Parameter = Parameter::number("stiffness_ratio", 0.0, 50.0);
const STARTS: &[&[f64]] = &[&[0.1, 0.5, 0.0], &[0.5, 1.0, 0.5], &[1.0, 0.3, -0.1]];

pub(super) static EFFECT: Effect = Effect {
    name: "bouc-wen-hysteresis",
    equation: "n = k z, z' = x' - b |x'| z - c x' |z|",
    source: "Y. K. Wen, J. Eng. Mech. Div. 102 (1976), 249",
    validity: "without drift of the loops",
    mistaken_for: &["coulomb-friction", "backlash", "structural-damping"],
    experiment: "a slow load and unload with inner loops, at two rates",
    forms: &[
        Form {
            name: "linear",
            place: Place::Stand,
            parameters: &[
                PART,
                Parameter::motion("loss", -1, 0, 0.0, 100.0),
                Parameter::motion("shape", -1, 0, -100.0, 100.0),
            ],
            starts: STARTS,
            build: |p| Action::Torque(Box::new(BoucWen::of(p, false))),
        },
        Form {
            name: "square",
            place: Place::Stand,
            parameters: &[
                PART,
                Parameter::motion("loss", -2, 0, 0.0, 100.0),
                Parameter::motion("shape", -2, 0, -100.0, 100.0),
            ],
            starts: STARTS,
            build: |p| Action::Torque(Box::new(BoucWen::of(p, true))),
        },
    ],
};

struct BoucWen {
    ratio: f64,
    loss: f64,
    shape: f64,
    square: bool,
}

impl BoucWen {
    fn of(p: &[f64], square: bool) -> Self {
        Self {
            ratio: p[0],
            loss: p[1],
            shape: p[2],
            square,
        }
    }

    /// `dz/dx` for a step of that sign.
    fn slope(&self, z: f64, step: f64) -> f64 {
        let size = if self.square { z * z } else { z.abs() };
        1.0 - size * (self.loss.copysign(step * z) + self.shape)
    }
}

impl Torque for BoucWen {
    fn value(&self, memory: &mut Memory, x: f64, _: f64) -> f64 {
        let [z, last] = *memory;
        let step = x - last;
        let middle = z + 0.5 * step * self.slope(z, step);
        *memory = [z + step * self.slope(middle, step), x];
        self.ratio * memory[0]
    }

    fn begin(&self, x: f64) -> Memory {
        [0.0, x]
    }
}
