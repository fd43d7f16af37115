//! Pairs of effects fitted together: the residual of two effects shows neither clearly while the other is missing.

use nalgebra::DMatrix;

use super::fit::{FitEffort, FittedModel, fit};
use super::records::Records;
use super::score::{BaseModel, ScoredModel};
use super::search::Workers;
use super::starts::Start;
use super::structure::{EffectForm, Structure};
use crate::parallel::parallel;
use torqcomp_dsp::{dot, sort_by_number};

/// Number of forms of a pair of effects that are fitted.
const FORMS: usize = 2;
/// Number of pairs that get a first, a second and a full fit.
const FITTED: [usize; 3] = [10, 5, 3];
const EFFORTS: [FitEffort; 3] = [
    FitEffort::brief(3),
    FitEffort::brief(5),
    FitEffort::full(15),
];
/// Limits of the magnitude of an effect in a pair, relative to its magnitude alone.
const FACTORS: [f64; 2] = [0.1, 2.0];

/// Number of samples of changes that are kept at a time, and number of changes kept of long records: an inner product
/// takes two of them, and the others are simulated again for each group of these.
const KEPT_SAMPLES: usize = 1 << 22;
const FEWEST_KEPT: usize = 8;

/// Change of the model by an effect fitted alone.
struct Change {
    effect: EffectForm,
    /// Parameters of the plain stand minus those of the base, and the effect's own.
    plain: Vec<f64>,
    own: Vec<f64>,
}

/// Inner products of the changes of the training residuals by several effects, each fitted alone, without what the
/// base's own parameters can absorb.
struct Products {
    /// Square of the residual of the base.
    whole: f64,
    /// Products of each change with it.
    along: Vec<f64>,
    /// Products of the changes with each other, for `k ≤ j`.
    mixed: DMatrix<f64>,
}

/// Two changes, and the magnitudes that minimise the residual of both together.
struct EffectPair {
    members: [usize; 2],
    factors: [f64; 2],
    /// Bayesian information criterion on the training records, up to a constant, to first order.
    criterion: f64,
}

/// Pairs of effects in ascending order of the criterion, preselected by its first-order value. `alone` are fits
/// of single effects with the same base.
pub fn best_pairs(
    base: &BaseModel,
    alone: &[ScoredModel],
    records: &Records,
    workers: Workers,
) -> Vec<ScoredModel> {
    let changes: Vec<Change> = alone.iter().map(|model| Change::of(base, model)).collect();
    let samples = base.scored.train_count() as f64;
    let products = Products::of(base, alone, workers.threads);
    let mut pairs = pairs(&changes, &products, samples);
    let training = base.scored.fitted.with_initial_states(&records.train);
    // A decay tells the magnitudes of two at once, also of a pair that changes too much to be chosen to first order.
    let of_decays = pairs.iter().filter(|_| records.are_free());
    let of_decays = of_decays.filter_map(|pair| {
        let (structure, values) = pair.start(base, &changes);
        let start = Start::from_backbone(&structure, values, &training)?;
        Some((structure, start))
    });
    let mut starts: Vec<(Structure, Start)> = of_decays.collect();
    pairs.truncate(FITTED[0]);
    starts.extend(pairs.iter().map(|pair| {
        let (structure, values) = pair.start(base, &changes);
        (structure, Start::untried(values, None))
    }));
    let mut fits: Vec<FittedModel> = parallel(starts.len(), workers.threads, |k| {
        let (structure, start) = &starts[k];
        let records = start.in_records(&training);
        fit(structure.clone(), &start.values, &records, EFFORTS[0]).ok()
    })
    .into_iter()
    .flatten()
    .collect();
    for (count, effort) in FITTED.into_iter().zip(EFFORTS).skip(1) {
        let criterion = |fit: &FittedModel| {
            samples * fit.train_sum.ln() + fit.values.len() as f64 * samples.ln()
        };
        sort_by_number(&mut fits, criterion);
        fits.truncate(count);
        let again = parallel(fits.len(), workers.threads, |k| {
            fits[k].refit(&records.train, effort).ok()
        });
        for (old, new) in fits.iter_mut().zip(again) {
            if let Some(new) = new.filter(|new| new.train_sum < old.train_sum) {
                *old = new;
            }
        }
    }
    let fits = fits.into_iter();
    let mut scored: Vec<ScoredModel> = fits
        .filter_map(|fit| ScoredModel::of(fit, records))
        .map(ScoredModel::without_samples)
        .collect();
    sort_by_number(&mut scored, ScoredModel::criterion);
    scored
}

impl Change {
    fn of(base: &BaseModel, model: &ScoredModel) -> Self {
        let before = &base.scored;
        let count = before.fitted.structure.context.plain_count();
        let values = &model.fitted.values;
        let plain = values[..count].iter().zip(&before.fitted.values);
        Self {
            effect: model.fitted.structure.effects[before.fitted.structure.effects.len()],
            plain: plain.map(|(with, without)| with - without).collect(),
            own: values[before.fitted.values.len()..].to_vec(),
        }
    }
}

impl Products {
    fn of(base: &BaseModel, alone: &[ScoredModel], threads: usize) -> Self {
        let before = base.scored.train();
        let residual = base.cleared(|k| before[k].samples.clone());
        let change = |model: &ScoredModel| {
            let after = model.train();
            base.cleared(|k| {
                let pairs = before[k].samples.iter().zip(&after[k].samples);
                pairs.map(|(before, after)| before - after).collect()
            })
        };
        let count = alone.len();
        let mut along = Vec::new();
        let mut mixed = DMatrix::zeros(count, count);
        let kept = (KEPT_SAMPLES / residual.len().max(1)).max(FEWEST_KEPT);
        for first in (0..count).step_by(kept) {
            let last = (first + kept).min(count);
            let some = parallel(last - first, threads, |k| change(&alone[first + k]));
            along.extend(some.iter().map(|one| dot(one, &residual)));
            let with_some = parallel(count - first, threads, |j| {
                let again;
                let other = match some.get(j) {
                    Some(other) => other,
                    None => {
                        again = change(&alone[first + j]);
                        &again
                    }
                };
                some.iter().map(|one| dot(one, other)).collect::<Vec<_>>()
            });
            for (j, products) in with_some.into_iter().enumerate() {
                for (k, product) in products.into_iter().enumerate() {
                    mixed[(first + k, first + j)] = product;
                }
            }
        }
        Self {
            whole: dot(&residual, &residual),
            along,
            mixed,
        }
    }
}

impl EffectPair {
    /// Structure and start values: each effect with its magnitude in the pair, the plain stand changed
    /// by both.
    fn start(&self, base: &BaseModel, changes: &[Change]) -> (Structure, Vec<f64>) {
        let fitted = &base.scored.fitted;
        let (mut structure, mut values) = (fitted.structure.clone(), fitted.values.clone());
        for (member, factor) in self.members.iter().zip(self.factors) {
            let change = &changes[*member];
            let factor = factor.clamp(FACTORS[0], FACTORS[1]);
            for (value, moved) in values.iter_mut().zip(&change.plain) {
                *value += factor * moved;
            }
            let mut own = change.own.clone();
            if let Some(size) = change.effect.size() {
                own[size] *= factor;
            }
            values.extend(own);
            structure = structure.with(change.effect);
        }
        (structure, values)
    }
}

/// All pairs of different effects, each in its best forms, in ascending order of the criterion.
fn pairs(changes: &[Change], products: &Products, count: f64) -> Vec<EffectPair> {
    let Products {
        whole,
        along,
        mixed: products,
    } = products;
    let mut found: Vec<EffectPair> = Vec::new();
    for (k, one) in changes.iter().enumerate() {
        let own = products[(k, k)];
        for (j, other) in changes.iter().enumerate().skip(k + 1) {
            if one.effect.effect.name == other.effect.effect.name {
                continue;
            }
            let (square, mixed) = (products[(j, j)], products[(k, j)]);
            let determinant = own * square - mixed * mixed;
            if determinant <= NEARLY_THE_SAME * own * square {
                continue;
            }
            let factors = [
                (square * along[k] - mixed * along[j]) / determinant,
                (own * along[j] - mixed * along[k]) / determinant,
            ];
            let reduction = factors[0] * along[k] + factors[1] * along[j];
            let left = (1.0 - reduction / whole).max(f64::EPSILON);
            let parameters = (one.own.len() + other.own.len()) as f64;
            found.push(EffectPair {
                members: [k, j],
                factors,
                criterion: count * left.ln() + parameters * count.ln(),
            });
        }
    }
    sort_by_number(&mut found, |pair| pair.criterion);
    // A body that moves with the stand differs from a second mode only in how torques act on it.
    let names = |pair: &EffectPair| {
        pair.members.map(|k| {
            let effect = changes[k].effect;
            (effect.effect.name, effect.is_body())
        })
    };
    let mut seen = Vec::new();
    found.retain(|pair| {
        let before = seen.iter().filter(|names_of| **names_of == names(pair));
        let is_kept = before.count() < FORMS;
        seen.push(names(pair));
        is_kept
    });
    found
}

/// Threshold of one minus the squared correlation of two changes, below which they count as one.
const NEARLY_THE_SAME: f64 = 1e-4;
