//! Guard models: laws that are not offered as effects. An effect is not named where one of them explains its residual.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_model::effects::{Effect, RIVALS};

use super::acceptance::refusal;
use super::reason::Reason;
use super::records::Records;
use super::score::{BaseModel, EffectParameter, RmsErrors, ScoredModel};
use super::search::{CandidateFit, Workers, fit_all};
use super::structure::EffectForm;

/// A law that is not offered as an effect, fitted.
#[derive(Serialize, JsonSchema)]
pub struct GuardModel {
    /// Name of the law.
    #[serde(rename = "law", serialize_with = "super::search::name_of")]
    #[schemars(with = "String")]
    pub effect: &'static Effect,
    /// Equation of the law.
    pub equation: &'static str,
    /// The effects that were in the model already.
    pub with: Vec<&'static str>,
    #[serde(flatten)]
    pub errors: RmsErrors,
    /// Unit of both errors.
    pub unit: String,
    /// Parameters of the law.
    pub parameters: Vec<EffectParameter>,
    #[serde(skip)]
    pub model: ScoredModel,
}

/// Minimum significance of a guard model's improvement over an effect.
const LEAST_SIGNIFICANCE: f64 = 3.0;
/// Minimum reduction of the criterion from an effect to a guard model.
const LEAST_REDUCTION: f64 = 20.0;
/// Largest fraction of an effect's excess error power that a guard model may leave, unless it has fewer parameters: a law
/// that explains half of it is not its cause.
const LEFT: f64 = 0.5;

impl GuardModel {
    /// Fits of all guard models added to a base model.
    pub fn fits(base: &BaseModel, records: &Records, workers: Workers) -> Vec<ScoredModel> {
        let forms = EffectForm::all(RIVALS.iter().copied());
        let workers = workers.silent();
        let fits = fit_all(base, &forms, &[], base.effort(), records, workers);
        fits.into_iter().flatten().collect()
    }

    /// The guard model that explains most, if it passes as an effect would and has a significantly smaller
    /// residual than the accepted effect, if any.
    pub fn best(
        fits: Vec<ScoredModel>,
        base: &ScoredModel,
        accepted: Option<&ScoredModel>,
        noise_rms: f64,
    ) -> Option<Self> {
        let fits = fits.into_iter();
        let passing = fits.filter(|model| refusal(model, base).is_none());
        let model = passing.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))?;
        if accepted.is_some_and(|accepted| !outdoes(&model, accepted, noise_rms)) {
            return None;
        }
        let effect = model.fitted.structure.effects.last()?.effect;
        Some(Self {
            effect,
            equation: effect.equation,
            with: base.effect_names(),
            errors: model.errors(),
            unit: model.fitted.structure.context.units.printed(),
            parameters: model.last_parameters(),
            model,
        })
    }

    /// Why a candidate is not accepted because of this law.
    pub fn instead_of(&self, candidate: &CandidateFit) -> Reason {
        let error = candidate.model.as_ref().map(ScoredModel::compared_rms);
        Reason::GuardModel {
            ratio: error.unwrap_or(f64::INFINITY) / self.model.compared_rms(),
            law: self.effect.name,
            equation: self.equation,
        }
    }
}

fn outdoes(guard: &ScoredModel, accepted: &ScoredModel, noise_rms: f64) -> bool {
    guard.against(accepted).significance() >= LEAST_SIGNIFICANCE
        && guard.criterion() + LEAST_REDUCTION <= accepted.criterion()
        && (guard.excess_power(noise_rms) <= LEFT * accepted.excess_power(noise_rms)
            || guard.fitted.values.len() < accepted.fitted.values.len())
}
