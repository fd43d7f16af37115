//! A gage or bridge whose output is not in proportion to the strain.
//!
//! `y = x + a x²` (`square`, the law of a silicon gage, Appendix B of the thesis:
//! `ΔR/R = GF (T₀/T) ε + C₂ (T₀/T)² ε²`), `y = x + b x³` (`cube`) or both (`both`). **Valid while the curve rises.**
//! Mistaken for `quadratic-stiffness` or `cubic-stiffness`, which change the motion too, and for `saturation`.

use super::{Action, Effect, Form, Parameter, Stage};

const SQUARE: Parameter = Parameter::motion("square", -1, 0, -0.15, 0.15);
const CUBE: Parameter = Parameter::motion("cube", -2, 0, -0.05, 1.0);

pub(super) static EFFECT: Effect = Effect {
    name: "gage-nonlinearity",
    equation: "y = x + a x^2 + b x^3",
    source: "T. P. Hertel's thesis, Appendix B",
    validity: "while the curve rises",
    mistaken_for: &["quadratic-stiffness", "cubic-stiffness", "saturation"],
    experiment: "known static loads over the whole range, to both sides",
    forms: &[
        Form {
            name: "square",
            stage: Stage::Gage,
            parameters: &[SQUARE],
            starts: &[&[0.005]],
            build: |p| curve(p[0], 0.0),
        },
        Form {
            name: "cube",
            stage: Stage::Gage,
            parameters: &[CUBE],
            starts: &[&[0.002]],
            build: |p| curve(0.0, p[0]),
        },
        Form {
            name: "both",
            stage: Stage::Gage,
            parameters: &[SQUARE, CUBE],
            starts: &[&[0.005, 0.002]],
            build: |p| curve(p[0], p[1]),
        },
    ],
};

fn curve(square: f64, cube: f64) -> Action {
    Action::Transform {
        apply: Box::new(move |_, samples| {
            for x in samples {
                *x += *x * *x * (square + cube * *x);
            }
        }),
        undo: Some(Box::new(move |_, samples| {
            for y in samples {
                *y = inverse(square, cube, *y);
            }
        })),
    }
}

/// The `x` nearest to `y` with `x + a x² + b x³ = y`, by Newton's method from `y`.
fn inverse(square: f64, cube: f64, y: f64) -> f64 {
    let mut x = y;
    for _ in 0..50 {
        let slope = 1.0 + x * (2.0 * square + 3.0 * cube * x);
        if slope <= 0.0 {
            return y;
        }
        let step = (x + x * x * (square + cube * x) - y) / slope;
        x -= step;
        if step.abs() <= 1e-15 * x.abs() {
            break;
        }
    }
    x
}
