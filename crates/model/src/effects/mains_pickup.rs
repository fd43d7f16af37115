//! Hum of the mains in the record.
//!
//! Lines at 50 or 60 Hz and their orders 2 to 5, added to the record; the phase belongs to the record, the
//! frequency is that of the grid within ½ %. **Valid for a steady grid.** Mistaken for an order of the shaft
//! (`rotor-imbalance`) that falls on the same frequency.

use super::{Action, Effect, Form, Line, Parameter, Place, Ruler};

const AMPLITUDE: [&str; 5] = [
    "amplitude",
    "amplitude_2",
    "amplitude_3",
    "amplitude_4",
    "amplitude_5",
];

const fn amplitude(order: usize) -> Parameter {
    Parameter::motion(AMPLITUDE[order - 1], 1, 0, 0.0, 10.0)
}

macro_rules! grid {
    ($name:literal, $hz:literal) => {
        Form {
            name: $name,
            place: Place::Disturbance,
            parameters: &[
                Parameter {
                    name: "frequency",
                    unit: super::Unit::Hertz,
                    ruler: Ruler::Absolute,
                    lower: 0.995 * $hz,
                    upper: 1.005 * $hz,
                },
                amplitude(1),
                amplitude(2),
                amplitude(3),
                amplitude(4),
                amplitude(5),
            ],
            starts: &[&[$hz, 0.01, 0.0, 0.0, 0.0, 0.0]],
            build: |p| {
                let line = |order: usize| Line {
                    frequency_hz: p[0] * order as f64,
                    amplitude: p[order],
                };
                Action::Lines((1..p.len()).map(line).collect())
            },
        }
    };
}

pub(super) static EFFECT: Effect = Effect {
    name: "mains-pickup",
    equation: "y = x + sum of a_k sin(2 pi k f t + phase), f = 50 or 60 Hz",
    source: "the definition",
    validity: "for a steady grid",
    mistaken_for: &["rotor-imbalance"],
    experiment: "a record with the motor off, or at another speed: the mains stay",
    forms: &[grid!("60-Hz", 60.0), grid!("50-Hz", 50.0)],
};
