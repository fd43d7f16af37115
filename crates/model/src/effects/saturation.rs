//! A recorder or amplifier that reaches the end of its range.
//!
//! `y = clamp(x, −L, L)` (`hard`; `uneven` with two limits), `y = L tanh(x/L)` (`soft`) or `y = x/(1 + |x/L|^p)^{1/p}`
//! (`knee`). **Clipped values cannot be recovered**; those of a soft form can, up to just below `L`. Mistaken for
//! `gage-nonlinearity` (cube) if soft.

use super::curve::curve;
use super::{
    Action, Distortion, Effect, EffectParameter, Form, ParameterScale, SampleClock, Stage,
    Treatment, Unrecovered,
};

const LIMIT: EffectParameter =
    EffectParameter::motion("limit", 1, 0, 0.05, 4.0).by(ParameterScale::Peak);

/// A soft form curves noticeably even far below its limit.
const FAR_LIMIT: EffectParameter =
    EffectParameter::motion("limit", 1, 0, 0.05, 15.0).by(ParameterScale::Peak);

pub(super) static EFFECT: Effect = Effect {
    name: "saturation",
    equation: "y = clamp(x, -L, L), or L tanh(x/L)",
    meaning: "The recorder or amplifier reaches the end of its range and clips the signal.",
    remedy: "Record again with a lower gain or a wider range: the clipped part cannot be recovered.",
    source: "the definition",
    validity: "for a range that is the same in both directions",
    mistaken_for: &["gage-nonlinearity", "cubic-stiffness"],
    experiment: "the same excitation at a lower level or a lower recorder gain",
    forms: &[
        Form {
            name: "hard",
            law: "y = clamp(x, -L, L)",
            stage: Stage::Limit,
            parameters: &[LIMIT],
            // Noise raises the peak of the record above the limit; from a start farther below, a step past the peak
            // finds zero slope.
            starts: &[
                &[0.9998],
                &[0.9995],
                &[0.999],
                &[0.998],
                &[0.996],
                &[0.99],
                &[0.98],
                &[0.96],
                &[0.7],
            ],
            build: |p| clipping(-p[0], p[0]),
        },
        Form {
            name: "uneven",
            law: "y = clamp(x, L_lower, L)",
            stage: Stage::Limit,
            parameters: &[
                LIMIT,
                EffectParameter::motion("lower_limit", 1, 0, -4.0, -0.05).by(ParameterScale::Peak),
            ],
            starts: &[
                &[0.998, -0.998],
                &[0.99, -0.99],
                &[0.7, -0.99],
                &[0.99, -0.7],
            ],
            build: |p| clipping(p[1], p[0]),
        },
        Form {
            name: "knee",
            law: "y = x/(1 + |x/L|^p)^(1/p)",
            stage: Stage::Limit,
            parameters: &[LIMIT, EffectParameter::number("sharpness", 1.0, 30.0)],
            starts: &[&[1.1, 4.0], &[1.02, 10.0]],
            build: |p| {
                let (limit, sharpness) = (p[0], p[1]);
                let part = move |x: f64| (x / limit).abs();
                curve(
                    move |x| x / (1.0 + part(x).powf(sharpness)).powf(1.0 / sharpness),
                    move |y| y / (1.0 - part(y).min(0.99).powf(sharpness)).powf(1.0 / sharpness),
                )
            },
        },
        Form {
            name: "soft",
            law: "y = L tanh(x/L)",
            stage: Stage::Limit,
            parameters: &[FAR_LIMIT],
            starts: &[&[1.1], &[2.5], &[6.0]],
            build: |p| {
                let limit = p[0];
                // Just below the limit the inverse would amplify noise without bound.
                curve(
                    move |x| limit * (x / limit).tanh(),
                    move |y| limit * (y / limit).clamp(-0.999, 0.999).atanh(),
                )
            },
        },
    ],
};

fn clipping(lower: f64, upper: f64) -> Action {
    Action::Distortion(Box::new(Clipping { lower, upper }))
}

/// `y = clamp(x, lower, upper)`.
struct Clipping {
    lower: f64,
    upper: f64,
}

/// Distance from the limit, in standard deviations of the noise, within which a sample counts as
/// clipped.
const AT_LIMIT: f64 = 3.0;
/// Distance from the limit, relative to it, within which a sample counts as clipped.
const RELATIVE: f64 = 1e-9;
/// Ratio of limit to largest sample beyond which the limit does not apply to the record.
const OUT_OF_REACH: f64 = 1e3;

impl Distortion for Clipping {
    fn forward(&self, _: SampleClock, samples: &mut [f64]) {
        for x in samples {
            *x = x.clamp(self.lower, self.upper);
        }
    }

    /// Clipped values are lost: the samples at the limits are marked.
    fn inverse(&self, _: SampleClock, noise_std: f64, samples: &mut [f64]) -> Unrecovered {
        let largest = samples
            .iter()
            .fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let limits = [-OUT_OF_REACH * largest, OUT_OF_REACH * largest]
            .map(|x| x.clamp(self.lower, self.upper));
        let near = |limit: f64| AT_LIMIT * noise_std + RELATIVE * limit.abs();
        let lost = |y: &f64| *y <= limits[0] + near(limits[0]) || *y >= limits[1] - near(limits[1]);
        let places = samples.iter().enumerate().filter(|(_, y)| lost(y));
        Unrecovered {
            why: format!(
                "at the limits {:.4} and {:.4} in SI units the record is clipped",
                limits[0], limits[1]
            ),
            samples: places.map(|(i, _)| i).collect(),
        }
    }

    fn treatment(&self) -> Treatment {
        Treatment::Marked
    }

    fn is_pointwise(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clipped_sample_is_marked() {
        let clipping = Clipping {
            lower: -1.0,
            upper: 2.0,
        };
        let mut samples = [0.0, 2.0, 1.9, -1.0, 1.99];
        let lost = clipping.inverse(SampleClock { step_s: 1e-3 }, 0.01, &mut samples);
        assert_eq!(lost.samples, [1, 3, 4]);
        assert!(lost.why.contains("-1.0000 and 2.0000"), "{}", lost.why);
    }
}
