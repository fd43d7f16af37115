//! Successful outcome of a verb, and its results.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::io::output::{self, Output};
use crate::warning::Warning;
use crate::{log, print};

/// Successful outcome of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Complete.
    Done,
    /// Done, but data were lost, or a warning counts under `--strict`.
    WithLoss,
}

impl Outcome {
    /// The exit code.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::WithLoss => 3,
        }
    }
}

/// Figures of a record and its result. `None` is unknown, or nothing that the verb determines.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct RecordFigures {
    /// Number of samples; `null` if unknown.
    pub(crate) samples: Option<usize>,
    /// Sampling rate, in Hz; `null` if unknown.
    pub(crate) rate_hz: Option<f64>,
    /// End of the part of the spectrum that is compensated in full, in Hz; `null` if the verb determines none.
    pub(crate) band_hz: Option<f64>,
    /// Unit of `rms`, `peak` and `noise_rms`.
    pub(crate) unit: Option<String>,
    /// Root mean square about the mean, in `unit`; `null` if unknown.
    pub(crate) rms: Option<f64>,
    /// Largest magnitude, in `unit`; `null` if unknown.
    pub(crate) peak: Option<f64>,
    /// Rms of the noise, in `unit`; `null` if unknown.
    pub(crate) noise_rms: Option<f64>,
}

impl RecordFigures {
    /// Those of a record alone.
    pub(crate) fn of(samples: usize, rate_hz: f64) -> Self {
        Self {
            samples: Some(samples),
            rate_hz: Some(rate_hz),
            ..Self::default()
        }
    }
}

/// Results of a verb for one record. The outputs are complete; [`Made::publish`] gives them their names.
pub(crate) struct Made {
    pub(crate) outputs: Vec<Output>,
    /// JSON document for standard output.
    pub(crate) document: Option<String>,
    /// Report for standard error.
    pub(crate) notes: String,
    /// Warnings for standard error.
    pub(crate) talk: String,
    pub(crate) warnings: Vec<Warning>,
    pub(crate) outcome: Outcome,
    pub(crate) figures: RecordFigures,
}

impl Made {
    /// Names the outputs and prints the messages.
    ///
    /// # Errors
    /// As [`Output::write`].
    pub(crate) fn publish(self) -> Result<Outcome, Failure> {
        // Do everything that can fail before renaming the first output.
        if let Some(document) = &self.document {
            output::print(document)?;
        }
        output::finish_all(self.outputs)?;
        print::note(&self.notes);
        print::say(&self.talk);
        log::warnings(None, &self.warnings);
        Ok(self.outcome)
    }

    /// Names the outputs.
    ///
    /// # Errors
    /// As [`Output::write`].
    pub(crate) fn publish_silently(self) -> Result<(), Failure> {
        output::finish_all(self.outputs)
    }
}
