//! Where the fit of an effect starts: near the size that the residual asks for.

use super::candidate::{Base, Records};
use super::fit::difference;
use super::record::dot;
use super::spectra::Peak;
use super::structure::{Choice, Structure};

/// Starts that are fitted.
const FITTED: usize = 2;
/// Starts whose size is set right.
const SIZED: usize = 4;
/// Least and greatest factor on the size of a start.
const FACTORS: [f64; 2] = [1e-3, 4.0];

/// Start values of the effect's own parameters.
#[must_use]
pub fn own(choice: Choice, peaks: &[Peak]) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = choice.form.starts.iter().map(|s| s.to_vec()).collect();
    if choice.is_line() {
        // Lines in the data that may be the one.
        let first = &choice.form.parameters[0];
        let near = peaks.iter().map(|p| p.frequency_hz);
        let near = near.filter(|f| (first.lower..=first.upper).contains(f));
        all.extend(near.map(|frequency_hz| vec![frequency_hz]));
    }
    all
}

/// What a start leaves of the training residual, with what a change of the base's own parameters can do left in.
pub struct Trial {
    /// Values of all parameters.
    pub values: Vec<f64>,
    /// Sum of squares that is left.
    pub left: f64,
    /// Fall of the sum of squares with the right size of what the start adds, to first order.
    fall: f64,
    /// That size.
    factor: f64,
}

/// The starts that leave least: each as it is and with the size that the residual asks for.
#[must_use]
pub fn best(
    base: &Base,
    structure: &Structure,
    own: Vec<Vec<f64>>,
    records: &Records,
) -> Vec<Trial> {
    let Some(choice) = structure.choices.last() else {
        return Vec::new();
    };
    let size = choice
        .form
        .parameters
        .iter()
        .position(|p| p.lower <= 0.0 && p.upper >= 0.0);
    let whole = |own: &[f64]| {
        let plain = &base.judged.fitted.values;
        let together = [plain.as_slice(), &own[..choice.moved()]].concat();
        with_stiffness_shared(structure, together)
    };
    let try_one = |own: &Vec<f64>| attempt(base, structure, whole(own), records);
    let mut trials: Vec<(Vec<f64>, Trial)> = own
        .into_iter()
        .filter_map(|own| try_one(&own).map(|trial| (own, trial)))
        .collect();
    trials.sort_by(|(_, a), (_, b)| b.fall.total_cmp(&a.fall));
    if let Some(place) = size.filter(|_| !choice.is_line()) {
        let bounds = &choice.form.parameters[place];
        let sized: Vec<(Vec<f64>, Trial)> = trials
            .iter()
            .take(SIZED)
            .filter_map(|(own, trial)| {
                let mut own = own.clone();
                let factor = trial.factor.abs().clamp(FACTORS[0], FACTORS[1]);
                let signed = factor.copysign(trial.factor) * own[place];
                own[place] = if (bounds.lower..=bounds.upper).contains(&signed) {
                    signed
                } else {
                    FACTORS[0] * own[place]
                };
                try_one(&own).map(|trial| (own, trial))
            })
            .collect();
        trials.extend(sized);
    }
    trials.sort_by(|(_, a), (_, b)| a.left.total_cmp(&b.left));
    trials.into_iter().take(FITTED).map(|(_, t)| t).collect()
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

fn attempt(
    base: &Base,
    structure: &Structure,
    values: Vec<f64>,
    records: &Records,
) -> Option<Trial> {
    let (model, waves) = structure.model(&values);
    let judged = &base.judged;
    let (mut left, mut along, mut size) = (0.0, 0.0, 0.0);
    let each = records
        .train
        .iter()
        .zip(&judged.fitted.begins)
        .zip(&judged.train)
        .zip(base.slopes.iter().zip(&base.cleared));
    for (((record, begin), before), (slopes, cleared)) in each {
        let mut record = record.clone();
        record.begin = *begin;
        if waves.disturb() {
            let mut residual = before.samples.clone();
            record
                .nuisance(&records.reference, &waves, None)
                .clear(&mut residual);
            left += dot(&residual, &residual);
            continue;
        }
        let mut moved = difference(&model, &record).ok()?;
        cleared.clear(&mut moved);
        let pairs = before.samples.iter().zip(&moved);
        let mut change: Vec<f64> = pairs.map(|(b, m)| b - m).collect();
        slopes.clear(&mut change);
        let rest: Vec<f64> = before
            .samples
            .iter()
            .zip(&change)
            .map(|(b, c)| b - c)
            .collect();
        left += dot(&rest, &rest);
        along += dot(&change, &before.samples);
        size += dot(&change, &change);
    }
    let factor = if size > 0.0 { along / size } else { 0.0 };
    Some(Trial {
        values,
        left,
        fall: if waves.disturb() {
            -left
        } else {
            along * factor
        },
        factor,
    })
}
