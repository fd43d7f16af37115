#![doc = include_str!("../README.md")]

mod batch;
mod chart;
mod cli;
mod commands;
mod diagnose;
#[cfg(test)]
mod docs_tests;
pub mod failure;
pub mod identify;
pub mod inverse;
pub mod io;
pub mod outcome;
mod parallel;
mod pipeline;
pub mod print;
mod provenance;
pub mod quality;
pub mod recording;
pub mod stand;
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
    let reading = cli.verb.reading();
    if let Some(mebibytes) = reading.and_then(|reading| reading.longest_metadata) {
        io::mcap::limit_metadata(mebibytes << 20);
    }
    match commands::run(cli) {
        Ok(outcome) => ExitCode::from(outcome.exit_code()),
        Err(failure) => {
            let code = failure.exit_code();
            if code != 0 {
                print::say(&format!("torqcomp: {failure}\n"));
            }
            print_document(&failure);
            ExitCode::from(code)
        }
    }
}

/// Says what clap has to say, and how that ends: help and version with 0, wrong usage with 2.
fn stopped_by(stopped: &clap::Error) -> ExitCode {
    // Nobody may be there to read it.
    let _ = stopped.print();
    match cli::wrong_usage(stopped) {
        Some(failure) => {
            print_document(&failure);
            ExitCode::from(failure.exit_code())
        }
        None => ExitCode::SUCCESS,
    }
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
