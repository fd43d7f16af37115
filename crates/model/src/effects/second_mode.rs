//! Another resonance of the stand in the band.
//!
//! `coupled`: a second inertia hangs on the first one. `H = H₁ + a H₂` (`added`), `(1 − a) H₁ + a H₂` (`shared`, the static gain stays), `H₁ H₂` (`series`), or
//! `g H₁ + (a + b s/ω₂) H₂` (`free`), with `H_i = ω_i²/(s² + 2ζ_i ω_i s + ω_i²)`. D. J. Ewins, *Modal Testing* (2000), 2.
//! **Valid for modes separated by more than their widths.** Mistaken for `recorder-lowpass` or `time-delay` if it lies
//! above the excitation.

use super::{Action, Effect, EffectParameter, Form, History, Mode, Stage};
use crate::modal::ModalResponse;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// A mode far above the band shows only as a slope, which has other causes.
const FREQUENCY: EffectParameter =
    EffectParameter::frequency("frequency", 0.05, 20.0).showing(History::Rings);
const DAMPING: EffectParameter = EffectParameter::number("damping_ratio", 1e-4, 1.0);
const SHARE: EffectParameter = EffectParameter::number("share", -3.0, 3.0);

macro_rules! starts {
    ($($rest:literal),*) => {
        &[
            &[0.2, 0.03 $(, $rest)*],
            &[0.35, 0.03 $(, $rest)*],
            &[0.5, 0.03 $(, $rest)*],
            &[0.7, 0.03 $(, $rest)*],
            &[1.25, 0.03 $(, $rest)*],
            &[1.5, 0.03 $(, $rest)*],
            &[1.75, 0.03 $(, $rest)*],
            &[2.0, 0.03 $(, $rest)*],
            &[2.3, 0.03 $(, $rest)*],
            &[2.6, 0.03 $(, $rest)*],
            &[3.0, 0.03 $(, $rest)*],
            &[3.5, 0.03 $(, $rest)*],
            &[4.2, 0.03 $(, $rest)*],
            &[5.0, 0.03 $(, $rest)*],
            &[7.0, 0.03 $(, $rest)*],
        ]
    };
}

pub(super) static EFFECT: Effect = Effect {
    name: "second-mode",
    equation: "H = H1 + a H2",
    meaning: "Another resonance of the stand lies in or near the band, so a single inertia and spring do not describe \
        the response.",
    remedy: "Stiffen the part that moves in that mode, or identify the stand with excitation to well above that \
        resonance.",
    source: "D. J. Ewins, Modal Testing (2000), 2",
    validity: "for modes separated by more than their widths",
    mistaken_for: &["recorder-lowpass", "time-delay", "gain-error"],
    experiment: "excitation to well above the second resonance",
    forms: &[
        Form {
            name: "added",
            law: "H = H1 + a H2",
            stage: Stage::Dynamics,
            parameters: &[FREQUENCY, DAMPING, SHARE],
            starts: starts!(0.02),
            build: |p| {
                let (second, share) = (mode(p[0], p[1]), p[2]);
                factor(move |first, omega| {
                    1.0 + share * first.inverse(omega) * second.response(omega)
                })
            },
        },
        Form {
            name: "shared",
            law: "H = (1 - a) H1 + a H2",
            stage: Stage::Dynamics,
            parameters: &[FREQUENCY, DAMPING, SHARE],
            starts: starts!(0.02),
            build: |p| {
                let (second, share) = (mode(p[0], p[1]), p[2]);
                factor(move |first, omega| {
                    1.0 - share + share * first.inverse(omega) * second.response(omega)
                })
            },
        },
        Form {
            name: "series",
            law: "H = H1 H2",
            stage: Stage::Dynamics,
            // With more damping it is a second-order low-pass.
            parameters: &[
                FREQUENCY,
                EffectParameter::number("damping_ratio", 1e-4, 0.3),
            ],
            starts: starts!(),
            build: |p| {
                let second = mode(p[0], p[1]);
                factor(move |_, omega| second.response(omega))
            },
        },
        Form {
            name: "coupled",
            law: "a second inertia, mu times the first, coupled to it by a spring and a damper",
            stage: Stage::Dynamics,
            parameters: &[
                FREQUENCY.showing(History::RingsCoupled),
                DAMPING,
                EffectParameter::number("inertia_ratio", 0.0, 3.0),
            ],
            starts: starts!(0.02),
            build: |p| {
                let (second, ratio) = (mode(p[0], p[1]), p[2]);
                Action::Body {
                    factor: Box::new(move |first, omega| {
                        // J₂ is attached to J₁: (s² + …)₁ x + μ s² (2ζ₂ω₂ s + ω₂²)/(s² + …)₂ x = ω₁² u.
                        let w1 = omega / first.first().omega_rad_s;
                        let hung = second.inverse(omega) + (omega / second.omega_rad_s).powi(2);
                        let load = -ratio * w1 * w1 * hung * second.response(omega);
                        let plain = first.inverse(omega);
                        plain / (plain + load)
                    }),
                    coupled: Box::new(move |stand| {
                        ModalResponse::of_two_inertias(stand.only()?, second, ratio)
                    }),
                }
            },
        },
        Form {
            name: "free",
            law: "H = g H1 + (a + b s/w_2) H2",
            stage: Stage::Dynamics,
            parameters: &[
                FREQUENCY,
                DAMPING,
                EffectParameter::number("gain", 0.1, 3.0),
                SHARE,
                EffectParameter::number("slope_share", -3.0, 3.0),
            ],
            starts: starts!(1.0, 0.02, 0.0),
            build: |p| {
                let (second, gain, share, slope) = (mode(p[0], p[1]), p[2], p[3], p[4]);
                factor(move |first, omega| {
                    let term = Complex64::new(share, slope * omega / second.omega_rad_s);
                    gain + term * first.inverse(omega) * second.response(omega)
                })
            },
        },
    ],
};

fn mode(frequency_hz: f64, damping_ratio: f64) -> Mode {
    Mode {
        omega_rad_s: TAU * frequency_hz,
        damping_ratio,
    }
}

fn factor(f: impl Fn(&ModalResponse, f64) -> Complex64 + Send + Sync + 'static) -> Action {
    Action::Factor(Box::new(f))
}
