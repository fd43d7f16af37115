//! Material damping: in quadrature with the displacement, independent of the speed.
//!
//! `K (1 + jη)` for positive frequencies: the response becomes `1/(1 − (ω/ω₀)² + 2jζω/ω₀ + jη sgn ω)`. T. Theodorsen,
//! I. E. Garrick, NACA Report 685 (1940). **Valid for steady vibration**; strictly it is non-causal (`springpot`,
//! `K (jω/ω₀)^α`, is causal; A. Gemant, Physics 7 (1936), 311), which shows only at the very start of a transient.
//! Mistaken for viscous damping where only the resonance is excited, `coulomb-friction` at one level.

use super::{Action, Effect, EffectParameter, Form, History, Mode, Stage};
use num_complex::Complex64;

/// A springpot remembers the load before a record, as `t^(−α)`.
const ORDER: EffectParameter = EffectParameter::number("order", 0.0, 0.5).showing(History::Lingers);

pub(super) static EFFECT: Effect = Effect {
    name: "structural-damping",
    equation: "K (1 + j eta)",
    meaning: "The material and its joints lose energy in proportion to the displacement, not to the speed.",
    remedy: "The stand needs no repair: keep the effect in the stand file, and measure it with steady sines over the \
        whole band.",
    source: "T. Theodorsen, I. E. Garrick, NACA Report 685 (1940)",
    validity: "for steady vibration",
    mistaken_for: &["coulomb-friction", "bouc-wen-hysteresis", "time-delay"],
    experiment: "steady sines from far below to far above the natural frequency",
    forms: &[
        Form {
            name: "loss-factor",
            law: "K (1 + j eta)",
            stage: Stage::Dynamics,
            parameters: &[EffectParameter::number("loss_factor", 0.0, 2.0)],
            starts: &[&[0.02]],
            build: |p| {
                let eta = p[0];
                stiffness(move |_, omega, plain| match omega == 0.0 {
                    true => plain,
                    false => plain + Complex64::new(0.0, eta.copysign(omega)),
                })
            },
        },
        Form {
            name: "springpot",
            law: "K (j w/w_0)^alpha",
            stage: Stage::Dynamics,
            parameters: &[ORDER],
            starts: &[&[0.02]],
            build: |p| {
                let order = p[0];
                stiffness(move |mode, omega, plain| {
                    // The static stiffness of a springpot is zero: far below the band it is
                    // clamped.
                    let w = (omega / mode.omega_rad_s).abs().max(1e-4);
                    let turn = (0.5 * std::f64::consts::PI * order).copysign(omega);
                    plain - 1.0 + Complex64::from_polar(w.powf(order), turn)
                })
            },
        },
        Form {
            name: "springpot-stiffness",
            law: "r K (j w/w_0)^alpha",
            stage: Stage::Dynamics,
            parameters: &[ORDER, EffectParameter::number("stiffness_ratio", 0.3, 3.0)],
            starts: &[&[0.02, 1.0]],
            build: |p| {
                let (order, ratio) = (p[0], p[1]);
                stiffness(move |mode, omega, plain| {
                    let w = (omega / mode.omega_rad_s).abs().max(1e-4);
                    let turn = (0.5 * std::f64::consts::PI * order).copysign(omega);
                    plain - 1.0 + Complex64::from_polar(ratio * w.powf(order), turn)
                })
            },
        },
    ],
};

fn stiffness(
    change: impl Fn(&Mode, f64, Complex64) -> Complex64 + Send + Sync + 'static,
) -> Action {
    Action::Stiffness(Box::new(change))
}
