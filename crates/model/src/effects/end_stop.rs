//! An end stop: beyond a displacement, a second contact carries load too.
//!
//! `n = k (x − clamp(x, −g, g))`, or beyond `g` on one side only; with losses the contact adds `c x'` while closed. S.
//! W. Shaw, P. J. Holmes, *A periodically forced piecewise linear oscillator*, J. Sound Vib. 90 (1983), 129. **Valid
//! for a contact that does not move.** Mistaken for `cubic-stiffness`, `saturation` and `bouc-wen-hysteresis`.
//!
//! Integration: for constant `x` in contact, the speed follows `x'' = −ω₀² (k (x − g) + c x')` exactly.

use super::{Action, Effect, EffectParameter, Form, Memory, ParameterScale, Stage, Torque, Zero};

const GAP: EffectParameter =
    EffectParameter::motion("gap", 1, 0, 0.05, 2.0).by(ParameterScale::Peak);
const UPPER: EffectParameter =
    EffectParameter::motion("gap", 1, 0, -1.0, 2.0).by(ParameterScale::Peak);
const STIFFNESS: EffectParameter = EffectParameter::number("stiffness_ratio", 0.0, 1e4);
const DAMPING: EffectParameter = EffectParameter::motion("contact_damping", 0, 1, 0.0, 20.0);
const BELOW: EffectParameter = EffectParameter {
    name: "gap_below",
    ..GAP
};
const ABOVE: EffectParameter = EffectParameter {
    name: "gap_above",
    ..GAP
};
const STARTS: &[&[f64]] = &[&[0.3, 0.5], &[0.5, 0.7], &[1.0, 0.85]];
const TO_ONE_SIDE: &[&[f64]] = &[&[0.1, 0.05], &[0.3, 0.5], &[1.0, 0.8]];
const ONE_DAMPED: &[&[f64]] = &[&[0.3, 0.5, 0.1], &[1.0, 0.8, 0.1], &[10.0, 0.85, 0.3]];

pub(super) static EFFECT: Effect = Effect {
    name: "end-stop",
    equation: "n = k (x - clamp(x, -g, g))",
    meaning: "Beyond some displacement another part shares the load, such as a stop that the beam touches.",
    remedy: "Find what the beam touches and move it away, or stay below that displacement.",
    source: "S. W. Shaw, P. J. Holmes, J. Sound Vib. 90 (1983), 129",
    validity: "for a contact that does not move",
    mistaken_for: &["cubic-stiffness", "saturation", "bouc-wen-hysteresis"],
    experiment: "slow loading and unloading in both directions, past the displacement where the stop engages, and the \
        response at a level that does not reach it",
    forms: &[
        Form {
            name: "both",
            law: "n = k (x - clamp(x, -g, g)); the gage shows x",
            stage: Stage::Stand,
            parameters: &[STIFFNESS, GAP],
            starts: STARTS,
            build: |p| Action::beside(Stop::both(p)),
        },
        Form {
            name: "both-shown",
            law: "n = k (x - clamp(x, -g, g)); the gage shows x + n",
            stage: Stage::Stand,
            parameters: &[STIFFNESS, GAP],
            starts: STARTS,
            build: |p| Action::in_gage_path(Stop::both(p)),
        },
        Form {
            name: "above",
            law: "n = k max(x - g, 0)",
            stage: Stage::Stand,
            parameters: &[STIFFNESS, UPPER],
            starts: TO_ONE_SIDE,
            build: |p| Action::beside(Stop::above(p)),
        },
        Form {
            name: "below",
            law: "n = k min(x + g, 0)",
            stage: Stage::Stand,
            parameters: &[STIFFNESS, UPPER],
            starts: TO_ONE_SIDE,
            build: |p| Action::beside(Stop::below(p)),
        },
        Form {
            name: "above-damped",
            law: "n = k (x - g) + c x' for x > g",
            stage: Stage::Stand,
            parameters: &[STIFFNESS, UPPER, DAMPING],
            starts: ONE_DAMPED,
            build: |p| Action::beside(Stop::above(p)),
        },
        Form {
            name: "below-damped",
            law: "n = k (x + g) + c x' for x < -g",
            stage: Stage::Stand,
            parameters: &[STIFFNESS, UPPER, DAMPING],
            starts: ONE_DAMPED,
            build: |p| Action::beside(Stop::below(p)),
        },
        Form {
            name: "uneven-damped",
            law: "n = k (x - clamp(x, -g1, g2)), and c x' beyond them",
            stage: Stage::Stand,
            parameters: &[STIFFNESS, BELOW, DAMPING, ABOVE],
            starts: &[
                &[0.3, 0.5, 0.1, 0.5],
                &[1.0, 0.85, 0.1, 0.85],
                &[10.0, 0.9, 0.3, 0.9],
            ],
            build: |p| {
                Action::beside(Stop {
                    upper: p[3],
                    is_centred: false,
                    ..Stop::both(p)
                })
            },
        },
    ],
};

struct Stop {
    stiffness: f64,
    damping: f64,
    lower: f64,
    upper: f64,
    /// Whether the two stops are as far from the zero of displacement.
    is_centred: bool,
}

impl Stop {
    fn both(p: &[f64]) -> Self {
        Self {
            stiffness: p[0],
            damping: p.get(2).copied().unwrap_or(0.0),
            lower: -p[1],
            upper: p[1],
            is_centred: true,
        }
    }

    fn above(p: &[f64]) -> Self {
        Self {
            lower: f64::NEG_INFINITY,
            is_centred: false,
            ..Self::both(p)
        }
    }

    fn below(p: &[f64]) -> Self {
        Self {
            upper: f64::INFINITY,
            is_centred: false,
            ..Self::both(p)
        }
    }

    /// Penetration of a displacement beyond the stop.
    fn beyond(&self, x: f64) -> f64 {
        x - x.clamp(self.lower, self.upper)
    }
}

impl Torque for Stop {
    fn value(&self, _: &mut Memory, x: f64, speed: f64) -> f64 {
        match self.beyond(x) {
            0.0 => 0.0,
            beyond => self.stiffness * beyond + self.damping * speed,
        }
    }

    fn kick(&self, _: &mut Memory, x: f64, speed: f64, _: f64, impulse: f64) -> f64 {
        let beyond = self.beyond(x);
        let loss = impulse * self.damping;
        if beyond == 0.0 || loss == 0.0 {
            return speed - impulse * self.stiffness * beyond;
        }
        let towards = -self.stiffness * beyond / self.damping;
        towards + (speed - towards) * (-loss).exp()
    }

    fn zero(&self) -> Zero {
        match self.is_centred {
            true => Zero::Fixed,
            false => Zero::Placed,
        }
    }
}
