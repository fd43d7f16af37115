//! A line at the rate of the shaft.
//!
//! `y = x + a sin(2π f t + phase)` (`twice`: and twice the rate, as of misalignment): an unbalanced or misaligned rotor turns a torque or a force once a turn (the
//! thesis, section III). The rate is found in the data; the phase belongs to the record. **Valid for a
//! constant speed.** Mistaken for `mains-pickup` where the rate or an order of it falls on the mains.

use super::{Action, Effect, Form, Line, Parameter, Ruler, Stage};

pub(super) static EFFECT: Effect = Effect {
    name: "rotor-imbalance",
    equation: "y = x + a sin(2 pi f t + phase)",
    source: "T. P. Hertel's thesis, section III",
    validity: "for a constant speed",
    mistaken_for: &["mains-pickup"],
    experiment: "a record at another speed, or with the motor off",
    forms: &[
        Form {
            name: "line",
            stage: Stage::Disturbance,
            parameters: &[RATE, Parameter::motion("amplitude", 1, 0, 0.0, 10.0)],
            // The rate is looked for in the spectrum of the residual.
            starts: &[],
            build: |p| Action::Lines(Line::orders(p)),
        },
        Form {
            name: "twice",
            stage: Stage::Disturbance,
            parameters: &[
                RATE,
                Parameter::motion("amplitude", 1, 0, 0.0, 10.0),
                Parameter::motion("amplitude_2", 1, 0, 0.0, 10.0),
            ],
            starts: &[],
            build: |p| Action::Lines(Line::orders(p)),
        },
    ],
};

const RATE: Parameter = Parameter::frequency("frequency", 0.1, 5000.0).by(Ruler::Absolute);
