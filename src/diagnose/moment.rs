//! A stand that changes within a record: something came loose, cracked, or was touched.
//!
//! The record is split and a stand is fitted to each part; the split moves to where the first stand before it and the
//! second one after it leave the smallest residual, until it converges. Anything that changes in a record besides the
//! stand (level, or excited frequencies) must be alike on both sides, so that a missing effect is not mistaken for a
//! change.

use std::ops::Range;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;

use super::SearchState;
use super::fit::{FitEffort, FittedModel, fit};
use super::record::StandRecord;
use super::structure::{FitContext, Structure};
use super::verdict::noise_rms;
use torqcomp_dsp::dot;

/// Initial splits, as fractions of a record.
const CUTS: [f64; 3] = [0.25, 0.5, 0.75];
/// Maximum number of rounds of alternating fits of stands and split.
const ROUNDS: usize = 8;
/// Minimum length of a part, in periods of the stand.
const SHORTEST_TURNS: f64 = 20.0;
/// Residual power above the noise with two stands, relative to that with one, up to which the stand counts
/// as changed.
const LEFT: f64 = 0.1;
/// Minimum significant change of a constant, in standard uncertainties.
const SIGNIFICANT: f64 = 5.0;
/// Ratio of level or mean frequency of the input between the parts up to which they count as alike.
const ALIKE: f64 = 1.25;

const FIT: FitEffort = FitEffort::full(20);

/// A change of the stand's constants at a moment.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ChangedStand {
    /// Path of the record.
    pub record: String,
    /// Time of the change since the first sample, in s.
    pub time_s: f64,
    /// Constants before and after.
    pub constants: Vec<ChangedConstant>,
    /// Rms error of one stand over the record, fitted to it alone.
    pub one_stand_rms: f64,
    /// Rms error of two stands, one before and one after the change.
    pub two_stands_rms: f64,
    /// Unit of both errors.
    pub unit: String,
}

/// A constant of the stand on both sides of a moment.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ChangedConstant {
    /// Name of the constant.
    pub name: &'static str,
    /// Unit of the values.
    pub unit: String,
    /// Value before the moment.
    pub before: f64,
    /// Standard uncertainty of `before`; `null` if unknown.
    pub before_std: Option<f64>,
    /// Value after the moment.
    pub after: f64,
    /// Standard uncertainty of `after`; `null` if unknown.
    pub after_std: Option<f64>,
}

/// What is fitted to each part: the stand with the effects that are known, and its values to start from.
struct Base {
    structure: Structure,
    values: Vec<f64>,
}

/// A split record, with a stand for each part.
struct CutRecord {
    /// First sample of the second part.
    at: usize,
    stands: [FittedModel; 2],
}

impl CutRecord {
    fn of(base: &Base, record: &StandRecord, at: usize) -> Option<Self> {
        let [first, second] = parts(record, at);
        let stands = [base.stand_of(&first)?, base.stand_of(&second)?];
        Some(Self { at, stands })
    }

    fn sum(&self) -> f64 {
        self.stands.iter().map(|stand| stand.train_sum).sum()
    }

    /// Residual sum of squares with another split; the second part starts with any motion.
    fn sum_at(&self, record: &StandRecord, at: usize) -> Option<f64> {
        let parts = parts(record, at);
        let left = self.stands.iter().zip(&parts).map(|(stand, part)| {
            let left = stand.residual(part)?.samples;
            Some(dot(&left, &left))
        });
        left.sum()
    }

    /// The same with the split where the residual is smallest: the motion takes some periods to become that of the
    /// second stand, during which the first one fits better.
    fn placed(self, base: &Base, record: &StandRecord, shortest: usize) -> Option<Self> {
        let (mut at, mut sum) = (self.at, self.sum());
        let mut step = shortest / 2;
        while step > 0 {
            let both = [at.saturating_sub(step), at + step];
            let inside = both
                .into_iter()
                .filter(|at| (shortest..=record.measured.len() - shortest).contains(at));
            let tried = inside.filter_map(|at| Some((self.sum_at(record, at)?, at)));
            match tried.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some(found) if found.0 < sum => (sum, at) = found,
                _ => step /= 2,
            }
        }
        Self::of(base, record, at)
    }
}

fn parts(record: &StandRecord, at: usize) -> [StandRecord; 2] {
    [0..at, at..record.measured.len()].map(|part| record.part(part))
}

impl SearchState {
    /// The change that explains most of the residual of a single stand, which is then not due to a law of the
    /// motion.
    pub(super) fn settle_change(&mut self) -> Option<ChangedStand> {
        if self.before.fitted.structure.context.held.is_some() {
            return None;
        }
        // A change beside an effect is one only together with it; such fits take long, and need a reason.
        let mut models = vec![(&self.before, &self.tests_before)];
        if !self.after.effect_names().is_empty() {
            models.push((&self.after, &self.tests));
        }
        models.retain(|(model, tests)| {
            model.fitted.structure.effects.is_empty() || tests.nonstationary().is_some()
        });
        let bases: Vec<Base> = models
            .iter()
            .map(|(model, _)| Base::of(&model.fitted))
            .collect();
        let noise_rms = noise_rms(self.noise_floor);
        let mut records: Vec<&StandRecord> = Vec::new();
        for record in self.records.train.iter().chain(&self.records.holdout) {
            let is_seen = records.iter().any(|seen| seen.source == record.source);
            if !is_seen && !record.is_free() {
                records.push(record);
            }
        }
        let changes = bases.iter().find_map(|base| {
            let changes = records.iter().filter_map(|record| {
                let whole = record.part(0..record.measured.len());
                change_in(base, &whole, noise_rms)
            });
            changes.min_by(|a, b| a.0.total_cmp(&b.0))
        });
        let (_, change) = changes?;
        self.suspected = None;
        Some(change)
    }
}

/// A change within a record, with the fraction of the error power above the noise that remains.
fn change_in(base: &Base, record: &StandRecord, noise_rms: f64) -> Option<(f64, ChangedStand)> {
    let context = &base.structure.context;
    let count = record.measured.len();
    let turns = SHORTEST_TURNS * record.rate_hz() / context.plain.natural_hz;
    let shortest = (turns.ceil() as usize).max(count / 50);
    if count < 2 * shortest {
        return None;
    }
    let one = base.stand_of(record)?;
    let cuts = CUTS.into_iter();
    let cuts =
        cuts.filter_map(|cut| settled(base, record, (cut * count as f64) as usize, shortest));
    let best = cuts.min_by(|a, b| a.sum().total_cmp(&b.sum()))?;
    let best = best.placed(base, record, shortest)?;
    let power = |sum: f64| sum / count as f64;
    let above = |sum: f64| power(sum) - noise_rms * noise_rms;
    let share = above(best.sum()) / above(one.train_sum);
    let parts = [0..best.at, best.at..count];
    if above(one.train_sum) <= 0.0 || share > LEFT || !are_alike(record, &parts) {
        return None;
    }
    let units = &context.units;
    let change = ChangedStand {
        record: record.source.clone(),
        time_s: best.at as f64 / record.rate_hz(),
        constants: changed(context, &best.stands)?,
        one_stand_rms: power(one.train_sum).sqrt() / units.per_printed,
        two_stands_rms: power(best.sum()).sqrt() / units.per_printed,
        unit: units.printed(),
    };
    Some((share, change))
}

impl Base {
    fn of(fitted: &FittedModel) -> Self {
        let context = FitContext {
            plain: fitted.stand(),
            gain_is_free: true,
            ..FitContext::clone(&fitted.structure.context)
        };
        let mut values = context.plain_values(&context.plain);
        let of_effects = fitted.structure.context.plain_count();
        values.extend(&fitted.values[of_effects..]);
        let structure = Structure {
            context: Arc::new(context),
            ..fitted.structure.clone()
        };
        Self { structure, values }
    }

    fn stand_of(&self, record: &StandRecord) -> Option<FittedModel> {
        let record = std::slice::from_ref(record);
        fit(self.structure.clone(), &self.values, record, FIT).ok()
    }
}

/// The converged split, from an initial one.
fn settled(base: &Base, record: &StandRecord, mut at: usize, shortest: usize) -> Option<CutRecord> {
    let count = record.measured.len();
    let mut best: Option<CutRecord> = None;
    for _ in 0..ROUNDS {
        at = at.clamp(shortest, count - shortest);
        let now = CutRecord::of(base, record, at)?;
        let next = least(&now.stands, record)?;
        let is_better = best.as_ref().is_none_or(|best| now.sum() < best.sum());
        if !is_better {
            break;
        }
        let stays = next == at;
        best = Some(now);
        if stays {
            break;
        }
        at = next;
    }
    best
}

/// Where the first stand before the split and the second one after it leave the smallest residual.
fn least(stands: &[FittedModel; 2], record: &StandRecord) -> Option<usize> {
    let [first, second] = stands.each_ref().map(|stand| stand.residual(record));
    let (first, second) = (first?.samples, second?.samples);
    let mut sum = 0.0;
    let mut best = (0.0, 0);
    for (i, (a, b)) in first.iter().zip(&second).enumerate() {
        sum += a * a - b * b;
        if sum < best.0 {
            best = (sum, i + 1);
        }
    }
    Some(best.1)
}

/// Whether level and mean frequency (RMS of the slope over the RMS) of the input are alike in both
/// parts.
fn are_alike(record: &StandRecord, parts: &[Range<usize>; 2]) -> bool {
    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    let [first, second] = parts.clone().map(|part| {
        let applied = &record.input.samples()[part];
        let slopes: Vec<f64> = applied.windows(2).map(|w| w[1] - w[0]).collect();
        [rms(applied), rms(&slopes) / rms(applied)]
    });
    let ratios = first.iter().zip(&second).map(|(a, b)| a / b);
    ratios
        .into_iter()
        .all(|ratio| (1.0 / ALIKE..=ALIKE).contains(&ratio))
}

/// The constants of two stands, if any changes significantly.
fn changed(context: &FitContext, stands: &[FittedModel; 2]) -> Option<Vec<ChangedConstant>> {
    let (gain_unit, gain_scale) = context.units.gain();
    let named = [
        (
            "natural_frequency",
            "Hz".to_owned(),
            context.scales.natural_hz,
        ),
        ("damping_ratio", String::new(), 1.0),
        ("static_gain", gain_unit, gain_scale * context.plain.gain),
    ];
    let constants = named
        .into_iter()
        .enumerate()
        .map(|(k, (name, unit, scale))| {
            let [before, after] = stands.each_ref().map(|stand| stand.values[k] * scale);
            let [before_std, after_std] = stands
                .each_ref()
                .map(|stand| stand.std[k].map(|std| std * scale.abs()));
            ChangedConstant {
                name,
                unit,
                before,
                before_std,
                after,
                after_std,
            }
        });
    let constants: Vec<ChangedConstant> = constants.collect();
    constants
        .iter()
        .any(ChangedConstant::is_significant)
        .then_some(constants)
}

impl ChangedConstant {
    /// Whether the values differ by more than their uncertainties.
    pub fn is_significant(&self) -> bool {
        let std = |std: Option<f64>| std.unwrap_or(f64::INFINITY);
        (self.after - self.before).abs()
            > SIGNIFICANT * std(self.before_std).hypot(std(self.after_std))
    }
}
