#![doc = include_str!("../README.md")]

mod batch;
mod chart;
mod cli;
mod commands;
mod diagnose;
#[cfg(test)]
mod docs_tests;
pub mod failure;
mod file_name;
pub mod identify;
pub mod inverse;
pub mod io;
mod log;
mod noise_colour;
pub mod outcome;
mod parallel;
mod pipeline;
pub mod print;
mod progress;
mod provenance;
pub mod quality;
pub mod recording;
pub mod stand;
mod student;
pub mod unit;
pub mod warning;

use std::process::ExitCode;

/// Runs the command line of this process.
#[must_use]
pub fn run() -> ExitCode {
    if let Err(error) = io::remove_when_interrupted() {
        let message = "interrupting this run may leave a temporary file behind";
        print::say(&format!("torqcomp: {message}: {error}\n"));
    }
    let cli = match cli::parse() {
        Ok(cli) => cli,
        Err(stopped) => return stopped_by(&stopped),
    };
    print::set_quiet(cli.messages.quiet);
    progress::choose(cli.messages.progress, cli.messages.quiet);
    let reading = cli.verb.reading();
    if let Some(mebibytes) = reading.and_then(|reading| reading.longest_metadata) {
        io::mcap::limit_metadata(mebibytes << 20);
    }
    let begun = cli.messages.log.as_deref().map_or(Ok(()), log::begin);
    let code = match begun.and_then(|()| commands::run(cli)) {
        Ok(outcome) => outcome.exit_code(),
        Err(failure) => failed(&failure),
    };
    ExitCode::from(logged(code))
}

/// Says what kept the command from being done; the exit code.
fn failed(failure: &failure::Failure) -> u8 {
    let code = failure.exit_code();
    if code != 0 {
        print::say(&format!("torqcomp: {failure}\n"));
        log::failure(failure);
    }
    print_document(failure);
    code
}

/// Ends the log; the exit code of a run that would have ended with this one.
fn logged(code: u8) -> u8 {
    match log::end(code) {
        Ok(()) => code,
        Err(failure) => {
            print::say(&format!("torqcomp: {failure}\n"));
            code.max(failure.exit_code())
        }
    }
}

/// Says what clap has to say, and how that ends: help and version with 0, wrong usage with 2.
fn stopped_by(stopped: &clap::Error) -> ExitCode {
    let failure = cli::wrong_usage(stopped);
    match &failure {
        // clap does not say which argument it is.
        Some(failure) if stopped.kind() == clap::error::ErrorKind::InvalidUtf8 => {
            print::say(&format!("torqcomp: {failure}\n"));
        }
        _ => {
            // Nobody may be there to read it.
            let _ = stopped.print();
        }
    }
    let Some(failure) = failure else {
        return ExitCode::SUCCESS;
    };
    // The words of the usage are the ones to say; that the log cannot be written as well would hide them.
    if cli::log_asked().is_some_and(|path| log::begin(&path).is_ok()) {
        log::failure(&failure);
    }
    print_document(&failure);
    ExitCode::from(logged(failure.exit_code()))
}

/// Prints a failure as a JSON document where a report was asked for as one and did not appear.
fn print_document(failure: &failure::Failure) {
    if let Some(document) = failure.document()
        && cli::is_json_asked()
        && !io::output::is_stdout_used()
    {
        // The failure itself is the one that the exit code tells of.
        let _ = io::output::print(&print::document(failure::SCHEMA, &document));
    }
}
