#![doc = include_str!("../README.md")]

mod batch;
mod chart;
mod cli;
mod commands;
mod diagnose;
#[cfg(test)]
mod docs_tests;
mod failure;
mod file_name;
pub mod identify;
mod inverse;
pub mod io;
mod log;
mod noise_colour;
mod outcome;
mod packed_text;
mod parallel;
mod pipeline;
pub mod print;
mod progress;
mod provenance;
pub mod quality;
pub mod recording;
mod stand;
mod student;
mod unit;
pub mod warning;

use std::process::ExitCode;

/// Runs the command line of this process.
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

/// Prints the failure of the command; returns the exit code.
fn failed(failure: &failure::Failure) -> u8 {
    let code = failure.exit_code();
    if code != 0 {
        print::say(&format!("torqcomp: {failure}\n"));
        log::failure(failure);
    }
    print_document(failure);
    code
}

/// Ends the log; returns the exit code of a run that would otherwise end with this one.
fn logged(code: u8) -> u8 {
    match log::end(code) {
        Ok(()) => code,
        Err(failure) => {
            print::say(&format!("torqcomp: {failure}\n"));
            code.max(failure.exit_code())
        }
    }
}

/// Prints clap's output; returns the exit code: 0 for help and version, 2 for wrong usage.
fn stopped_by(stopped: &clap::Error) -> ExitCode {
    let failure = cli::wrong_usage(stopped);
    match &failure {
        // clap does not name the argument.
        Some(failure) if stopped.kind() == clap::error::ErrorKind::InvalidUtf8 => {
            print::say(&format!("torqcomp: {failure}\n"));
        }
        _ => {
            // The stream may be closed.
            let _ = stopped.print();
        }
    }
    let Some(failure) = failure else {
        return ExitCode::SUCCESS;
    };
    // Report the usage error; an additional failure to write the log would hide it.
    if cli::log_asked().is_some_and(|path| log::begin(&path).is_ok()) {
        log::failure(&failure);
    }
    print_document(&failure);
    ExitCode::from(logged(failure.exit_code()))
}

/// Prints a failure as a JSON document if a JSON report was requested and not printed.
fn print_document(failure: &failure::Failure) {
    if let Some(document) = failure.document()
        && cli::is_json_asked()
        && !io::output::is_stdout_used()
    {
        // The exit code is that of the original failure.
        let _ = io::output::print(&print::document(failure::SCHEMA, &document));
    }
}
