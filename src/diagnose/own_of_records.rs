//! Fit parameters that belong to a record rather than the stand.

use std::ops::Range;

use torqcomp_model::Chain;
use torqcomp_model::effects::Zero;
use torqcomp_model::fit::Parameter;
use torqcomp_model::simulate::MotionState;

use super::record::StandRecord;

/// Parameters fitted for each record: the displacement under a constant load where it matters, and the initial state of
/// an integrated free decay.
pub struct OwnOfRecords {
    /// Scale of displacement.
    size: f64,
    /// Frequency that converts a speed to a displacement.
    omega_rad_s: f64,
    /// Indices of the records whose displacement under a constant load is a parameter.
    preloaded: Range<usize>,
    /// Indices of the free-decay records.
    ringing: Vec<usize>,
}

impl OwnOfRecords {
    /// Largest displacement under a constant load, relative to the RMS of the record.
    pub const LARGEST_PRELOAD: f64 = 0.5;
    /// Largest initial displacement of a free decay, relative to the RMS of the record.
    const LARGEST_STATE: f64 = 100.0;

    /// For a model, with a scale of displacement.
    pub fn of(model: &Chain, size: f64, records: &[StandRecord]) -> Self {
        let rings = |k: &usize| model.is_integrated() && records[*k].is_free();
        Self {
            size,
            omega_rad_s: model.free_mode().omega_rad_s,
            preloaded: Self::preloaded(model, records.len()),
            ringing: (0..records.len()).filter(rings).collect(),
        }
    }

    /// Records whose displacement under a constant load is a parameter: all, or all but the first if its places are
    /// parameters of the model.
    pub fn preloaded(model: &Chain, records: usize) -> Range<usize> {
        match model.zero() {
            Zero::Any => 0..0,
            Zero::Fixed => 0..records,
            Zero::Placed => 1..records,
        }
    }

    /// Takes the constant load off the records for which it is no parameter: a start from a model for which it was one.
    pub fn unload_others(model: &Chain, records: &mut [StandRecord]) {
        let loaded = Self::preloaded(model, records.len());
        let others = records.iter_mut().enumerate();
        for (_, record) in others.filter(|(k, _)| !loaded.contains(k)) {
            record.initial.preload = 0.0;
        }
    }

    /// Whether record `k` is an integrated free decay.
    pub fn is_ringing(&self, k: usize) -> bool {
        self.ringing.contains(&k)
    }

    /// The parameters, starting from the records' values.
    pub fn parameters(&self, records: &[StandRecord]) -> Vec<Parameter> {
        let limit = Self::LARGEST_PRELOAD;
        let preload = |r: &StandRecord| within(r.initial.preload / self.size, [-limit, limit], 0.1);
        let preloads = records[self.preloaded.clone()].iter().map(preload);
        let states = self.ringing.iter().flat_map(|k| {
            let motion = records[*k].initial.motion;
            [motion.x, motion.speed / self.omega_rad_s].map(|x| {
                within(
                    x / self.size,
                    [-Self::LARGEST_STATE, Self::LARGEST_STATE],
                    1.0,
                )
            })
        });
        preloads.chain(states).collect()
    }

    /// Record `k` with values of these parameters.
    pub fn set(&self, k: usize, record: &StandRecord, values: &[f64]) -> StandRecord {
        let mut record = record.clone();
        let preloads = self.preloaded.len();
        if self.preloaded.contains(&k) {
            record.initial.preload = values[k - self.preloaded.start] * self.size;
        }
        if let Some(place) = self.ringing.iter().position(|ringing| *ringing == k) {
            let state = &values[preloads + 2 * place..];
            record.initial.motion = MotionState {
                x: state[0] * self.size,
                speed: state[1] * self.size * self.omega_rad_s,
            };
        }
        record
    }
}

/// A parameter within bounds.
pub fn within(start: f64, [lower, upper]: [f64; 2], scale: f64) -> Parameter {
    Parameter::new("", start.clamp(lower, upper))
        .at_least(lower)
        .at_most(upper)
        .scaled(scale)
}
