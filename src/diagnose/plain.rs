//! The plain stand, fitted as well as possible, so that a wrong constant is not reported as a missing effect.

use std::sync::Arc;

use torqcomp_model::fit::FitError;
use torqcomp_model::simulate::MotionState;

use super::declared::DeclaredStand;
use super::fit::{FitEffort, FittedModel, correct_starts};
use super::record::{NuisanceTerms, StandRecord};
use super::residual_tests::without_mean;
use super::several_modes::fit_with_modes;
use super::structure::{FitContext, PlainStand, Structure};
use crate::failure::{ErrorCode, Failure};
use torqcomp_dsp::{dot, peaks, sort_by_number};

/// Natural frequencies tried per decade where none is declared.
const PER_DECADE: f64 = 24.0;
/// Damping ratios tried.
const DAMPING: [f64; 4] = [0.01, 0.05, 0.2, 0.7];
/// Damping ratios tried at a line of a free decay.
const RINGING: [f64; 5] = [3e-4, 1e-3, 3e-3, 0.01, 0.04];
/// Factors tried on the declared frequency.
const NEAR: [f64; 9] = [0.5, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.4, 2.0];
/// Number of starts that get a full fit.
const FULL: usize = 3;

const SEARCH: FitEffort = FitEffort::full(60);
const REFINEMENT: FitEffort = FitEffort::full(10);

/// Finds the best-fitting plain stand of the records, and its context.
///
/// # Errors
/// If no start leads to a fit.
pub fn find_plain(
    context: &FitContext,
    declared: Option<PlainStand>,
    records: &[StandRecord],
) -> Result<FitContext, Failure> {
    let of_several = declared.filter(|_| context.several.is_some());
    let starts = match of_several {
        Some(declared) => vec![(0.0, declared)],
        None => scan(context, declared, records),
    };
    let fits = starts.into_iter().take(FULL).filter_map(|(_, start)| {
        let context = Arc::new(context.at(start));
        let values = context.plain_values(&start);
        fit_with_modes(Structure::plain(context), &values, records, SEARCH).ok()
    });
    let best = fits.min_by(|a, b| a.train_sum.total_cmp(&b.train_sum));
    let best = best.ok_or_else(|| {
        ErrorCode::NotIdentifiable
            .failed("the plain stand could not be fitted to the training records")
    })?;
    let found = FitContext {
        several: best.structure.context.several.clone(),
        ..context.clone()
    };
    Ok(found.at(best.stand()))
}

/// The plain stand of a context, refitted with the current samples and steps of the records; with the effects of the
/// stand file, starting from their declared values.
///
/// # Errors
/// If it cannot be fitted.
pub fn refine_plain(
    context: FitContext,
    declared: Option<DeclaredStand>,
    train: &[StandRecord],
) -> Result<FittedModel, Failure> {
    let declared = declared.filter(|declared| !declared.effects.is_empty());
    let context = Arc::new(context);
    let Some(declared) = declared else {
        let values = context.plain_values(&context.plain);
        let structure = Structure::plain(context);
        return fit_with_modes(structure, &values, train, REFINEMENT)
            .map_err(Failure::of(ErrorCode::NotIdentifiable));
    };
    // The declared constants belong with the effects; those of a plain stand without effects may be
    // closer.
    let fitted = DeclaredStand {
        plain: context.plain,
        ..declared
    };
    let fits = [declared, fitted].map(|stand| {
        let (structure, values) = (stand.structure(context.clone()), stand.values(&context));
        let (model, _) = structure.model(&values);
        let mut train = train.to_vec();
        if model.is_integrated() {
            // From rest, the phase of a free decay would find no minimum.
            correct_starts(&structure, &values, &mut train, &model.free_mode());
        }
        let fitted = fit_with_modes(structure, &values, &train, REFINEMENT)?;
        let on = |fit: &FittedModel| {
            fit.refit(&train, REFINEMENT)
                .unwrap_or_else(|_| fit.clone())
        };
        let is_free = model.is_integrated() && train.iter().all(StandRecord::is_free);
        Ok::<_, FitError>(match is_free {
            true => fitted.on_both_sides(on),
            false => fitted,
        })
    });
    let [declared, fitted] = fits;
    match (declared, fitted) {
        (Ok(declared), Ok(fitted)) if fitted.train_sum < declared.train_sum => Ok(fitted),
        (Ok(declared), _) => Ok(declared),
        (Err(_), fitted) => fitted.map_err(Failure::of(ErrorCode::NotIdentifiable)),
    }
}

/// Sum of squares for each start on a coarse grid, in ascending order.
fn scan(
    context: &FitContext,
    declared: Option<PlainStand>,
    records: &[StandRecord],
) -> Vec<(f64, PlainStand)> {
    let record = &records[0];
    let mut starts = starts(context, declared, record);
    starts.extend(from_ringing(context, record));
    let starts = starts.into_iter();
    let mut found: Vec<(f64, PlainStand)> = starts
        .filter_map(|start| try_start(context, start, record))
        .collect();
    sort_by_number(&mut found, |(left, _)| *left);
    found
}

/// A coarse grid of plain stands: near the declared one, or over the observable range.
pub fn starts(
    context: &FitContext,
    declared: Option<PlainStand>,
    record: &StandRecord,
) -> Vec<PlainStand> {
    let frequencies: Vec<f64> = match declared {
        Some(declared) => NEAR.iter().map(|n| n * declared.natural_hz).collect(),
        None => {
            let rate_hz = record.rate_hz();
            let lowest = 2.0 * rate_hz / record.count() as f64;
            let count = ((0.45 * rate_hz / lowest).log10() * PER_DECADE).ceil() as i32;
            let frequency = |k| lowest * 10_f64.powf(f64::from(k) / PER_DECADE);
            (0..=count).map(frequency).collect()
        }
    };
    let mut damping = DAMPING.to_vec();
    damping.extend(declared.map(|d| d.damping_ratio.max(1e-4)));
    let gain = context.plain.gain;
    let pairs = frequencies.iter().flat_map(|natural_hz| {
        let stand = move |damping_ratio: &f64| PlainStand {
            natural_hz: *natural_hz,
            damping_ratio: *damping_ratio,
            gain,
        };
        damping.iter().map(stand)
    });
    pairs.collect()
}

/// Plain stands at the strongest line of a record, for a lightly damped resonance, which falls between the grid points.
fn from_ringing(context: &FitContext, record: &StandRecord) -> Vec<PlainStand> {
    let y = without_mean(record.measured_in_range());
    let rate_hz = record.rate_hz();
    let lowest_hz = 2.0 * rate_hz / y.len() as f64;
    let line = peaks::strongest(&y, rate_hz, lowest_hz, 0.5 * rate_hz);
    let stand = |natural_hz| {
        RINGING.map(|damping_ratio| PlainStand {
            natural_hz,
            damping_ratio,
            gain: context.plain.gain,
        })
    };
    line.map_or_else(Vec::new, |line| stand(line.frequency_hz).to_vec())
}

/// Sum of squares of a start; with the optimum gain, if that is free.
fn try_start(
    context: &FitContext,
    mut start: PlainStand,
    record: &StandRecord,
) -> Option<(f64, PlainStand)> {
    if record.is_free() {
        let mut left = record.measured_in_range().to_vec();
        let nuisance = record.nuisance(&start.mode(), &NuisanceTerms::NONE, None);
        nuisance.clear(&mut left);
        return Some((dot(&left, &left), start));
    }
    let is_free = context.gain_is_free;
    if is_free {
        start.gain = 1.0;
    }
    let modelled = context
        .chain(&start)
        .simulate(&record.input, MotionState::default());
    let x = without_mean(&modelled[record.range.clone()]);
    let y = without_mean(record.measured_in_range());
    let (xx, xy, yy) = (dot(&x, &x), dot(&x, &y), dot(&y, &y));
    if !(xx > 0.0 && xx.is_finite()) {
        return None;
    }
    if is_free {
        start.gain = xy / xx;
        return (start.gain != 0.0).then(|| (yy - xy * xy / xx, start));
    }
    Some((yy - 2.0 * xy + xx, start))
}

/// Sets the initial state of each record to that of the plain stand.
pub fn set_starts(plain: &FittedModel, records: &mut [StandRecord]) {
    let (model, _) = plain.structure.model(&plain.values);
    for record in records {
        let Some(found) = plain.residual(record) else {
            continue;
        };
        if model.is_integrated() {
            record.initial.motion = found.record.initial.motion;
            continue;
        }
        let [x, speed] = model.state_at_start(&record.input);
        let [dx, dspeed] = found.nuisance.motion.unwrap_or_default();
        let of_modes = found.nuisance.of_modes;
        record.initial.motion = MotionState {
            x: x + dx + of_modes.x,
            speed: speed + dspeed * plain.free.omega_rad_s + of_modes.speed,
        };
    }
}
