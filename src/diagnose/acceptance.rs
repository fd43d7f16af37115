//! Criteria for accepting an effect: how much it must explain beyond noise.

use super::blocks::Comparison;
use super::reason::Reason;
use super::score::ScoredModel;
use super::structure::EffectForm;

/// Minimum reduction of the sum of squares, in residual variances.
const LEAST_GAIN: f64 = 40.0;
/// Minimum relative reduction of the sum of squares.
const LEAST_SHARE: f64 = 0.005;
/// Minimum significance of the reduction over the blocks of the records; times the square root of the number of
/// effects that cause it together, as they fit more of the noise.
const LEAST_SIGNIFICANCE: f64 = 3.0;
/// Number of parameters of an effect up to which that holds; in correlated noise, those with more fit
/// more of it.
const FEW_PARAMETERS: f64 = 3.0;
/// One-sided 95 % quantile of the normal distribution.
const CERTAIN: f64 = 1.645;

/// Why an effect is not accepted, considered alone.
pub fn refusal(model: &ScoredModel, before: &ScoredModel) -> Option<Reason> {
    refusal_for(&model.against(before), model, before)
}

/// The same for a known comparison of both models.
pub fn refusal_for(gain: &Comparison, model: &ScoredModel, before: &ScoredModel) -> Option<Reason> {
    if let Some(reason) = no_gain_by(gain, model, before) {
        return Some(reason);
    }
    if let Some(name) = model.insignificant_parameter() {
        return Some(Reason::ZeroParameter { name });
    }
    (model.criterion() >= before.criterion()).then_some(Reason::CriterionNotLower)
}

/// Why a model is not better than a simpler one.
pub fn no_gain(model: &ScoredModel, before: &ScoredModel) -> Option<Reason> {
    no_gain_by(&model.against(before), model, before)
}

fn no_gain_by(
    comparison: &Comparison,
    model: &ScoredModel,
    before: &ScoredModel,
) -> Option<Reason> {
    let (gain, variance) = (comparison.gain(), model.compared_rms().powi(2));
    let total = before.compared_rms().powi(2) * before.compared_count() as f64;
    let change = model.compared_rms() / before.compared_rms() - 1.0;
    if gain <= 0.0 {
        return Some(Reason::NoReduction { change });
    }
    let count = |m: &ScoredModel| m.effect_names().len();
    let added = count(model).saturating_sub(count(before)).max(1) as f64;
    let last = model.fitted.structure.effects.last();
    let parameters = last.map_or(0, EffectForm::moved) as f64;
    let least = LEAST_SIGNIFICANCE * added.sqrt() * (parameters / FEW_PARAMETERS).max(1.0);
    if gain < LEAST_GAIN * variance || comparison.significance() < least {
        return Some(Reason::NotSignificant { change });
    }
    if gain < LEAST_SHARE * total {
        let share = gain / total;
        return Some(Reason::SmallShare { share });
    }
    None
}

/// Whether held-out records bear out, with 95 % confidence, that a model is better than a simpler one.
pub fn is_confirmed(model: &ScoredModel, before: &ScoredModel) -> bool {
    let comparison = model.against(before);
    match no_gain_by(&comparison, model, before) {
        Some(Reason::NotSignificant { .. }) => comparison.significance() >= CERTAIN,
        reason => reason.is_none(),
    }
}

/// Ratio of a gain, for the number of parameters and samples, to what [`refusal`] requires, whatever the noise, with 95
/// % confidence.
pub fn evidence(comparison: &Comparison, samples: usize, parameters: usize) -> f64 {
    let [gain, std] = comparison.expected_gain();
    let sure = gain - CERTAIN * std;
    let [before, after] = comparison.sums();
    let n = samples as f64;
    let criterion = n * (1.0 + sure.max(0.0) / after).ln() / (parameters as f64 * n.ln());
    let least = [
        sure / (LEAST_GAIN * after / n),
        sure / (LEAST_SIGNIFICANCE * std),
        sure / (LEAST_SHARE * before),
        criterion,
    ];
    least.into_iter().fold(f64::INFINITY, f64::min)
}
