//! `identify`: constants of the stand from records, with uncertainties.

mod arrivals;
mod constants;
mod decay;
mod factor;
mod modes;
mod replaced;
mod response;
mod rest;
mod runup;
mod static_load;

use std::path::{Path, PathBuf};

use torqcomp_model::{Kind, UnitSystem};

use super::{Outcome, conclude, same};
use crate::cli::identify::{Findings, Identify, Test};
use crate::failure::{ErrorCode, Failure};
use crate::file_name::{self, ShowPath, is_dash};
use crate::identify::{Identification, NamedEstimate};
use crate::io::output::{self, Output, Policy};
use crate::print::Report;
use crate::provenance::Provenance;
use crate::stand::update::Entry;
use crate::stand::{self, update};
use crate::unit::{NamedUnit, RecordedChannel};
use crate::warning::Warning;

/// Runs the verb.
pub fn run(args: &Identify) -> Result<Outcome, Failure> {
    let (findings, inputs) = args.test.target();
    // Rejects unwritable outputs before the work.
    FindingOutputs::open(findings, inputs)?;
    match &args.test {
        Test::Decay(args) => decay::run(args),
        Test::Runup(args) => runup::run(args),
        Test::Static(args) => static_load::run(args),
        Test::Response(args) => response::run(args),
    }
}

/// Inputs read, for the result.
#[derive(Default)]
struct Recorded {
    inputs: Vec<PathBuf>,
    samples: usize,
    rate_hz: Option<f64>,
    rate_std_hz: Option<f64>,
    warnings: Vec<Warning>,
    is_lossy: bool,
}

impl Recorded {
    /// Adds a file; sampling rate and its standard uncertainty are those of the first file.
    fn add(&mut self, input: &Path, samples: usize, rate_hz: Option<(f64, Option<f64>)>) {
        if self.inputs.is_empty() {
            self.rate_hz = rate_hz.map(|(rate_hz, _)| rate_hz);
            self.rate_std_hz = rate_hz.and_then(|(_, std_hz)| std_hz);
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

/// Text and name of the stand file with the declared values.
fn stand_text(findings: &Findings) -> Result<Option<(String, String)>, Failure> {
    let declaring = findings.stand.as_deref().or_else(|| existing(findings));
    declaring.map(stand::text).transpose()
}

/// The stand file of `-o`, if it already exists.
fn existing(findings: &Findings) -> Option<&Path> {
    let place = findings.result.output.as_deref()?;
    (!is_dash(place) && place.is_file()).then_some(place)
}

/// A declared value of `[mechanics]` and its standard uncertainty.
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
    Entry::quantity(section, key, &constant.estimate, source)
}

/// Completes the result, writes the stand file and the HTML page, and prints the result.
fn deliver(
    mut result: Identification,
    recorded: Recorded,
    findings: &Findings,
    entries: &[Entry],
) -> Result<Outcome, Failure> {
    result.inputs = file_name::texts(&recorded.inputs);
    result.samples = recorded.samples;
    result.rate_hz = recorded.rate_hz;
    result.rate_std_hz = recorded.rate_std_hz;
    result.warnings.extend(recorded.warnings);
    result.warnings.extend(same::files(&recorded.inputs).0);
    result.convert(UnitSystem::from(findings.units));
    let mut targets = FindingOutputs::open(findings, &recorded.inputs)?;
    if let Some(stand) = &mut targets.stand {
        stand.write(stand_file(findings, entries)?.as_bytes())?;
    }
    if let Some(page) = &mut targets.page {
        let stand = stand_text(findings)?;
        let stand = stand
            .as_ref()
            .map(|(name, text)| (name.as_str(), text.as_str()));
        let provenance = Provenance::of(&recorded.inputs, stand)?;
        page.write(result.page(&provenance).as_bytes())?;
    }
    // Standard output contains the stand file.
    if findings.json || findings.result.output.is_none() || !findings.result.is_stdout() {
        output::print(&result.document(findings.json))?;
    }
    output::finish_all(targets.stand.into_iter().chain(targets.page))?;
    Ok(conclude(
        &result.warnings,
        recorded.is_lossy,
        &findings.strictness,
    ))
}

/// The files written by the verb.
struct FindingOutputs {
    stand: Option<Output>,
    page: Option<Output>,
}

impl FindingOutputs {
    /// Opens them; an existing stand file is updated.
    fn open(findings: &Findings, inputs: &[PathBuf]) -> Result<Self, Failure> {
        let result = &findings.result;
        if result.output.as_deref().is_some_and(is_dash) && findings.json {
            return Err(ErrorCode::ConflictingArguments.usage(
                "the stand file and the JSON document cannot both go to standard output; give -o FILE",
            ));
        }
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let policy = Policy {
            replace: result.force || existing(findings).is_some(),
            ..result.policy()
        };
        let place = result.output.as_deref();
        let stand = place.map(|_| Output::open(place, policy, &inputs));
        let page = findings.html.as_deref();
        Ok(Self {
            stand: stand.transpose()?,
            page: result.open_beside(page, &inputs)?,
        })
    }
}

/// The stand file with the entries: the existing one, a copy of the one given by `--stand`, or a new one.
fn stand_file(findings: &Findings, entries: &[Entry]) -> Result<String, Failure> {
    let basis = existing(findings).or(findings.stand.as_deref());
    match basis.map(stand::text).transpose()? {
        Some((name, text)) => update::update(&name, Some(&text), entries),
        None => {
            let name = findings.result.output.as_deref().unwrap_or(Path::new("-"));
            update::update(&name.shown().to_string(), None, entries)
        }
    }
}

/// Unit of a channel, from the flag if the file does not give it.
fn unit_or(channel: RecordedChannel, flag: &str) -> Result<NamedUnit, Failure> {
    channel.unit.cloned().ok_or_else(|| {
        let name = channel.name;
        match channel.unit_text {
            None => ErrorCode::UnitUnclear.failed(format_args!(
                "channel \"{name}\" has no unit; give it with {flag}"
            )),
            Some(text) => channel.unknown_unit(text, &format!("give a known one with {flag}")),
        }
    })
}

/// Reads a quantity from the command line that must be greater than 0.
fn positive(flag: &str, text: &str, kind: Kind) -> Result<f64, Failure> {
    let value = quantity(flag, text, kind)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err(ErrorCode::InvalidValue.usage(format_args!("{flag} {text}: it must be greater than 0")))
    }
}

/// The radius at which a force acts, in m, if given.
fn radius(text: Option<&str>) -> Result<Option<f64>, Failure> {
    text.map(|text| positive("--radius", text, Kind::Length))
        .transpose()
}

/// Reads a quantity from the command line.
fn quantity(flag: &str, text: &str, kind: Kind) -> Result<f64, Failure> {
    kind.parse(text)
        .map_err(|error| ErrorCode::InvalidValue.usage(format_args!("{flag} {text}: {error}")))
}
