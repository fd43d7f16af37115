//! A stray or series capacitance in the measuring chain.
//!
//! `slope-of-load`: `y = x + G τ u'`, the derivative of the load couples into the record; at a load step it is the
//! spike that the thesis attributes to "capacitive coupling within the recorder". `slope-of-record`: `y = x + τ x'`.
//! `high-pass-leak`: `y = x + c s τ/(1 + s τ) G u`. `ac-coupled`: `y = s/(s + ω_c) x`, a series capacitor. **Valid far
//! below the corner of the stray path** for the first two. Mistaken for `second-mode` below the excitation,
//! `time-delay` of the other channel.

use super::{Action, Effect, EffectParameter, Form, History, Stage};
use num_complex::Complex64;
use std::f64::consts::TAU;

pub(super) static EFFECT: Effect = Effect {
    name: "capacitive-coupling",
    equation: "y = x + G tau u'",
    meaning: "A stray capacitance couples the slope of the load into the record, or a series capacitor blocks low \
        frequencies.",
    remedy: "Shield the gage's cable, keep it away from the motor supply, and set the recorder's input to DC.",
    source: "T. P. Hertel's thesis, section III",
    validity: "far below the corner of the stray path",
    mistaken_for: &["second-mode", "time-delay"],
    experiment: "the same excitation with the gage's supply off: any remaining signal is coupled",
    forms: &[
        Form {
            name: "slope-of-load",
            law: "y = x + G tau u'",
            stage: Stage::Chain,
            parameters: &[EffectParameter::motion("time", 0, 1, -5.0, 5.0)],
            starts: &[&[0.005]],
            build: |p| {
                let time_s = p[0];
                Action::Feedthrough(Box::new(move |_, omega| {
                    Complex64::new(0.0, omega * time_s)
                }))
            },
        },
        Form {
            name: "slope-of-record",
            law: "y = x + tau x'",
            stage: Stage::Chain,
            parameters: &[EffectParameter::motion("time", 0, 1, -5.0, 5.0)],
            starts: &[&[0.005]],
            build: |p| {
                let time_s = p[0];
                Action::Factor(Box::new(move |_, omega| {
                    Complex64::new(1.0, omega * time_s)
                }))
            },
        },
        Form {
            name: "high-pass-leak",
            law: "y = x + c s tau/(1 + s tau) G u, tau = 1/(2 pi corner)",
            stage: Stage::Chain,
            parameters: &[
                // A small capacitor has its corner far above the band, so the share may be large.
                EffectParameter::number("share", -100.0, 100.0),
                EffectParameter::frequency("corner", 0.01, 300.0),
            ],
            starts: &[&[0.01, 0.3], &[0.01, 1.0], &[0.01, 4.0], &[0.1, 40.0]],
            build: |p| {
                let (share, corner) = (p[0], TAU * p[1]);
                Action::Feedthrough(Box::new(move |_, omega| {
                    let s = Complex64::new(0.0, omega / corner);
                    share * s / (1.0 + s)
                }))
            },
        },
        Form {
            name: "ac-coupled",
            law: "y = s/(s + 2 pi corner) x",
            stage: Stage::Chain,
            // Below this bound, a record of a thousand periods shows a slope instead of a corner,
            // which is a drift.
            parameters: &[EffectParameter::frequency("corner", 1e-4, 3.0).showing(History::Fades)],
            starts: &[&[0.003], &[0.05], &[0.3]],
            build: |p| {
                let corner = TAU * p[0];
                Action::Factor(Box::new(move |_, omega| {
                    let s = Complex64::new(0.0, omega / corner);
                    s / (1.0 + s)
                }))
            },
        },
    ],
};

/// Removes the slope introduced by dividing out a link that blocks constants: what it blocked is known except for a
/// constant at either end.
pub fn level(before: &[f64], after: &mut [f64]) {
    if after.len() < 2 {
        return;
    }
    let middle = 0.5 * (after.len() - 1) as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for (i, (a, b)) in after.iter().zip(before).enumerate() {
        sum += (i as f64 - middle) * (a - b);
        squares += (i as f64 - middle).powi(2);
    }
    let slope = sum / squares;
    for (i, a) in after.iter_mut().enumerate() {
        *a -= slope * (i as f64 - middle);
    }
}
