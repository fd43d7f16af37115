//! Damping proportional to the square of the speed, as of air drag.
//!
//! `n = d x' |x'|`. J. W. Strutt (Rayleigh), *The Theory of Sound* I (1894), 39. **Valid for turbulent flow**;
//! at low speed drag is viscous. Mistaken for `coulomb-friction` with the opposite dependence on level,
//! `bouc-wen-hysteresis`.
//!
//! Integration: for constant `x`, `x' = v/(1 + ω₀² d |v| t)` exactly.

use super::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque};

pub(super) static EFFECT: Effect = Effect {
    name: "quadratic-damping",
    equation: "n = d x' |x'|",
    meaning: "The damping grows with the speed, like the drag of turbulent air or oil.",
    remedy: "Remove parts that move air or oil with the stator, or identify the stand at the level of use.",
    source: "J. W. Strutt (Rayleigh), The Theory of Sound I (1894), 39",
    validity: "for turbulent flow",
    mistaken_for: &["coulomb-friction", "bouc-wen-hysteresis"],
    experiment: "free decays from two amplitudes, or the response at two levels",
    forms: &[Form {
        name: "drag",
        law: "n = d x' |x'|",
        stage: Stage::Stand,
        parameters: &[EffectParameter::motion("coefficient", -1, 2, 0.0, 20.0)],
        starts: &[&[0.02]],
        build: |p| Action::beside(Drag { coefficient: p[0] }),
    }],
};

struct Drag {
    coefficient: f64,
}

impl Torque for Drag {
    fn value(&self, _: &mut Memory, _: f64, speed: f64) -> f64 {
        self.coefficient * speed * speed.abs()
    }

    fn kick(&self, _: &mut Memory, _: f64, speed: f64, _: f64, impulse: f64) -> f64 {
        speed / (1.0 + impulse * self.coefficient * speed.abs())
    }
}
