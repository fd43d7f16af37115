//! Creep of the gage and its bond: under a constant load the record keeps changing for a while.
//!
//! `y = x + c x_s`, with `x_s` being `x` through a first-order lag of time constant `τ = 1/(2π corner)`: slow changes
//! are shown `1 + c` times, fast ones unchanged; `c < 0` where the bond yields. K. Hoffmann, *An Introduction to
//! Measurements using Strain Gages* (HBM, 1989), 3.4. **Valid at one temperature.** Mistaken for `thermal-drift` and
//! `ac-coupled` of `capacitive-coupling`, which is `c = −1`.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::{Action, Effect, EffectParameter, Form, History, Stage};

pub(super) static EFFECT: Effect = Effect {
    name: "gage-creep",
    equation: "y = x + c/(1 + s tau) x",
    meaning: "The gage or its bond creeps: after a change of load the record keeps changing for a while.",
    remedy: "Use a gage with creep matched to the beam, cure the bond again, or read at a fixed time after loading.",
    source: "K. Hoffmann, An Introduction to Measurements using Strain Gages (HBM, 1989), 3.4",
    validity: "at one temperature",
    mistaken_for: &["thermal-drift", "capacitive-coupling", "structural-damping"],
    experiment: "a known load applied, held for several time constants and removed",
    forms: &[Form {
        name: "lag",
        law: "y = x + c/(1 + s tau) x, tau = 1/(2 pi corner)",
        stage: Stage::Gage,
        parameters: &[
            EffectParameter::number("share", -0.5, 0.5),
            EffectParameter::frequency("corner", 1e-4, 0.3).showing(History::Fades),
        ],
        starts: &[&[0.01, 0.001], &[0.01, 0.01], &[0.01, 0.1]],
        build: |p| {
            let (share, corner) = (p[0], TAU * p[1]);
            Action::Factor(Box::new(move |_, omega| {
                1.0 + share / Complex64::new(1.0, omega / corner)
            }))
        },
    }],
};
