//! Stiffness that changes linearly with displacement.
//!
//! `n = c x²` (even: stiffer on one side, as a preloaded or bent beam) or `n = c x |x|` (odd: stiffer on both
//! sides). A. H. Nayfeh, D. T. Mook, *Nonlinear Oscillations* (1979), 2.3. **Valid for small changes**: at
//! `2 c x = −1` the even form loses all stiffness. Mistaken for `gage-nonlinearity` (even) and
//! `cubic-stiffness` (odd).

use super::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque, Zero};

pub(super) static EFFECT: Effect = Effect {
    name: "quadratic-stiffness",
    equation: "n = c x^2, or c x |x|",
    meaning: "The stiffness changes in proportion to the displacement, in one direction as with a bent or preloaded \
        beam, or in both.",
    remedy: "Straighten the beam and remove its preload, or stay at levels where the term is small.",
    source: "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (1979), 2.3",
    validity: "while the stiffness stays positive",
    mistaken_for: &["gage-nonlinearity", "cubic-stiffness"],
    experiment: "slow loading and unloading in both directions, and the response at two levels",
    forms: &[
        Form {
            name: "even",
            law: "n = c x^2; the gage shows x",
            stage: Stage::Stand,
            parameters: &[EffectParameter::motion("coefficient", -1, 0, -0.5, 0.5)],
            starts: &[&[0.005]],
            build: |p| Action::beside(Even { coefficient: p[0] }),
        },
        Form {
            name: "even-shown",
            law: "n = c x^2; the gage shows x + n",
            stage: Stage::Stand,
            parameters: &[EffectParameter::motion("coefficient", -1, 0, -0.5, 0.5)],
            starts: &[&[0.005]],
            build: |p| Action::in_gage_path(Even { coefficient: p[0] }),
        },
        Form {
            name: "odd",
            law: "n = c x |x|; the gage shows x",
            stage: Stage::Stand,
            parameters: &[EffectParameter::motion("coefficient", -1, 0, -0.3, 20.0)],
            starts: &[&[0.01]],
            build: |p| Action::beside(Odd { coefficient: p[0] }),
        },
        Form {
            name: "odd-shown",
            law: "n = c x |x|; the gage shows x + n",
            stage: Stage::Stand,
            parameters: &[EffectParameter::motion("coefficient", -1, 0, -0.3, 20.0)],
            starts: &[&[0.01]],
            build: |p| Action::in_gage_path(Odd { coefficient: p[0] }),
        },
    ],
};

struct Even {
    coefficient: f64,
}

impl Torque for Even {
    fn value(&self, _: &mut Memory, x: f64, _: f64) -> f64 {
        self.coefficient * x * x
    }

    fn zero(&self) -> Zero {
        Zero::Fixed
    }
}

struct Odd {
    coefficient: f64,
}

impl Torque for Odd {
    fn value(&self, _: &mut Memory, x: f64, _: f64) -> f64 {
        self.coefficient * x * x.abs()
    }

    fn zero(&self) -> Zero {
        Zero::Fixed
    }
}
