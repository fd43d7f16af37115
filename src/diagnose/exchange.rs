//! Effects exchanged for others: one that was found first may only resemble another, or two others, beside those found later.

use super::SearchState;
use super::pairs::best_pairs;
use super::score::{BaseModel, ScoredModel};
use super::search::{SAME, Workers, refusal, try_all};

/// Most exchanges on one way.
const MOST: usize = 4;
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

    /// The best model in which one effect is exchanged, if it is better than the one found, or as good and simpler.
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
        let mut found = Vec::new();
        for (k, less) in without.iter().enumerate() {
            let Some(less) = less else { continue };
            let base = BaseModel::of(less.clone(), &self.records);
            let round = try_all(&base, &self.records, silent);
            found.extend(round.accepted().cloned());
            if self.after.fitted.structure.added()[k].moved() >= MANY {
                let pairs = best_pairs(&base, &round.fits, &self.records, silent).into_iter();
                found.extend(pairs.filter(|pair| refusal(pair, less).is_none()));
            }
        }
        found.retain(|model| {
            let is_new = !seen.contains(&sorted(model));
            is_new && model.criterion() < self.after.criterion() + SAME
        });
        found
            .into_iter()
            .min_by(|a, b| a.criterion().total_cmp(&b.criterion()))
    }
}

/// The effects of a model in the order of their names.
fn sorted(model: &ScoredModel) -> Vec<&'static str> {
    let mut names = model.effect_names();
    names.sort_unstable();
    names
}
