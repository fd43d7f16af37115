//! The search: every effect put to the model, the best taken if it helps beyond chance.

use std::sync::atomic::{AtomicUsize, Ordering};

use torqcomp_model::effects::{EFFECTS, Effect};

use super::candidate::{
    Base, Judged, Records, begin, choices, finish, first_look, judge, second_look,
};
use super::fit::Fitted;
use super::spectra::{Peak, lines};
use super::structure::Choice;
use crate::parallel::parallel;

/// What became of an effect that was tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// It is added to the model.
    Accepted,
    /// It is not.
    Rejected,
    /// The data cannot tell it from the one that is added.
    Indistinguishable,
}

/// An effect that was tried, in its best form.
pub struct Tried<'a> {
    /// The effect.
    pub effect: &'static Effect,
    /// The model with it; `None` if no fit came out.
    pub judged: Option<Judged<'a>>,
    /// Probability of its gain by chance.
    pub p_value: Option<f64>,
    /// What became of it.
    pub status: Status,
    /// Why.
    pub why: String,
}

/// Least fall of the held-out sum of squares, in variances of the residual.
const LEAST_GAIN: f64 = 40.0;
/// Least relative fall of the held-out sum of squares.
const LEAST_SHARE: f64 = 0.005;
/// Least significance over the blocks of the held-out records.
const LEAST_SIGNIFICANCE: f64 = 3.0;
/// Significance up to which one effect counts as no better than another.
const WITHIN_CHANCE: f64 = 2.33;
/// Forms that get a first look, by what their starts leave; beside an effect, where each look costs more.
const MOST_LOOKS: [usize; 2] = [usize::MAX, 12];
/// Gain of a first look, over the largest of all, from which on a second one follows; beside an effect that is accepted
/// already, where each look costs more and finds less.
const FOLLOWED_UP: [f64; 2] = [0.03, 0.1];
/// Gain of a second look, over the largest of all, from which on a fit is taken to its end.
const PROMISING: f64 = 0.5;
/// Least such gain in variances of the residual: what does not pay for a parameter is not taken on.
const PAYS: f64 = 5.0;
/// Forms that are fitted to the end at most, ties aside; and beside an effect.
const MOST_FITS: [usize; 2] = [12, 4];
/// Difference of the criterion on all records that counts as none.
const SAME: f64 = 4.0;
/// Lines of the residual's spectrum that may be that of a shaft.
const PEAKS: usize = 3;
/// Prominence of a line over the spectrum around it.
const PROMINENT: f64 = 12.0;

/// Puts every effect to a base model and says which one, if any, is accepted: the first of the result then.
pub fn try_all<'a>(
    base: &Base<'a>,
    records: &Records,
    threads: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Vec<Tried<'a>> {
    let peaks = peaks(base, records);
    let present = &base.judged.fitted.structure.choices;
    let gain_is_free = base.judged.fitted.structure.frame.gain_is_free;
    let jobs: Vec<Choice> = EFFECTS
        .iter()
        .filter(|e| present.iter().all(|c| c.effect.name != e.name))
        .filter(|e| !(gain_is_free && e.name == "gain-error"))
        .flat_map(|e| choices(e))
        .collect();
    let fits = fit_all(base, &jobs, &peaks, records, threads, progress);
    let mut tried: Vec<Tried> = Vec::new();
    for (choice, judged) in jobs.iter().zip(fits) {
        match tried
            .last_mut()
            .filter(|t| std::ptr::eq(t.effect, choice.effect))
        {
            Some(last) => {
                let better = judged.as_ref().is_some_and(|new| {
                    last.judged
                        .as_ref()
                        .is_none_or(|old| new.criterion() < old.criterion())
                });
                if better {
                    last.judged = judged;
                }
            }
            None => tried.push(Tried {
                effect: choice.effect,
                judged,
                p_value: None,
                status: Status::Rejected,
                why: String::new(),
            }),
        }
    }
    decide(base, &mut tried);
    tried
}

/// The best fit of each form, judged: those whose starts leave least get a first look (all of them, unless there is an
/// effect already), those that lower the training error a second one, and those
/// that lower it nearly most a fit to the end. How much work that is depends on the records alone, not on the clock.
pub(super) fn fit_all<'a>(
    base: &Base<'a>,
    jobs: &[Choice],
    peaks: &[Peak],
    records: &Records,
    threads: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Vec<Option<Judged<'a>>> {
    let whole = base.judged.fitted.train_sum;
    let variance = base.judged.train_rms().powi(2);
    let later = usize::from(!base.judged.fitted.structure.choices.is_empty());
    let started = parallel(jobs.len(), threads, |k| {
        begin(base, jobs[k], peaks, records)
    });
    let left = |k: usize| {
        started[k]
            .iter()
            .map(|t| t.left)
            .fold(f64::INFINITY, f64::min)
    };
    let mut looked: Vec<usize> = (0..jobs.len()).collect();
    looked.sort_by(|a, b| left(*a).total_cmp(&left(*b)));
    looked.truncate(MOST_LOOKS[later]);
    let done = AtomicUsize::new(0);
    let first = parallel(jobs.len(), threads, |k| {
        let from = if looked.contains(&k) {
            started[k].as_slice()
        } else {
            &[]
        };
        let found = first_look(base, jobs[k], from, records);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len());
        found
    });
    let most = first.iter().flatten().map(|f| whole - f.train_sum);
    let least = FOLLOWED_UP[later] * most.fold(0.0, f64::max);
    let second = parallel(jobs.len(), threads, |k| {
        let looks = first[k].iter().map(|look| {
            let followed = !look.converged && whole - look.train_sum >= least;
            let found = followed.then(|| second_look(look, records)).flatten();
            found.unwrap_or_else(|| look.clone())
        });
        looks.min_by(|a, b| a.train_sum.total_cmp(&b.train_sum))
    });
    let gain = |look: &Option<Fitted>| look.as_ref().map_or(0.0, |f| whole - f.train_sum);
    let mut gains: Vec<f64> = second.iter().map(gain).collect();
    gains.sort_by(|a, b| b.total_cmp(a));
    let least = gains
        .get(MOST_FITS[later])
        .copied()
        .unwrap_or(0.0)
        .max(PROMISING * gains.first().copied().unwrap_or(0.0))
        .max(PAYS * variance);
    parallel(jobs.len(), threads, |k| {
        // A form that only raises the training error is not worth judging.
        let look = second[k].as_ref().filter(|f| f.train_sum < whole)?;
        let done = look.converged && !look.integrates() || gain(&second[k]) < least;
        let taken_on = if done { None } else { finish(look, records) };
        judge(taken_on.unwrap_or_else(|| look.clone()), records)
    })
}

/// Lines of the residual that stand out.
fn peaks(base: &Base, records: &Records) -> Vec<Peak> {
    let rate_hz = records.train[0].input.rate_hz();
    let longest = records.train.iter().map(|r| r.count()).max().unwrap_or(1);
    let residuals: Vec<(&[f64], f64)> = base
        .judged
        .train
        .iter()
        .map(|r| (r.samples.as_slice(), rate_hz))
        .collect();
    let from_hz = 3.0 * rate_hz / longest as f64;
    let mut found = lines(&residuals, from_hz, 0.45 * rate_hz, 4 * PEAKS);
    found.retain(|p| p.prominence > PROMINENT);
    found.truncate(PEAKS);
    found
}

fn decide<'a>(base: &Base<'a>, tried: &mut [Tried<'a>]) {
    let before = &base.judged;
    let mut passing: Vec<usize> = Vec::new();
    for (k, one) in tried.iter_mut().enumerate() {
        let Some(judged) = &one.judged else {
            one.why = "not followed: its first steps do not lower the error on the training records, or nothing in them suggests where to start".to_owned();
            continue;
        };
        let comparison = judged.against(before);
        one.p_value = comparison.p_value();
        match refusal(judged, before) {
            Some(why) => one.why = why,
            None => passing.push(k),
        }
    }
    let hold = |k: usize| {
        tried[k]
            .judged
            .as_ref()
            .map_or(f64::INFINITY, Judged::hold_rms)
    };
    let Some(best) = passing
        .iter()
        .copied()
        .min_by(|a, b| hold(*a).total_cmp(&hold(*b)))
    else {
        return;
    };
    let tied: Vec<usize> = passing
        .iter()
        .copied()
        .filter(|k| is_tied(tried, *k, best))
        .collect();
    let simplest = best_of(tried, &tied).unwrap_or(best);
    name_all(tried, &passing, &tied, simplest);
    tried.swap(0, simplest);
}

/// Why an effect is not accepted, as far as it alone tells.
pub(super) fn refusal(judged: &Judged, before: &Judged) -> Option<String> {
    let comparison = judged.against(before);
    let (gain, variance) = (comparison.gain(), judged.hold_rms().powi(2));
    let total = before.hold_rms().powi(2) * before.held_out().len() as f64;
    if gain <= 0.0 {
        return Some(format!(
            "the error on the held-out records does not fall (it changes by {:+.2} %)",
            100.0 * (judged.hold_rms() / before.hold_rms() - 1.0)
        ));
    }
    if gain < LEAST_GAIN * variance || comparison.significance() < LEAST_SIGNIFICANCE {
        return Some(format!(
            "the error on the held-out records falls by no more than chance, seen from stretch to stretch ({:+.2} % over all)",
            100.0 * (judged.hold_rms() / before.hold_rms() - 1.0)
        ));
    }
    if gain < LEAST_SHARE * total {
        return Some(format!(
            "it explains {:.2} % of the power of the residual: too little to tell from what else is not exact",
            100.0 * gain / total
        ));
    }
    if let Some(name) = judged.lacks() {
        return Some(format!(
            "its {name} is not different from zero: what it then describes is not what its name says"
        ));
    }
    if judged.criterion() >= before.criterion() {
        return Some("it does not pay for its parameters on the training records".to_owned());
    }
    None
}

/// Whether an effect is within chance of the best one.
fn is_tied(tried: &[Tried], k: usize, best: usize) -> bool {
    let (Some(one), Some(other)) = (&tried[k].judged, &tried[best].judged) else {
        return false;
    };
    let comparison = other.against(one);
    k == best
        || comparison.significance() < WITHIN_CHANCE
        || comparison.gain() < 9.0 * other.hold_rms().powi(2)
}

/// Of effects that the held-out records do not tell apart: the one with the least criterion on all records, which has a
/// price for parameters; of those within a hair of it, the one that stands first in the list: a line on the
/// frequency of the grid is the grid's rather than a shaft's by chance, a lag without a corner is a delay.
fn best_of(tried: &[Tried], tied: &[usize]) -> Option<usize> {
    let criterion = |k: &usize| {
        let judged = tried[*k].judged.as_ref();
        judged.map_or(f64::INFINITY, Judged::pooled_criterion)
    };
    let least = tied.iter().map(criterion).fold(f64::INFINITY, f64::min);
    let place = |k: &usize| {
        EFFECTS
            .iter()
            .position(|e| std::ptr::eq(*e, tried[*k].effect))
    };
    let near = tied.iter().filter(|k| criterion(k) <= least + SAME);
    near.min_by_key(|k| place(k)).copied()
}

fn name_all(tried: &mut [Tried], passing: &[usize], tied: &[usize], chosen: usize) {
    let Some(judged) = &tried[chosen].judged else {
        return;
    };
    let (own, parameters, name) = (
        judged.hold_rms(),
        judged.parameters(),
        tried[chosen].effect.name,
    );
    for k in passing {
        let Some(other) = &tried[*k].judged else {
            continue;
        };
        let (rms, count) = (other.hold_rms(), other.parameters());
        let (status, why) = if *k == chosen {
            (
                Status::Accepted,
                "the error on the held-out records falls beyond chance, to the least of all"
                    .to_owned(),
            )
        } else if !tied.contains(k) {
            (
                Status::Rejected,
                format!(
                    "it helps, but leaves {:.3} times the held-out error of {name}",
                    rms / own
                ),
            )
        } else if count > parameters {
            (
                Status::Rejected,
                format!("no better than {name}, with more parameters"),
            )
        } else {
            (
                Status::Indistinguishable,
                format!(
                    "within chance of {name}; to tell them apart: {}",
                    tried[*k].effect.experiment
                ),
            )
        };
        tried[*k].status = status;
        tried[*k].why = why;
    }
}
