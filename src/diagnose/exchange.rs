//! Effects exchanged for others: one that was found first may only resemble another, or two others, beside those found later.

use torqcomp_model::effects::{EFFECTS, Effect, Form};

use super::SearchState;
use super::fit::{FitEffort, fit};
use super::pairs::best_pairs;
use super::records::Records;
use super::score::{BaseModel, ScoredModel};
use super::search::{FOR_FIRST_EFFECT, SAME, SearchEffort, Workers, refusal, try_effects};
use crate::parallel::parallel;

/// Most exchanges.
const MOST: usize = 3;
/// Most effects beside which all others are tried in the place of one, and most steps of integration for that, over those of
/// the stand without effects: what takes more is not of the list.
const MOST_OPEN: usize = 3;
const FINEST_OPEN: usize = 2;
/// Forms that are fitted in the place of an effect.
const FOR_EXCHANGE: SearchEffort = SearchEffort {
    first: 12,
    second: 0.1,
    full: 2,
    promising: 0.5,
};
/// The fit of another form, which starts where the present one ended.
const OTHER_FORM: FitEffort = FitEffort::full(15);
/// Parameters of an effect from which on it may imitate two others.
pub const MANY: usize = 3;

impl SearchState {
    /// Exchanges effects for others as long as that explains the records better, or as well with less; whether any was.
    /// `coarse` is the number of steps of integration for the stand without effects.
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

    /// The best model in which one effect is exchanged or found anew, if it is better than the one found, or as good and first
    /// in the list. While something is left, any effect may come in; otherwise only one that resembles the other.
    fn other_effects(
        &self,
        seen: &[Vec<&'static str>],
        coarse: usize,
        workers: Workers,
    ) -> Option<ScoredModel> {
        let present = self.after.fitted.structure.added();
        let is_open = self.is_worthwhile(&self.after, &self.tests);
        let is_long = present.len() > MOST_OPEN || self.records.substeps() > FINEST_OPEN * coarse;
        if present.len() < 2 || !self.settled || is_open && is_long {
            return None;
        }
        let silent = workers.silent();
        let without = self.after.without_each(&self.records, workers.threads);
        let mut found = Vec::new();
        for (form, less) in present.iter().zip(without) {
            let Some(less) = less else { continue };
            let effect = form.effect;
            let base = BaseModel::of(less.clone(), &self.records);
            let among = |e: &Effect| is_open || e.name == effect.name || effect.resembles(e);
            let round = try_effects(&base, among, &FOR_EXCHANGE, &self.records, silent);
            let passes = |model: &ScoredModel| refusal(model, &less).is_none();
            let singles = round.tried.into_iter().filter_map(|c| {
                let model = c.model.filter(passes)?;
                self.is_better(&model, effect, c.effect).then_some(model)
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
        let is_new = |model: &ScoredModel| {
            let names = sorted(model);
            let is_last = seen.last() == Some(&names);
            !seen.contains(&names) || is_last && model.criterion() < self.after.criterion() - SAME
        };
        let found = found.into_iter().filter(is_new);
        found.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))
    }

    /// Whether a model with one effect in the place of another is better than the one found.
    fn is_better(&self, model: &ScoredModel, present: &Effect, other: &Effect) -> bool {
        let place = |effect: &Effect| EFFECTS.iter().position(|e| e.name == effect.name);
        let difference = model.criterion() - self.after.criterion();
        difference < -SAME || difference < SAME && place(other) < place(present)
    }
}

impl ScoredModel {
    /// The model with each of its effects that another one resembles in its other forms of the same parameters, fitted: a second
    /// mode that takes from the first what it adds is one effect, not a second mode and a gain.
    fn in_other_forms(&self, other: &Effect, records: &Records, threads: usize) -> Vec<Self> {
        let fitted = &self.fitted;
        let mut structures = Vec::new();
        for (k, present) in fitted.structure.effects.iter().enumerate() {
            let names = |form: &Form| form.parameters.iter().map(|p| p.name).collect::<Vec<_>>();
            let is_alike = present.effect.resembles(other) && k >= fitted.structure.declared;
            let forms = present.effect.forms.iter().filter(|_| is_alike);
            let forms = forms.filter(|form| form.name != present.form.name);
            for form in forms.filter(|form| names(form) == names(present.form)) {
                let mut structure = fitted.structure.clone();
                structure.effects[k].form = form;
                structures.push(structure);
            }
        }
        let training = fitted.with_initial_states(&records.train);
        let fits = parallel(structures.len(), threads, |k| {
            let fitted = fit(structures[k].clone(), &fitted.values, &training, OTHER_FORM).ok()?;
            Self::of(fitted, records)
        });
        fits.into_iter().flatten().collect()
    }
}

/// The effects of a model in the order of their names.
fn sorted(model: &ScoredModel) -> Vec<&'static str> {
    let mut names = model.effect_names();
    names.sort_unstable();
    names
}
