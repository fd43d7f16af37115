//! Fits of other effects from where the best one ended.
//!
//! With several modes, a frequency that is 1 % wrong adds up to whole cycles over a record, and the fit of the right
//! effect may get stuck there, while another changes the spring alike and arrives near the right frequencies. From those,
//! the right effect needs no more than its own magnitude.

use super::fit::{FittedModel, fit};
use super::record::{InitialState, StandRecord};
use super::records::Records;
use super::score::{BaseModel, ScoredModel};
use super::search::{FIRST_FIT, Workers, to_the_end};
use super::starts::with_shared_stiffness;
use super::structure::{EffectForm, Structure};
use crate::parallel::parallel;
use torqcomp_dsp::sort_by_number;
use torqcomp_model::effects::Stage;

/// Maximum sum of squares of the best fit, relative to that without the effect.
const CLOSE: f64 = 0.25;
/// Minimum sum of squares of a fit that got stuck, relative to the best one.
const STUCK: f64 = 2.0;
/// Magnitudes that are tried, relative to the starts of a form.
const MAGNITUDES: [f64; 4] = [1.0, 0.3, 0.1, 0.03];
/// Number of forms that are fitted, those with the smallest residuals at their starts.
const RETRIED: usize = 8;

/// Refits the forms of the first effect beside several modes that got stuck far above the best fit, if that one reduces
/// the sum of squares substantially.
pub fn fit_from_best(
    base: &BaseModel,
    forms: &[EffectForm],
    fits: &mut [Option<ScoredModel>],
    records: &Records,
    workers: Workers,
) {
    let fitted = &base.scored.fitted;
    let is_first = fitted.structure.effects.is_empty();
    if !is_first || fitted.structure.context.several.is_none() {
        return;
    }
    let sum = |fit: &Option<ScoredModel>| {
        let found = fit.as_ref();
        found.map_or(fitted.train_sum, |model| model.fitted.train_sum)
    };
    let found = fits.iter().flatten().map(|model| &model.fitted);
    let best = found.min_by(|a, b| a.train_sum.total_cmp(&b.train_sum));
    let Some(best) = best.filter(|best| best.train_sum <= CLOSE * fitted.train_sum) else {
        return;
    };
    let Some(near) = Near::of(best, records) else {
        return;
    };
    let is_stuck = |k: &usize| {
        let is_allowed = near.structure.context.allows(&forms[*k]);
        let is_far = sum(&fits[*k]) > STUCK * best.train_sum;
        forms[*k].form.stage == Stage::Stand && is_allowed && is_far
    };
    let stuck: Vec<usize> = (0..forms.len()).filter(is_stuck).collect();
    let starts = parallel(stuck.len(), workers.threads, |i| {
        near.start(forms[stuck[i]])
    });
    let starts = starts.into_iter().zip(stuck);
    let mut starts: Vec<_> = starts.filter_map(|(start, k)| Some((start?, k))).collect();
    sort_by_number(&mut starts, |((left, _), _)| *left);
    starts.truncate(RETRIED);
    let found = parallel(starts.len(), workers.threads, |i| {
        let ((_, start), k) = &starts[i];
        near.fit(forms[*k], start, records)
    });
    for ((_, k), found) in starts.into_iter().zip(found) {
        if found.is_some() && sum(&found) < sum(&fits[k]) {
            fits[k] = found;
        }
    }
}

/// The neighbourhood of the best fit.
struct Near<'a> {
    best: &'a FittedModel,
    /// Its structure without the effect.
    structure: Structure,
    /// Values of that.
    plain: &'a [f64],
    /// Stiffness that the effect adds.
    present: f64,
    /// The training records with its initial states.
    training: Vec<StandRecord>,
}

impl<'a> Near<'a> {
    fn of(best: &'a FittedModel, records: &Records) -> Option<Self> {
        let mut structure = best.structure.clone();
        let last = structure.effects.pop()?;
        Some(Self {
            best,
            structure,
            plain: &best.values[..best.values.len() - last.moved()],
            present: best.structure.model(&best.values).0.added_stiffness(),
            training: best.with_initial_states(&records.train),
        })
    }

    /// Fit of another form. The initial states of the best fit make up for what its effect does not explain, so that the
    /// fit goes on from rest.
    fn fit(&self, form: EffectForm, start: &[f64], records: &Records) -> Option<ScoredModel> {
        let first = fit(self.structure.with(form), start, &self.training, FIRST_FIT).ok()?;
        let there = to_the_end(&first, records);
        let from_rest = FittedModel {
            initial: vec![InitialState::default(); there.initial.len()],
            train_sum: f64::INFINITY,
            ..there.clone()
        };
        let anew = to_the_end(&from_rest, records);
        let less = match anew.train_sum < there.train_sum {
            true => anew,
            false => there,
        };
        Some(ScoredModel::of(less, records)?.without_samples())
    }

    /// Sum of squares and values of the best start of another form.
    fn start(&self, form: EffectForm) -> Option<(f64, Vec<f64>)> {
        let structure = self.structure.with(form);
        let size = form.size();
        let tried = if size.is_some() { MAGNITUDES.len() } else { 1 };
        let own = MAGNITUDES[..tried].iter().flat_map(|magnitude| {
            form.form.starts.iter().map(move |start| {
                let mut own = start[..form.moved()].to_vec();
                if let Some(size) = size {
                    own[size] *= magnitude;
                }
                own
            })
        });
        let starts = own.filter_map(|own| {
            let values = [self.plain, &own].concat();
            let values = with_shared_stiffness(&structure, self.present, values);
            let model = FittedModel {
                structure: structure.clone(),
                values,
                amplitudes: Vec::new(),
                ..self.best.clone()
            };
            let residuals = self.training.iter().map(|record| model.residual(record));
            let left = residuals
                .map(|r| r.map(|r| r.sum_of_squares()))
                .sum::<Option<f64>>()?;
            Some((left, model.values))
        });
        starts.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}
