//! The declared stand with its effects.

use std::sync::Arc;

use super::fit::FittedModel;
use super::several_modes::SeveralModes;
use super::structure::{EffectForm, FitContext, PlainStand, Structure};

/// An effect declared in the stand file.
#[derive(Clone)]
pub struct DeclaredForm {
    pub effect: EffectForm,
    /// Its parameters, in units of the record, s and Hz.
    pub values: Vec<f64>,
}

/// The plain stand and effects of a stand file.
#[derive(Clone, Copy)]
pub struct DeclaredStand<'a> {
    pub plain: PlainStand,
    /// All modes of a stand that has several.
    pub several: Option<&'a SeveralModes>,
    pub effects: &'a [DeclaredForm],
}

impl DeclaredStand<'_> {
    /// The plain stand with the effects of the file.
    pub fn structure(&self, context: Arc<FitContext>) -> Structure {
        let effects: Vec<EffectForm> = self.effects.iter().map(|e| e.effect).collect();
        Structure {
            context,
            declared: effects.len(),
            effects,
        }
    }

    /// Values of all fit parameters of that structure.
    pub fn values(&self, context: &FitContext) -> Vec<f64> {
        let mut values = context.plain_values(&self.plain);
        for declared in self.effects {
            let effect = &declared.effect;
            let parameters = effect.form.parameters.iter().take(effect.moved());
            let own = parameters.zip(&declared.values);
            values.extend(own.map(|(p, value)| p.moved(*value, &context.scales)));
        }
        values
    }

    /// The declared stand as a model, in place of a fitted one.
    pub fn model(&self, fitted: &FittedModel) -> FittedModel {
        let context = FitContext {
            several: self.several.cloned(),
            ..(*fitted.structure.context).clone()
        };
        let values = self.values(&context);
        let structure = fitted.structure.clone().in_context(Arc::new(context));
        FittedModel {
            free: structure.model(&values).0.free_mode(),
            structure,
            values,
            amplitudes: self.amplitudes(),
            ..fitted.clone()
        }
    }

    /// Amplitudes of all lines.
    pub fn amplitudes(&self) -> Vec<f64> {
        let lines = self.effects.iter().filter(|e| e.effect.is_line());
        let own = lines.flat_map(|e| &e.values[e.effect.moved()..]);
        own.copied().collect()
    }
}
