//! `inspect`: content and faults of recordings.

mod content;
mod describe;
mod messages;
mod plot;
mod report;
mod text;
mod whole;

use std::path::{Path, PathBuf};

use self::content::Content;
pub(super) use self::report::InspectReport;
use self::report::{ChannelWarning, Inspected};
use super::{Outcome, made, many, same};
use crate::batch;
use crate::cli::Inspect;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::{ShowPath, is_dash};
use crate::io::Input;
use crate::io::output::Output;
use crate::log;
use crate::outcome::Made;
use crate::print::{self, Report};
use crate::quality::copies;
use crate::recording::Recording;

/// Runs the verb: reports of many files one by one, or one report that compares them.
///
/// # Errors
/// Whatever kept it from being done.
pub fn run(args: &Inspect, options: &[String]) -> Result<Outcome, Failure> {
    if many::are_asked(args) {
        return many::run(args, options);
    }
    let args = Inspect {
        files: batch::expand(&args.files)?,
        ..args.clone()
    };
    let (made, failed) = compare(&args)?;
    let outcome = made.publish()?;
    match failed.split_last() {
        None => Ok(outcome),
        Some((last, others)) => {
            for failure in others {
                print::say(&format!("torqcomp: {failure}\n"));
                log::failure(failure);
            }
            Err(last.clone())
        }
    }
}

/// Inspects one file.
///
/// # Errors
/// Whatever kept it from being done.
pub fn work(args: &Inspect) -> Result<Made, Failure> {
    compare(args).map(|(made, _)| made)
}

/// Inspects files and compares them; includes why some of several could not be read.
fn compare(args: &Inspect) -> Result<(Made, Vec<Failure>), Failure> {
    check(args)?;
    let inputs: Vec<&Path> = args.files.iter().map(PathBuf::as_path).collect();
    let output = args.result.open(&inputs)?;
    let plot = args.result.open_beside(args.plot.as_deref(), &inputs)?;

    let read: Vec<Result<Content, Failure>> = args
        .files
        .iter()
        .map(|file| content::read(&Input::of(file), &args.reading))
        .collect();
    if let [Err(failure)] = read.as_slice() {
        return Err(failure.clone());
    }
    let report = InspectReport {
        files: read.iter().zip(&args.files).map(entry).collect(),
        warnings: between(&args.files, &read),
    };
    let made = finish(args, &report, &read, output, plot)?;
    Ok((made, read.into_iter().filter_map(Result::err).collect()))
}

/// Rejects impossible requests.
fn check(args: &Inspect) -> Result<(), Failure> {
    if args.files.iter().filter(|file| is_dash(file)).count() > 1 {
        return Err(ErrorCode::ConflictingArguments
            .usage("standard input can be read only once; name files"));
    }
    if args.reading.resample {
        return Err(ErrorCode::ConflictingArguments
            .usage("--resample does not apply: inspect shows recordings as they are"));
    }
    Ok(())
}

fn entry((read, file): (&Result<Content, Failure>, &PathBuf)) -> Inspected {
    match read {
        Ok(content) => Inspected::Read(Box::new(describe::file(content))),
        Err(failure) => Inspected::Failed {
            file: file.shown().to_string(),
            error: failure.to_string(),
        },
    }
}

/// Findings from comparing the files. Channels of identical files need no comparison.
fn between(files: &[PathBuf], read: &[Result<Content, Failure>]) -> Vec<ChannelWarning> {
    let (mut found, firsts) = same::files(files);
    let recordings: Vec<&Recording> = firsts
        .iter()
        .filter_map(|i| read[*i].as_ref().ok().map(|content| &content.recording))
        .collect();
    found.extend(copies::across(&recordings));
    found
        .into_iter()
        .map(|warning| describe::said(warning, Vec::new()))
        .collect()
}

/// Writes all findings.
fn finish(
    args: &Inspect,
    report: &InspectReport,
    read: &[Result<Content, Failure>],
    mut output: Output,
    mut plot: Option<Output>,
) -> Result<Made, Failure> {
    output.write(report.document(args.json).as_bytes())?;
    if let Some(plot) = &mut plot {
        let contents = read.iter().flatten();
        let recordings: Vec<&Recording> = contents.map(|content| &content.recording).collect();
        plot.write(plot::svg(&recordings, report).as_bytes())?;
    }
    let warnings = report.all_warnings().map(|w| w.warning.clone()).collect();
    let outputs = plot.into_iter().chain([output]).collect();
    Ok(Made {
        // The report has them.
        talk: String::new(),
        figures: report.figures(),
        ..made(outputs, warnings, report.is_lossy(), &args.strictness)
    })
}
