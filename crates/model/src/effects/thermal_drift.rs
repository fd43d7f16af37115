//! A zero or a sensitivity that moves with temperature.
//!
//! `linear`: `y = x + d t`; `exponential`: `y = x + D (1 − e^{−t/τ})`, a body that warms up; `sensitivity`:
//! `y = (1 + g t) x`. `t` is the time since the record began.
//! `course`: any slow course, of up to eight half waves over the record; like the phase of a line it belongs to the
//! record and is found anew in each. Thesis, Appendix B: "temperatures … not large enough" for the
//! gage factor; as a zero shift 2 % of resistance at 85 °F is. **Valid over one warm-up.** Mistaken for `ac-coupled` of
//! `capacitive-coupling`, a slow disturbance.

use super::{Action, Clock, Effect, Form, Parameter, Ruler, Stage};

/// Most half waves of a course over a record.
const HALF_WAVES: usize = 8;

pub(super) static EFFECT: Effect = Effect {
    name: "thermal-drift",
    equation: "y = x + d t, or x + D (1 - e^(-t/tau)), or (1 + g t) x",
    source: "T. P. Hertel's thesis, Appendix B",
    validity: "over one warm-up",
    mistaken_for: &["capacitive-coupling"],
    experiment: "a record at constant load over several times the length",
    forms: &[
        Form {
            name: "linear",
            stage: Stage::Chain,
            parameters: &[Parameter::motion("slope", 1, -1, -100.0, 100.0).by(Ruler::Record)],
            starts: &[&[0.01]],
            build: |p| {
                let slope = p[0];
                added(move |time_s| slope * time_s)
            },
        },
        Form {
            name: "exponential",
            stage: Stage::Chain,
            parameters: &[
                Parameter::motion("drift", 1, 0, -100.0, 100.0),
                Parameter::motion("time_constant", 0, 1, 0.01, 20.0).by(Ruler::Record),
            ],
            starts: &[&[0.01, 0.1], &[0.01, 0.4], &[0.01, 1.5]],
            build: |p| {
                let (drift, constant_s) = (p[0], p[1]);
                added(move |time_s| -drift * (-time_s / constant_s).exp_m1())
            },
        },
        Form {
            name: "sensitivity",
            stage: Stage::Chain,
            parameters: &[Parameter::motion("rate", 0, -1, -0.9, 10.0).by(Ruler::Record)],
            starts: &[&[0.01]],
            build: |p| {
                let rate = p[0];
                Action::Transform {
                    apply: Box::new(move |clock, samples| scale(clock, samples, rate, 1.0)),
                    undo: Some(Box::new(move |clock, samples| {
                        scale(clock, samples, rate, -1.0);
                    })),
                }
            },
        },
        Form {
            name: "course",
            stage: Stage::Disturbance,
            parameters: &[],
            starts: &[&[]],
            build: |_| Action::Course(HALF_WAVES),
        },
    ],
};

fn scale(clock: Clock, samples: &mut [f64], rate: f64, power: f64) {
    for (i, sample) in samples.iter_mut().enumerate() {
        *sample *= (1.0 + rate * clock.time_s(i)).powf(power);
    }
}

fn added(drift: impl Fn(f64) -> f64 + Copy + Send + Sync + 'static) -> Action {
    let add = move |clock: Clock, samples: &mut [f64], sign: f64| {
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample += sign * drift(clock.time_s(i));
        }
    };
    Action::Transform {
        apply: Box::new(move |clock, samples| add(clock, samples, 1.0)),
        undo: Some(Box::new(move |clock, samples| add(clock, samples, -1.0))),
    }
}
