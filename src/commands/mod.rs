//! The verbs, a module each: arguments, plan, computation, report.

mod compensate;
mod completions;
mod diagnose;
mod extract;
mod harmonics;
mod identify;
mod init;
mod inspect;
mod man;
mod many;
mod merge;
mod predict;
mod rows;
mod same;
pub(crate) mod schema;
mod simulate;
mod table;

use torqcomp_dsp::conversion::ConversionError;

use crate::cli::{Cli, Strictness, Verb};
use crate::failure::Failure;
use crate::io::output::Output;
use crate::log;
use crate::outcome::{Made, Outcome, RecordFigures};
use crate::print::{self, Report};
use crate::stand::{Calibration, TransducerSignal};
use crate::unit::NamedUnit;
use crate::warning::Warning;

/// Runs a command.
///
/// # Errors
/// If the work cannot be done.
pub fn run(cli: Cli) -> Result<Outcome, Failure> {
    match cli.verb {
        Verb::Init(args) => init::run(&args),
        Verb::Compensate(args) => many::run(&args, &cli.options),
        Verb::Extract(args) => many::run(&args, &cli.options),
        Verb::Harmonics(args) => many::run(&args, &cli.options),
        Verb::Inspect(args) => inspect::run(&args, &cli.options),
        Verb::Table(args) => table::run(&args),
        Verb::Predict(args) => predict::run(&args),
        Verb::Identify(args) => identify::run(&args),
        Verb::Simulate(args) => many::run(&args, &cli.options),
        Verb::Diagnose(args) => diagnose::run(&args),
        Verb::Merge(args) => merge::run(&args),
        Verb::Completions(args) => completions::run(&args),
        Verb::Man(args) => man::run(&args),
        Verb::Schema(args) => schema::run(&args),
    }
}

/// Writes a report and completes its output.
fn publish(report: &impl Report, as_json: bool, mut output: Output) -> Result<(), Failure> {
    output.write(report.document(as_json).as_bytes())?;
    output.finish()
}

/// Prints the warnings, including losses, and returns the outcome of the command.
fn conclude(warnings: &[Warning], lost: bool, strictness: &Strictness) -> Outcome {
    print::say(&warned(warnings));
    log::warnings(None, warnings);
    judged(warnings, lost, strictness)
}

/// The outputs of a verb for one record, with its warnings, losses included, for people and for the exit code.
fn made(outputs: Vec<Output>, warnings: Vec<Warning>, lost: bool, strictness: &Strictness) -> Made {
    Made {
        outputs,
        document: None,
        notes: String::new(),
        talk: warned(&warnings),
        outcome: judged(&warnings, lost, strictness),
        figures: RecordFigures::default(),
        warnings,
    }
}

/// Warnings for people, a line each.
fn warned(warnings: &[Warning]) -> String {
    let line = |w: &Warning| format!("torqcomp: warning [{}]: {}\n", w.code, w.message);
    warnings.iter().map(line).collect()
}

/// Outcome of a command.
fn judged(warnings: &[Warning], lost: bool, strictness: &Strictness) -> Outcome {
    match lost || strictness.refuses(warnings.iter().map(|w| w.code)) {
        true => Outcome::WithLoss,
        false => Outcome::Done,
    }
}

/// A unit as written in the file; empty if there is none.
fn unit_text(unit: Option<&NamedUnit>) -> &str {
    unit.map_or("", |unit| &unit.text)
}

/// Largest magnitude accepted as a measurement: its squares and sums stay finite.
const LARGEST: f64 = 1e100;

/// Converts recorded values to the static applied quantity, in SI units; index and reason of the
/// first that cannot be converted.
pub(crate) fn convert(chain: &Calibration, values: &mut [f64]) -> Result<(), (usize, String)> {
    if chain.recorded_factor != 1.0 {
        values.iter_mut().for_each(|v| *v *= chain.recorded_factor);
    }
    if let Some((largest, why)) = chain.signal.and_then(TransducerSignal::largest)
        && let Some(index) = values.iter().position(|v| v.abs() > largest)
    {
        return Err((index, why.to_owned()));
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

/// Index of the first value that is not a measurement. Checks many at once, as there is usually none.
fn first_impossible(values: &[f64]) -> Option<usize> {
    const TOGETHER: usize = 64;
    let is_possible = |v: &f64| v.abs() <= LARGEST;
    let all = |part: &[f64]| part.iter().fold(true, |all, v| all & is_possible(v));
    let part = values.chunks(TOGETHER).position(|part| !all(part))?;
    let start = part * TOGETHER;
    Some(start + values[start..].iter().position(|v| !is_possible(v))?)
}
