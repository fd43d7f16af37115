//! A constant time delay of the record.
//!
//! `y(t) = x(t − τ)`, response `e^{−jωτ}`. **Valid if both channels share one clock**; where two recorders run,
//! their clocks drift apart. Mistaken for `recorder-lowpass` with a corner far above the excitation.

use super::{Action, Effect, EffectParameter, Form, Stage};
use num_complex::Complex64;

pub(super) static EFFECT: Effect = Effect {
    name: "time-delay",
    equation: "y(t) = x(t - tau)",
    meaning: "The measured channel lags behind the applied one by a constant time.",
    remedy: "Record both channels with one clock and the same filters, or declare the lag as delay in [recorder] of \
        the stand file.",
    source: "the definition",
    validity: "if both channels share one clock",
    mistaken_for: &["recorder-lowpass", "structural-damping"],
    experiment: "the same signal on both channels, with energy at high frequencies",
    forms: &[Form {
        name: "lag",
        law: "y(t) = x(t - tau)",
        stage: Stage::Chain,
        parameters: &[EffectParameter::motion("delay", 0, 1, 0.0, 20.0)],
        starts: &[&[0.02], &[0.5], &[1.0], &[2.0], &[4.0], &[7.0]],
        build: |p| {
            let delay_s = p[0];
            Action::Factor(Box::new(move |_, omega| {
                Complex64::from_polar(1.0, -omega * delay_s)
            }))
        },
    }],
};
