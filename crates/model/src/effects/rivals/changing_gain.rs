//! A gain that drifts linearly over the record and is right at some point within it.
//!
//! `y = x (1 + a + r t)`. **Valid for small changes.** Mistaken for `thermal-drift`, whose sensitivity is right at
//! the start of a record, and, in a sweep, where time and frequency go together, for `second-mode` and
//! `recorder-lowpass`.

use crate::effects::{
    Action, Distortion, Effect, EffectParameter, Form, ParameterScale, SampleClock, Stage,
    Unrecovered,
};

const OFFSET: EffectParameter = EffectParameter::number("offset", -0.5, 0.5);
const RATE: EffectParameter =
    EffectParameter::motion("rate", 0, -1, -1.0, 2.0).by(ParameterScale::Record);

pub(super) static EFFECT: Effect = Effect {
    name: "changing-gain",
    equation: "y = x (1 + a + r t)",
    meaning: "The sensitivity changes linearly over the record.",
    remedy: "Let everything warm up before recording, and check the bridge supply.",
    source: "the definition",
    validity: "for small changes",
    mistaken_for: &["thermal-drift", "second-mode", "recorder-lowpass"],
    experiment: "the same excitation several times over, or a sweep in the other direction",
    forms: &[Form {
        name: "even",
        law: "y = x (1 + a + r t)",
        stage: Stage::Gage,
        parameters: &[RATE, OFFSET],
        starts: &[&[0.02, -0.01], &[-0.02, 0.01]],
        build: |p| {
            Action::Distortion(Box::new(ChangingGain {
                rate_per_s: p[0],
                offset: p[1],
            }))
        },
    }],
};

struct ChangingGain {
    rate_per_s: f64,
    offset: f64,
}

impl ChangingGain {
    fn at(&self, time_s: f64) -> f64 {
        1.0 + self.offset + self.rate_per_s * time_s
    }
}

impl Distortion for ChangingGain {
    fn forward(&self, clock: SampleClock, samples: &mut [f64]) {
        for (i, x) in samples.iter_mut().enumerate() {
            *x *= self.at(clock.time_s(i));
        }
    }

    fn inverse(&self, clock: SampleClock, _: f64, samples: &mut [f64]) -> Unrecovered {
        for (i, y) in samples.iter_mut().enumerate() {
            *y /= self.at(clock.time_s(i));
        }
        Unrecovered::default()
    }
}
