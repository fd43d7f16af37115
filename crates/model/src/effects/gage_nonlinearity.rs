//! A gage or bridge whose output is not proportional to strain.
//!
//! `y = x + a x²` (`square`, the law of a silicon gage, Appendix B of the thesis: `ΔR/R = GF (T₀/T) ε + C₂ (T₀/T)²
//! ε²`), `y = x + b x³` (`cube`) or both (`both`). **Valid while the curve is rising.** Mistaken for
//! `quadratic-stiffness` or `cubic-stiffness`, which change the motion too, and for `saturation`.

use super::curve::curve;
use super::{Action, Effect, EffectParameter, Form, Stage};

const SQUARE: EffectParameter = EffectParameter::motion("square", -1, 0, -0.15, 0.15);
const CUBE: EffectParameter = EffectParameter::motion("cube", -2, 0, -0.05, 1.0);

pub(super) static EFFECT: Effect = Effect {
    name: "gage-nonlinearity",
    equation: "y = x + a x^2 + b x^3",
    meaning: "The output of gage or bridge is not proportional to the strain.",
    remedy: "Calibrate with known static loads over the whole range, and use less strain, a full bridge or metal \
              gages.",
    source: "T. P. Hertel's thesis, Appendix B",
    validity: "while the curve is rising",
    mistaken_for: &["quadratic-stiffness", "cubic-stiffness", "saturation"],
    experiment: "known static loads over the whole range, in both directions",
    forms: &[
        Form {
            name: "square",
            law: "y = x + a x^2",
            stage: Stage::Gage,
            parameters: &[SQUARE],
            starts: &[&[0.005]],
            build: |p| law(p[0], 0.0),
        },
        Form {
            name: "cube",
            law: "y = x + b x^3",
            stage: Stage::Gage,
            parameters: &[CUBE],
            starts: &[&[0.002]],
            build: |p| law(0.0, p[0]),
        },
        Form {
            name: "both",
            law: "y = x + a x^2 + b x^3",
            stage: Stage::Gage,
            parameters: &[SQUARE, CUBE],
            starts: &[&[0.005, 0.002]],
            build: |p| law(p[0], p[1]),
        },
    ],
};

fn law(square: f64, cube: f64) -> Action {
    curve(
        move |x| x + x * x * (square + cube * x),
        move |y| inverse(square, cube, y),
    )
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::SampleClock;

    #[test]
    fn a_fold_ends_the_branch_and_is_reported() {
        // The minimum of x + x²/10 is −2.5 at −5; its inverse has slope 10 where 1 + x/5 = 1/10, at −2.475.
        let Action::Distortion(bent) = law(0.1, 0.0) else {
            panic!("not a curve")
        };
        let mut samples = [1.0, 2.0, -2.4, -2.6, -4.0];
        let beyond = bent.inverse(SampleClock { step_s: 1e-3 }, 0.0, &mut samples);
        assert_eq!(beyond.samples, [3, 4]);
        assert!(beyond.why.contains("beyond -2.475"), "{}", beyond.why);
        assert!((samples[0] + 0.1 * samples[0] * samples[0] - 1.0).abs() < 1e-12);
        assert!(samples[4] < samples[3] && samples[3] < -4.5, "{samples:?}");
    }
}
