//! From a diagnosis to the refined stand file.

use crate::diagnose::{Diagnosis, EffectParameter, RecordResidual};
use crate::failure::Failure;
use crate::io::digits;
use crate::stand::{self, Refined, Stand};

/// The refined stand file.
///
/// # Errors
/// If the declared one cannot be read again.
pub fn stand_file(
    diagnosis: &Diagnosis,
    declared: Option<(&Stand, &str)>,
) -> Result<String, Failure> {
    let model = &diagnosis.after;
    let context = diagnosis.context();
    let effects = model.fitted.structure.effects.iter();
    let effects = effects.zip(model.parameters()).map(|(effect, own)| {
        let texts = own.iter().map(written).collect();
        (effect.effect.name, effect.form.name, texts)
    });
    let [natural_hz, damping_ratio, gain] = model.constants();
    let both = |estimate: torqcomp_model::Estimate| (estimate.value(), estimate.std_uncertainty());
    let units = &context.units;
    let refined = Refined {
        natural_hz: both(natural_hz),
        damping_ratio: both(damping_ratio),
        gain: context.gain_is_free.then_some(gain.value()),
        units: (&units.diagnosed, &stand::si_unit(&units.applied)),
        measured_unit: match units.measured.as_str() {
            "" => "1",
            unit => unit,
        },
        constants: [
            mean(&model.train, |r| r.nuisance.offset),
            mean(&model.train, |r| r.record.initial.preload),
        ],
        effects: effects.collect(),
        source: format!("diagnosed: {}", diagnosis.sources.train.join(", ")),
        verdict: diagnosis.verdict.name(),
    };
    stand::refine(declared, &refined)
}

/// A parameter as it is written: its name, and the texts of its value and of its standard uncertainty.
fn written(parameter: &EffectParameter) -> (&'static str, String, Option<String>) {
    let estimate = &parameter.estimate;
    let text = |number: f64, digits: u32| {
        let text = format!("{} {}", digits::text(number, digits), estimate.unit());
        text.trim().to_owned()
    };
    let std = estimate.std_uncertainty();
    (
        parameter.name,
        text(estimate.value(), 12),
        std.map(|std| text(std, 3)),
    )
}

/// Mean over the training records of something that belongs to a record.
fn mean(residuals: &[RecordResidual], of: impl Fn(&RecordResidual) -> f64) -> f64 {
    residuals.iter().map(of).sum::<f64>() / residuals.len() as f64
}
