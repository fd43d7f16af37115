//! Play between stator and beam.
//!
//! `gap`: within `±g` of its middle the beam is not touched, `n = −clamp(x, −g, g)`, and the gage shows nothing
//! (`gap-beside`: the gage follows the displacement all the same). `soft-gap`: something
//! softer carries within it, `n = −r clamp(x, −g, g)`; with `g` far out this would be an end stop, so `g` is bounded. `joint`: the beam follows the stator with play,
//! `n = w − x` with `w` dragged along at a distance of at most `g` (the play operator of M. A. Krasnoselskii, A. V.
//! Pokrovskii, *Systems with Hysteresis* (1989)). `recorded`: the same play, in what the gage is moved by
//! only. M. Nordin, P.-O. Gutman, *Controlling mechanical systems with backlash*, Automatica 38 (2002), 1633.
//! **Valid for stiff flanks without impact losses.** Mistaken for `coulomb-friction`, `bouc-wen-hysteresis`, and at
//! one level for `cubic-stiffness`.

use super::{Action, Effect, Form, Memory, Parameter, Stage, Torque};

const GAP: Parameter = Parameter::motion("gap", 1, 0, 0.0, 3.0);
/// With the gap far out, this would be an end stop beside the beam.
const SMALL_GAP: Parameter = Parameter::motion("gap", 1, 0, 0.0, 0.8);
const SOFTENING: Parameter = Parameter::number("softening", 0.0, 1.0);
const GAPS: &[&[f64]] = &[&[0.005], &[0.02], &[0.1], &[0.4]];
const SOFT_GAPS: &[&[f64]] = &[&[0.01, 0.4], &[0.05, 0.4], &[0.3, 0.4]];

pub(super) static EFFECT: Effect = Effect {
    name: "backlash",
    equation: "n = -clamp(x, -g, g)",
    source: "M. Nordin, P.-O. Gutman, Automatica 38 (2002), 1633",
    validity: "for stiff flanks without impact losses",
    mistaken_for: &["coulomb-friction", "bouc-wen-hysteresis", "cubic-stiffness"],
    experiment: "a slow load and unload through zero, and the response with a preload",
    forms: &[
        Form {
            name: "gap",
            stage: Stage::Stand,
            parameters: &[GAP],
            starts: GAPS,
            build: |p| Action::shown(Gap::of(p)),
        },
        Form {
            name: "gap-beside",
            stage: Stage::Stand,
            parameters: &[GAP],
            starts: GAPS,
            build: |p| Action::beside(Gap::of(p)),
        },
        Form {
            name: "soft-gap",
            stage: Stage::Stand,
            parameters: &[SMALL_GAP, SOFTENING],
            starts: SOFT_GAPS,
            build: |p| Action::shown(Gap::of(p)),
        },
        Form {
            name: "soft-gap-beside",
            stage: Stage::Stand,
            parameters: &[SMALL_GAP, SOFTENING],
            starts: SOFT_GAPS,
            build: |p| Action::beside(Gap::of(p)),
        },
        Form {
            name: "joint",
            stage: Stage::Stand,
            parameters: &[GAP],
            starts: &[&[0.02], &[0.1]],
            build: |p| Action::beside(Joint { gap: p[0] }),
        },
        Form {
            name: "recorded",
            stage: Stage::Gage,
            parameters: &[GAP],
            starts: &[&[0.02], &[0.1]],
            build: |p| {
                let gap = p[0];
                Action::Transform {
                    apply: Box::new(move |_, samples| {
                        let mut follower = samples.first().copied().unwrap_or(0.0);
                        for sample in samples {
                            follower = follower.clamp(*sample - gap, *sample + gap);
                            *sample = follower;
                        }
                    }),
                    undo: None,
                }
            },
        },
    ],
};

struct Gap {
    gap: f64,
    share: f64,
}

impl Gap {
    fn of(p: &[f64]) -> Self {
        Self {
            gap: p[0],
            share: p.get(1).copied().unwrap_or(1.0),
        }
    }
}

impl Torque for Gap {
    fn value(&self, _: &mut Memory, x: f64, _: f64) -> f64 {
        -self.share * x.clamp(-self.gap, self.gap)
    }

    fn hidden(&self) -> f64 {
        // A soft gap shows its inside, if weakly.
        if self.share < 1.0 { 0.0 } else { self.gap }
    }

    fn has_zero(&self) -> bool {
        true
    }
}

struct Joint {
    gap: f64,
}

impl Torque for Joint {
    fn value(&self, memory: &mut Memory, x: f64, _: f64) -> f64 {
        memory[0] = memory[0].clamp(x - self.gap, x + self.gap);
        memory[0] - x
    }

    fn begin(&self, x: f64) -> Memory {
        [x, 0.0]
    }
}
