//! Damping that grows with displacement, as of a squeezed film or bush.
//!
//! `n = d x² x'`. B. van der Pol, *On relaxation-oscillations*, Phil. Mag. 2 (1926), 978 (there with the other sign
//! at rest). **Valid for small changes of the gap.** Mistaken for `quadratic-damping` and `bouc-wen-hysteresis`.
//!
//! Integration: for constant `x`, `x' = v e^{−ω₀² d x² t}` exactly.

use crate::effects::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque, Zero};

pub(super) static EFFECT: Effect = Effect {
    name: "squeezed-damping",
    equation: "n = d x^2 x'",
    meaning: "The damping grows with the displacement, as with a squeezed oil film or rubber bush.",
    remedy: "Find the squeezed film, seal or bush, and replace it or widen its gap.",
    source: "B. van der Pol, Phil. Mag. 2 (1926), 978",
    validity: "for small changes of the gap",
    mistaken_for: &["quadratic-damping", "bouc-wen-hysteresis"],
    experiment: "free decays from two amplitudes with and without a preload",
    forms: &[Form {
        name: "square",
        law: "n = d x^2 x'",
        stage: Stage::Stand,
        parameters: &[EffectParameter::motion("coefficient", -2, 1, 0.0, 20.0)],
        starts: &[&[0.01]],
        build: |p| Action::beside(Squeezed { coefficient: p[0] }),
    }],
};

struct Squeezed {
    coefficient: f64,
}

impl Torque for Squeezed {
    fn value(&self, _: &mut Memory, x: f64, speed: f64) -> f64 {
        self.coefficient * x * x * speed
    }

    fn kick(&self, _: &mut Memory, x: f64, speed: f64, _: f64, impulse: f64) -> f64 {
        speed * (-impulse * self.coefficient * x * x).exp()
    }

    fn zero(&self) -> Zero {
        Zero::Fixed
    }
}
