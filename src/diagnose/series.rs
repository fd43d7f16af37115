//! What a report draws: each record sample by sample, with both models.

use super::candidate::Judged;
use super::record::Record;
use super::{Diagnosis, Records};

/// One record over the samples that count, in the units of the diagnosis.
#[derive(Debug, Clone)]
pub struct Series {
    /// File it comes from.
    pub source: String,
    /// Whether it was held out of the fit.
    pub held_out: bool,
    /// Time of the first sample in s.
    pub start_s: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// What was applied.
    pub applied: Vec<f64>,
    /// What was measured.
    pub measured: Vec<f64>,
    /// The plain stand's record, with what belongs to the record (offset, free motion, phases).
    pub before: Vec<f64>,
    /// The same of the model with the accepted effects.
    pub after: Vec<f64>,
}

impl Series {
    /// Time of a sample in s.
    #[must_use]
    pub fn time_s(&self, index: usize) -> f64 {
        self.start_s + index as f64 / self.rate_hz
    }

    /// Measured less the plain stand's record.
    #[must_use]
    pub fn residual_before(&self) -> Vec<f64> {
        differences(&self.measured, &self.before)
    }

    /// Measured less the record of the model with the accepted effects.
    #[must_use]
    pub fn residual_after(&self) -> Vec<f64> {
        differences(&self.measured, &self.after)
    }
}

fn differences(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

impl Diagnosis<'_> {
    /// All records sample by sample, the training records first.
    #[must_use]
    pub fn series(&self) -> Vec<Series> {
        let Records { train, hold, .. } = &self.records;
        let fitted = (0..train.len()).map(|k| (&train[k], false, k));
        let held_out = (0..hold.len()).map(|k| (&hold[k], true, k));
        fitted
            .chain(held_out)
            .map(|(record, held_out, k)| self.one(record, held_out, k))
            .collect()
    }

    fn one(&self, record: &Record, held_out: bool, place: usize) -> Series {
        let range = record.range.clone();
        let measured = record.measured[range.clone()].to_vec();
        let model = |judged: &Judged| {
            let residuals = if held_out {
                &judged.hold
            } else {
                &judged.train
            };
            differences(&measured, &residuals[place].samples)
        };
        let rate_hz = record.input.rate_hz();
        Series {
            source: record.source.clone(),
            held_out,
            start_s: record.input.start_s() + range.start as f64 / rate_hz,
            rate_hz,
            applied: record.input.samples()[range].to_vec(),
            before: model(&self.before),
            after: model(&self.after),
            measured,
        }
    }
}
