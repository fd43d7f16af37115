//! Mains hum in the record.
//!
//! A line at 50 or 60 Hz (`orders`: and its orders 2 to 5), added to the record; its phase differs from record to
//! record, its frequency is that of the grid within ¼ %. **Valid for a steady grid.** Mistaken for an order of
//! the shaft (`rotor-imbalance`) at the same frequency.

use super::lines::SpectralLine;
use super::{Action, Effect, EffectParameter, Form, ParameterScale, Stage};

const fn amplitude(name: &'static str) -> EffectParameter {
    EffectParameter::motion(name, 1, 0, 0.0, 10.0)
}

const fn grid(hz: f64) -> EffectParameter {
    EffectParameter::frequency("frequency", 0.9975 * hz, 1.0025 * hz).by(ParameterScale::Absolute)
}

macro_rules! form {
    ($name:literal, $hz:literal, $($amplitude:literal),+) => {
        Form {
            name: $name,
            law: "y = x + sum of a_k sin(2 pi k f t + phase_k)",
            stage: Stage::Disturbance,
            parameters: &[grid($hz), $(amplitude($amplitude)),+],
            starts: &[&[$hz]],
            build: |p| Action::Lines(SpectralLine::orders(p)),
        }
    };
}

pub(super) static EFFECT: Effect = Effect {
    name: "mains-pickup",
    equation: "y = x + sum of a_k sin(2 pi k f t + phase), f = 50 or 60 Hz",
    meaning: "The mains add a line at their frequency, and often at its multiples, to the record.",
    remedy: "Shield the gage's cable, keep it away from power cables, and ground the stand at one point only.",
    source: "the definition",
    validity: "for a constant mains frequency",
    mistaken_for: &["rotor-imbalance"],
    experiment: "a record with the motor off, or at another speed: the mains lines stay",
    forms: &[
        form!("60-Hz", 60.0, "amplitude"),
        form!("50-Hz", 50.0, "amplitude"),
        form!(
            "60-Hz-orders",
            60.0,
            "amplitude",
            "amplitude_2",
            "amplitude_3",
            "amplitude_4",
            "amplitude_5"
        ),
        form!(
            "50-Hz-orders",
            50.0,
            "amplitude",
            "amplitude_2",
            "amplitude_3",
            "amplitude_4",
            "amplitude_5"
        ),
    ],
};
