//! Effects exchanged for others: one that was found first may only resemble another, or two others, beside those found later.

use torqcomp_model::effects::{EFFECTS, Effect};

use super::SearchState;
use super::pairs::best_pairs;
use super::score::{BaseModel, ScoredModel};
use super::search::{SAME, SearchEffort, Workers, refusal, try_effects};

/// Most exchanges on one way.
const MOST: usize = 3;
/// Forms that are fitted in the place of an effect.
const FOR_EXCHANGE: SearchEffort = SearchEffort {
    first: 8,
    second: 0.1,
    full: 2,
};
/// Parameters of an effect from which on it may imitate two others.
pub const MANY: usize = 3;

impl SearchState {
    /// Exchanges effects for others as long as that explains the records better, or as well with less; if so, the model
    /// without each of the effects then. `without` is the model without each of the effects now, `coarse` the number of
    /// steps of integration for the stand without effects.
    pub(super) fn exchange(
        &mut self,
        without: &[Option<ScoredModel>],
        coarse: usize,
        workers: Workers,
    ) -> Option<Vec<Option<ScoredModel>>> {
        let mut seen = vec![sorted(&self.after)];
        let mut exchanged: Option<Vec<Option<ScoredModel>>> = None;
        for _ in 0..MOST {
            let without = exchanged.as_deref().unwrap_or(without);
            let Some(other) = self.other_effects(without, &seen, workers) else {
                break;
            };
            self.take(&other, coarse);
            seen.push(sorted(&self.after));
            exchanged = Some(self.eliminate(workers.threads));
        }
        exchanged
    }

    /// The best model in which one effect is exchanged, if it is better than the one found, or as good and first in the list.
    /// While something is left, any effect may come in; otherwise only one that resembles the other.
    fn other_effects(
        &self,
        without: &[Option<ScoredModel>],
        seen: &[Vec<&'static str>],
        workers: Workers,
    ) -> Option<ScoredModel> {
        let silent = Workers {
            progress: &|_, _| {},
            ..workers
        };
        let is_open = self.is_worthwhile(&self.after, &self.tests);
        let present = self.after.fitted.structure.added();
        let mut found = Vec::new();
        for (form, less) in present.iter().zip(without) {
            let Some(less) = less else { continue };
            let base = BaseModel::of(less.clone(), &self.records);
            let among = |other: &Effect| {
                other.name != form.effect.name && (is_open || form.effect.resembles(other))
            };
            let round = try_effects(&base, among, &FOR_EXCHANGE, &self.records, silent);
            let singles = round.tried.iter().filter_map(|c| {
                let model = c.model.as_ref()?;
                (self.is_better(model, form.effect, c.effect)).then_some(model)
            });
            found.extend(singles.filter(|m| refusal(m, less).is_none()).cloned());
            if form.moved() >= MANY {
                let pairs = best_pairs(&base, &round.fits, &self.records, silent).into_iter();
                let better = pairs.filter(|pair| pair.criterion() < self.after.criterion());
                found.extend(better.filter(|pair| refusal(pair, less).is_none()));
            }
        }
        found.retain(|model| !seen.contains(&sorted(model)));
        let found = found.into_iter();
        found.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))
    }

    /// Whether a model with one effect in the place of another is better than the one found.
    fn is_better(&self, model: &ScoredModel, present: &Effect, other: &Effect) -> bool {
        let place = |effect: &Effect| EFFECTS.iter().position(|e| e.name == effect.name);
        let difference = model.criterion() - self.after.criterion();
        difference < -SAME || difference < SAME && place(other) < place(present)
    }
}

/// The effects of a model in the order of their names.
fn sorted(model: &ScoredModel) -> Vec<&'static str> {
    let mut names = model.effect_names();
    names.sort_unstable();
    names
}
