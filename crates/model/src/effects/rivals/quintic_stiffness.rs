//! Stiffness nonlinearity of a higher power than the cube.
//!
//! `n = c x⁵`. I. Kovacic, M. J. Brennan (eds.), *The Duffing Equation* (2011), 1. **Valid where the cubic part is
//! small.** Mistaken for `cubic-stiffness` and, owing to its four parameters, `bouc-wen-hysteresis`.

use crate::effects::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque, Zero};

const COEFFICIENT: &[EffectParameter] =
    &[EffectParameter::motion("coefficient", -4, 0, -0.02, 100.0)];
const STARTS: &[&[f64]] = &[&[1e-3], &[-3e-4]];

pub(super) static EFFECT: Effect = Effect {
    name: "quintic-stiffness",
    equation: "n = c x^5",
    meaning: "The restoring torque grows with the fifth power of the displacement, so the stand is much stiffer for \
        large motions.",
    remedy: "Stay at lower levels, and look for parts that come into contact at large displacements.",
    source: "I. Kovacic, M. J. Brennan (eds.), The Duffing Equation (2011), 1",
    validity: "where the cubic part is small",
    mistaken_for: &["cubic-stiffness", "bouc-wen-hysteresis"],
    experiment: "slow loading and unloading up to the largest load, and the response at three levels",
    forms: &[
        Form {
            name: "beside",
            law: "n = c x^5; the gage shows x",
            stage: Stage::Stand,
            parameters: COEFFICIENT,
            starts: STARTS,
            build: |p| Action::beside(Quintic { coefficient: p[0] }),
        },
        Form {
            name: "shown",
            law: "n = c x^5; the gage shows x + n",
            stage: Stage::Stand,
            parameters: COEFFICIENT,
            starts: STARTS,
            build: |p| Action::in_gage_path(Quintic { coefficient: p[0] }),
        },
    ],
};

struct Quintic {
    coefficient: f64,
}

impl Torque for Quintic {
    fn value(&self, _: &mut Memory, x: f64, _: f64) -> f64 {
        self.coefficient * x.powi(5)
    }

    fn zero(&self) -> Zero {
        Zero::Fixed
    }
}
