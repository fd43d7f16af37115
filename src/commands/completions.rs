//! `completions`: the script that completes the command line in a shell.

use super::Outcome;
use crate::cli::Completions;
use crate::failure::Failure;

/// Runs the verb.
pub fn run(args: &Completions) -> Result<Outcome, Failure> {
    let mut output = args.result.open(&[])?;
    let mut script = Vec::new();
    clap_complete::generate(
        args.shell,
        &mut crate::cli::command(),
        "torqcomp",
        &mut script,
    );
    output.write(&script)?;
    output.finish()?;
    Ok(Outcome::Done)
}
