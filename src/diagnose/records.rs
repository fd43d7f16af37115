//! The training and held-out records of a diagnosis.

use std::sync::Arc;

use torqcomp_model::simulate::{Between, Excitation, substeps};

use super::intersample::{from_inputs, noise_on_plateaus};
use super::record::StandRecord;
use super::structure::FitContext;

#[derive(Clone)]
pub struct Records {
    /// Records for fitting and model selection.
    pub train: Vec<StandRecord>,
    /// Records for the reported errors. Empty during model selection.
    pub holdout: Vec<StandRecord>,
}

/// Samples always excluded at both ends, where the extrapolation beyond the record matters most.
pub const EXCLUDED: usize = 32;
/// Fractions of a record excluded at its start and end: a second mode, a filter or a joint decays more slowly than the
/// stand, and a complex stiffness is non-causal.
const EXCLUDED_PARTS: [f64; 2] = [0.04, 0.01];
/// Time constants of the stand excluded at the start: the initial state of recorder and joints has then decayed.
const SETTLING: f64 = 3.0;
/// Largest excluded fraction of a record.
const MOST_EXCLUDED: f64 = 0.1;

/// How much longer the integration steps of a search are than those of a simulation: the model found is refitted with
/// shorter ones as far as that changes it.
const COARSER: f64 = 2.0;

/// Fraction of a training record that is fitted if the rest is held out.
const FITTED: f64 = 0.7;

/// Whether an input consists of plateaus.
fn has_plateaus(input: &Excitation) -> bool {
    noise_on_plateaus(input.samples()).is_some()
}

impl Records {
    /// Holds out the end of each training record.
    pub fn hold_out_ends(&mut self) {
        for record in &mut self.train {
            let count = record.measured.len();
            let cut = (FITTED * count as f64) as usize;
            let mut rest = record.clone();
            rest.range = cut..count;
            record.range.end = cut;
            self.holdout.push(rest);
        }
    }

    /// The training records alone; nothing is held out during model selection.
    pub fn training(&self) -> Self {
        Self {
            train: self.train.clone(),
            holdout: Vec::new(),
        }
    }

    /// Whether all of them are free decays.
    pub fn are_free(&self) -> bool {
        self.train
            .iter()
            .chain(&self.holdout)
            .all(StandRecord::is_free)
    }

    fn all(&mut self) -> impl Iterator<Item = &mut StandRecord> {
        self.train.iter_mut().chain(&mut self.holdout)
    }

    pub fn rate_hz(&self) -> f64 {
        self.train[0].rate_hz()
    }

    /// Integration steps per sample.
    pub fn substeps(&self) -> usize {
        self.train[0].input.substeps()
    }

    pub fn set_substeps(&mut self, substeps: usize) {
        self.change_inputs(|input| {
            (input.substeps() != substeps).then(|| input.with_substeps(substeps))
        });
    }

    /// The same records with another waveform of the input between its samples. If other training inputs are present,
    /// plateau inputs remain held; with held plateau inputs only, other inputs are band-limited.
    pub fn with_between(&self, between: Between) -> Self {
        let only_plateaus = from_inputs(&self.train) == Between::Held;
        let mut other = self.clone();
        other.change_inputs(|input| {
            let own = match (has_plateaus(input), only_plateaus, between) {
                (true, false, _) => Between::Held,
                (false, true, Between::Held) => Between::BandLimited,
                _ => between,
            };
            (input.between() != own).then(|| input.with_between(own))
        });
        other
    }

    /// Waveform of the input between its samples; that of plateau inputs only if no training record has
    /// another input.
    pub fn between(&self) -> Between {
        let is_other = |r: &&StandRecord| !r.is_free() && !has_plateaus(&r.input);
        let other = self.train.iter().find(is_other);
        other.unwrap_or(&self.train[0]).input.between()
    }

    /// Changes applied and measured quantities; shared ones remain shared.
    pub fn change_records(&mut self, change: impl Fn(&StandRecord) -> StandRecord) {
        let mut made: Vec<(Arc<Excitation>, StandRecord)> = Vec::new();
        for record in self.all() {
            let known = made.iter().find(|(old, _)| Arc::ptr_eq(old, &record.input));
            let new = match known {
                Some((_, new)) => new.clone(),
                None => {
                    let new = change(record);
                    made.push((record.input.clone(), new.clone()));
                    new
                }
            };
            record.input = new.input;
            record.measured = new.measured;
            record.is_held = new.is_held;
        }
    }

    /// Changes the inputs for which there is a change; shared ones remain shared.
    fn change_inputs(&mut self, change: impl Fn(&Excitation) -> Option<Excitation>) {
        let mut made: Vec<(Arc<Excitation>, Arc<Excitation>)> = Vec::new();
        for record in self.all() {
            let known = made.iter().find(|(old, _)| Arc::ptr_eq(old, &record.input));
            let new = match known {
                Some((_, new)) => new.clone(),
                None => {
                    let new = change(&record.input).map_or_else(|| record.input.clone(), Arc::new);
                    made.push((record.input.clone(), new.clone()));
                    new
                }
            };
            record.input = new;
        }
    }

    /// Sets the integration steps and the compared samples for the stand of a context, with or without effects.
    pub fn prepare_for(&mut self, context: &FitContext, has_effects: bool) {
        let rate_hz = self.rate_hz();
        let mode = context.plain.mode();
        let decay = mode.damping_ratio * mode.omega_rad_s / rate_hz;
        // All of a free decay is used: its initial state is estimated, and nothing acts beyond it.
        for record in self.all().filter(|record| !record.is_free()) {
            let count = record.measured.len();
            let most = (MOST_EXCLUDED * count as f64) as usize;
            let [first, last] =
                EXCLUDED_PARTS.map(|part| EXCLUDED.max((part * count as f64) as usize).min(most));
            let settled = ((SETTLING / decay.max(1e-9)) as usize).clamp(first, most);
            record.range.start = record.range.start.max(settled);
            if record.range.end == count {
                record.range.end = count - last;
            }
        }
        let coarser = if has_effects { 1.0 } else { COARSER };
        let steps = substeps(context.highest_hz() / coarser, rate_hz);
        if steps != self.substeps() {
            self.set_substeps(steps);
        }
    }
}
