//! A recorder that does not follow fast changes.
//!
//! `second-order`: `L = 1/(1 + 2ζ s/ω_c + s²/ω_c²)`. Otherwise: Butterworth low-pass of order 1 (an RC low-pass) to 4: `L = Π 1/(1 − (jf/f_c)/p_k)` over its poles
//! `p_k = e^{jπ(2k+n−1)/2n}`. S. Butterworth, Exp. Wireless 7 (1930), 536. **Valid below half the sampling rate.**
//! Mistaken for `time-delay` where the corner lies far above the excitation.

use super::{Action, Effect, EffectParameter, Form, Stage};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

const CORNER: EffectParameter = EffectParameter::corner("cutoff", 0.0, 50.0);
const STARTS: &[&[f64]] = &[&[3.0], &[1.0], &[0.4], &[0.15], &[0.02]];

macro_rules! order {
    ($order:literal, $name:literal, $law:literal) => {
        Form {
            name: $name,
            law: $law,
            stage: Stage::Chain,
            parameters: &[CORNER],
            starts: STARTS,
            build: |p| butterworth($order, p[0]),
        }
    };
}

pub(super) static EFFECT: Effect = Effect {
    name: "recorder-lowpass",
    equation: "L = 1/(1 + j f/f_c), or Butterworth of order 2 to 4",
    meaning: "A low-pass filter in the amplifier or recorder attenuates and delays high frequencies.",
    remedy: "Raise its corner frequency or switch it off, or declare it as low_pass in [recorder] of the stand \
              file.",
    source: "S. Butterworth, Exp. Wireless 7 (1930), 536",
    validity: "below half the sampling rate",
    mistaken_for: &["time-delay", "second-mode"],
    experiment: "the same signal on both channels, with energy around the corner frequency",
    forms: &[
        order!(1, "order-1", "L = 1/(1 + j f/f_c), an RC low-pass"),
        order!(2, "order-2", "Butterworth of order 2"),
        order!(3, "order-3", "Butterworth of order 3"),
        order!(4, "order-4", "Butterworth of order 4"),
        Form {
            name: "second-order",
            law: "L = 1/(1 + 2 zeta s/w_c + s^2/w_c^2), w_c = 2 pi cutoff",
            stage: Stage::Chain,
            parameters: &[CORNER, EffectParameter::number("damping_ratio", 0.3, 3.0)],
            starts: &[&[1.0, 0.8], &[0.3, 0.8], &[0.1, 0.8]],
            build: |p| {
                let (corner, damping) = (TAU * p[0], p[1]);
                Action::Factor(Box::new(move |_, omega| {
                    let w = omega / corner;
                    Complex64::new(1.0 - w * w, 2.0 * damping * w).inv()
                }))
            },
        },
    ],
};

fn butterworth(order: u32, cutoff_hz: f64) -> Action {
    let n = f64::from(order);
    let poles: Vec<Complex64> = (1..=order)
        .map(|k| Complex64::from_polar(1.0, PI * (2.0 * f64::from(k) + n - 1.0) / (2.0 * n)))
        .collect();
    Action::Factor(Box::new(move |_, omega| {
        let s = Complex64::new(0.0, omega / (TAU * cutoff_hz));
        poles
            .iter()
            .map(|p| 1.0 - s / p)
            .product::<Complex64>()
            .inv()
    }))
}
