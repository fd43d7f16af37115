//! The search: every effect is fitted, the best is accepted if it reduces the error significantly.

use std::sync::atomic::{AtomicUsize, Ordering};
use torqcomp_dsp::sort_by_number;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use torqcomp_model::effects::{EFFECTS, Effect};

use super::acceptance::refusal_for;
use super::blocks::{Comparison, family_p_values};
use super::fit::{FitEffort, FittedModel, fit};
use super::reason::{Reason, Status};
use super::records::Records;
use super::score::{BaseModel, EffectParameter, ScoredModel};
use super::special_cases::fit_special_cases;
use super::spectra::{SpectralLine, lines_of};
use super::starts::{Start, best_starts};
use super::structure::{EffectForm, Structure};
use crate::parallel::parallel;

/// An effect that was tried, in its best form.
#[derive(Clone, Serialize, JsonSchema)]
pub struct CandidateFit {
    /// Name of the effect.
    #[serde(serialize_with = "name_of")]
    #[schemars(with = "String")]
    pub effect: &'static Effect,
    /// Best form of the effect; `null` if none could be fitted.
    pub form: Option<&'static str>,
    /// Names of the effects that were in the model already.
    pub with: Vec<&'static str>,
    /// Error on the training records, in the unit of `error`; `null` without a fit.
    pub train_rms: Option<f64>,
    /// Error on the hold-out records, in the unit of `error`; `null` without a fit.
    pub holdout_rms: Option<f64>,
    /// Probability of such a gain by chance, for the number of effects tried beside this one; `null` without a fit.
    pub p_value: Option<f64>,
    /// Parameters of the effect.
    pub parameters: Vec<EffectParameter>,
    #[serde(flatten)]
    pub reason: Reason,
    /// The model with it, if a fit came about.
    #[serde(skip)]
    pub model: Option<ScoredModel>,
    /// Parameters of the plainest of its forms that are no worse.
    #[serde(skip)]
    pub fewest_parameters: usize,
}

pub fn name_of<S: Serializer>(effect: &&'static Effect, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(effect.name)
}

/// Threads of the search, and progress reporting.
#[derive(Clone, Copy)]
pub struct Workers<'p> {
    pub threads: usize,
    pub progress: &'p (dyn Fn(usize, usize) + Sync),
}

impl Workers<'_> {
    /// The same without progress reporting.
    pub fn silent(self) -> Workers<'static> {
        Workers {
            progress: &|_, _| {},
            threads: self.threads,
        }
    }
}

/// Difference of the criterion that counts as a tie.
pub const SAME: f64 = 4.0;
/// Number of lines of the residual's spectrum that may be from a shaft.
const LINES: usize = 3;
/// Minimum power of such a line relative to its surroundings.
const PROMINENT: f64 = 12.0;
/// Reduction of the training sum of squares, in residual variances, below which a fit is not continued.
const WORTHWHILE: f64 = 5.0;

pub const FIRST_FIT: FitEffort = FitEffort::brief(3);
const SECOND_FIT: FitEffort = FitEffort::brief(5);
/// Minimum gain of a first fit for a second one, relative to the largest of the same form.
const COMPARABLE: f64 = 0.5;
const FULL_FIT: FitEffort = FitEffort::full(15);
/// Maximum number of successive full fits, and ratio of successive sums of squares above which they end.
const MOST_FULL_FITS: usize = 4;
const FALLING: f64 = 0.9;
/// Factors of the size of an effect from which it is fitted again.
const SIDES: [f64; 2] = [1.02, 0.98];
/// Maximum sum of squares of a fit, relative to the best one, that is continued, and minimum relative reduction by that.
const NEAR: f64 = 1.1;
const NEARER: f64 = 1e-4;

/// Number of forms and starts that advance between the stages of fitting.
pub struct SearchEffort {
    /// Number of starts of each form that get a first fit, ranked by their residual.
    pub starts: usize,
    /// Number of forms that get a first fit, ranked by the residual of their starts.
    pub first: usize,
    /// Minimum gain of the first fit, relative to the largest, for a second one.
    pub second: f64,
    /// Number of forms that get a full fit, excluding ties.
    pub full: usize,
    /// Minimum gain of the second fit, relative to the largest, for a full one.
    pub promising: f64,
}

pub const FOR_FIRST_EFFECT: SearchEffort = SearchEffort {
    starts: 2,
    first: usize::MAX,
    second: 0.03,
    full: 12,
    promising: 0.5,
};
/// The second start of a form hardly ever leads farther than the first here. With an accepted effect, the gain of a
/// first fit predicts that of the last one less well: all parameters must move together.
const FOR_SECOND_EFFECT: SearchEffort = SearchEffort {
    starts: 1,
    first: usize::MAX,
    second: 0.02,
    full: usize::MAX,
    promising: 0.1,
};

/// One round of adding each effect to a base model.
pub struct Round {
    /// One candidate per effect, in its best form; an accepted one is first.
    pub tried: Vec<CandidateFit>,
    /// The fits of all forms that reduce the training error.
    pub fits: Vec<ScoredModel>,
}

impl Round {
    /// The model with the accepted effect.
    pub fn accepted(&self) -> Option<&ScoredModel> {
        let first = self.tried.first()?;
        let is_accepted = first.status() == Status::Accepted;
        first.model.as_ref().filter(|_| is_accepted)
    }
}

/// Adds each effect to a base model, one at a time.
pub fn try_all(base: &BaseModel, records: &Records, workers: Workers) -> Round {
    try_effects(base, |_| true, base.effort(), records, workers)
}

/// Adds each of some effects to a base model, one at a time.
pub fn try_effects(
    base: &BaseModel,
    among: impl Fn(&Effect) -> bool,
    effort: &SearchEffort,
    records: &Records,
    workers: Workers,
) -> Round {
    let effects = listed(&base.scored.fitted.structure).filter(|effect| among(effect));
    let forms = EffectForm::all(effects.clone());
    let lines = residual_lines(base, records);
    let fits = fit_all(base, &forms, &lines, effort, records, workers);
    let mut rest = fits.iter();
    let tried = effects.map(|effect| {
        let models: Vec<_> = rest.by_ref().take(effect.forms.len()).flatten().collect();
        CandidateFit::new(effect, &base.scored, &models)
    });
    let (mut tried, gains): (Vec<CandidateFit>, Vec<_>) = tried.unzip();
    set_p_values(&mut tried, gains);
    super::decide::decide(&mut tried, base, records);
    let fits = fits.into_iter().flatten().collect();
    Round { tried, fits }
}

/// The effects that may be added to a model.
pub fn listed(structure: &Structure) -> impl Iterator<Item = &'static Effect> + Clone {
    let context = &structure.context;
    EFFECTS.iter().copied().filter(move |effect| {
        let is_free = context.gain_is_free && effect.name == "gain-error";
        let mut forms = EffectForm::all([*effect]).into_iter();
        let is_allowed = forms.any(|form| context.allows(&form));
        let is_present = structure.names().any(|name| name == effect.name);
        !is_present && !is_free && is_allowed
    })
}

/// Sets the p-value of each gain, corrected for the number of effects tried.
fn set_p_values(tried: &mut [CandidateFit], gains: Vec<Option<Comparison>>) {
    let comparisons: Vec<Comparison> = gains.into_iter().flatten().collect();
    let fitted = tried.iter_mut().filter(|c| c.model.is_some());
    for (candidate, p) in fitted.zip(family_p_values(&comparisons)) {
        candidate.p_value = p;
    }
}

impl CandidateFit {
    /// An effect with the fits of its forms; and the best one compared with the model without the effect.
    fn new(
        effect: &'static Effect,
        base: &ScoredModel,
        forms: &[&ScoredModel],
    ) -> (Self, Option<Comparison>) {
        let best = forms.iter().copied();
        let best = best.min_by(|a, b| a.criterion().total_cmp(&b.criterion()));
        let best = best.map(|best| best.clone().with_samples());
        let fewest = best.as_ref().map(|best| {
            let count = best.parameter_count();
            let plainer = forms.iter().filter(|form| form.parameter_count() < count);
            let no_worse = plainer.filter(|form| form.is_no_worse_than(best));
            no_worse
                .map(|form| form.parameter_count())
                .fold(count, usize::min)
        });
        let gain = best.as_ref().map(|best| best.against(base));
        let model = best.map(ScoredModel::without_samples);
        let last = model
            .as_ref()
            .and_then(|m| m.fitted.structure.effects.last());
        let errors = model.as_ref().map(ScoredModel::errors);
        let both = model.as_ref().zip(gain.as_ref());
        let refusal = both.map(|(model, gain)| refusal_for(gain, model, base));
        let candidate = Self {
            effect,
            form: last.map(|e| e.form.name),
            with: base.effect_names(),
            train_rms: errors.map(|e| e.train_rms),
            holdout_rms: None,
            p_value: None,
            parameters: model
                .as_ref()
                .map_or_else(Vec::new, ScoredModel::last_parameters),
            reason: match refusal {
                None => Reason::NotFitted,
                Some(refusal) => refusal.unwrap_or(Reason::Best),
            },
            model,
            fewest_parameters: fewest.unwrap_or(usize::MAX),
        };
        (candidate, gain)
    }

    /// Replaces its fit by one in which another effect took its place, from which the records do not distinguish it.
    pub fn exchange(&mut self, model: &ScoredModel, best: &'static str) {
        let structure = &model.fitted.structure;
        let place = structure.names().position(|name| name == self.effect.name);
        let Some(place) = place else { return };
        let mut parameters = model.parameters();
        self.form = Some(structure.effects[place].form.name);
        self.with = model.effect_names();
        self.with.retain(|name| *name != self.effect.name);
        self.parameters = parameters.swap_remove(place);
        self.train_rms = Some(model.errors().train_rms);
        self.reason = Reason::Tied {
            best,
            experiment: self.effect.experiment,
        };
        self.model = Some(model.clone());
    }

    /// Names of the effects of its model.
    pub fn names(&self) -> Vec<&'static str> {
        [&self.with[..], &[self.effect.name]].concat()
    }

    pub fn status(&self) -> Status {
        self.reason.status()
    }

    /// Whether it reduces the error significantly. A line or a drift that the held-out records do not have is
    /// correlated noise.
    pub fn is_confirmed(&self) -> bool {
        let effects = self
            .model
            .iter()
            .flat_map(|model| &model.fitted.structure.effects);
        let is_disturbance = effects.last().is_some_and(EffectForm::is_disturbance);
        let is_of_one_record = is_disturbance && matches!(self.reason, Reason::NotConfirmed { .. });
        self.reason.is_significant() && !is_of_one_record
    }

    /// Hold-out error for comparisons: infinite without a fit.
    pub fn holdout_error(&self) -> f64 {
        self.holdout_rms.unwrap_or(f64::INFINITY)
    }
}

/// Rejects all remaining candidates for a reason.
pub fn reject_all(tried: &mut [CandidateFit], reason: impl Fn(&CandidateFit) -> Reason) {
    let named = tried.iter_mut().filter(|t| t.status() != Status::Rejected);
    for candidate in named {
        candidate.reason = reason(candidate);
    }
}

/// The best fit of each form, scored. The forms whose starts have the smallest residuals get a first fit (all of them
/// if there is no effect yet), those that reduce the training error a second one, and those close to the largest
/// reduction a full one. The amount of work depends on the records alone, not on the clock.
pub fn fit_all(
    base: &BaseModel,
    forms: &[EffectForm],
    lines: &[SpectralLine],
    limits: &SearchEffort,
    records: &Records,
    workers: Workers,
) -> Vec<Option<ScoredModel>> {
    let fitted = &base.scored.fitted;
    let first = first_fits(base, forms, lines, records, limits, workers);
    let gain = |fit: &FittedModel| fitted.train_sum - fit.train_sum;
    let largest = first.iter().flatten().map(gain).fold(0.0, f64::max);
    let second = parallel(forms.len(), workers.threads, |k| {
        let own = first[k].iter().map(gain).fold(0.0, f64::max);
        let fits = first[k].iter().map(|fit| {
            let least = (limits.second * largest).max(COMPARABLE * own);
            let is_followed = !fit.converged && gain(fit) >= least;
            let second = is_followed.then(|| fit.refit(&records.train, SECOND_FIT));
            second.and_then(Result::ok).unwrap_or_else(|| fit.clone())
        });
        fits.min_by(|a, b| a.train_sum.total_cmp(&b.train_sum))
    });
    let mut gains: Vec<f64> = second
        .iter()
        .map(|f| f.as_ref().map_or(0.0, gain))
        .collect();
    sort_by_number(&mut gains, |gain| -gain);
    let least = gains
        .get(limits.full)
        .copied()
        .unwrap_or(0.0)
        .max(limits.promising * gains.first().copied().unwrap_or(0.0))
        .max(WORTHWHILE * base.scored.train_rms().powi(2));
    let mut fits = parallel(forms.len(), workers.threads, |k| {
        let fit = second[k].as_ref().filter(|f| gain(f) > 0.0)?;
        let full = match gain(fit) >= least {
            true => to_the_end(fit, records),
            false => fit.clone(),
        };
        ScoredModel::of(full, records).map(ScoredModel::without_samples)
    });
    let promising = (fitted.train_sum, least);
    fit_special_cases(forms, &mut fits, promising, records, workers);
    fit_near_best(&mut fits, records, workers);
    fits
}

/// Continues the fits that are nearly as good as the best one, so that none loses because it has not converged. Where
/// decays stick, a small change of friction moves the moment by whole half periods: fits of decays, the best one
/// included, are also continued from either side of where they ended.
fn fit_near_best(fits: &mut [Option<ScoredModel>], records: &Records, workers: Workers) {
    let sum =
        |fit: &Option<ScoredModel>| fit.as_ref().map_or(f64::INFINITY, |m| m.fitted.train_sum);
    let least = fits.iter().map(sum).fold(f64::INFINITY, f64::min);
    let is_free = records.are_free();
    let first = if is_free { least } else { least * (1.0 + 1e-9) };
    let is_near = |k: &usize| (first..NEAR * least).contains(&sum(&fits[*k]));
    let near: Vec<usize> = (0..fits.len()).filter(is_near).collect();
    let found = parallel(near.len(), workers.threads, |i| {
        let model = fits[near[i]].as_ref()?;
        let on = |fit: &FittedModel| to_the_end(fit, records);
        let further = match is_free {
            true => model.fitted.on_both_sides(on),
            false => on(&model.fitted),
        };
        let is_less = further.train_sum < (1.0 - NEARER) * model.fitted.train_sum;
        let scored = is_less.then(|| ScoredModel::of(further, records));
        scored.flatten().map(ScoredModel::without_samples)
    });
    for (k, fit) in near.into_iter().zip(found) {
        if fit.is_some() {
            fits[k] = fit;
        }
    }
}

impl FittedModel {
    /// The best continuation of a fit from its values, and from those with a slightly larger or smaller size of its last
    /// effect.
    pub fn on_both_sides(&self, on: impl Fn(&Self) -> Self) -> Self {
        let last = self.structure.effects.last();
        let size = last.and_then(|last| Some(self.values.len() - last.moved() + last.size()?));
        let beside = |factor: f64| {
            let mut beside = self.clone();
            beside.values[size?] *= factor;
            Some(on(&beside))
        };
        let sides = SIDES.into_iter().filter_map(beside);
        sides.fold(on(self), |best, next| {
            match next.train_sum < best.train_sum {
                true => next,
                false => best,
            }
        })
    }
}

/// A fit continued while the error falls substantially: with light damping, small frequency errors accumulate, and
/// convergence is slow at first.
pub fn to_the_end(fit: &FittedModel, records: &Records) -> FittedModel {
    let mut best = fit.clone();
    for _ in 0..MOST_FULL_FITS {
        let Ok(next) = best.refit(&records.train, FULL_FIT) else {
            break;
        };
        let still_falls = !next.converged && next.train_sum < FALLING * best.train_sum;
        best = next;
        if !still_falls {
            break;
        }
    }
    best
}

impl BaseModel {
    /// Number of forms fitted in addition to it.
    pub fn effort(&self) -> &'static SearchEffort {
        match self.scored.fitted.structure.effects.is_empty() {
            true => &FOR_FIRST_EFFECT,
            false => &FOR_SECOND_EFFECT,
        }
    }
}

/// Fits with very few iterations from the best starts of each form with the smallest residuals.
fn first_fits(
    base: &BaseModel,
    forms: &[EffectForm],
    lines: &[SpectralLine],
    records: &Records,
    limits: &SearchEffort,
    workers: Workers,
) -> Vec<Vec<FittedModel>> {
    let structure = &base.scored.fitted.structure;
    let training = base.scored.fitted.with_initial_states(&records.train);
    let starts = parallel(forms.len(), workers.threads, |k| {
        if !structure.context.allows(&forms[k]) {
            return Vec::new();
        }
        best_starts(
            base,
            &structure.with(forms[k]),
            lines,
            &training,
            limits.starts,
        )
    });
    let left = |k: usize| {
        let left = starts[k].iter().map(|start: &Start| start.left);
        left.fold(f64::INFINITY, f64::min)
    };
    let mut chosen: Vec<usize> = (0..forms.len()).collect();
    sort_by_number(&mut chosen, |k| left(*k));
    chosen.truncate(limits.first);
    let done = AtomicUsize::new(0);
    parallel(forms.len(), workers.threads, |k| {
        let starts = starts[k].iter().filter(|_| chosen.contains(&k));
        let fits = starts.flat_map(|start| {
            let records = start.in_records(&training);
            fit(structure.with(forms[k]), &start.values, &records, FIRST_FIT)
        });
        let fits = fits.collect();
        (workers.progress)(done.fetch_add(1, Ordering::Relaxed) + 1, forms.len());
        fits
    })
}

/// Significant lines of the training residual.
fn residual_lines(base: &BaseModel, records: &Records) -> Vec<SpectralLine> {
    let highest_hz = 0.45 * records.rate_hz();
    let mut found = lines_of(&base.scored.train(), highest_hz, 4 * LINES);
    found.retain(|line| line.prominence > PROMINENT);
    found.truncate(LINES);
    found
}
