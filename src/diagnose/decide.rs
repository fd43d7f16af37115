//! Choice of the accepted candidate, and comparison of the others with it.

use super::applied_noise::AppliedNoise;
use super::reason::Reason;
use super::records::Records;
use super::score::{BaseModel, ScoredModel};
use super::search::{CandidateFit, SAME};

/// Significance up to which one effect counts as no better than another.
const TIED_SIGNIFICANCE: f64 = 2.33;
/// Reduction of the sum of squares, in residual variances, up to which one effect counts as no better than
/// another.
const TIED_GAIN: f64 = 9.0;

/// Ratio of the errors up to which an effect with fewer parameters counts as no worse than one that is not determined, or
/// that takes out noise on the applied quantity.
pub const NEARLY: f64 = 1.05;

/// Accepts the best of the candidates that are not rejected, and compares the others with it.
pub fn decide(tried: &mut [CandidateFit], base: &BaseModel, records: &Records) {
    let noise = AppliedNoise::of(records);
    let (chosen, tied) = loop {
        let Some((chosen, tied)) = choose(tried) else {
            return;
        };
        let model = tried[chosen].model.as_ref();
        if model.is_none_or(|model| noise.bears_out(&base.scored, model)) {
            break (chosen, tied);
        }
        tried[chosen].reason = Reason::TakesOutNoise;
    };
    for k in passing(tried).filter(|k| *k != chosen).collect::<Vec<_>>() {
        if let Some(reason) = behind(&tried[k], &tried[chosen], tied.contains(&k)) {
            tried[k].reason = reason;
        }
    }
    tried.swap(0, chosen);
}

/// Indices of the candidates that are not rejected.
fn passing(tried: &[CandidateFit]) -> impl Iterator<Item = usize> + '_ {
    (0..tried.len()).filter(|k| tried[*k].reason == Reason::Best)
}

/// The best of the candidates that are not rejected, and those tied with it.
fn choose(tried: &[CandidateFit]) -> Option<(usize, Vec<usize>)> {
    let best =
        passing(tried).min_by(|a, b| criterion(tried, *a).total_cmp(&criterion(tried, *b)))?;
    // It is compared with each of the others.
    let model = tried[best].model.clone()?.with_samples();
    let tied: Vec<usize> = passing(tried)
        .filter(|k| *k == best || is_tied(tried, *k, (best, &model)))
        .collect();
    Some((simplest(tried, &tied).unwrap_or(best), tied))
}

/// Whether an effect is not significantly worse than the best one.
fn is_tied(tried: &[CandidateFit], k: usize, (best, other): (usize, &ScoredModel)) -> bool {
    let Some(one) = &tried[k].model else {
        return false;
    };
    let is_nearly = one.parameter_count() < other.parameter_count()
        && one.compared_rms() < NEARLY * other.compared_rms();
    one.is_no_worse_than(other) || is_nearly && is_undetermined(&tried[best])
}

/// Whether the records do not determine a parameter that cannot be zero, such as the frequency of a mode: the effect then
/// imitates another.
fn is_undetermined(candidate: &CandidateFit) -> bool {
    let form = candidate
        .form
        .and_then(|name| candidate.effect.form(Some(name)));
    let pairs = form.map(|form| form.parameters.iter().zip(&candidate.parameters));
    pairs.into_iter().flatten().any(|(of, found)| {
        let estimate = &found.estimate;
        let is_unknown = |std: f64| std > estimate.value().abs();
        of.lower > 0.0 && estimate.std_uncertainty().is_some_and(is_unknown)
    })
}

impl ScoredModel {
    /// Whether it is not significantly worse than the best model.
    pub(super) fn is_no_worse_than(&self, best: &Self) -> bool {
        let comparison = best.against(self);
        // Each further parameter fits as much of the noise again.
        let further = best
            .parameter_count()
            .saturating_sub(self.parameter_count());
        let least = TIED_SIGNIFICANCE * (further.max(1) as f64).sqrt();
        comparison.significance() < least
            || comparison.gain() < TIED_GAIN * best.compared_rms().powi(2)
    }
}

/// Among effects that the records cannot distinguish: those with the fewest parameters, in a form no worse than their
/// best one, as the criterion overrates evidence in correlated noise; among these the one with the smallest criterion,
/// or the first in the list of those close to it. So a line at the mains frequency is mains pickup rather than a shaft
/// at that speed, and a lag without a corner is a delay.
fn simplest(tried: &[CandidateFit], tied: &[usize]) -> Option<usize> {
    let count = |k: usize| tried[k].fewest_parameters;
    let fewest = tied.iter().map(|k| count(*k)).min()?;
    let tied: Vec<usize> = tied
        .iter()
        .copied()
        .filter(|k| count(*k) == fewest)
        .collect();
    let least = tied.iter().map(|k| criterion(tried, *k));
    let least = least.fold(f64::INFINITY, f64::min);
    // The candidates are in the order of the list.
    let mut tied = tied.into_iter();
    tied.find(|k| criterion(tried, *k) <= least + SAME)
}

fn criterion(tried: &[CandidateFit], k: usize) -> f64 {
    let model = tried[k].model.as_ref();
    model.map_or(f64::INFINITY, ScoredModel::criterion)
}

/// Why a candidate that passes is not accepted.
fn behind(other: &CandidateFit, chosen: &CandidateFit, is_tied: bool) -> Option<Reason> {
    let (model, accepted) = (other.model.as_ref()?, chosen.model.as_ref()?);
    let best = chosen.effect.name;
    let reason = if !is_tied {
        let ratio = model.compared_rms() / accepted.compared_rms();
        let best = best.to_owned();
        Reason::Worse { ratio, best }
    } else if model.parameter_count() > accepted.parameter_count() {
        Reason::MoreParameters { best }
    } else {
        let experiment = other.effect.experiment;
        Reason::Tied { best, experiment }
    };
    Some(reason)
}
