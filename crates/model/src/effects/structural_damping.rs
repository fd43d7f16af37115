//! Loss in the material: out of phase with the displacement, not with the speed.
//!
//! `K (1 + jη)` for positive frequencies: the response becomes `1/(1 − (ω/ω₀)² + 2jζω/ω₀ + jη sgn ω)`.
//! T. Theodorsen, I. E. Garrick, NACA Report 685 (1940). **Valid for steady vibration**; taken literally it acts
//! before its cause, which shows in the first moments of a transient only. Mistaken for viscous damping where
//! only the resonance is excited, `coulomb-friction` at one level.

use super::{Action, Effect, Form, Parameter, Place};
use num_complex::Complex64;

pub(super) static EFFECT: Effect = Effect {
    name: "structural-damping",
    equation: "K (1 + j eta)",
    source: "T. Theodorsen, I. E. Garrick, NACA Report 685 (1940)",
    validity: "for steady vibration",
    mistaken_for: &["coulomb-friction", "bouc-wen-hysteresis", "time-delay"],
    experiment: "steady lines from far below to far above the natural frequency",
    forms: &[Form {
        name: "loss-factor",
        place: Place::Dynamics,
        parameters: &[Parameter::number("loss_factor", 0.0, 2.0)],
        starts: &[&[0.02]],
        build: |p| {
            let eta = p[0];
            Action::Factor(Box::new(move |mode, omega| {
                if omega == 0.0 {
                    return Complex64::ONE;
                }
                let plain = mode.inverse(omega);
                plain / (plain + Complex64::new(0.0, eta.copysign(omega)))
            }))
        },
    }],
};
