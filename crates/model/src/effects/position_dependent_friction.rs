//! Position-dependent friction: a spot that rubs, or a wedge that presses harder the farther it goes.
//!
//! `n = F e^{−((x−c)/w)²} tanh(x'/v)` (`spot`), or `n = μ |x − c| tanh(x'/v)` (`wedge`). B. Armstrong-Hélouvry, P.
//! Dupont, C. Canudas de Wit, *A survey of models, analysis tools and compensation methods for the control of machines
//! with friction*, Automatica 30 (1994), 1083. **Valid for gross sliding.** Mistaken for `coulomb-friction` if the
//! motion has one amplitude, and the wedge for `structural-damping`.
//!
//! Integration: `x` is constant while a torque acts, so the flow is that of
//! [`coulomb_friction`](super::coulomb_friction).

use super::coulomb_friction::Friction;
use super::{Action, Effect, EffectParameter, Form, Memory, ParameterScale, Stage, Torque, Zero};

const CENTRE: EffectParameter =
    EffectParameter::motion("centre", 1, 0, -1.0, 1.0).by(ParameterScale::Peak);
const TRANSITION_SPEED: EffectParameter =
    EffectParameter::motion("transition_speed", 1, -1, 1e-5, 0.3);

pub(super) static EFFECT: Effect = Effect {
    name: "position-dependent-friction",
    equation: "n = F exp(-((x - c)/w)^2) tanh(x'/v), or mu |x - c| tanh(x'/v)",
    meaning: "Friction is higher at some displacements than at others, as from a rubbing spot or a wedge.",
    remedy: "Find where parts touch at the displacement named, and clear that place or align the parts.",
    source: "B. Armstrong-Helouvry et al., Automatica 30 (1994), 1083",
    validity: "for gross sliding",
    mistaken_for: &[
        "coulomb-friction",
        "stribeck-friction",
        "structural-damping",
        "bouc-wen-hysteresis",
    ],
    experiment: "slow loading and unloading over the whole range, and the response with and without a preload",
    forms: &[
        Form {
            name: "spot",
            law: "n = F exp(-((x - c)/w)^2) tanh(x'/v)",
            stage: Stage::Stand,
            parameters: &[
                EffectParameter::motion("torque", 1, 0, 0.0, 5.0),
                CENTRE,
                EffectParameter::motion("width", 1, 0, 0.02, 2.0).by(ParameterScale::Peak),
                TRANSITION_SPEED,
            ],
            starts: &[
                &[0.1, 0.0, 0.2, 0.02],
                &[0.1, 0.3, 0.2, 0.02],
                &[0.1, -0.3, 0.2, 0.02],
            ],
            build: |p| {
                let (torque, centre, width) = (p[0], p[1], p[2]);
                local(p[3], move |x| {
                    torque * (-((x - centre) / width).powi(2)).exp()
                })
            },
        },
        Form {
            name: "wedge",
            law: "n = mu |x - c| tanh(x'/v)",
            stage: Stage::Stand,
            parameters: &[
                EffectParameter::number("coefficient", 0.0, 5.0),
                CENTRE,
                TRANSITION_SPEED,
            ],
            starts: &[&[0.05, 0.0, 0.02], &[0.05, 0.3, 0.02], &[0.05, -0.3, 0.02]],
            build: |p| {
                let (coefficient, centre) = (p[0], p[1]);
                local(p[2], move |x| coefficient * (x - centre).abs())
            },
        },
    ],
};

/// Friction whose size is a function of the displacement.
struct Local<F> {
    torque: F,
    transition_speed: f64,
}

fn local(transition_speed: f64, torque: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Action {
    Action::beside(Local {
        torque,
        transition_speed,
    })
}

impl<F: Fn(f64) -> f64> Local<F> {
    fn at(&self, x: f64) -> Friction {
        Friction {
            torque: (self.torque)(x),
            speed: self.transition_speed,
        }
    }
}

impl<F: Fn(f64) -> f64 + Send + Sync> Torque for Local<F> {
    fn value(&self, memory: &mut Memory, x: f64, speed: f64) -> f64 {
        self.at(x).value(memory, x, speed)
    }

    fn blurred(&self, memory: &mut Memory, x: f64, speed: f64, speed_std: f64) -> f64 {
        self.at(x).blurred(memory, x, speed, speed_std)
    }

    fn kick(&self, memory: &mut Memory, x: f64, speed: f64, change: f64, impulse: f64) -> f64 {
        self.at(x).kick(memory, x, speed, change, impulse)
    }

    fn switches(&self) -> bool {
        true
    }

    fn zero(&self) -> Zero {
        Zero::Placed
    }
}
