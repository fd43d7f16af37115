//! Damping proportional to the cube of the speed.
//!
//! `n = d x'³`. B. Ravindra, A. K. Mallik, *Performance of non-linear vibration isolators under harmonic
//! excitation*, J. Sound Vib. 170 (1994), 325. **Valid where the level separates viscous and quadratic parts.**
//! Mistaken for `quadratic-damping`.
//!
//! Integration: for constant `x`, `x' = v/√(1 + 2 ω₀² d v² t)` exactly.

use crate::effects::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque};

pub(super) static EFFECT: Effect = Effect {
    name: "cubic-damping",
    equation: "n = d x'^3",
    meaning: "The damping torque grows with the cube of the speed.",
    remedy: "Remove parts that move air or oil with the stator, or identify the stand at the level of use.",
    source: "B. Ravindra, A. K. Mallik, J. Sound Vib. 170 (1994), 325",
    validity: "where viscous and quadratic parts can be distinguished by level",
    mistaken_for: &["quadratic-damping"],
    experiment: "free decays from three amplitudes, or the response at three levels",
    forms: &[Form {
        name: "cube",
        law: "n = d x'^3",
        stage: Stage::Stand,
        parameters: &[EffectParameter::motion("coefficient", -2, 3, 0.0, 20.0)],
        starts: &[&[0.01]],
        build: |p| Action::beside(Cube { coefficient: p[0] }),
    }],
};

struct Cube {
    coefficient: f64,
}

impl Torque for Cube {
    fn value(&self, _: &mut Memory, _: f64, speed: f64) -> f64 {
        self.coefficient * speed.powi(3)
    }

    fn kick(&self, _: &mut Memory, _: f64, speed: f64, _: f64, impulse: f64) -> f64 {
        speed / (1.0 + 2.0 * impulse * self.coefficient * speed * speed).sqrt()
    }
}
