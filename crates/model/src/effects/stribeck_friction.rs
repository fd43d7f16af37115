//! Friction that falls with sliding speed, and the elastic sticking before.
//!
//! `F(x') = F (1 − d (1 − e^{−(x'/v_s)²}))`, from `F` at rest to `(1 − d) F` at speed, as
//! `n = F(x') sgn x'` with sticking (`sharp`), as `n = F(x') tanh(x'/v)` (`tanh`), or as bristles that bend by `z` before they
//! slide: `n = k z`, `z' = x' − |x'| k z/F(x')` (`bristles`, for `d = 0` Dahl's law). R. Stribeck, *Die wesentlichen
//! Eigenschaften der Gleit- und Rollenlager*, Z. VDI 46 (1902), 1341; C. Canudas de Wit, H. Olsson, K. J. Åström,
//! P. Lischinsky, *A new model for control of systems with friction*, IEEE Trans. Autom. Control 40 (1995), 419.
//! **Valid for steady lubrication.** Mistaken for `coulomb-friction` where few speeds occur.
//!
//! Integration: sharp friction is the dry friction `F`, whose switching is located, minus its drop, which is smooth and
//! zero at rest. For `tanh`, the flow is that of [`coulomb_friction`](super::coulomb_friction) with the midpoint value
//! of the torque. The bristles follow the steps of `x` exactly for the `F(x')` of each step.

use super::coulomb_friction::Friction;
use super::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque};

const TORQUE: EffectParameter = EffectParameter::motion("torque", 1, 0, 0.0, 5.0);
/// Without a drop it is friction of constant magnitude.
const DROP: EffectParameter = EffectParameter::number("drop", 0.0, 1.0).essential();
const STRIBECK_SPEED: EffectParameter = EffectParameter::motion("stribeck_speed", 1, -1, 0.01, 3.0);

pub(super) static EFFECT: Effect = Effect {
    name: "stribeck-friction",
    equation: "n = F (1 - d (1 - exp(-(x'/v_s)^2))) sgn(x')",
    meaning: "Friction is highest at rest and drops once the contact slides, so slow motion can stick and slip.",
    remedy: "Find the rubbing contact (bearing, seal, cable), and lubricate or free it, or avoid reversals at low \
        speed.",
    source: "R. Stribeck, Z. VDI 46 (1902), 1341; C. Canudas de Wit et al., IEEE Trans. Autom. Control 40 (1995), 419",
    validity: "for steady lubrication",
    mistaken_for: &[
        "coulomb-friction",
        "bouc-wen-hysteresis",
        "quadratic-damping",
    ],
    experiment: "the response at two levels, one of them so low that the stand nearly sticks, and a free decay to rest",
    forms: &[
        Form {
            name: "sharp",
            law: "n = F (1 - d (1 - exp(-(x'/v_s)^2))) sgn(x'), with sticking",
            stage: Stage::Stand,
            parameters: &[TORQUE, DROP, STRIBECK_SPEED],
            starts: &[&[0.05, 0.5, 0.2], &[0.3, 0.5, 0.2], &[0.2, 0.6, 0.8]],
            build: |p| Action::beside(Falling::of(p)),
        },
        Form {
            name: "tanh",
            law: "n = F (1 - d (1 - exp(-(x'/v_s)^2))) tanh(x'/v)",
            stage: Stage::Stand,
            parameters: &[
                TORQUE,
                DROP,
                STRIBECK_SPEED,
                EffectParameter::motion("transition_speed", 1, -1, 1e-5, 0.3),
            ],
            starts: &[&[0.05, 0.5, 0.2, 0.02], &[0.3, 0.5, 0.3, 0.02]],
            build: |p| Action::beside(Falling::of(p)),
        },
        Form {
            name: "bristles",
            law: "n = k z, z' = x' - |x'| k z/F(x'), F(x') = F (1 - d (1 - exp(-(x'/v_s)^2)))",
            stage: Stage::Stand,
            parameters: &[
                TORQUE,
                DROP,
                STRIBECK_SPEED,
                EffectParameter::number("bristle_stiffness", 0.05, 1e3),
            ],
            starts: &[&[0.05, 0.5, 0.2, 1.0], &[0.3, 0.5, 0.3, 5.0]],
            build: |p| {
                Action::beside(Bristles {
                    friction: Falling::of(&p[..3]),
                    stiffness: p[3],
                })
            },
        },
    ],
};

/// Above it, the exponential is lost in the digits of 1, and far above it is slow to underflow.
const FALLEN: f64 = 40.0;

struct Falling {
    torque: f64,
    drop: f64,
    stribeck_speed: f64,
    transition_speed: f64,
}

impl Falling {
    fn of(p: &[f64]) -> Self {
        Self {
            torque: p[0],
            drop: p[1],
            stribeck_speed: p[2],
            transition_speed: p.get(3).copied().unwrap_or(0.0),
        }
    }

    /// Drop of the friction at a speed.
    fn fallen(&self, speed: f64) -> f64 {
        let part = speed / self.stribeck_speed;
        if part * part > FALLEN {
            return self.torque * self.drop;
        }
        // It runs in every step of hundreds of fits; exp_m1 takes three times as long, and its digits are lost in F.
        self.torque * self.drop * (1.0 - (-part * part).exp())
    }

    /// Friction of constant magnitude, as at that speed.
    fn at(&self, speed: f64) -> Friction {
        Friction {
            torque: self.torque - self.fallen(speed),
            speed: self.transition_speed,
        }
    }
}

impl Torque for Falling {
    fn value(&self, memory: &mut Memory, x: f64, speed: f64) -> f64 {
        self.at(speed).value(memory, x, speed)
    }

    fn dry(&self) -> Option<f64> {
        (self.transition_speed == 0.0).then_some(self.torque)
    }

    fn switches(&self) -> bool {
        true
    }

    fn blurred(&self, memory: &mut Memory, x: f64, speed: f64, speed_std: f64) -> f64 {
        self.at(speed).blurred(memory, x, speed, speed_std)
    }

    fn kick(&self, memory: &mut Memory, x: f64, speed: f64, change: f64, impulse: f64) -> f64 {
        if self.dry().is_some() {
            let half = speed + 0.5 * impulse * self.fallen(speed).copysign(speed);
            return speed + impulse * self.fallen(half).copysign(speed);
        }
        let half = self.at(speed).kick(memory, x, speed, change, 0.5 * impulse);
        self.at(half).kick(memory, x, speed, change, impulse)
    }
}

/// Elastic contacts that slide; the memory holds their deflection and the last displacement.
struct Bristles {
    friction: Falling,
    stiffness: f64,
}

impl Torque for Bristles {
    fn value(&self, memory: &mut Memory, x: f64, speed: f64) -> f64 {
        let [z, last] = *memory;
        let step = x - last;
        let limit = self.friction.at(speed).torque / self.stiffness;
        let z = match limit > 0.0 {
            true => {
                let sliding = limit.copysign(step);
                sliding + (z - sliding) * (-step.abs() / limit).exp()
            }
            false => 0.0,
        };
        *memory = [z, x];
        self.stiffness * z
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }

    fn begin(&self, x: f64) -> Memory {
        [0.0, x]
    }
}
