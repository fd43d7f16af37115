//! One effect put to the model: fitted on the training records, judged on the held-out ones.

use std::sync::Arc;

use torqcomp_model::effects::{Effect, Mode};
use torqcomp_model::simulate::Input;

use super::blocks::{Comparison, compare};
use super::fit::{Fitted, Residual, difference, fit, look};
use super::record::{Nuisance, Record, dot};
use super::spectra::Peak;
use super::structure::{Choice, Structure, Waves};

/// The records of a diagnosis.
pub struct Records {
    /// Fitted.
    pub train: Vec<Record>,
    /// Held out.
    pub hold: Vec<Record>,
    /// The plain mode, that free motion is taken from.
    pub reference: Mode,
}

impl Records {
    /// Gives all records that many steps of integration from sample to sample.
    pub fn set_substeps(&mut self, substeps: usize) {
        set_substeps(self.train.iter_mut().chain(&mut self.hold), substeps);
    }
}

/// Gives records that many steps of integration from sample to sample; records that share an input go on to share it.
pub fn set_substeps<'r>(records: impl Iterator<Item = &'r mut Record>, substeps: usize) {
    let mut made: Vec<(Arc<Input>, Arc<Input>)> = Vec::new();
    for record in records {
        let known = made.iter().find(|(old, _)| Arc::ptr_eq(old, &record.input));
        let new = match known {
            Some((_, new)) => new.clone(),
            None => {
                let new = Arc::new(record.input.with_substeps(substeps));
                made.push((record.input.clone(), new.clone()));
                new
            }
        };
        record.input = new;
    }
}

/// Error of the integration over the rms of the held-out residual, above which the step is halved.
const STEP_ERROR: f64 = 0.1;
/// Most steps from sample to sample.
const MOST_SUBSTEPS: usize = 128;
/// Rounds of a fit with a finer step.
const FINER_ROUNDS: usize = 6;

/// Halves the step of integration, and fits again, until its error no longer matters.
#[must_use]
pub fn refine_step<'a>(mut judged: Judged<'a>, records: &mut Records) -> Judged<'a> {
    while judged.fitted.integrates() {
        let substeps = records.train[0].input.substeps();
        let Some(change) = step_change(&judged.fitted, &records.train[0]) else {
            break;
        };
        if change <= STEP_ERROR * judged.hold_rms() || 2 * substeps > MOST_SUBSTEPS {
            break;
        }
        records.set_substeps(2 * substeps);
        let training = begun(&records.train, &judged.fitted);
        let structure = judged.fitted.structure.clone();
        let again = fit(
            structure,
            &judged.fitted.values,
            &training,
            &records.reference,
            FINER_ROUNDS,
        );
        match again.ok().and_then(|fitted| judge(fitted, records)) {
            Some(finer) => judged = finer,
            None => break,
        }
    }
    judged
}

/// Rms by which a record changes with half the step.
fn step_change(fitted: &Fitted, record: &Record) -> Option<f64> {
    let (mut model, _) = fitted.structure.model(&fitted.values);
    let mut record = record.clone();
    record.begin = *fitted.begins.first()?;
    model.shift = record.begin.shift;
    let coarse = difference(&model, &record).ok()?;
    record.input = Arc::new(record.input.with_substeps(2 * record.input.substeps()));
    let fine = difference(&model, &record).ok()?;
    let sum: f64 = coarse.iter().zip(&fine).map(|(a, b)| (a - b).powi(2)).sum();
    Some((sum / coarse.len() as f64).sqrt())
}

/// A model with its residuals.
#[derive(Clone)]
pub struct Judged<'a> {
    /// The fitted model.
    pub fitted: Fitted<'a>,
    /// Residuals on the training records.
    pub train: Vec<Residual>,
    /// Residuals on the held-out records.
    pub hold: Vec<Residual>,
}

/// A model to which effects are added, with what small changes of its own parameters do.
pub struct Base<'a> {
    /// The model.
    pub judged: Judged<'a>,
    /// For each training record, the changes of its record with each parameter.
    pub slopes: Vec<Nuisance>,
    /// For each training record, what belongs to it.
    pub cleared: Vec<Nuisance>,
}

/// Relative step of the differences.
const STEP: f64 = 1e-6;

impl<'a> Base<'a> {
    /// Takes the slopes of a model.
    #[must_use]
    pub fn of(judged: Judged<'a>, records: &Records) -> Self {
        let fitted = &judged.fitted;
        let mut slopes = Vec::new();
        let mut cleared = Vec::new();
        for (record, begin) in records.train.iter().zip(&fitted.begins) {
            let mut record = record.clone();
            record.begin = *begin;
            let nuisance = record.nuisance(&records.reference, &Waves::NONE, None);
            let at = |values: &[f64]| {
                let (model, _) = fitted.structure.model(values);
                let mut residual = difference(&model, &record).ok()?;
                nuisance.clear(&mut residual);
                Some(residual)
            };
            let mut own = Nuisance::none();
            if let Some(here) = at(&fitted.values) {
                for k in 0..fitted.values.len() {
                    let mut values = fitted.values.clone();
                    let step = STEP * values[k].abs().max(1e-3);
                    values[k] += step;
                    if let Some(there) = at(&values) {
                        own.push(
                            there
                                .iter()
                                .zip(&here)
                                .map(|(a, b)| (a - b) / step)
                                .collect(),
                        );
                    }
                }
            }
            slopes.push(own);
            cleared.push(nuisance);
        }
        Self {
            judged,
            slopes,
            cleared,
        }
    }
}

/// Rounds of a first look.
const FIRST_ROUNDS: usize = 6;
/// Rounds of a fit.
const MOST_ROUNDS: usize = 15;
/// Starts that are fitted in full.
const FULL: usize = 2;

impl Judged<'_> {
    /// Rms over the training records.
    #[must_use]
    pub fn train_rms(&self) -> f64 {
        rms(&self.train)
    }

    /// Rms over the held-out records.
    #[must_use]
    pub fn hold_rms(&self) -> f64 {
        rms(&self.hold)
    }

    /// All held-out residuals, one after the other.
    #[must_use]
    pub fn held_out(&self) -> Vec<f64> {
        self.hold
            .iter()
            .flat_map(|r| r.samples.iter().copied())
            .collect()
    }

    /// Count of parameters, amplitudes of lines included.
    #[must_use]
    pub fn parameters(&self) -> usize {
        let (_, waves) = self.fitted.structure.model(&self.fitted.values);
        self.fitted.values.len() + self.fitted.amplitudes.len() + waves.course
    }

    /// Comparison with another model on the held-out records.
    #[must_use]
    pub fn against(&self, before: &Judged) -> Comparison {
        compare(&before.held_out(), &self.held_out())
    }

    /// Criterion of Schwarz on the training records, less a constant: smaller is better.
    #[must_use]
    pub fn criterion(&self) -> f64 {
        let count: usize = self.train.iter().map(|r| r.samples.len()).sum();
        let n = count as f64;
        n * (self.fitted.train_sum / n).ln() + self.parameters() as f64 * n.ln()
    }
}

fn rms(residuals: &[Residual]) -> f64 {
    let count: usize = residuals.iter().map(|r| r.samples.len()).sum();
    let sum: f64 = residuals.iter().map(|r| dot(&r.samples, &r.samples)).sum();
    (sum / count as f64).sqrt()
}

/// Takes the residuals of a fitted model; `None` if the model cannot be run on all records.
#[must_use]
pub fn judge<'a>(fitted: Fitted<'a>, records: &Records) -> Option<Judged<'a>> {
    let train = records
        .train
        .iter()
        .zip(&fitted.begins)
        .map(|(record, start)| {
            let mut record = record.clone();
            record.begin = *start;
            fitted.residual(&record, &records.reference)
        });
    let train = train.collect::<Option<Vec<_>>>()?;
    let hold = records.hold.iter().map(|r| {
        // A part of a training record starts where that record starts.
        let same = records
            .train
            .iter()
            .position(|t| Arc::ptr_eq(&t.input, &r.input));
        let mut record = r.clone();
        if let Some(place) = same {
            record.begin = fitted.begins[place];
        }
        fitted.residual(&record, &records.reference)
    });
    let hold = hold.collect::<Option<Vec<_>>>()?;
    Some(Judged {
        fitted,
        train,
        hold,
    })
}

/// A first look at one effect in one form: a few rounds from its best starts.
#[must_use]
pub fn first_look<'a>(
    base: &Base<'a>,
    choice: Choice,
    peaks: &[Peak],
    records: &Records,
) -> Option<Fitted<'a>> {
    let fitted = &base.judged.fitted;
    let mut structure = fitted.structure.clone();
    structure.choices.push(choice);
    let from: Vec<Vec<f64>> = starts(choice, peaks)
        .into_iter()
        .map(|own| {
            let together = [fitted.values.as_slice(), &own[..choice.moved()]].concat();
            with_stiffness_shared(&structure, together)
        })
        .collect();
    let from = best_starts(base, &structure, from, records);
    let training = begun(&records.train, fitted);
    let mut best: Option<Fitted> = None;
    for start in from {
        let found = look(
            structure.clone(),
            &start,
            &training,
            &records.reference,
            FIRST_ROUNDS,
        );
        let Ok(found) = found else { continue };
        if best.as_ref().is_none_or(|b| found.train_sum < b.train_sum) {
            best = Some(found);
        }
    }
    best
}

/// Takes the stiffness that an effect adds off the plain stand, so that the whole is as stiff as before.
fn with_stiffness_shared(structure: &Structure, mut values: Vec<f64>) -> Vec<f64> {
    let factor = 1.0 + structure.model(&values).0.added_stiffness();
    values[0] /= factor.sqrt();
    if structure.frame.gain_is_free {
        values[2] *= factor;
    }
    values
}

/// The fit taken on to its end.
#[must_use]
pub fn finish<'a>(first: &Fitted<'a>, records: &Records) -> Option<Fitted<'a>> {
    let training = begun(&records.train, first);
    let (structure, values) = (first.structure.clone(), &first.values);
    fit(
        structure,
        values,
        &training,
        &records.reference,
        MOST_ROUNDS,
    )
    .ok()
}

/// The training records with the motion at their start that a fit has found.
fn begun(train: &[Record], fitted: &Fitted) -> Vec<Record> {
    let mut training = train.to_vec();
    for (record, start) in training.iter_mut().zip(&fitted.begins) {
        record.begin = *start;
    }
    training
}

/// Start values of the effect's own parameters.
fn starts(choice: Choice, peaks: &[Peak]) -> Vec<Vec<f64>> {
    if choice.is_line() && choice.form.starts.is_empty() {
        let bounds = choice.form.parameters[0].lower..choice.form.parameters[0].upper;
        let known = peaks
            .iter()
            .map(|p| p.frequency_hz)
            .filter(|f| bounds.contains(f));
        return known.map(|f| vec![f]).collect();
    }
    let mut all: Vec<Vec<f64>> = choice.form.starts.iter().map(|s| s.to_vec()).collect();
    if choice.is_line() {
        // The line in the data nearest to the grid's frequency, if there is one.
        let (lower, upper) = (
            choice.form.parameters[0].lower,
            choice.form.parameters[0].upper,
        );
        let near = peaks
            .iter()
            .find(|p| (lower..=upper).contains(&p.frequency_hz));
        if let Some(peak) = near {
            all.push(vec![peak.frequency_hz]);
        }
    }
    all
}

/// The starts towards which the residual points most: a score test of each, with what a change of the base's own
/// parameters could do left in.
fn best_starts(
    base: &Base,
    structure: &Structure,
    mut starts: Vec<Vec<f64>>,
    records: &Records,
) -> Vec<Vec<f64>> {
    if starts.len() <= FULL {
        return starts;
    }
    let mut scored: Vec<(f64, Vec<f64>)> = starts
        .drain(..)
        .map(|start| (score(base, structure, &start, records), start))
        .collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    scored.truncate(FULL);
    scored.into_iter().map(|(_, start)| start).collect()
}

/// By how much the sum of squares of the training residual would fall with the right size of what the start adds.
fn score(base: &Base, structure: &Structure, start: &[f64], records: &Records) -> f64 {
    let (model, waves) = structure.model(start);
    let mut fall = 0.0;
    let judged = &base.judged;
    let each = records
        .train
        .iter()
        .zip(&judged.fitted.begins)
        .zip(&judged.train)
        .zip(base.slopes.iter().zip(&base.cleared));
    for (((record, begin), before), (slopes, cleared)) in each {
        let mut record = record.clone();
        record.begin = *begin;
        if !waves.is_empty() {
            let mut residual = before.samples.clone();
            record
                .nuisance(&records.reference, &waves, None)
                .clear(&mut residual);
            fall += dot(&before.samples, &before.samples) - dot(&residual, &residual);
            continue;
        }
        let Ok(mut moved) = difference(&model, &record) else {
            return 0.0;
        };
        cleared.clear(&mut moved);
        let mut change: Vec<f64> = before
            .samples
            .iter()
            .zip(&moved)
            .map(|(b, m)| b - m)
            .collect();
        slopes.clear(&mut change);
        let size = dot(&change, &change);
        if size > 0.0 {
            fall += dot(&change, &before.samples).max(0.0).powi(2) / size;
        }
    }
    fall
}

/// All forms of an effect that the search tries.
pub fn choices(effect: &'static Effect) -> impl Iterator<Item = Choice> {
    effect.forms.iter().map(move |form| Choice { effect, form })
}
