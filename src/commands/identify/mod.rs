//! `identify`: constants of the stand from records, with uncertainties.

mod anchor;
mod decay;
mod response;
mod runup;
mod static_load;

use std::path::Path;

use torqcomp_model::Kind;

use super::{Outcome, conclude};
use crate::cli::identify::{Findings, Identify, Test};
use crate::failure::Failure;
use crate::io::csv::{NamedUnit, Place};
use crate::io::output;
use crate::recording::{Recording, Selection};
use crate::report;
use crate::report::identify::Report;
use crate::stand::update::{self, Entry};

/// Runs the verb.
pub fn run(args: &Identify) -> Result<Outcome, Failure> {
    match &args.test {
        Test::Decay(args) => decay::run(args),
        Test::Runup(args) => runup::run(args),
        Test::Static(args) => static_load::run(args),
        Test::Response(args) => response::run(args),
    }
}

/// Text of the stand file that declared values come from, with its name.
fn stand_text(findings: &Findings) -> Result<Option<(String, String)>, Failure> {
    let read = |path: &Path| {
        std::fs::read_to_string(path)
            .map(|text| Some((path.display().to_string(), text)))
            .map_err(|error| Failure::reading(path, &error))
    };
    match (&findings.stand, &findings.result.output) {
        (Some(path), _) => read(path),
        (None, Some(place)) if place != "-" && Path::new(place).is_file() => read(Path::new(place)),
        _ => Ok(None),
    }
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

/// Prints the report, writes the stand file and the page.
fn deliver(
    report: &Report,
    findings: &Findings,
    inputs: &[&str],
    entries: &[Entry],
) -> Result<Outcome, Failure> {
    let result = &findings.result;
    let taken: Vec<&Path> = inputs.iter().map(Path::new).collect();
    if let Some(place) = result.output.as_deref() {
        if place == "-" && findings.json {
            return Err(Failure::usage(
                "the stand file and the JSON document cannot both go to standard output; give -o FILE",
            ));
        }
        // An existing stand file is a basis for the new one, whoever it came from.
        let existing = match Path::new(place) {
            path if place != "-" && path.is_file() => {
                Some(std::fs::read_to_string(path).map_err(|e| Failure::reading(path, &e))?)
            }
            _ => None,
        };
        let text = update::update(place, existing.as_deref(), entries)?;
        let force = result.force || existing.is_some();
        output::write_all(Some(place), force, &taken, &text)?;
    }
    if let Some(place) = findings.html.as_deref() {
        let beside: Vec<&Path> = taken
            .iter()
            .copied()
            .chain(result.output.as_deref().map(Path::new))
            .collect();
        output::write_all(Some(place), result.force, &beside, &report.page())?;
    }
    let printed = match (findings.json, result.output.as_deref()) {
        (true, _) => report::json(report),
        // The stand file is there already.
        (false, Some("-")) => String::new(),
        (false, _) => report.text(),
    };
    output::write_all(None, false, &[], &printed)?;
    Ok(conclude(&report.warnings, false, findings.strict))
}

/// Reads one file.
fn read(input: &str, options: &crate::io::csv::Options) -> Result<Recording, Failure> {
    crate::recording::read(&Place::of(input), options)
}

/// The unit of a channel, or what to do to have one.
fn unit_of(selection: &Selection, flag: &str) -> Result<NamedUnit, Failure> {
    selection.unit.clone().ok_or_else(|| {
        Failure::failed(format_args!(
            "the channel \"{}\" does not say its unit; give it with {flag}",
            selection.channel.name
        ))
    })
}

/// Reads a quantity of the command line.
fn quantity(flag: &str, text: &str, kind: Kind) -> Result<f64, Failure> {
    kind.parse(text)
        .map_err(|error| Failure::usage(format_args!("{flag} {text}: {error}")))
}

/// Refuses samples that are not there.
fn whole(selection: &Selection) -> Result<(), Failure> {
    match selection.channel.holes.first() {
        None => Ok(()),
        Some(hole) => Err(Failure::failed(format_args!(
            "line {}: the channel \"{}\" has no number there; remove the line or repair it",
            hole.line, selection.channel.name
        ))),
    }
}

/// Largest deviation of time stamps from a uniform grid that is none, in steps.
const JITTER: f64 = 0.05;

/// Whether stamps are as good as uniform.
fn uniform(stamps_s: &[f64], rate_hz: f64) -> bool {
    let first = stamps_s.first().copied().unwrap_or(0.0);
    stamps_s
        .iter()
        .enumerate()
        .all(|(i, t)| ((t - first) * rate_hz - i as f64).abs() < JITTER + 1e-6 * i as f64)
}

/// Refuses a channel whose stamps are not uniform.
fn must_be_uniform(selection: &Selection, given: bool) -> Result<(), Failure> {
    match &selection.channel.axis.stamps_s {
        Some(stamps) if !given && !uniform(stamps, selection.rate_hz) => {
            Err(Failure::failed(format_args!(
                "the time stamps of \"{}\" are not uniform; give --rate HZ if they are wrong, or \
                 resample the record first",
                selection.channel.name
            )))
        }
        _ => Ok(()),
    }
}
