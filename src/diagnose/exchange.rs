//! Exchange of effects: one that was found first may only resemble another, or two others, and be recognised once later
//! effects are present.

use std::cmp::Ordering;

use torqcomp_model::effects::{EFFECTS, Effect, Form, Stage};

use super::SearchState;
use super::acceptance::refusal;
use super::applied_noise::AppliedNoise;
use super::decide::NEARLY;
use super::fit::{FitEffort, FittedModel, fit};
use super::pairs::best_pairs;
use super::reason::Reason;
use super::records::Records;
use super::score::{BaseModel, ScoredModel};
use super::search::{FOR_FIRST_EFFECT, SAME, SearchEffort, Workers, listed, try_effects};
use super::special_cases::own_in_form;
use super::structure::{EffectForm, Structure};
use crate::parallel::parallel;

/// Maximum number of exchanges.
const MOST: usize = 3;
/// Limits for trying all other effects in place of one: maximum number of effects, and of integration steps relative to
/// the stand without effects; a model that needs more is not of the list.
const MOST_OPEN: usize = 3;
const FINEST_OPEN: usize = 2;
/// Forms fitted in place of an effect.
const FOR_EXCHANGE: SearchEffort = SearchEffort {
    starts: 1,
    first: 12,
    second: 0.1,
    full: 2,
    promising: 0.5,
};
/// The same among those that resemble the present one, most of which have several forms.
const AMONG_ALIKE: SearchEffort = SearchEffort {
    full: 6,
    ..FOR_EXCHANGE
};
/// Fit of another form, starting where the present one ended.
const OTHER_FORM: FitEffort = FitEffort::full(15);
/// The effect that changes the recorded value of a constant load.
const GAIN: &str = "gain-error";
const SMALL: f64 = 1e-3;
/// Minimum number of parameters of an effect that may imitate two others.
pub const MANY: usize = 3;

impl SearchState {
    /// Exchanges effects while that explains the records better, or equally well with less; returns whether any was
    /// exchanged. `coarse` is the number of integration steps for the stand without effects.
    pub(super) fn exchange(&mut self, coarse: usize, workers: Workers) -> bool {
        let mut seen = vec![sorted(&self.after)];
        for _ in 0..MOST {
            let Some(other) = self.other_effects(&seen, coarse, workers) else {
                break;
            };
            self.take(&other, coarse);
            seen.push(sorted(&self.after));
        }
        seen.len() > 1
    }

    /// The best model with one effect exchanged or refitted, if it is better than the current one, or as good and first
    /// in the list; what only takes out noise on the applied quantity is no reason for more parameters. While a residual
    /// remains, or if the effect lacks what makes it one, any may replace it; otherwise only one that resembles it.
    /// Models with one that resembles it are kept, as they may explain the records equally well.
    fn other_effects(
        &mut self,
        seen: &[Vec<&'static str>],
        coarse: usize,
        workers: Workers,
    ) -> Option<ScoredModel> {
        let present = self.after.fitted.structure.added();
        let is_open = self.is_worthwhile(&self.after, &self.tests);
        let is_long = present.len() > MOST_OPEN || self.records.substeps() > FINEST_OPEN * coarse;
        if present.len() < 2 || !self.settled {
            return None;
        }
        let declared = self.after.fitted.structure.declared;
        let silent = workers.silent();
        let without = self.after.without_each(&self.records, workers.threads);
        let noise = AppliedNoise::of(&self.records);
        let (mut found, mut alike) = (Vec::new(), Vec::new());
        for (k, (form, less)) in present.iter().zip(without).enumerate() {
            let Some(less) = less else { continue };
            // Without what makes it this effect, it only has the shape of another.
            let is_void = self.after.insignificant_of(declared + k).is_some();
            if is_open && is_long && !is_void {
                continue;
            }
            let effect = form.effect;
            let base = BaseModel::of(less.clone(), &self.records);
            let is_alike = |e: &Effect| e.name == effect.name || effect.resembles(e);
            let round = try_effects(&base, is_alike, &AMONG_ALIKE, &self.records, silent);
            let others = (is_open || is_void).then(|| {
                let among = |e: &Effect| !is_alike(e);
                try_effects(&base, among, &FOR_EXCHANGE, &self.records, silent)
            });
            let models = round.tried.iter().filter_map(|c| c.model.clone());
            alike.extend(models.map(ScoredModel::without_samples));
            let tried = round.tried.into_iter();
            let tried = tried.chain(others.into_iter().flat_map(|others| others.tried));
            let passes = |model: &ScoredModel| refusal(model, &less).is_none();
            let singles = tried.filter_map(|c| {
                let model = c.model.filter(passes)?;
                self.is_better((&model, c.effect), effect, &noise)
                    .then_some(model)
            });
            found.extend(singles);
            let merged = less.in_other_forms(effect, &self.records, workers.threads);
            let merged = merged.into_iter().filter(|m| passes(m));
            found.extend(merged.filter(|m| m.criterion() < self.after.criterion() + SAME));
            if form.moved() >= MANY {
                let alike = |e: &Effect| effect.resembles(e);
                let round = try_effects(&base, alike, &FOR_FIRST_EFFECT, &self.records, silent);
                let pairs = best_pairs(&base, &round.fits, &self.records, silent).into_iter();
                let better = pairs.filter(|pair| pair.criterion() < self.after.criterion());
                found.extend(better.filter(passes));
            }
        }
        found.retain(|model| self.is_new(model, seen));
        self.alike.extend(alike);
        let found = found.into_iter();
        found.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))
    }

    /// Whether a model has other effects than all before, or better ones than the last with the same names.
    fn is_new(&self, model: &ScoredModel, seen: &[Vec<&'static str>]) -> bool {
        let names = sorted(model);
        let is_last = seen.last() == Some(&names);
        !seen.contains(&names) || is_last && model.criterion() < self.after.criterion() - SAME
    }

    /// Whether a model with one effect in place of another is better than the current one.
    fn is_better(
        &self,
        (model, other): (&ScoredModel, &Effect),
        present: &Effect,
        noise: &AppliedNoise,
    ) -> bool {
        let place = |effect: &Effect| EFFECTS.iter().position(|e| e.name == effect.name);
        let difference = model.criterion() - self.after.criterion();
        let is_better = difference < -SAME || difference < SAME && place(other) < place(present);
        if other.name == present.name {
            return is_better;
        }
        let is_only_noise = |less: &ScoredModel, more: &ScoredModel| {
            let is_near = less.compared_rms() < NEARLY * more.compared_rms();
            is_near && !noise.bears_out(less, more)
        };
        match model.parameter_count().cmp(&self.after.parameter_count()) {
            Ordering::Less => is_better || is_only_noise(model, &self.after),
            Ordering::Equal => is_better,
            Ordering::Greater => is_better && !is_only_noise(&self.after, model),
        }
    }
}

impl SearchState {
    /// Changes the form of effects while a gain error is added or removed, if that explains the records better, or equally
    /// well without it; returns whether any changed. Whether a torque is part of the stand's stiffness, and whether the
    /// gage shows it, changes the recorded value of a constant load: a gain error makes up for the wrong form.
    pub(super) fn exchange_with_gain(&mut self, coarse: usize, workers: Workers) -> bool {
        let mut named = self.after.effect_names().into_iter();
        let best = match named.any(|name| name == GAIN) {
            true => self.without_gain(workers),
            false => self.with_gain(workers),
        };
        self.take_any(best.as_ref(), coarse)
    }

    /// Refits the model from other starts of its effects, and returns whether that explains more: without the effects found
    /// later, the search may have ended at a bound, or, while something is left, on the wrong side of zero.
    pub(super) fn restart(&mut self, coarse: usize, workers: Workers) -> bool {
        if !self.settled {
            return false;
        }
        let is_left = self.is_worthwhile(&self.after, &self.tests);
        let starts = from_other_starts(&self.after.fitted, is_left);
        let best = self.best_from(&starts, workers, |model| {
            model.criterion() < self.after.criterion() - SAME
        });
        self.take_any(best.as_ref(), coarse)
    }

    /// Judges ties that were found before other effects were added: beside these, one of the two may be clearly better.
    pub(super) fn judge_ties(&mut self, workers: Workers) {
        let names = self.after.effect_names();
        let mut worse = Vec::new();
        for (k, candidate) in self.rounds.iter().flatten().enumerate() {
            let Reason::Tied { best, .. } = candidate.reason else {
                continue;
            };
            let is_beside_all = names
                .iter()
                .all(|n| *n == best || candidate.with.contains(n));
            let place = names.iter().position(|name| *name == best);
            let less = place.and_then(|place| self.without.get(place)?.clone());
            let Some(less) = less.filter(|_| !is_beside_all) else {
                continue;
            };
            let base = BaseModel::of(less.clone(), &self.records);
            let is_it = |effect: &Effect| effect.name == candidate.effect.name;
            let round = try_effects(&base, is_it, &AMONG_ALIKE, &self.records, workers.silent());
            let instead = round.tried.into_iter().find_map(|tried| tried.model);
            let instead = instead.unwrap_or(less);
            if !instead.is_no_worse_than(&self.after) {
                let best = names.join(" + ");
                let ratio = instead.train_rms() / self.after.train_rms();
                worse.push((k, Reason::Worse { ratio, best }));
            }
        }
        for (k, reason) in worse {
            if let Some(candidate) = self.rounds.iter_mut().flatten().nth(k) {
                candidate.reason = reason;
            }
        }
    }

    /// Reports an effect that was exchanged for another, or could be, although the records do not distinguish them.
    pub(super) fn report_exchanged(&mut self) {
        let names = self.after.effect_names();
        let alike = std::mem::take(&mut self.alike);
        // What the records keep of their history says nothing of the effect.
        let count = |model: &ScoredModel| model.fitted.values.len();
        for model in self.path.iter().chain(&alike) {
            let of_model = model.effect_names();
            let [gone, new] = [(&of_model, &names), (&names, &of_model)].map(|(some, others)| {
                let mut own = some.iter().filter(|name| !others.contains(name));
                own.next().filter(|_| own.next().is_none())
            });
            if let (Some(gone), Some(best)) = (gone, new)
                && count(model) <= count(&self.after)
                && model.clone().with_samples().is_no_worse_than(&self.after)
            {
                let entries = self.rounds.iter_mut().flatten().rev();
                let mut entries = entries.filter(|c| c.model.is_some());
                if let Some(entry) = entries.find(|c| c.effect.name == *gone) {
                    entry.exchange(model, best);
                }
            }
        }
    }

    /// Adopts a model, if there is one, and returns whether there is.
    fn take_any(&mut self, better: Option<&ScoredModel>, coarse: usize) -> bool {
        if let Some(better) = better {
            self.take(better, coarse);
        }
        better.is_some()
    }

    /// The best model with a gain error and another form of an effect, if it is better.
    fn with_gain(&self, workers: Workers) -> Option<ScoredModel> {
        let gain = listed(&self.after.fitted.structure).find(|effect| effect.name == GAIN);
        let effect = gain.filter(|_| self.has_room())?;
        let gain = EffectForm {
            effect,
            form: &effect.forms[0],
        };
        let starts = self.after.with_gain_in_other_forms(gain);
        self.best_from(&starts, workers, |model| {
            refusal(model, &self.after).is_none() && !self.excess().is_too_small(&self.after, model)
        })
    }

    /// The best model without its gain error and with another form of an effect, if it is as good.
    fn without_gain(&self, workers: Workers) -> Option<ScoredModel> {
        let fitted = &self.after.fitted;
        let is_gain = |k: usize| {
            k >= fitted.structure.declared && fitted.structure.effects[k].effect.name == GAIN
        };
        let (structure, values) = fitted.structure.reduced(&fitted.values, |k| !is_gain(k));
        let starts = in_other_stand_forms(&structure, &values);
        self.best_from(&starts, workers, |model| {
            model.criterion() < self.after.criterion() + SAME
        })
    }

    /// The best of the models from some starts that pass a criterion.
    fn best_from(
        &self,
        starts: &[(Structure, Vec<f64>)],
        workers: Workers,
        passes: impl Fn(&ScoredModel) -> bool,
    ) -> Option<ScoredModel> {
        let models = self
            .after
            .fitted_from(starts, &self.records, workers.threads);
        let passing = models.into_iter().filter(passes);
        passing.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))
    }
}

/// The model with the start values of its form, except for the size, for one of the added effects: one with a parameter at
/// a bound, or, on request, that may lie on either side of zero.
fn from_other_starts(fitted: &FittedModel, on_both_sides: bool) -> Vec<(Structure, Vec<f64>)> {
    let shape = |effect: &EffectForm, i: usize| Some(i) != effect.size();
    let has_sides = |effect: &EffectForm, i: usize| effect.form.starts.iter().any(|s| s[i] < 0.0);
    let mut starts = fitted.with_start_values(|effect, own| {
        let is_stuck = own.iter().any(Option::is_none);
        let all = (0..own.len()).filter(|i| shape(effect, *i));
        let may_turn = on_both_sides && all.clone().any(|i| has_sides(effect, i));
        all.filter(|_| is_stuck || may_turn).collect()
    });
    starts.extend(fitted.off_bounds());
    starts
}

impl FittedModel {
    /// The model with start values for the parameters of an added effect that ended at a bound.
    pub fn off_bounds(&self) -> Vec<(Structure, Vec<f64>)> {
        self.with_start_values(|effect, own| {
            let is_stuck = |i: &usize| own[*i].is_none() && Some(*i) != effect.size();
            (0..own.len()).filter(is_stuck).collect()
        })
    }

    /// The model with start values of its form for some parameters of one of the added effects, which are chosen by their
    /// uncertainties.
    fn with_start_values(
        &self,
        chosen: impl Fn(&EffectForm, &[Option<f64>]) -> Vec<usize>,
    ) -> Vec<(Structure, Vec<f64>)> {
        let structure = &self.structure;
        let mut starts: Vec<(Structure, Vec<f64>)> = Vec::new();
        let added = structure.placed().skip(structure.declared);
        for (effect, own) in added.filter(|(effect, _)| !effect.is_line()) {
            let chosen = chosen(effect, &self.std[own.clone()]);
            for start in effect.form.starts {
                let mut values = self.values.clone();
                chosen
                    .iter()
                    .for_each(|i| values[own.start + i] = start[*i]);
                if values != self.values && starts.iter().all(|(_, other)| *other != values) {
                    starts.push((structure.clone(), values));
                }
            }
        }
        starts
    }
}

/// Structures in which one of the added effects of the stand has another form, and start values with the same stiffness.
fn in_other_stand_forms(structure: &Structure, values: &[f64]) -> Vec<(Structure, Vec<f64>)> {
    let stiffness = |structure: &Structure, values: &[f64]| {
        let (chain, _) = structure.model(values);
        1.0 + chain.added_stiffness()
    };
    let present = stiffness(structure, values);
    let mut starts = Vec::new();
    for (k, (effect, own)) in structure.placed().enumerate() {
        if k < structure.declared || effect.form.stage != Stage::Stand {
            continue;
        }
        let forms = effect.effect.forms.iter();
        for form in forms.filter(|form| form.name != effect.form.name) {
            let mut other = structure.clone();
            other.effects[k].form = form;
            let mut values = values.to_vec();
            let moved = own_in_form(form, effect.form, &values[own.clone()]);
            values.splice(own.clone(), moved);
            let factor = stiffness(&other, &values) / present;
            if factor > 0.0 {
                values[0] /= factor.sqrt();
                starts.push((other, values));
            }
        }
    }
    starts
}

impl ScoredModel {
    /// Structures with a gain error in which one of the effects has another form, and start values: the same stiffness
    /// as before, and a gain that compensates the static change of the other form.
    fn with_gain_in_other_forms(&self, gain: EffectForm) -> Vec<(Structure, Vec<f64>)> {
        let fitted = &self.fitted;
        let small = SMALL * fitted.structure.context.scales.rms;
        let shown = |structure: &Structure, values: &[f64]| {
            let (chain, _) = structure.model(values);
            chain.under_slow_loads(&[small / chain.gain.abs()])[0] / small
        };
        let present = shown(&fitted.structure, &fitted.values);
        let values = [&fitted.values[..], &[0.0]].concat();
        let starts = in_other_stand_forms(&fitted.structure.with(gain), &values).into_iter();
        let compensated = starts.filter_map(|(structure, mut values)| {
            let error = present / shown(&structure, &values) - 1.0;
            *values.last_mut()? = error;
            (error.abs() < 1.0).then_some((structure, values))
        });
        compensated.collect()
    }

    /// The model refitted with each effect that resembles the other in its other forms with the same parameters: a
    /// second mode that takes its contribution from the first is one effect, not a second mode and a gain.
    fn in_other_forms(&self, other: &Effect, records: &Records, threads: usize) -> Vec<Self> {
        let fitted = &self.fitted;
        let mut starts = Vec::new();
        for (k, present) in fitted.structure.effects.iter().enumerate() {
            let names = |form: &Form| form.parameters.iter().map(|p| p.name).collect::<Vec<_>>();
            let is_alike = present.effect.resembles(other) && k >= fitted.structure.declared;
            let forms = present.effect.forms.iter().filter(|_| is_alike);
            let forms = forms.filter(|form| form.name != present.form.name);
            for form in forms.filter(|form| names(form) == names(present.form)) {
                let mut structure = fitted.structure.clone();
                structure.effects[k].form = form;
                starts.push((structure, fitted.values.clone()));
            }
        }
        self.fitted_from(&starts, records, threads)
    }

    /// Fits of other structures with given start values and this model's initial states of the records.
    fn fitted_from(
        &self,
        starts: &[(Structure, Vec<f64>)],
        records: &Records,
        threads: usize,
    ) -> Vec<Self> {
        let training = self.fitted.with_initial_states(&records.train);
        let fits = parallel(starts.len(), threads, |k| {
            let (structure, values) = &starts[k];
            let fitted = fit(structure.clone(), values, &training, OTHER_FORM).ok()?;
            Some(Self::of(fitted, records)?.without_samples())
        });
        fits.into_iter().flatten().collect()
    }
}

/// Effects of a model, sorted by name.
fn sorted(model: &ScoredModel) -> Vec<&'static str> {
    let mut names = model.effect_names();
    names.sort_unstable();
    names
}
