//! Spikes of the drive in the record.
//!
//! `y = x + a Σ s(t − t_j)`, `t_j = t₀ + j/f`, `max |s| = 1`: each switching of the drive's converter, or each
//! commutation of a motor with brushes, couples into the gage's cable. `t₀` and the shape `s`, up to 16 samples long,
//! differ from record to record; rate and size do not. **Valid for a constant rate**, at least twelve spikes in a record
//! and twice their length between them. Mistaken for lines (`rotor-imbalance`, `mains-pickup`): a train has all orders
//! of its rate.

use super::spikes::SpikeTrain;
use super::{Action, Effect, EffectParameter, Form, ParameterScale, Stage};

pub(super) static EFFECT: Effect = Effect {
    name: "commutation-spikes",
    equation: "y = x + a sum of s(t - t0 - j/f)",
    meaning: "Each switching or commutation of the drive adds a spike to the record, at equal intervals.",
    remedy: "Keep the gage's cable away from the motor's, shield and twist it, and put a filter at the drive's output.",
    source: "the definition",
    validity: "for a constant rate and spikes of up to 16 samples, at least 32 samples apart",
    mistaken_for: &["rotor-imbalance", "mains-pickup"],
    experiment: "the same record with the motor's supply off, or with its cables away from those of the gage: the \
        spikes go",
    forms: &[Form {
        name: "train",
        law: "y = x + a sum of s(t - t0 - j/f), max |s| = 1",
        stage: Stage::Disturbance,
        parameters: &[
            EffectParameter::frequency("frequency", 12.0, 1e9).by(ParameterScale::Record),
            EffectParameter::motion("amplitude", 1, 0, 0.0, 1e3),
        ],
        // The rate is searched for in the residual.
        starts: &[],
        build: |p| {
            Action::Spikes(SpikeTrain {
                frequency_hz: p[0],
                amplitude: p[1],
            })
        },
    }],
};
