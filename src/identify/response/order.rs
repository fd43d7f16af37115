//! Number of modes, chosen by the hold-out error.

use torqcomp_dsp::frf::{self, Estimator, Powers, Window};

use super::blocks::Set;
use super::lines::{self, MOST_LINES, data};
use super::whole::Whole;
use super::{Data, Effort, FinalFit, Modal, ResponseOptions, determined, shift};
use crate::failure::{ErrorCode, Failure};
use crate::print::rounded;
use crate::warning::Warning;

/// Relative frequency difference below which no second mode is searched for, unless the number of modes is given: the
/// residual of a slightly nonlinear mode is close to its line.
const APART: f64 = 0.03;

/// Maximum number of modes tried.
const MOST_MODES: usize = 24;

/// Number of additional modes without improvement after which the search ends.
const PATIENCE: usize = 3;

/// Ratio of the hold-out error of fewer modes to the minimum, up to which they are preferred.
const SLACK: f64 = 1.05;

/// Hold-out error without modes up to which the response follows the applied signal without them.
const FLAT: f64 = 0.1;

/// Adds one mode; `None` if no line is left to start from. The first one with a delay starts from a mode without one.
pub(super) fn grow(
    data: &Data,
    so_far: &Modal,
    options: &ResponseOptions,
) -> Result<Option<Modal>, Failure> {
    if data.lag.is_some() && so_far.poles.is_empty() {
        let prompt = Data {
            lag: None,
            ..data.clone()
        };
        let Some(first) = grow(&prompt, so_far, options)? else {
            return Ok(None);
        };
        let start_s = shift::likeliest_delay(data, &first)?;
        return Ok(Some(data.fit(&first.poles, start_s, Effort::Coarse)?));
    }
    let apart = if options.modes.is_some() { 0.0 } else { APART };
    let Some(pole) = data.next_pole(so_far, apart) else {
        return Ok(None);
    };
    let mut starts = so_far.poles.clone();
    starts.push(pole);
    Ok(Some(data.fit(&starts, so_far.delay_s, Effort::Coarse)?))
}

/// Folds of the blocks; each is held out once.
pub(super) fn folds(set: &Set) -> Vec<Vec<usize>> {
    let count = set.blocks.len();
    let folds = count.min(3);
    // Neighbours share a fold, since segments overlap.
    (0..folds)
        .map(|f| (count * f / folds..count * (f + 1) / folds).collect())
        .collect()
}

/// A coarse fit to all blocks, and the hold-out errors for 0, 1, 2, … modes, which determine their number; if that is
/// given, only its error. `said` are the warnings so far.
pub(super) fn order(
    set: &Set,
    options: &ResponseOptions,
    data: &Data,
    said: &[Warning],
) -> Result<(Modal, Vec<f64>), Failure> {
    let folds = folds(set);
    if set.band.len() > MOST_LINES {
        let (from, to) = lines::strongest(set, &set.band);
        return Err(ErrorCode::TooManySamples.failed(format_args!(
            "{} lines in the band, more than {MOST_LINES}; narrow it to where the response is strongest: \
             --band {}..{}",
            set.band.len(),
            rounded(from as f64 * set.step_hz, 4),
            rounded(to as f64 * set.step_hz, 4)
        )));
    }
    if let Some(modes) = options.modes {
        let all = grown(data, options, modes)?;
        let errors = of_given(set, options, &all)?;
        return Ok((all, errors));
    }
    if folds.len() < 2 {
        return Err(one_block(said));
    }
    let errors = tried(set, options, &folds)?;
    // Leakage may hide a mode in blocks, but not in whole records.
    let best = match (fewest(&errors), set.window) {
        (0, Window::Hann) if errors.len() > 1 => least_of_some(&errors),
        (0, _) if errors[0] < FLAT => {
            return Err(determined::none(data, None, options.band_hz.is_some()));
        }
        (0, _) => return Err(unexplained()),
        (best, _) => best,
    };
    Ok((grown(data, options, best)?, errors))
}

/// Failure for a single block, and for the hits that were left out before.
fn one_block(said: &[Warning]) -> Failure {
    let left_out = said.iter().filter(|warning| warning.code == "hit-left-out");
    let mut all: Vec<&str> = left_out.map(|warning| warning.message.as_str()).collect();
    all.push(match all.is_empty() {
        true => {
            "one block is not enough to choose the number of modes; give it, as --modes 1 for a single resonance, or record \
             more"
        }
        false => {
            "the one hit that is left is not enough to choose the number of modes; hit again, without overdriving the inputs, \
             or give the number, as --modes 1 for a single resonance"
        }
    });
    ErrorCode::TooFewSamples.failed(all.join("; "))
}

/// The number of modes, one or more, with the smallest hold-out error.
fn least_of_some(errors: &[f64]) -> usize {
    (1..errors.len())
        .min_by(|a, b| errors[*a].total_cmp(&errors[*b]))
        .unwrap_or(1)
}

/// The fewest modes with about the smallest hold-out error.
fn fewest(errors: &[f64]) -> usize {
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    errors.iter().position(|e| *e <= SLACK * least).unwrap_or(0)
}

/// Whether no number of modes clearly reduces the hold-out error, if that without modes is known.
pub(super) fn is_unexplained(errors: &[f64]) -> bool {
    errors.first().is_some_and(|none| !none.is_nan()) && fewest(errors) == 0
}

pub(super) fn unexplained() -> Failure {
    ErrorCode::NotIdentifiable.failed(
        "no mode explains hold-out data: the measured signal does not follow the applied one; check --applied, \
         --measured and --band",
    )
}

/// The fit of whole records with the fewest modes that explain them, up to the number chosen from the averaged
/// response: there, leakage of a swept or other unsteady excitation looks like further modes, in hold-out blocks as
/// well. Of the fits that converge, the one with the smallest [criterion](FinalFit::criterion); `None` if none does.
///
/// # Errors
/// If there are too few lines.
pub(super) fn of_whole(
    whole: &mut Whole,
    set: &Set,
    options: &ResponseOptions,
    (data, coarse): (&Data, &Modal),
) -> Result<Option<FinalFit>, Failure> {
    let all = shift::refined(whole, set, data, coarse)?;
    if options.modes.is_some() {
        return Ok(all);
    }
    let few = best_of_whole(whole, set, options, data, coarse.poles.len() - 1)?;
    let both = [all, few].into_iter().flatten();
    Ok(both.min_by(|a, b| a.criterion.total_cmp(&b.criterion)))
}

/// The fit of whole records with the smallest [criterion](FinalFit::criterion) of those with 1, 2, … modes. Each further
/// mode is searched for in the residual of whole records, which has no leakage.
///
/// # Errors
/// If there are too few lines.
pub(super) fn best_of_whole(
    whole: &mut Whole,
    set: &Set,
    options: &ResponseOptions,
    data: &Data,
    most: usize,
) -> Result<Option<FinalFit>, Failure> {
    let mut best: Option<FinalFit> = None;
    let mut seen = data.clone();
    let mut last = data.fit(&[], 0.0, Effort::Coarse)?;
    let mut since = 0;
    for _ in 0..most {
        let Some(next) = grow(&seen, &last, options)? else {
            break;
        };
        last = next;
        since += 1;
        if let Some(found) = whole.refine(data, &last, set) {
            last = found.modal.clone();
            seen.response = last
                .response
                .iter()
                .zip(&found.residual)
                .map(|(h, left)| h + left)
                .collect();
            if best
                .as_ref()
                .is_none_or(|best| found.criterion < best.criterion)
            {
                (best, since) = (Some(found), 0);
            }
        }
        if since >= PATIENCE {
            break;
        }
    }
    Ok(best)
}

/// Data of each fold: all blocks except those held out.
fn training(set: &Set, options: &ResponseOptions, folds: &[Vec<usize>]) -> Vec<Data> {
    folds
        .iter()
        .map(|fold| {
            let held_out = Powers::of(fold.iter().map(|i| &set.blocks[*i]), 0..usize::MAX);
            data(&set.powers.without(&held_out), set, options)
        })
        .collect()
}

/// Mean error of each fold's model on its hold-out blocks.
fn held_out(set: &Set, folds: &[Vec<usize>], models: &[Modal]) -> f64 {
    let each = models.iter().zip(folds).flat_map(|(model, fold)| {
        fold.iter()
            .map(|i| frf::prediction_error(&model.response, &set.blocks[*i], set.band.clone()))
    });
    each.sum::<f64>() / set.blocks.len() as f64
}

/// Hold-out error for the number of modes of the fit to all blocks only.
pub(super) fn of_given(
    set: &Set,
    options: &ResponseOptions,
    all: &Modal,
) -> Result<Vec<f64>, Failure> {
    let mut errors = vec![f64::NAN; all.poles.len() + 1];
    let folds = folds(set);
    if folds.len() > 1 {
        let training = training(set, options, &folds);
        let models = side_by_side(&training, |data, _| {
            Ok(data.fit(&all.poles, all.delay_s, Effort::Coarse)?)
        })?;
        errors[all.poles.len()] = held_out(set, &folds, &models);
    }
    Ok(errors)
}

/// Hold-out errors for 0, 1, 2, … modes, until more do not help.
fn tried(set: &Set, options: &ResponseOptions, folds: &[Vec<usize>]) -> Result<Vec<f64>, Failure> {
    let most = MOST_MODES.min(set.band.len() / 6);
    let training = training(set, options, folds);
    let mut models: Vec<Modal> = training
        .iter()
        .map(|d| d.fit(&[], 0.0, Effort::Coarse))
        .collect::<Result<_, _>>()?;
    let error = |models: &[Modal]| held_out(set, folds, models);
    let mut errors = vec![error(&models)];
    let mut since = 0;
    // The error of the response itself, one parameter per line, is a lower bound: once it is reached, more modes would
    // not be chosen.
    let raw = &set.powers.response(Estimator::H1).response[set.band.clone()];
    let floor = set.error(raw);
    let settled = |errors: &[f64]| errors.iter().any(|e| *e <= SLACK * floor);
    while errors.len() <= most && since < PATIENCE && !settled(&errors) {
        models = side_by_side(&training, |data, fold| {
            let grown = grow(data, &models[fold], options)?;
            Ok(grown.unwrap_or_else(|| models[fold].clone()))
        })?;
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let now = error(&models);
        since = if now < 0.99 * least { 0 } else { since + 1 };
        errors.push(now);
    }
    Ok(errors)
}

/// A model for each fold, each in its own thread.
fn side_by_side(
    training: &[Data],
    fit: impl Fn(&Data, usize) -> Result<Modal, Failure> + Sync,
) -> Result<Vec<Modal>, Failure> {
    let fit = &fit;
    std::thread::scope(|scope| {
        let handles: Vec<_> = training
            .iter()
            .enumerate()
            .map(|(fold, data)| scope.spawn(move || fit(data, fold)))
            .collect();
        handles
            .into_iter()
            .map(|handle| handle.join().expect("a fit does not panic"))
            .collect()
    })
}

/// A coarse fit of `count` modes, added one by one.
fn grown(data: &Data, options: &ResponseOptions, count: usize) -> Result<Modal, Failure> {
    let mut fitted = data.fit(&[], 0.0, Effort::Coarse)?;
    for _ in 0..count {
        fitted = grow(data, &fitted, options)?.unwrap_or(fitted);
    }
    Ok(fitted)
}
