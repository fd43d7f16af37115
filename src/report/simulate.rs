//! What `simulate` reports.

use serde::Serialize;

use crate::print::short;
use crate::warning::Warning;

/// Schema of the document.
pub const SCHEMA: &str = "torqcomp.simulate/1";

/// The report.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Schema.
    pub schema: &'static str,
    /// Version of torqcomp.
    pub version: &'static str,
    /// File with the applied quantity.
    pub input: String,
    /// Stand file.
    pub stand: String,
    /// Name of the applied channel.
    pub applied: String,
    /// Its unit.
    pub applied_unit: String,
    /// Unit of the result.
    pub measured_unit: String,
    /// Course of the input between its samples.
    pub input_between_samples: &'static str,
    /// Samples written.
    pub samples: usize,
    /// Samples a second.
    pub rate_hz: f64,
    /// Time of the first one.
    pub start_s: f64,
    /// Steps of integration from sample to sample.
    pub steps_per_sample: usize,
    /// Effects of the stand.
    pub effects: Vec<&'static str>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

impl Report {
    /// For people.
    #[must_use]
    pub fn text(&self) -> String {
        let effects = match self.effects.as_slice() {
            [] => "no effects".to_owned(),
            some => some.join(", "),
        };
        format!(
            "simulated {} samples at {} Hz, {} steps a sample, with {effects}; applied {} in {}, {} between samples; \
             measured in {}\n",
            self.samples,
            short(self.rate_hz),
            self.steps_per_sample,
            self.applied,
            self.applied_unit,
            self.input_between_samples,
            self.measured_unit,
        )
    }
}
