//! One file for each verb.

mod compensate;
mod harmonics;
mod predict;
mod table;

use torqcomp_dsp::conversion::ConversionError;

use crate::cli::{Cli, Verb};
use crate::failure::Failure;
use crate::report::Warning;
use crate::stand::{Chain, Stand};

/// How a command ended well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// All was done.
    Done,
    /// It was done, but data were lost, or `--strict` made a warning count.
    WithLoss,
}

/// Runs a command.
///
/// # Errors
/// Whatever kept it from being done.
pub fn run(cli: Cli) -> Result<Outcome, Failure> {
    match cli.verb {
        Verb::Compensate(args) => compensate::run(&args),
        Verb::Harmonics(args) => harmonics::run(&args),
        Verb::Table(args) => table::run(&args),
        Verb::Predict(args) => predict::run(&args),
    }
}

/// Says the warnings and what was lost, and tells how the command ended.
fn conclude(warnings: &[Warning], lost: bool, strict: bool) -> Outcome {
    for warning in warnings {
        eprintln!("torqcomp: warning [{}]: {}", warning.code, warning.message);
    }
    if lost || (strict && !warnings.is_empty()) {
        Outcome::WithLoss
    } else {
        Outcome::Done
    }
}

/// Relative standard uncertainty of the compensated torque that the stand's constants bring.
fn relative_std(stand: &Stand, chain: &Chain, frequency_hz: f64) -> Option<f64> {
    let mechanics = stand.mechanics.as_ref()?;
    let mut std = mechanics.std;
    std.static_gain_relative = chain.relative_std;
    let found = mechanics.response.inverse_uncertainty(frequency_hz, &std);
    found.ok().flatten().map(|u| u.magnitude_relative)
}

/// Index and reason of the sample that could not be converted.
pub(crate) fn unconverted(error: ConversionError) -> (usize, String) {
    match error {
        ConversionError::Sample { index, source } => (index, source.to_string()),
        other => (0, other.to_string()),
    }
}
