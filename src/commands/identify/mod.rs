//! `identify`: constants of the stand from records, with uncertainties.

mod anchor;
mod decay;
mod plain;
mod response;
mod runup;
mod static_load;

use std::path::Path;

use torqcomp_model::Kind;

use super::{Outcome, conclude};
use crate::cli::identify::{Findings, Identify, Test};
use crate::failure::Failure;
use crate::io::Input;
use crate::io::csv::{NamedUnit, Options};
use crate::io::output;
use crate::print;
use crate::recording::{Recording, Selection};
use crate::report::identify::Report;
use crate::signal::Together;
use crate::signal::together::{axes, uniform};
use crate::stand::update::Entry;
use crate::stand::{self, update};
use crate::warning::Warning;

/// Runs the verb.
pub fn run(args: &Identify) -> Result<Outcome, Failure> {
    match &args.test {
        Test::Decay(args) => decay::run(args),
        Test::Runup(args) => runup::run(args),
        Test::Static(args) => static_load::run(args),
        Test::Response(args) => response::run(args),
    }
}

/// Why several modes are not written.
const ONE_MODE: &str = "a stand file holds one mode, and several were found; choose one with --band and --modes 1, or \
                        leave -o out to see them";

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

/// Prints the report, writes the stand file and the page.
fn deliver(
    report: &Report,
    findings: &Findings,
    inputs: &[&str],
    entries: &[Entry],
    is_lossy: bool,
) -> Result<Outcome, Failure> {
    let result = &findings.result;
    let taken: Vec<&Path> = inputs.iter().map(Path::new).collect();
    if let Some(place) = result.output.as_deref() {
        if place == "-" && findings.json {
            return Err(Failure::usage(
                "the stand file and the JSON document cannot both go to standard output; give -o FILE",
            ));
        }
        // An existing stand file is a basis for the new one, whoever it came from; so is the one that declared values
        // come from.
        let existing = existing(findings);
        let basis = existing.or(findings.stand.as_deref());
        let basis = basis.map(stand::text).transpose()?;
        let text = match &basis {
            Some((name, text)) => update::update(name, Some(text), entries),
            None => update::update(place, None, entries),
        }?;
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
        (true, _) => print::json(report),
        // The stand file is there already.
        (false, Some("-")) => String::new(),
        (false, _) => report.text(),
    };
    output::write_all(None, false, &[], &printed)?;
    Ok(conclude(&report.warnings, is_lossy, findings.strict))
}

/// Reads one file: all of a text, the signals that are named of an MCAP file.
fn read(input: &str, wanted: &[Options]) -> Result<Recording, Failure> {
    crate::recording::read_channels(&Input::of(input), wanted)
}

/// Reads channels of one file that are to lie on one time axis. Stamps of a text must be uniform, those
/// of messages never are and are brought onto a grid.
fn together(input: &str, wanted: &[Options]) -> Result<Together, Failure> {
    let recording = read(input, wanted)?;
    if recording.format != "mcap" {
        let mut chosen = Vec::new();
        for options in wanted {
            let selection = recording.select(options)?;
            whole(&selection)?;
            chosen.push(selection);
        }
        let is_given = wanted.iter().any(|options| options.rate_hz.is_some());
        for selection in axes(&chosen) {
            must_be_uniform(selection, is_given)?;
        }
    }
    Together::of(recording, wanted)
}

/// What was lost of a file, and what else should be known of it.
fn said(warnings: &[Warning], lost: Option<&Warning>) -> Vec<Warning> {
    lost.into_iter().chain(warnings).cloned().collect()
}

/// The unit of a channel, or what to do to have one.
fn unit_of(selection: &Selection, flag: &str) -> Result<NamedUnit, Failure> {
    unit_or(selection.unit.as_ref(), &selection.channel.name, flag)
}

/// The unit of a channel of that name.
fn unit_or(unit: Option<&NamedUnit>, name: &str, flag: &str) -> Result<NamedUnit, Failure> {
    unit.cloned().ok_or_else(|| {
        Failure::failed(format_args!(
            "the channel \"{name}\" does not say its unit; give it with {flag}"
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
