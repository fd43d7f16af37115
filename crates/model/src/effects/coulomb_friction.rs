//! Dry friction: a torque of constant magnitude opposing the motion.
//!
//! `n = F sgn(x')`, with sticking (`sharp`), or `n = F tanh(x'/v)` (`tanh`). C. A. Coulomb, *Théorie des machines
//! simples* (1781). **Valid for gross sliding**; before that a joint shows hysteresis with memory. Mistaken for
//! `bouc-wen-hysteresis` and `quadratic-damping`.
//!
//! Integration: `sharp` friction is a constant torque between the zero crossings of the speed, which are located;
//! there the stand sticks if the other torques do not exceed the friction. For `tanh`, with `x` constant, the speed
//! follows `x'' = −ω₀² F tanh(x'/v)` exactly, `sinh(x'/v) ∝ e^{−ω₀² F t/v}`, which cannot overshoot zero; where the
//! speed changes sign between two nodes, `v` is at least half the change, so that the sum over the nodes switches the
//! friction at the right time.

use super::{Action, Effect, EffectParameter, Form, Memory, Stage, Torque};

pub(super) static EFFECT: Effect = Effect {
    name: "coulomb-friction",
    equation: "n = F sgn(x'), or F tanh(x'/v)",
    meaning: "Dry friction opposes the motion with a constant torque, so small motions are damped more than large \
        ones.",
    remedy: "Find the rubbing contact (bearing, seal, cable, dirt in a gap), and free or lubricate it.",
    source: "C. A. Coulomb, Theorie des machines simples (1781)",
    validity: "for gross sliding",
    mistaken_for: &[
        "stribeck-friction",
        "bouc-wen-hysteresis",
        "quadratic-damping",
        "structural-damping",
    ],
    experiment: "slow loading and unloading, a free decay to rest, and the response at two levels",
    forms: &[
        Form {
            name: "sharp",
            law: "n = F sgn(x'), with sticking",
            stage: Stage::Stand,
            parameters: &[EffectParameter::motion("torque", 1, 0, 0.0, 5.0)],
            starts: &[&[0.02], &[0.2]],
            build: |p| {
                Action::beside(Friction {
                    torque: p[0],
                    speed: 0.0,
                })
            },
        },
        Form {
            name: "tanh",
            law: "n = F tanh(x'/v)",
            stage: Stage::Stand,
            parameters: &[
                EffectParameter::motion("torque", 1, 0, 0.0, 5.0),
                EffectParameter::motion("transition_speed", 1, -1, 1e-5, 0.3),
            ],
            starts: &[&[0.03, 0.02], &[0.3, 0.02]],
            build: |p| {
                Action::beside(Friction {
                    torque: p[0],
                    speed: p[1],
                })
            },
        },
    ],
};

/// Friction of constant magnitude, smoothed over a range of speeds.
pub(super) struct Friction {
    pub(super) torque: f64,
    pub(super) speed: f64,
}

impl Torque for Friction {
    fn value(&self, _: &mut Memory, _: f64, speed: f64) -> f64 {
        if self.speed > 0.0 {
            self.torque * (speed / self.speed).tanh()
        } else if speed == 0.0 {
            0.0
        } else {
            self.torque.copysign(speed)
        }
    }

    fn dry(&self) -> Option<f64> {
        (self.speed == 0.0).then_some(self.torque)
    }

    fn switches(&self) -> bool {
        true
    }

    /// `F tanh(x'/√(v² + πσ²/2))`: for `v = 0` its slope at zero is that of the mean of `sgn`.
    fn blurred(&self, memory: &mut Memory, x: f64, speed: f64, speed_std: f64) -> f64 {
        let width = (0.5 * std::f64::consts::PI).sqrt() * speed_std;
        if width == 0.0 {
            return self.value(memory, x, speed);
        }
        self.torque * (speed / self.speed.hypot(width)).tanh()
    }

    fn kick(&self, _: &mut Memory, _: f64, speed: f64, change: f64, impulse: f64) -> f64 {
        if self.speed == 0.0 {
            // The integration handles all of it, as dry friction.
            return speed;
        }
        let width = self.speed.max(0.5 * change.abs());
        let loss = impulse * self.torque;
        let size = speed.abs();
        if size - loss > 15.0 * width {
            return speed - loss.copysign(speed);
        }
        decay(size / width, loss / width) * width.copysign(speed)
    }
}

/// `asinh(sinh(a) e^{−b})` for `a ≥ 0`, also where `sinh(a)` would overflow. It runs in every step of hundreds of fits:
/// with the standard library's `sinh` and `asinh`, a diagnosis takes half as long again.
fn decay(a: f64, b: f64) -> f64 {
    if a.min(a - b) > LARGE {
        return a - b;
    }
    if b - a > VANISHED {
        return 0.0;
    }
    let sine = if a > LARGE {
        0.5 * (a - b).exp()
    } else if a < SMALL {
        (-b).exp() * series(a, [1.0 / 6.0, 1.0 / 20.0, 1.0 / 42.0])
    } else {
        let grown = a.exp();
        0.5 * (grown - grown.recip()) * (-b).exp()
    };
    match sine < SMALL {
        true => series(sine, [-1.0 / 6.0, -9.0 / 20.0, -25.0 / 42.0]),
        false => (sine + (1.0 + sine * sine).sqrt()).ln(),
    }
}

/// Below it, four terms of the series of `sinh` and `asinh` are exact to 1e-14; above it, cancellation in logarithm and
/// difference costs no more than that.
const SMALL: f64 = 0.03;
/// Above it, `sinh` equals half the exponential to the last bit.
const LARGE: f64 = 20.0;
/// The exponential of less than its negative is zero or subnormal, and slow to compute.
const VANISHED: f64 = 700.0;

/// `x (1 + c₀ x² (1 + c₁ x² (1 + c₂ x²)))`.
fn series(x: f64, c: [f64; 3]) -> f64 {
    let square = x * x;
    x * (1.0 + c[0] * square * (1.0 + c[1] * square * (1.0 + c[2] * square)))
}

#[cfg(test)]
mod tests {
    use super::decay;

    #[test]
    fn the_decay_is_that_of_the_functions_it_is_made_of() {
        for a in [0.0, 1e-9, 0.01, 0.029, 0.031, 0.2, 1.0, 7.0, 19.0, 25.0] {
            for b in [-1.0, 0.0, 1e-6, 0.1, 2.0, 9.0, 24.0, 60.0] {
                let right = (f64::sinh(a) * f64::exp(-b)).asinh();
                let found = decay(a, b);
                assert!(
                    (found - right).abs() <= 3e-14 * right,
                    "{a} {b}: {found} for {right}"
                );
            }
        }
        assert_eq!(decay(1000.0, 0.5), 999.5);
    }
}
