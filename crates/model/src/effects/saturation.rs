//! A recorder or amplifier that reaches the end of its range.
//!
//! `y = clamp(x, −L, L)` (`hard`; `uneven` with two limits), `y = L tanh(x/L)` (`soft`) or `y = x/(1 + |x/L|^p)^{1/p}`
//! (`knee`). **What was cut off cannot be recovered**; the soft
//! form can, up to just below `L`. Mistaken for `gage-nonlinearity` (cube) if soft.

use super::{Action, Effect, Form, Parameter, Ruler, Stage};

const LIMIT: Parameter = Parameter::motion("limit", 1, 0, 0.05, 4.0).by(Ruler::Peak);

/// A record far below the limit of a soft form bends all the same.
const FAR_LIMIT: Parameter = Parameter::motion("limit", 1, 0, 0.05, 15.0).by(Ruler::Peak);

pub(super) static EFFECT: Effect = Effect {
    name: "saturation",
    equation: "y = clamp(x, -L, L), or L tanh(x/L)",
    source: "the definition",
    validity: "for a range that is the same to both sides",
    mistaken_for: &["gage-nonlinearity", "cubic-stiffness"],
    experiment: "the same excitation at a lower level or a lower gain of the recorder",
    forms: &[
        Form {
            name: "hard",
            stage: Stage::Limit,
            parameters: &[LIMIT],
            starts: &[&[0.99], &[0.7]],
            build: |p| {
                let limit = p[0];
                Action::Transform {
                    apply: Box::new(move |_, samples| {
                        for x in samples {
                            *x = x.clamp(-limit, limit);
                        }
                    }),
                    undo: None,
                }
            },
        },
        Form {
            name: "uneven",
            stage: Stage::Limit,
            parameters: &[
                LIMIT,
                Parameter::motion("lower_limit", 1, 0, -4.0, -0.05).by(Ruler::Peak),
            ],
            starts: &[&[0.99, -0.99], &[0.7, -0.99], &[0.99, -0.7]],
            build: |p| {
                let (upper, lower) = (p[0], p[1]);
                Action::Transform {
                    apply: Box::new(move |_, samples| {
                        for x in samples {
                            *x = x.clamp(lower, upper);
                        }
                    }),
                    undo: None,
                }
            },
        },
        Form {
            name: "knee",
            stage: Stage::Limit,
            parameters: &[LIMIT, Parameter::number("sharpness", 1.0, 30.0)],
            starts: &[&[1.1, 4.0], &[1.02, 10.0]],
            build: |p| {
                let (limit, sharpness) = (p[0], p[1]);
                Action::Transform {
                    apply: Box::new(move |_, samples| {
                        for x in samples {
                            let over = (*x / limit).abs().powf(sharpness);
                            *x /= (1.0 + over).powf(1.0 / sharpness);
                        }
                    }),
                    undo: Some(Box::new(move |_, samples| {
                        for y in samples {
                            let over = (*y / limit).abs().min(0.99).powf(sharpness);
                            *y /= (1.0 - over).powf(1.0 / sharpness);
                        }
                    })),
                }
            },
        },
        Form {
            name: "soft",
            stage: Stage::Limit,
            parameters: &[FAR_LIMIT],
            starts: &[&[1.1], &[2.5], &[6.0]],
            build: |p| {
                let limit = p[0];
                Action::Transform {
                    apply: Box::new(move |_, samples| {
                        for x in samples {
                            *x = limit * (*x / limit).tanh();
                        }
                    }),
                    undo: Some(Box::new(move |_, samples| {
                        for y in samples {
                            // Just below the limit, where noise would be blown up without bound.
                            *y = limit * (*y / limit).clamp(-0.999, 0.999).atanh();
                        }
                    })),
                }
            },
        },
    ],
};
