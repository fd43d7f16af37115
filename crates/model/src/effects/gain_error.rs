//! An error of the calibration constant.
//!
//! `y = (1 + e) x`. Only where the static gain is declared (both channels torque, or volts with a calibration);
//! elsewhere the gain is a parameter of the plain stand. **Valid at all levels and frequencies.** Mistaken for
//! wrong stiffness where only frequencies far above the natural one are excited.

use super::{Action, Effect, EffectParameter, Form, Stage};
use num_complex::Complex64;

pub(super) static EFFECT: Effect = Effect {
    name: "gain-error",
    equation: "y = (1 + e) x",
    meaning: "The whole record is too large or too small by a constant factor.",
    remedy: "Calibrate again with a known static load, and check gage factor, bridge supply and gain in the \
              stand file.",
    source: "the definition",
    validity: "for a factor independent of level and frequency",
    mistaken_for: &["second-mode"],
    experiment: "a known static load",
    forms: &[Form {
        name: "factor",
        law: "y = (1 + e) x",
        stage: Stage::Gage,
        parameters: &[EffectParameter::number("error", -0.9, 10.0)],
        starts: &[&[0.01]],
        build: |p| {
            let gain = Complex64::new(1.0 + p[0], 0.0);
            Action::Factor(Box::new(move |_, _| gain))
        },
    }],
};
