//! `identify`: constants of the stand from records, with uncertainties.

mod constants;
mod decay;
mod response;
mod runup;
mod static_load;

use std::path::Path;

use torqcomp_model::{Dimension, Kind, UnitSystem};

use super::{Outcome, conclude};
use crate::cli::identify::{Findings, Identify, Test};
use crate::failure::Failure;
use crate::identify::{Identification, NamedEstimate};
use crate::io::output;
use crate::print::Report;
use crate::stand::update::Entry;
use crate::stand::{self, update};
use crate::unit::NamedUnit;
use crate::warning::Warning;

const TORQUE: Dimension = Dimension::new([1, 2, -2, 0, 0, 0]);
const FORCE: Dimension = Dimension::new([1, 1, -2, 0, 0, 0]);

/// Runs the verb.
pub fn run(args: &Identify) -> Result<Outcome, Failure> {
    match &args.test {
        Test::Decay(args) => decay::run(args),
        Test::Runup(args) => runup::run(args),
        Test::Static(args) => static_load::run(args),
        Test::Response(args) => response::run(args),
    }
}

const ONE_MODE: &str = "a stand file describes one mode, and several were found; choose one with --band and --modes 1, or \
                        omit -o to see them";

/// What was read, for the result.
#[derive(Default)]
struct Recorded {
    inputs: Vec<String>,
    samples: usize,
    rate_hz: Option<f64>,
    warnings: Vec<Warning>,
    is_lossy: bool,
}

impl Recorded {
    /// Adds a file; the sampling rate is that of the first one.
    fn add(&mut self, input: &str, samples: usize, rate_hz: Option<f64>) {
        if self.inputs.is_empty() {
            self.rate_hz = rate_hz;
        }
        self.inputs.push(input.to_owned());
        self.samples += samples;
    }

    /// Adds the warnings about a file.
    fn warn(&mut self, warnings: Vec<Warning>, is_lossy: bool) {
        self.is_lossy |= is_lossy;
        self.warnings.extend(warnings);
    }
}

/// Text of the stand file that declared values come from, with its name.
fn stand_text(findings: &Findings) -> Result<Option<(String, String)>, Failure> {
    let declaring = findings.stand.as_deref().or_else(|| existing(findings));
    declaring.map(stand::text).transpose()
}

/// The stand file of `-o`, if it is there already.
fn existing(findings: &Findings) -> Option<&Path> {
    let place = findings.result.output.as_deref()?;
    (place != "-" && Path::new(place).is_file()).then(|| Path::new(place))
}

/// A value of `[mechanics]` that is declared, and its standard uncertainty.
fn declared(
    stand: Option<&(String, String)>,
    key: &str,
    kind: Kind,
) -> Result<Option<(f64, Option<f64>)>, Failure> {
    match stand {
        Some((name, text)) => update::declared(name, text, key, kind),
        None => Ok(None),
    }
}

/// Entry of a stand file for a constant.
fn entry(
    section: &'static str,
    key: &'static str,
    constant: &NamedEstimate,
    source: &str,
) -> Entry {
    Entry {
        section,
        key,
        value: constant.value(),
        std: constant.std(),
        unit: constant.estimate.unit().to_owned(),
        source: source.to_owned(),
    }
}

/// Completes the result, writes the stand file and the HTML page, and prints the result.
fn deliver(
    mut result: Identification,
    recorded: Recorded,
    findings: &Findings,
    entries: &[Entry],
) -> Result<Outcome, Failure> {
    result.inputs = recorded.inputs;
    result.samples = recorded.samples;
    result.rate_hz = recorded.rate_hz;
    result.warnings.extend(recorded.warnings);
    result.convert(UnitSystem::from(findings.units));
    let target = &findings.result;
    let output = target.output.as_deref();
    let read: Vec<&Path> = result.inputs.iter().map(Path::new).collect();
    if let Some(output) = output {
        write_stand(output, findings, &read, entries)?;
    }
    if let Some(page) = findings.html.as_deref() {
        let others: Vec<&Path> = read.into_iter().chain(output.map(Path::new)).collect();
        output::write_all(Some(page), target.force, &others, &result.page())?;
    }
    let printed = match (findings.json, output) {
        // Standard output has the stand file.
        (false, Some("-")) => String::new(),
        (as_json, _) => result.document(as_json),
    };
    output::write_all(None, false, &[], &printed)?;
    Ok(conclude(
        &result.warnings,
        recorded.is_lossy,
        findings.strict,
    ))
}

/// Writes the entries into a stand file: the existing one, a copy of that of `--stand`, or a new one.
fn write_stand(
    output: &str,
    findings: &Findings,
    read: &[&Path],
    entries: &[Entry],
) -> Result<(), Failure> {
    if output == "-" && findings.json {
        return Err(Failure::usage(
            "the stand file and the JSON document cannot both go to standard output; give -o FILE",
        ));
    }
    let existing = existing(findings);
    let basis = existing.or(findings.stand.as_deref());
    let text = match basis.map(stand::text).transpose()? {
        Some((name, text)) => update::update(&name, Some(&text), entries),
        None => update::update(output, None, entries),
    }?;
    let force = findings.result.force || existing.is_some();
    output::write_all(Some(output), force, read, &text)
}

/// The unit of a channel of that name.
fn unit_or(unit: Option<&NamedUnit>, name: &str, flag: &str) -> Result<NamedUnit, Failure> {
    unit.cloned().ok_or_else(|| {
        Failure::failed(format_args!(
            "channel \"{name}\" has no unit; give it with {flag}"
        ))
    })
}

/// Reads a quantity of the command line.
fn quantity(flag: &str, text: &str, kind: Kind) -> Result<f64, Failure> {
    kind.parse(text)
        .map_err(|error| Failure::usage(format_args!("{flag} {text}: {error}")))
}
