//! Backward elimination of effects: which ones a model needs, what each explains, and the errors with none, one, two
//! and so on.

use schemars::JsonSchema;
use serde::Serialize;

use super::fit::{FitEffort, FittedModel, fit};
use super::records::Records;
use super::score::{RmsErrors, ScoredModel};
use crate::parallel::parallel;
use torqcomp_dsp::dot;

/// A refit of a model without some effects.
const REPEATED: FitEffort = FitEffort::full(6);

/// A number of effects, and the error that they leave.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct LadderStep {
    /// Names of the effects.
    pub effects: Vec<&'static str>,
    #[serde(flatten)]
    pub errors: RmsErrors,
    /// Probability of the gain over the previous step by chance.
    pub p_value: Option<f64>,
}

/// What one of several effects explains.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EffectShare {
    /// Name of the effect.
    pub effect: &'static str,
    /// Increase of the residual power of the hold-out records without this effect, over the power explained by all
    /// effects.
    pub share: f64,
}

/// How alike two effects change the held-out records.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EffectCorrelation {
    /// Names of the two effects.
    pub effects: [&'static str; 2],
    /// Correlation of their separate contributions.
    pub correlation: f64,
}

/// What several effects explain, each and together.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct Ladder {
    /// Hold-out errors as effects are added.
    pub ladder: Vec<LadderStep>,
    /// What each of several effects explains.
    pub shares: Vec<EffectShare>,
    /// Similarity of the changes that pairs of effects make in the hold-out records.
    pub correlations: Vec<EffectCorrelation>,
}

impl FittedModel {
    /// The model with some of its added effects only, refitted.
    pub fn with_only(&self, keep: impl Fn(usize) -> bool, records: &Records) -> Option<Self> {
        let declared = self.structure.declared;
        let keeps = |k: usize| k.checked_sub(declared).is_none_or(&keep);
        let (structure, values) = self.structure.reduced(&self.values, keeps);
        let train = self.with_initial_states(&records.train);
        fit(structure, &values, &train, REPEATED).ok()
    }
}

impl ScoredModel {
    /// The model without each of its added effects, one at a time; `None` where that cannot be fitted.
    pub fn without_each(&self, records: &Records, threads: usize) -> Vec<Option<Self>> {
        parallel(self.fitted.structure.added().len(), threads, |k| {
            let less = self.fitted.with_only(|other| other != k, records)?;
            Some(Self::of(less, records)?.without_samples())
        })
    }

    /// The model with each of its added effects alone.
    fn each_alone(&self, records: &Records, threads: usize) -> Vec<Option<Self>> {
        parallel(self.fitted.structure.added().len(), threads, |k| {
            let alone = self.fitted.with_only(|other| other == k, records)?;
            Some(Self::of(alone, records)?.without_samples())
        })
    }

    fn compared_sum(&self) -> f64 {
        let samples = self.compared_samples();
        dot(&samples, &samples)
    }
}

impl Ladder {
    /// Contribution of each effect of a model; `without` is the model without each of them.
    pub fn of(
        after: &ScoredModel,
        before: &ScoredModel,
        without: Vec<Option<ScoredModel>>,
        records: &Records,
        threads: usize,
    ) -> Self {
        let names = after.effect_names();
        if names.is_empty() {
            return Self::default();
        }
        let explained = before.compared_sum() - after.compared_sum();
        let share = |(k, effect): (usize, &&'static str)| {
            let without = match names.len() {
                1 => Some(before),
                _ => without.get(k)?.as_ref(),
            };
            Some(EffectShare {
                effect,
                share: (without?.compared_sum() - after.compared_sum()) / explained,
            })
        };
        Self {
            shares: names.iter().enumerate().filter_map(share).collect(),
            correlations: correlations(after, before, &without, records, threads),
            ladder: steps(after, before, without, records, threads),
        }
    }
}

/// The models from no effects to all: starting from the last, the effect whose removal affects the training records
/// least goes first.
fn steps(
    after: &ScoredModel,
    before: &ScoredModel,
    mut without: Vec<Option<ScoredModel>>,
    records: &Records,
    threads: usize,
) -> Vec<LadderStep> {
    let mut models = vec![after.clone()];
    while let Some(less) = without
        .into_iter()
        .flatten()
        .min_by(|a, b| a.fitted.train_sum.total_cmp(&b.fitted.train_sum))
    {
        without = match less.effect_names().len() {
            0 | 1 => Vec::new(),
            _ => less.without_each(records, threads),
        };
        models.push(less);
    }
    if models.last().is_some_and(|m| !m.effect_names().is_empty()) {
        models.push(before.clone());
    }
    models.reverse();
    let step = |k: usize| LadderStep {
        effects: models[k].effect_names(),
        errors: models[k].errors(),
        p_value: match k {
            0 => None,
            _ => models[k].against(&models[k - 1]).p_value(),
        },
    };
    (0..models.len()).map(step).collect()
}

/// Correlations between the contributions of each effect alone. With two effects, each alone is the
/// model without the other.
fn correlations(
    after: &ScoredModel,
    before: &ScoredModel,
    without: &[Option<ScoredModel>],
    records: &Records,
    threads: usize,
) -> Vec<EffectCorrelation> {
    let names = after.effect_names();
    if names.len() < 2 {
        return Vec::new();
    }
    let residual = before.compared_samples();
    let change = |model: &Option<ScoredModel>| {
        let left = model.as_ref()?.compared_samples();
        Some(residual.iter().zip(left).map(|(b, a)| b - a).collect())
    };
    let changes: Vec<Option<Vec<f64>>> = match without {
        [without_first, without_second] => [without_second, without_first].map(change).to_vec(),
        _ => {
            let alone = after.each_alone(records, threads);
            alone.iter().map(change).collect()
        }
    };
    let mut found = Vec::new();
    for (k, one) in changes.iter().enumerate() {
        for (j, other) in changes.iter().enumerate().skip(k + 1) {
            let (Some(one), Some(other)) = (one, other) else {
                continue;
            };
            found.push(EffectCorrelation {
                effects: [names[k], names[j]],
                correlation: dot(one, other) / (dot(one, one) * dot(other, other)).sqrt(),
            });
        }
    }
    found
}
