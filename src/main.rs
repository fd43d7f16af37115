//! The `torqcomp` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    torqcomp::run()
}
