//! The refined stand file of a diagnosis.

use torqcomp_decimal::digits;
use torqcomp_model::Estimate;
use torqcomp_model::effects::Unit;

use crate::diagnose::{
    Diagnosis, EffectForm, EffectParameter, HeldBody, RecordResidual, ScoredModel,
};
use crate::failure::Failure;
use crate::identify::MODE_NUMBERS;
use crate::stand::{self, Refined, Stand};

/// The refined stand file.
///
/// # Errors
/// If the declared stand file cannot be read again.
pub fn stand_file(
    diagnosis: &Diagnosis,
    declared: Option<(&Stand, &str)>,
) -> Result<String, Failure> {
    let model = &diagnosis.after;
    let context = diagnosis.context();
    let effects = model.fitted.structure.effects.iter();
    let held = context.held.as_ref();
    let effects = effects.zip(model.parameters()).map(|(effect, own)| {
        let own = match held {
            Some(held) => weakly_held(held, effect, own),
            None => own,
        };
        let texts = own.iter().map(written).collect();
        (effect.effect.name, effect.form.name, texts)
    });
    let mut plain = model.constants();
    if let Some(held) = held {
        plain = held.weakly_held(plain);
    }
    let [natural_hz, damping_ratio, gain] = plain;
    let both = |estimate: Estimate| (estimate.value(), estimate.std_uncertainty());
    let units = held.map_or(&context.units, |held| &held.recorded);
    let constant = |of: fn(&RecordResidual) -> f64| match held {
        // The initial position of a free body does not apply to other records.
        Some(_) => 0.0,
        None => mean(&model.train(), of),
    };
    let refined = Refined {
        natural_hz: both(natural_hz),
        damping_ratio: both(damping_ratio),
        modes: modes(model),
        gain: match &diagnosis.known_loads {
            _ if context.gain_is_free || held.is_some() => Some(both(gain)),
            Some(loads) if !context.units.is_torque => Some(loads.gain_si),
            _ => None,
        },
        units: (&units.diagnosed, &stand::si_unit(&units.applied)),
        measured_unit: match units.measured.as_str() {
            "" => "1",
            unit => unit,
        },
        constants: [
            constant(|r| r.nuisance.offset),
            constant(|r| r.record.initial.preload),
        ],
        effects: effects.collect(),
        source: format!("diagnosed: {}", fitted_files(diagnosis).join(", ")),
        verdict: diagnosis.verdict.name(),
    };
    stand::refine(declared, &refined)
}

/// The source files of the numbers.
fn fitted_files(diagnosis: &Diagnosis) -> Vec<&str> {
    let loads = diagnosis.known_loads.iter().flat_map(|loads| &loads.files);
    let train = diagnosis.sources.train.iter().map(String::as_str);
    train
        .chain(loads.map(|file| file.source.as_str()))
        .collect()
}

/// Fitted parameters of each mode of a stand with several; mode shapes are unchanged.
fn modes(model: &ScoredModel) -> Vec<Vec<(&'static str, Estimate)>> {
    let several = &model.fitted.structure.context.several;
    let has_shapes = several.as_ref().is_some_and(|several| several.has_shapes);
    let of_mode = |numbers: [Estimate; 4]| {
        let all = MODE_NUMBERS.into_iter().zip(numbers);
        let is_moved = |(key, number): &(&str, Estimate)| match *key {
            "residue" => !has_shapes,
            "quadrature" => number.value() != 0.0,
            _ => true,
        };
        all.filter(is_moved).collect()
    };
    model.modes().into_iter().map(of_mode).collect()
}

/// The parameters of an effect on a free body with the weak spring of its stand file.
fn weakly_held(
    held: &HeldBody,
    effect: &EffectForm,
    own: Vec<EffectParameter>,
) -> Vec<EffectParameter> {
    let unit_of_record = &held.recorded.diagnosed;
    let parameters = effect.form.parameters.iter().zip(own).enumerate();
    let converted = parameters.map(|(k, (parameter, own))| {
        let power = match parameter.unit {
            Unit::Powers { recorded, .. } => recorded,
            Unit::Number | Unit::Hertz => 0,
        };
        let factor = held.weakly(power, k == 0);
        let std = own.estimate.std_uncertainty().map(|std| std * factor);
        let unit = parameter.unit.text(unit_of_record);
        EffectParameter {
            estimate: Estimate::of(unit, own.estimate.value() * factor, std),
            ..own
        }
    });
    converted.collect()
}

/// A parameter as written: its name, and the texts of its value and standard uncertainty.
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

/// Mean of a property of the training records.
fn mean(residuals: &[RecordResidual], of: impl Fn(&RecordResidual) -> f64) -> f64 {
    residuals.iter().map(of).sum::<f64>() / residuals.len() as f64
}
