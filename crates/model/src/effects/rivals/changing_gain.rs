//! A gain that changes evenly over the record and is right somewhere in it.
//!
//! `y = x (1 + a + r t)`. **Valid for small changes.** Mistaken for `thermal-drift`, whose sensitivity is right at
//! the start of a record, and, in a sweep, where time stands for frequency, for `second-mode` and `recorder-lowpass`.

use crate::effects::{Action, Effect, Form, Parameter, Ruler, Stage};

const OFFSET: Parameter = Parameter::number("offset", -0.5, 0.5);
const RATE: Parameter = Parameter::motion("rate", 0, -1, -1.0, 2.0).by(Ruler::Record);

pub(super) static EFFECT: Effect = Effect {
    name: "changing-gain",
    equation: "y = x (1 + a + r t)",
    source: "the definition",
    validity: "for small changes",
    mistaken_for: &["thermal-drift", "second-mode", "recorder-lowpass"],
    experiment: "the same excitation several times over, or a sweep in the other direction",
    forms: &[Form {
        name: "even",
        stage: Stage::Gage,
        parameters: &[RATE, OFFSET],
        starts: &[&[0.02, -0.01], &[-0.02, 0.01]],
        build: |p| {
            let (rate_per_s, offset) = (p[0], p[1]);
            Action::Transform {
                apply: Box::new(move |clock, samples| {
                    for (i, x) in samples.iter_mut().enumerate() {
                        *x *= 1.0 + offset + rate_per_s * clock.time_s(i);
                    }
                }),
                undo: None,
            }
        },
    }],
};
