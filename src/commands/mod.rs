//! One file for each verb.

mod compensate;
mod diagnose;
mod extract;
mod harmonics;
mod identify;
mod inspect;
mod predict;
mod rows;
mod simulate;
mod table;

use torqcomp_dsp::conversion::ConversionError;
use torqcomp_model::InverseUncertainty;

use crate::cli::{Cli, Verb};
use crate::failure::Failure;
use crate::print::{self};
use crate::stand::{Chain, Stand};
use crate::warning::Warning;

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
        Verb::Extract(args) => extract::run(&args),
        Verb::Harmonics(args) => harmonics::run(&args),
        Verb::Inspect(args) => inspect::run(&args),
        Verb::Table(args) => table::run(&args),
        Verb::Predict(args) => predict::run(&args),
        Verb::Identify(args) => identify::run(&args),
        Verb::Simulate(args) => simulate::run(&args),
        Verb::Diagnose(args) => diagnose::run(&args),
    }
}

/// Says the warnings and what was lost, and tells how the command ended.
fn conclude(warnings: &[Warning], lost: bool, strict: bool) -> Outcome {
    for warning in warnings {
        print::say(&format!(
            "torqcomp: warning [{}]: {}\n",
            warning.code, warning.message
        ));
    }
    if lost || (strict && !warnings.is_empty()) {
        Outcome::WithLoss
    } else {
        Outcome::Done
    }
}

/// Standard uncertainty of the compensated torque that the stand's constants bring, its calibration
/// included.
fn uncertainty(stand: &Stand, chain: &Chain, frequency_hz: f64) -> Option<InverseUncertainty> {
    let mechanics = stand.mechanics.as_ref()?;
    let mut std = mechanics.std;
    std.static_gain_relative = chain.relative_std;
    let found = mechanics.response.inverse_uncertainty(frequency_hz, &std);
    found.ok().flatten()
}

/// Largest magnitude that is taken for a measurement: squares and sums of it stay finite.
const LARGEST: f64 = 1e100;

/// Brings recorded values to the applied quantity at rest, in SI units; index and reason of the
/// first that cannot be.
pub(crate) fn convert(chain: &Chain, values: &mut [f64]) -> Result<(), (usize, String)> {
    if chain.recorded_factor != 1.0 {
        values.iter_mut().for_each(|v| *v *= chain.recorded_factor);
    }
    match chain.conversion.convert_slice(values) {
        Ok(()) => {}
        Err(ConversionError::Sample { index, source }) => return Err((index, source.to_string())),
        Err(other) => return Err((0, other.to_string())),
    }
    if chain.zero != 0.0 {
        values.iter_mut().for_each(|v| *v -= chain.zero);
    }
    match first_impossible(values) {
        Some(index) => Err((
            index,
            format!(
                "the value becomes {:e}, which no recorder measures; correct or remove the line",
                values[index]
            ),
        )),
        None => Ok(()),
    }
}

/// Index of the first value that is no measurement. Looks at many at once, since there is none.
fn first_impossible(values: &[f64]) -> Option<usize> {
    const TOGETHER: usize = 64;
    let is_possible = |v: &f64| v.abs() <= LARGEST;
    let all = |part: &[f64]| part.iter().fold(true, |all, v| all & is_possible(v));
    let part = values.chunks(TOGETHER).position(|part| !all(part))?;
    let start = part * TOGETHER;
    Some(start + values[start..].iter().position(|v| !is_possible(v))?)
}
