//! A line at the shaft speed.
//!
//! `y = x + a sin(2π f t + phase)` (`twice`: and at twice the speed, as of misalignment): an unbalanced or misaligned
//! rotor produces a torque or force that rotates with the shaft (the thesis, section III). The speed is found in the
//! data; the phase differs from record to record. **Valid for a constant speed.** Mistaken for `mains-pickup` where the
//! speed or an order of it coincides with the mains.

use super::lines::SpectralLine;
use super::{Action, Effect, EffectParameter, Form, ParameterScale, Stage};

pub(super) static EFFECT: Effect = Effect {
    name: "rotor-imbalance",
    equation: "y = x + a sin(2 pi f t + phase)",
    meaning: "An unbalanced or misaligned rotor adds a torque once or twice per revolution.",
    remedy: "Balance the rotor and align its coupling, or choose a speed whose line is away from the frequencies of \
        interest.",
    source: "T. P. Hertel's thesis, section III",
    validity: "for a constant speed",
    mistaken_for: &["mains-pickup"],
    experiment: "a record at another speed, or with the motor off",
    forms: &[
        Form {
            name: "line",
            law: "y = x + a sin(2 pi f t + phase)",
            stage: Stage::Disturbance,
            parameters: &[RATE, EffectParameter::motion("amplitude", 1, 0, 0.0, 10.0)],
            // The speed is searched for in the spectrum of the residual.
            starts: &[],
            build: |p| Action::Lines(SpectralLine::orders(p)),
        },
        Form {
            name: "twice",
            law: "y = x + a sin(2 pi f t + phase) + a_2 sin(4 pi f t + phase_2)",
            stage: Stage::Disturbance,
            parameters: &[
                RATE,
                EffectParameter::motion("amplitude", 1, 0, 0.0, 10.0),
                EffectParameter::motion("amplitude_2", 1, 0, 0.0, 10.0),
            ],
            starts: &[],
            build: |p| Action::Lines(SpectralLine::orders(p)),
        },
    ],
};

/// At least three turns per record, without an upper bound.
const RATE: EffectParameter =
    EffectParameter::frequency("frequency", 3.0, 1e9).by(ParameterScale::Record);
