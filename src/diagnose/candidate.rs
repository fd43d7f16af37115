//! One effect put to the model: fitted on the training records, judged on the held-out ones.

use std::sync::Arc;

use torqcomp_model::effects::{Effect, Mode};
use torqcomp_model::simulate::{Between, Excitation};

use super::blocks::{Comparison, compare};
use super::columns::Columns;
use super::fit::{Fitted, Residual, difference, fit, look};
use super::record::{Nuisance, Record, dot};
use super::spectra::Peak;
use super::starts::{self, Trial};
use super::structure::{Choice, Structure, Waves};

/// The records of a diagnosis.
#[derive(Clone)]
pub struct Records {
    /// Fitted.
    pub train: Vec<Record>,
    /// Held out.
    pub hold: Vec<Record>,
    /// The plain mode, that free motion is taken from.
    pub reference: Mode,
}

impl Records {
    /// Steps of integration from sample to sample.
    #[must_use]
    pub fn substeps(&self) -> usize {
        self.train[0].input.substeps()
    }

    /// Gives all records that many steps of integration from sample to sample.
    pub fn set_substeps(&mut self, substeps: usize) {
        set_substeps(self.train.iter_mut().chain(&mut self.hold), substeps);
    }

    /// The same records with another course of the input between its samples.
    #[must_use]
    pub fn with_between(&self, between: Between) -> Self {
        let mut other = self.clone();
        let all = other.train.iter_mut().chain(&mut other.hold);
        change_inputs(all, |input| input.with_between(between));
        other
    }

    /// That course.
    #[must_use]
    pub fn between(&self) -> Between {
        self.train[0].input.between()
    }
}

/// Gives records that many steps of integration from sample to sample.
pub fn set_substeps<'r>(records: impl Iterator<Item = &'r mut Record>, substeps: usize) {
    change_inputs(records, |input| input.with_substeps(substeps));
}

/// Changes the inputs of records; records that share an input go on to share it.
fn change_inputs<'r>(
    records: impl Iterator<Item = &'r mut Record>,
    change: impl Fn(&Excitation) -> Excitation,
) {
    let mut made: Vec<(Arc<Excitation>, Arc<Excitation>)> = Vec::new();
    for record in records {
        let known = made.iter().find(|(old, _)| Arc::ptr_eq(old, &record.input));
        let new = match known {
            Some((_, new)) => new.clone(),
            None => {
                let new = Arc::new(change(&record.input));
                made.push((record.input.clone(), new.clone()));
                new
            }
        };
        record.input = new;
    }
}

/// Error of the integration over the rms of the held-out residual, above which the step is halved.
const STEP_ERROR: f64 = 0.1;
/// Most steps, over those that the stand without effects takes: a listed effect is settled with one to four of them, a
/// law that bends itself to something else (a hard stop, say) with none.
const FINEST: usize = 8;
/// Rounds of a fit with a finer step.
const FINER_ROUNDS: usize = 6;

/// Halves the step of integration, and fits again, until its error no longer matters; says whether it came to that.
/// `coarse` is the step of the stand without effects.
#[must_use]
pub fn refine_step<'a>(
    mut judged: Judged<'a>,
    records: &mut Records,
    coarse: usize,
) -> (Judged<'a>, bool) {
    while judged.fitted.integrates() {
        let substeps = records.substeps();
        let Some(change) = step_change(&judged.fitted, &records.train[0]) else {
            return (judged, false);
        };
        if change <= STEP_ERROR * judged.hold_rms() {
            break;
        }
        if 2 * substeps > FINEST * coarse {
            return (judged, false);
        }
        records.set_substeps(2 * substeps);
        match again(&judged, records) {
            Some(finer) => judged = finer,
            None => return (judged, false),
        }
    }
    (judged, true)
}

/// The same model fitted again, with the step and the course of the input that the records have now.
pub(super) fn again<'a>(judged: &Judged<'a>, records: &Records) -> Option<Judged<'a>> {
    let fitted = &judged.fitted;
    let training = begun(&records.train, fitted);
    let (structure, values) = (fitted.structure.clone(), &fitted.values);
    let found = fit(
        structure,
        values,
        &training,
        &records.reference,
        FINER_ROUNDS,
    );
    judge(found.ok()?, records)
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
    pub slopes: Vec<Columns>,
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
            let mut own = Columns::default();
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
const FIRST_ROUNDS: usize = 3;
/// Rounds of a second look.
const SECOND_ROUNDS: usize = 5;
/// Rounds of a fit.
const MOST_ROUNDS: usize = 15;

/// Standard uncertainties above zero from which on a parameter is not zero.
const ABOVE_ZERO: f64 = 3.0;

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
        self.fitted.values.len()
            + self.fitted.amplitudes.len()
            + waves.course
            + waves.fades_per_s.len()
    }

    /// A parameter that makes the last effect what it is called, but is zero as far as the training records tell.
    #[must_use]
    pub fn lacks(&self) -> Option<&'static str> {
        let fitted = &self.fitted;
        let last = fitted.structure.choices.last()?;
        let first = fitted.structure.bounds().len() - last.moved();
        let own = last.form.parameters.iter().take(last.moved()).enumerate();
        let is_zero = |k: usize| {
            let std = fitted.std[first + k].unwrap_or(0.0);
            fitted.values[first + k] <= ABOVE_ZERO * std
        };
        own.filter(|(_, p)| p.essential)
            .find(|(k, _)| is_zero(*k))
            .map(|(_, p)| p.name)
    }

    /// Comparison with another model on the held-out records.
    #[must_use]
    pub fn against(&self, before: &Judged) -> Comparison {
        compare(&before.held_out(), &self.held_out())
    }

    /// Criterion of Schwarz on the training records, less a constant: smaller is better.
    #[must_use]
    pub fn criterion(&self) -> f64 {
        let (fit, n) = likelihood(&self.train);
        fit + self.parameters() as f64 * n.ln()
    }

    /// The same on all records.
    #[must_use]
    pub fn pooled_criterion(&self) -> f64 {
        let ((train, n), (hold, m)) = (likelihood(&self.train), likelihood(&self.hold));
        train + hold + self.parameters() as f64 * (n + m).ln()
    }
}

/// `n ln s²`, twice the negative logarithm of the likelihood of normal residuals less a constant, and `n`.
fn likelihood(residuals: &[Residual]) -> (f64, f64) {
    let n = residuals.iter().map(|r| r.samples.len()).sum::<usize>() as f64;
    (2.0 * n * rms(residuals).ln(), n)
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

/// The best starts of one effect in one form, each run once.
#[must_use]
pub fn begin(base: &Base, choice: Choice, peaks: &[Peak], records: &Records) -> Vec<Trial> {
    let structure = with(base, choice);
    starts::best(base, &structure, starts::own(choice, peaks), records)
}

fn with<'a>(base: &Base<'a>, choice: Choice) -> Structure<'a> {
    let mut structure = base.judged.fitted.structure.clone();
    structure.choices.push(choice);
    structure
}

/// A first look at one effect in one form: very few rounds from each of its starts.
#[must_use]
pub fn first_look<'a>(
    base: &Base<'a>,
    choice: Choice,
    from: &[Trial],
    records: &Records,
) -> Vec<Fitted<'a>> {
    let structure = with(base, choice);
    let training = begun(&records.train, &base.judged.fitted);
    let each = from.iter().map(|start| {
        look(
            structure.clone(),
            &start.values,
            &training,
            &records.reference,
            FIRST_ROUNDS,
        )
    });
    each.filter_map(Result::ok).collect()
}

/// A few rounds more.
#[must_use]
pub fn second_look<'a>(first: &Fitted<'a>, records: &Records) -> Option<Fitted<'a>> {
    let training = begun(&records.train, first);
    let (structure, values) = (first.structure.clone(), &first.values);
    look(
        structure,
        values,
        &training,
        &records.reference,
        SECOND_ROUNDS,
    )
    .ok()
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

/// All forms of an effect that the search tries.
pub fn choices(effect: &'static Effect) -> impl Iterator<Item = Choice> {
    effect.forms.iter().map(move |form| Choice { effect, form })
}
