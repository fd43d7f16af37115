//! Fit of a model to the training records, and its residual on any record.

use std::f64::consts::TAU;

use torqcomp_fourier::phasors;
use torqcomp_model::fit::{self, Differences, Fit, FitError, Options, Parameter};
use torqcomp_model::{Chain, Mode};

use super::own_of_records::{OwnOfRecords, within};
use super::record::{InitialState, Nuisance, NuisanceFit, NuisanceTerms, StandRecord};
use super::record_model::RecordModel;
use super::structure::{EffectForm, PlainStand, Structure};
use super::unexplained::{Unexplained, raw_residual};
use torqcomp_dsp::dot;

/// A model with fitted values.
#[derive(Clone)]
pub struct FittedModel {
    pub structure: Structure,
    /// Values of its parameters.
    pub values: Vec<f64>,
    /// Their standard uncertainties where identifiable.
    pub std: Vec<Option<f64>>,
    pub converged: bool,
    /// Amplitudes of its lines, from the training records.
    pub amplitudes: Vec<f64>,
    /// Sum of squares of the residuals on the training records.
    pub train_sum: f64,
    /// Initial state of each training record.
    pub initial: Vec<InitialState>,
    /// The mode of the free motion that is removed from the residuals.
    pub free: Mode,
}

/// Residual of a model on a record.
#[derive(Clone)]
pub struct RecordResidual {
    /// The record, with the initial state found for this model.
    pub record: StandRecord,
    /// Measured minus modelled record over the range, without nuisance terms.
    pub samples: Vec<f64>,
    /// The modelled record over the range, without the nuisance terms; for a free decay with them.
    pub modelled: Vec<f64>,
    pub nuisance: NuisanceFit,
}

/// Effort of a fit.
#[derive(Clone, Copy)]
pub struct FitEffort {
    /// Maximum number of evaluations, in multiples of one per parameter and one more.
    pub iterations: usize,
    /// Maximum number of steps that reduce the error.
    pub steps: usize,
    /// Whether to repeat the fit after correcting the initial states of the records.
    pub corrects_start: bool,
}

impl FitEffort {
    /// A full fit.
    pub const fn full(iterations: usize) -> Self {
        Self {
            iterations,
            steps: usize::MAX,
            corrects_start: true,
        }
    }

    /// A fit that only shows whether a longer one is worthwhile.
    pub const fn brief(iterations: usize) -> Self {
        Self {
            iterations,
            steps: iterations + 1,
            corrects_start: false,
        }
    }
}

/// Reduction of the sum of squares at which a fit has converged: relative, or in variances of the residual, whichever is
/// larger. Models are compared by several variances.
const TOLERANCE: f64 = 1e-6;
const TOLERANCE_OF_VARIANCE: f64 = 0.05;
/// Successive steps that only update the derivatives: two or three are nearly as good as new ones, and far cheaper.
const MOST_UPDATES: usize = 3;
/// Correction of a record's initial state, relative to the RMS residual, that makes a second fit worthwhile.
const START_MATTERS: f64 = 0.05;
/// Maximum number of such corrections or refits.
pub(super) const MOST_STARTS: usize = 8;
/// Relative reduction of the sum of squares by a correction that makes the next one worthwhile: an initial state fitted
/// without the effect is corrected only in part while the magnitude of the effect is wrong.
pub(super) const START_SETTLED: f64 = 0.01;

/// Fits a model from start values, clamped to their bounds.
///
/// # Errors
/// If the model cannot be evaluated at the start.
pub fn fit(
    mut structure: Structure,
    start: &[f64],
    records: &[StandRecord],
    effort: FitEffort,
) -> Result<FittedModel, FitError> {
    let mut records = records.to_vec();
    let start = &inside(&structure, start)[..];
    let start_model = structure.model(start).0;
    OwnOfRecords::unload_others(&start_model, &mut records);
    let mut free = start_model.free_mode();
    // For an integrated motion, the initial state is corrected instead.
    let integrates = start_model.is_integrated();
    // For the free decay of a plain stand, the mode of that motion is all there is to fit.
    let rings = !integrates && records.iter().any(StandRecord::is_free);
    let fixed = (!rings).then_some(&free);
    let (mut found, mut modes_move) = minimize(&mut structure, start, &mut records, fixed, effort)?;
    if rings {
        free = structure.model(&found.values).0.free_mode();
    }
    if effort.corrects_start && !rings {
        // The derivatives with respect to the initial states are those at the start of the fit.
        let falls = found.sum_of_squares < (1.0 - START_SETTLED) * found.sum_at_start;
        let mut slopes_move = integrates && falls;
        for _ in 0..MOST_STARTS {
            let free_moves = !integrates && moves_on(&structure, &found.values, &records, &free);
            let starts_move =
                integrates && correct_starts(&structure, &found.values, &mut records, &free);
            if !(free_moves || starts_move || modes_move || std::mem::take(&mut slopes_move)) {
                break;
            }
            // If the free motion of a plain stand's record decays before its end, the mode found is accurate enough for
            // it.
            let follows = free_moves && (!structure.effects.is_empty() || lasts(&records, &free));
            if free_moves {
                free = structure.model(&found.values).0.free_mode();
            }
            let values = &found.values[..start.len()];
            let fixed = (!follows).then_some(&free);
            let next;
            (next, modes_move) = minimize(&mut structure, values, &mut records, fixed, effort)?;
            if follows {
                free = structure.model(&next.values).0.free_mode();
            }
            let has_settled = next.sum_of_squares > (1.0 - START_SETTLED) * found.sum_of_squares;
            found = next;
            if has_settled {
                break;
            }
        }
    }
    let count = structure.bounds().len();
    let mut values = found.values;
    values.truncate(count);
    Ok(FittedModel {
        amplitudes: amplitudes(&structure, &values, &records, &free),
        std: with_std_of_rate(&structure, &found.std[..count], &values, &records),
        structure,
        train_sum: found.sum_of_squares,
        converged: found.stop.converged(),
        initial: records.iter().map(|r| r.initial).collect(),
        values,
        free,
    })
}

/// Minimises the residual without the nuisance terms; the free motion in them is in a fixed mode, which is faster, or
/// in that of the parameters. For an integrated free decay, the initial state is fitted as well, as the whole motion
/// depends on it nonlinearly.
fn minimize(
    structure: &mut Structure,
    start: &[f64],
    records: &mut [StandRecord],
    free: Option<&Mode>,
    effort: FitEffort,
) -> Result<(Fit, bool), FitError> {
    let own = structure.bounds().len();
    let (start_model, terms) = structure.model(start);
    find_spikes(&start_model, &terms, records);
    let of_records = OwnOfRecords::of(&start_model, structure.context.scales.rms, records);
    let mut parameters = parameters(structure, start);
    parameters.extend(of_records.parameters(records));
    let problem = Unexplained::of((structure, start), records, &of_records, free);
    let count: usize = records.iter().map(StandRecord::count).sum();
    let options = Options {
        differences: Differences::Forward,
        most_updates: MOST_UPDATES,
        most_steps: effort.steps,
        tolerance: TOLERANCE.max(TOLERANCE_OF_VARIANCE / count as f64),
        most_evaluations: effort.iterations * (parameters.len() + 1),
        ..Options::default()
    };
    let found = fit::minimize(&problem, &parameters, &options)?;
    let corrected = problem.corrected_modes(&found.values);
    for (k, record) in records.iter_mut().enumerate() {
        *record = of_records.set(k, record, &found.values[own..]);
    }
    let modes_move = corrected.as_ref().is_some_and(|(_, matters)| *matters);
    if let Some((modes, _)) = corrected {
        *structure = structure.clone().with_modes(modes);
    }
    Ok((found, modes_move))
}

/// Values clamped to the bounds of a structure: a parameter of either sign in one form of an effect may be one-sided in
/// another.
fn inside(structure: &Structure, values: &[f64]) -> Vec<f64> {
    let both = values.iter().zip(structure.bounds());
    both.map(|(value, [lower, upper])| value.clamp(lower, upper))
        .collect()
}

/// The structure's parameters.
fn parameters(structure: &Structure, start: &[f64]) -> Vec<Parameter> {
    let own = start.iter().zip(structure.bounds());
    let own = own.map(|(s, bounds)| within(*s, bounds, s.abs().max(1e-4)));
    let mut own: Vec<Parameter> = own.collect();
    // The error has many minima over the rate of spikes, which is found in the residual instead.
    if let Some(rate) = rate_of_spikes(structure) {
        own[rate].fixed = true;
    }
    own
}

/// Index of the rate of a train of spikes.
fn rate_of_spikes(structure: &Structure) -> Option<usize> {
    let train = structure.placed().find(|(effect, _)| effect.is_train());
    train.map(|(_, own)| own.start)
}

/// Standard uncertainties with that of the rate of spikes: over the longest record, the sum of their intervals is known
/// to a sample on either side.
fn with_std_of_rate(
    structure: &Structure,
    std: &[Option<f64>],
    values: &[f64],
    records: &[StandRecord],
) -> Vec<Option<f64>> {
    let mut std = std.to_vec();
    if let Some(rate) = rate_of_spikes(structure) {
        let longest = records.iter().map(StandRecord::count).max().unwrap_or(1);
        std[rate] = Some(values[rate] / (longest as f64 * 3.0_f64.sqrt()));
    }
    std
}

/// Finds the moments of spikes in the residual of each record.
fn find_spikes(model: &Chain, terms: &NuisanceTerms, records: &mut [StandRecord]) {
    for record in records.iter_mut().filter(|_| terms.spikes_hz.is_some()) {
        if let Ok(residual) = raw_residual(model, record) {
            *record = record.clone().with_spikes(terms, &residual);
        }
    }
}

impl RecordResidual {
    pub(super) fn sum_of_squares(&self) -> f64 {
        dot(&self.samples, &self.samples)
    }
}

/// Mean square of the raw residual of a record, and its nuisance terms.
fn nuisance_of(
    (model, terms): &(Chain, NuisanceTerms),
    record: &StandRecord,
    free: &Mode,
) -> Option<(f64, NuisanceFit)> {
    let mut residual = raw_residual(model, record).ok()?;
    let mean_square = dot(&residual, &residual) / residual.len() as f64;
    let nuisance = record.nuisance(free, terms, None);
    Some((mean_square, nuisance.fit(&mut residual)))
}

/// Re-estimates the initial state of each record; returns whether any record changed.
pub(super) fn correct_starts(
    structure: &Structure,
    values: &[f64],
    records: &mut [StandRecord],
    free: &Mode,
) -> bool {
    let model = RecordModel::of(structure, values, *free);
    let mut matters = false;
    for record in records {
        let old = record.initial.motion;
        let Some(found) = model.settled(record) else {
            continue;
        };
        record.initial.motion = found.record.initial.motion;
        let x = record.initial.motion.x - old.x;
        let speed = (record.initial.motion.speed - old.speed) / free.omega_rad_s;
        let mean_square = found.sum_of_squares() / found.samples.len() as f64;
        matters |= x.hypot(speed) > START_MATTERS * mean_square.sqrt();
    }
    matters
}

/// Whether the free motion at the start of a record deviates by more than the residual allows from one in the mode of
/// the current parameters: over ten thousand turns, a mode 1 % off loses its phase.
fn moves_on(structure: &Structure, values: &[f64], records: &[StandRecord], free: &Mode) -> bool {
    let model = structure.model(values);
    let now = model.0.free_mode();
    let fade = |mode: &Mode| mode.damping_ratio * mode.omega_rad_s;
    let apart = (now.omega_rad_s - free.omega_rad_s).hypot(fade(&now) - fade(free));
    records.iter().any(|record| {
        let Some((mean_square, found)) = nuisance_of(&model, record, free) else {
            return false;
        };
        let Some([x, speed]) = found.motion else {
            return false;
        };
        let duration_s = record.range.end as f64 / record.rate_hz();
        let turned = (apart * duration_s.min(1.0 / fade(&now).min(fade(free)))).min(1.0);
        turned * x.hypot(speed) > START_MATTERS * mean_square.sqrt()
    })
}

/// Whether more than a thousandth of a free motion remains at the end of a record.
fn lasts(records: &[StandRecord], free: &Mode) -> bool {
    let fades = |record: &StandRecord| {
        free.damping_ratio * free.omega_rad_s * record.range.end as f64 / record.rate_hz()
    };
    records.iter().any(|record| fades(record) < 1000.0_f64.ln())
}

/// Mean amplitude of each line and of the spikes over the records, in the order of the effects.
fn amplitudes(
    structure: &Structure,
    values: &[f64],
    records: &[StandRecord],
    free: &Mode,
) -> Vec<f64> {
    let model = structure.model(values);
    let terms = &model.1;
    let (mut lines, mut spikes) = (vec![0.0; terms.lines_hz.len()], 0.0);
    if lines.is_empty() && terms.spikes_hz.is_none() {
        return lines;
    }
    for record in records {
        let Some((_, found)) = nuisance_of(&model, record, free) else {
            continue;
        };
        for (sum, [c, s]) in lines.iter_mut().zip(&found.lines) {
            *sum += c.hypot(*s) / records.len() as f64;
        }
        spikes += found.peak_of_spikes(record, terms) / records.len() as f64;
    }
    let mut lines = lines.into_iter();
    let of_effect = |effect: &EffectForm| -> Vec<f64> {
        match effect.is_train() {
            true => vec![spikes],
            false => lines.by_ref().take(effect.amplitudes()).collect(),
        }
    };
    structure.effects.iter().flat_map(of_effect).collect()
}

impl NuisanceFit {
    /// Largest magnitude of the spikes in a record.
    fn peak_of_spikes(&self, record: &StandRecord, terms: &NuisanceTerms) -> f64 {
        let moments = terms.spikes_hz.and_then(|hz| record.spike_moments(hz));
        moments.map_or(0.0, |m| self.spikes.peak(m, record.range.clone()))
    }
}

impl InitialState {
    /// Adds a displacement, and a speed over the free motion's `ω₀`, to the initial state.
    pub(super) fn correct(&mut self, [x, speed]: [f64; 2], free: &Mode) {
        self.motion.x += x;
        self.motion.speed += speed * free.omega_rad_s;
    }
}

impl FittedModel {
    /// Refits the same model from where this fit ended.
    pub fn refit(&self, train: &[StandRecord], effort: FitEffort) -> Result<Self, FitError> {
        let train = self.with_initial_states(train);
        fit(self.structure.clone(), &self.values, &train, effort)
    }

    /// The training records with the initial states that this fit found.
    pub fn with_initial_states(&self, train: &[StandRecord]) -> Vec<StandRecord> {
        let both = train.iter().zip(&self.initial);
        both.map(|(record, initial)| record.starting_from(*initial))
            .collect()
    }

    /// Whether its motion is integrated in time.
    pub fn integrates(&self) -> bool {
        self.structure.model(&self.values).0.is_integrated()
    }

    /// Mode of its plain stand.
    pub fn mode(&self) -> Mode {
        self.structure.mode(&self.values).0
    }

    /// Its plain stand.
    pub fn stand(&self) -> PlainStand {
        self.structure.stand(&self.values)
    }

    /// Nuisance terms of a record. The initial state of an integrated free decay is part of the model instead.
    pub fn nuisance(&self, record: &StandRecord, terms: &NuisanceTerms) -> Nuisance {
        let model = self.record_model();
        let slopes = match record.is_free() {
            true => model.slopes(record),
            false => model.slopes_of_motion(record),
        };
        record.nuisance(&self.free, terms, slopes)
    }

    /// The same with the displacement under an unknown constant load, if the model depends on it.
    pub fn nuisance_under_load(&self, record: &StandRecord, terms: &NuisanceTerms) -> Nuisance {
        record.nuisance(&self.free, terms, self.record_model().slopes(record))
    }

    /// The same for training record `k`, whose load may be part of the model's parameters instead.
    pub fn nuisance_of_training(&self, k: usize, records: &[StandRecord]) -> Nuisance {
        let (model, terms) = self.structure.model(&self.values);
        match OwnOfRecords::preloaded(&model, records.len()).contains(&k) {
            true => self.nuisance_under_load(&records[k], &terms),
            false => self.nuisance(&records[k], &terms),
        }
    }

    fn record_model(&self) -> RecordModel {
        RecordModel::of(&self.structure, &self.values, self.free)
    }

    /// Residual of the fitted model on a record, with only the record's own constants, initial state and phases
    /// estimated. `None` if the motion diverges.
    pub fn residual(&self, record: &StandRecord) -> Option<RecordResidual> {
        self.residual_by(record, RecordModel::settled)
    }

    /// The same with the record's initial state as it is.
    pub fn residual_from(&self, record: &StandRecord) -> Option<RecordResidual> {
        self.residual_by(record, |model, record| model.residual(record.clone()))
    }

    fn residual_by(
        &self,
        record: &StandRecord,
        find: impl Fn(&RecordModel, &StandRecord) -> Option<RecordResidual>,
    ) -> Option<RecordResidual> {
        let model = self.record_model();
        let mut found = find(&model, record)?;
        self.restore_amplitudes(&model.terms, &mut found);
        Some(found)
    }

    /// The phase of a line belongs to the record, its amplitude to the stand: undoes the difference between the
    /// removed and the fitted amplitude.
    fn restore_amplitudes(&self, terms: &NuisanceTerms, found: &mut RecordResidual) {
        let rate_hz = found.record.rate_hz();
        let lines = terms.lines_hz.iter().zip(&found.nuisance.lines);
        for ((frequency_hz, [c, s]), amplitude) in lines.zip(self.amplitudes_of(false)) {
            let own = c.hypot(*s);
            if own == 0.0 {
                continue;
            }
            let excess = 1.0 - amplitude / own;
            let turning = phasors(TAU * frequency_hz / rate_hz, found.record.range.start);
            let turning = turning.take(found.samples.len());
            let line = turning.map(|z| excess * (c * z.re + s * z.im)).collect();
            let line = found.record.weighted(line);
            found
                .samples
                .iter_mut()
                .zip(line)
                .for_each(|(r, l)| *r += l);
        }
        self.restore_spikes(terms, found);
    }

    /// The same for spikes, whose moments and shape belong to the record.
    fn restore_spikes(&self, terms: &NuisanceTerms, found: &mut RecordResidual) {
        let record = &found.record;
        let own = found.nuisance.peak_of_spikes(record, terms);
        let moments = terms.spikes_hz.and_then(|hz| record.spike_moments(hz));
        let amplitude = self.amplitudes_of(true).next();
        let (Some(moments), Some(amplitude), true) = (moments, amplitude, own > 0.0) else {
            return;
        };
        let excess = 1.0 - amplitude / own;
        let shape = &found.nuisance.spikes;
        let train = shape.train(moments, record.range.clone());
        let train = record.weighted(train.map(|s| excess * s).collect());
        let both = found.samples.iter_mut().zip(train);
        both.for_each(|(r, s)| *r += s);
    }

    /// Amplitudes of the spikes, or of the lines.
    fn amplitudes_of(&self, trains: bool) -> impl Iterator<Item = f64> {
        let effects = self.structure.effects.iter();
        let each = effects.flat_map(|e| std::iter::repeat_n(e.is_train(), e.amplitudes()));
        let each = each.zip(&self.amplitudes);
        each.filter(move |(is_train, _)| *is_train == trains)
            .map(|(_, amplitude)| *amplitude)
    }
}

#[cfg(test)]
impl RecordResidual {
    /// The residual of a record at 1 kHz, for tests.
    pub fn made(applied: Vec<f64>, measured: Vec<f64>, samples: Vec<f64>) -> Self {
        use torqcomp_model::simulate::Excitation;
        let record = StandRecord {
            source: "a.csv".to_owned(),
            input: std::sync::Arc::new(Excitation::new(applied, 1000.0, 1.0, 1)),
            range: 0..measured.len(),
            measured: std::sync::Arc::new(measured.clone()),
            initial: InitialState::default(),
            is_held: false,
            whitening: None,
        };
        Self {
            record,
            samples,
            modelled: measured,
            nuisance: NuisanceFit::default(),
        }
    }
}
