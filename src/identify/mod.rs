//! Constants of a stand from records of it: signals from `dsp`, fits from `model`, joined here.

pub mod anchored;
pub mod decay;
pub mod plain;
pub mod response;
pub mod runup;
pub mod static_load;

use torqcomp_model::fit::FitError;

use crate::failure::Failure;
use crate::report::chart::Chart;
use crate::warning::Warning;

/// A number that was found, with what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Stable name, such as `inertia`.
    pub name: String,
    /// Its value in the unit.
    pub value: f64,
    /// Standard uncertainty in the unit, if the data tell one.
    pub std: Option<f64>,
    /// Its unit as text; empty for a ratio.
    pub unit: String,
}

impl Found {
    /// A number with its uncertainty.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        value: f64,
        std: Option<f64>,
        unit: impl Into<String>,
    ) -> Self {
        Self {
            name: name.into(),
            value,
            std,
            unit: unit.into(),
        }
    }
}

/// How well a model follows the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Root mean square of what is left, in the unit.
    pub rms: f64,
    /// Its unit.
    pub unit: String,
    /// The same as a part of the root mean square of the data.
    pub relative: f64,
}

/// What one way of evaluating a record says, beside the main one.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The method, for people.
    pub method: String,
    /// Its numbers.
    pub found: Vec<Found>,
    /// How well it follows the data, if it says.
    pub quality: Option<Quality>,
}

/// Two parameters that the data tell apart only weakly.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlated {
    /// The one.
    pub first: String,
    /// The other.
    pub second: String,
    /// Their correlation coefficient.
    pub coefficient: f64,
}

/// Correlations from this size on are said.
pub const STRONG: f64 = 0.95;

/// What an evaluation of records comes to, whatever the test was.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// The numbers, the main ones first.
    pub found: Vec<Found>,
    /// How well the model follows the data.
    pub quality: Option<Quality>,
    /// What other methods say.
    pub comparisons: Vec<Comparison>,
    /// Pairs that are hard to tell apart.
    pub correlated: Vec<Correlated>,
    /// How it was done, for people, a sentence each.
    pub method: Vec<String>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
    /// Data, fit and residual, to be drawn.
    pub charts: Vec<Chart>,
}

impl Outcome {
    /// A number by its name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Found> {
        self.found.iter().find(|found| found.name == name)
    }

    /// Notes a warning.
    pub fn warn(&mut self, code: &'static str, message: impl Into<String>) {
        self.warnings.push(Warning::new(code, message));
    }
}

impl From<FitError> for Failure {
    fn from(error: FitError) -> Self {
        Self::failed(error)
    }
}

/// Root of the mean square; 0 for nothing.
#[must_use]
pub fn rms(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}
