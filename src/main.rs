//! The `torqcomp` command.

use std::process::ExitCode;

use clap::Parser;
use torqcomp::cli::Cli;
use torqcomp::commands::{self, Outcome};
use torqcomp::io::output;
use torqcomp::print;

fn main() -> ExitCode {
    if let Err(error) = output::clean_up_when_interrupted() {
        let message = "interrupting this run may leave a temporary file behind";
        print::say(&format!("torqcomp: {message}: {error}\n"));
    }
    // clap ends wrong usage with code 2 itself, and help with 0.
    match commands::run(Cli::parse()) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::WithLoss) => ExitCode::from(3),
        Err(failure) => {
            let code = failure.exit_code();
            if code != 0 {
                print::say(&format!("torqcomp: {failure}\n"));
            }
            ExitCode::from(code)
        }
    }
}
