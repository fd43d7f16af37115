//! Stiffness that grows (or falls) with the square of the displacement.
//!
//! `n = c x³`: for a torque stand `K θ + k₃ θ³` with `c = k₃/K³`. `beside`: the gage shows `K θ` (the strain follows
//! the displacement); `shown`: it shows the whole torque of the beam, `x + n`. G. Duffing, *Erzwungene Schwingungen
//! bei veränderlicher Eigenfrequenz* (1918). **Valid while the next odd power is small**: an end stop or a gap,
//! which sets in at one displacement, is not cubic. Mistaken for `gage-nonlinearity` of the same power, which
//! distorts the record and not the motion, at low level for `quadratic-stiffness`.

use super::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque, Zero};

const COEFFICIENT: &[EffectParameter] =
    &[EffectParameter::motion("coefficient", -2, 0, -0.2, 100.0)];
const STARTS: &[&[f64]] = &[&[0.01], &[-0.005]];

pub(super) static EFFECT: Effect = Effect {
    name: "cubic-stiffness",
    equation: "n = c x^3",
    meaning: "The stiffness changes with the square of the displacement, so the natural frequency changes with \
              the level.",
    remedy: "Stay at levels where the term is small, and check the beam's clamp for edges that come into contact.",
    source: "G. Duffing, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz (1918)",
    validity: "while the next odd power is small",
    mistaken_for: &["gage-nonlinearity", "quadratic-stiffness", "backlash"],
    experiment: "slow loading and unloading up to the largest load, and the response at two levels",
    forms: &[
        Form {
            name: "beside",
            law: "n = c x^3; the gage shows x",
            stage: Stage::Stand,
            parameters: COEFFICIENT,
            starts: STARTS,
            build: |p| Action::beside(Cubic { coefficient: p[0] }),
        },
        Form {
            name: "shown",
            law: "n = c x^3; the gage shows x + n",
            stage: Stage::Stand,
            parameters: COEFFICIENT,
            starts: STARTS,
            build: |p| Action::in_gage_path(Cubic { coefficient: p[0] }),
        },
    ],
};

struct Cubic {
    coefficient: f64,
}

impl Torque for Cubic {
    fn value(&self, _: &mut Memory, x: f64, _: f64) -> f64 {
        self.coefficient * x * x * x
    }

    fn zero(&self) -> Zero {
        Zero::Fixed
    }
}
