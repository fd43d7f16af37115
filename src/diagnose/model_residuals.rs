//! Residuals of a model on records. All models that a search fits are compared with each other, but only a few at a
//! time: the samples of the others are dropped and simulated again when they are needed, from the initial states that
//! were found, which takes a small fraction of the time of a fit.

use std::sync::Arc;

use super::fit::{FittedModel, RecordResidual};
use super::record::StandRecord;

/// Residuals of a model on some records.
#[derive(Clone)]
pub struct ModelResiduals {
    /// The records, with the initial states found for the model.
    records: Arc<[StandRecord]>,
    count: usize,
    sum_of_squares: f64,
    /// The residuals, unless their samples were dropped.
    samples: Option<Arc<[RecordResidual]>>,
}

impl ModelResiduals {
    pub fn of(residuals: Vec<RecordResidual>) -> Self {
        Self {
            records: residuals.iter().map(|r| r.record.clone()).collect(),
            count: residuals.iter().map(|r| r.samples.len()).sum(),
            sum_of_squares: residuals.iter().map(RecordResidual::sum_of_squares).sum(),
            samples: Some(residuals.into()),
        }
    }

    /// The records, with the initial states found for the model.
    pub fn records(&self) -> &[StandRecord] {
        &self.records
    }

    /// Number of samples.
    pub fn count(&self) -> usize {
        self.count
    }

    pub fn rms(&self) -> f64 {
        (self.sum_of_squares / self.count as f64).sqrt()
    }

    /// The residuals, simulated again if their samples were dropped.
    pub fn with_samples(&self, fitted: &FittedModel) -> Arc<[RecordResidual]> {
        match &self.samples {
            Some(samples) => samples.clone(),
            None => self.records.iter().map(|r| again(fitted, r)).collect(),
        }
    }

    pub fn keep_samples(&mut self, fitted: &FittedModel) {
        self.samples = Some(self.with_samples(fitted));
    }

    pub fn drop_samples(&mut self) {
        self.samples = None;
    }
}

/// Residual of a model on a record with an initial state for which it was simulated before.
fn again(fitted: &FittedModel, record: &StandRecord) -> RecordResidual {
    let residual = fitted.residual_from(record);
    residual.expect("a simulation gives the same as before")
}
