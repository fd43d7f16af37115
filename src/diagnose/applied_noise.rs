//! Detection of effects that only remove the response of a model to noise on the applied quantity.
//!
//! The stand responds to the true applied quantity, the model to its recorded value including noise. A gap, or friction
//! that blocks small motions, passes less of this noise, so the error falls although the stand has no such effect. With
//! twice the noise it falls by as much again, unlike for a real effect: as in simulation extrapolation (J. R. Cook, L.
//! A. Stefanski, J. Am. Stat. Assoc. 89 (1994), 1314).

use std::cell::OnceCell;
use std::sync::Arc;

use torqcomp_model::simulate::Excitation;

use super::blocks::SplitMix64;
use super::noise_floor::noise_of_input;
use super::record::{InitialState, StandRecord};
use super::records::Records;
use super::score::ScoredModel;
use super::unexplained::raw_residual;
use torqcomp_dsp::dot;

/// Fraction of a gain above which it is attributed to noise.
const MOSTLY: f64 = 0.5;
/// A gain of so many times the power of the plain stand's response to the noise is not due to it, whatever a strongly
/// nonlinear model, which may have several motions for one input, does with further noise.
const FAR_MORE: f64 = 10.0;

/// Comparison of models on records with noise on their applied quantity.
pub struct AppliedNoise<'a> {
    records: &'a Records,
    /// Made for the first comparison; `None` if the applied quantity has no detectable noise.
    noisier: OnceCell<Option<NoisierRecords>>,
}

impl<'a> AppliedNoise<'a> {
    pub fn of(records: &'a Records) -> Self {
        Self {
            records,
            noisier: OnceCell::new(),
        }
    }

    /// Whether a model explains more than another beyond removing the response to that noise.
    pub fn bears_out(&self, before: &ScoredModel, after: &ScoredModel) -> bool {
        let noisier = self
            .noisier
            .get_or_init(|| NoisierRecords::of(self.records));
        let noisier = noisier.as_ref();
        noisier.is_none_or(|noisier| noisier.bear_out(before, after))
    }
}

/// Records for comparing models with the noise on their applied quantity doubled: once with further noise added, once
/// with it subtracted, so that its products with the existing noise cancel.
struct NoisierRecords {
    added: Vec<StandRecord>,
    taken_off: Vec<StandRecord>,
    /// Records whose input is the noise alone and whose measured quantity is zero.
    alone: Vec<StandRecord>,
    /// Whether they are the training records, for which each model has initial states.
    are_fitted: bool,
}

impl NoisierRecords {
    /// `None` if the applied quantity has no detectable noise.
    fn of(records: &Records) -> Option<Self> {
        let are_fitted = records.holdout.is_empty();
        let compared = match are_fitted {
            true => &records.train,
            false => &records.holdout,
        };
        let mut random = SplitMix64(0xA5A5_1F3D_66E4_9B27);
        let mut found = Self {
            added: Vec::new(),
            taken_off: Vec::new(),
            alone: Vec::new(),
            are_fitted,
        };
        let mut has_noise = false;
        for record in compared {
            let std = noise_of_input(record.input.samples()).sqrt();
            has_noise |= std > 0.0;
            let count = record.input.samples().len();
            let noise: Vec<f64> = (0..count).map(|_| std * random.normal()).collect();
            let with = |sign: f64| {
                let samples = record.input.samples().iter().zip(&noise);
                excited_by(record, samples.map(|(u, e)| u + sign * e).collect())
            };
            found.added.push(with(1.0));
            found.taken_off.push(with(-1.0));
            found.alone.push(StandRecord {
                measured: Arc::new(vec![0.0; count]),
                initial: InitialState::default(),
                ..excited_by(record, noise)
            });
        }
        has_noise.then_some(found)
    }

    /// Whether a model explains more than another beyond removing the response to noise on the applied quantity.
    fn bear_out(&self, before: &ScoredModel, after: &ScoredModel) -> bool {
        let gain = after.against(before).gain();
        if gain > FAR_MORE * self.passed_by(before) {
            return true;
        }
        let [Some(noisy_before), Some(noisy_after)] = [before, after].map(|m| self.left_by(m))
        else {
            return true;
        };
        let of_noise = (noisy_before - noisy_after) - gain;
        of_noise <= MOSTLY * gain
    }

    /// Mean residual sum of squares of a model on both; `None` if the motion diverges.
    fn left_by(&self, model: &ScoredModel) -> Option<f64> {
        let sum = |records: &[StandRecord]| -> Option<f64> {
            let records = match self.are_fitted {
                true => model.fitted.with_initial_states(records),
                false => records.to_vec(),
            };
            let left = records.iter().map(|r| model.fitted.residual(r));
            left.map(|r| r.map(|r| dot(&r.samples, &r.samples))).sum()
        };
        Some(0.5 * (sum(&self.added)? + sum(&self.taken_off)?))
    }

    /// Sum of squares of the response of a model's plain stand to the noise.
    fn passed_by(&self, model: &ScoredModel) -> f64 {
        let fitted = &model.fitted;
        let (plain, values) = fitted.structure.reduced(&fitted.values, |_| false);
        let chain = plain.model(&values).0;
        let response = |record| raw_residual(&chain, record).map(|r| dot(&r, &r));
        let sums: Result<Vec<f64>, _> = self.alone.iter().map(response).collect();
        sums.map_or(f64::INFINITY, |sums| sums.iter().sum())
    }
}

/// A record with another input.
fn excited_by(record: &StandRecord, samples: Vec<f64>) -> StandRecord {
    let input = &record.input;
    let other = Excitation::new(samples, input.rate_hz(), input.start_s(), input.substeps());
    StandRecord {
        input: Arc::new(other.with_between(input.between())),
        ..record.clone()
    }
}
