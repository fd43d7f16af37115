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
    // clap itself exits with code 2 for wrong usage, and with 0 for help.
    let cli = cli::parse();
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
            ExitCode::from(code)
        }
    }
}
