//! From a diagnosis to the refined stand file.

use crate::diagnose::{Judged, Residual};
use crate::failure::Failure;
use crate::io::digits;
use crate::report::diagnose::Parameter;
use crate::stand::{self, Refined, Stand};

use super::render::Rendered;

/// Natural frequency in Hz, damping ratio and static gain of a model, with their standard uncertainties.
pub fn plain_constants(judged: &Judged) -> [(f64, Option<f64>); 3] {
    let fitted = &judged.fitted;
    let (mode, gain) = fitted.structure.mode(&fitted.values);
    let values = [
        mode.omega_rad_s / std::f64::consts::TAU,
        mode.damping_ratio,
        gain,
    ];
    std::array::from_fn(|k| {
        // What is fitted is a multiple of what is meant.
        let std = fitted.std.get(k).copied().flatten();
        let is_fitted = k < fitted.structure.frame.plain_count();
        let scale = fitted.values.get(k).map(|v| (values[k] / v).abs());
        let std = std.zip(scale).map(|(std, scale)| std * scale);
        (values[k], std.filter(|_| is_fitted))
    })
}

impl Rendered<'_> {
    /// Means over the training records of the constant in them and of the displacement by a constant load.
    fn record_constants(&self) -> [f64; 2] {
        let train = &self.diagnosis.after.train;
        let mean =
            |of: &dyn Fn(&Residual) -> f64| train.iter().map(of).sum::<f64>() / train.len() as f64;
        [mean(&|r| r.taken.offset), mean(&|r| r.begin.shift)]
    }

    /// The refined stand file.
    ///
    /// # Errors
    /// If the declared one cannot be read again.
    pub fn stand(&self, declared: Option<(&Stand, &str)>) -> Result<String, Failure> {
        let after = &self.diagnosis.after;
        let [natural_hz, damping_ratio, (gain, _)] = plain_constants(after);
        let frame = after.fitted.structure.frame;
        let parameters = self.parameters(after);
        let effects =
            after
                .fitted
                .structure
                .choices
                .iter()
                .zip(&parameters)
                .map(|(choice, own)| {
                    let written = |p: &Parameter| {
                        let text = |number: f64, digits: u32| {
                            let text = format!("{} {}", digits::text(number, digits), p.unit);
                            text.trim().to_owned()
                        };
                        (p.name, text(p.value, 12), p.std.map(|std| text(std, 3)))
                    };
                    let texts = own.iter().map(written).collect();
                    (choice.effect.name, choice.form.name, texts)
                });
        let applied = stand::si_unit(&self.units.applied);
        let refined = Refined {
            natural_hz,
            damping_ratio,
            gain: frame.gain_is_free.then_some(gain),
            units: (&self.units.diagnosed, &applied),
            measured_unit: if self.units.measured.is_empty() {
                "1"
            } else {
                &self.units.measured
            },
            constants: self.record_constants(),
            effects: effects.collect(),
            source: format!("diagnosed: {}", self.args.train.join(", ")),
            verdict: self.diagnosis.verdict.name(),
        };
        stand::refine(declared, &refined)
    }
}
