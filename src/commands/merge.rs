//! `merge`: the table of a job from the manifests of its runs.

use std::path::Path;

use super::Outcome;
use crate::batch::{self, Merged};
use crate::cli::Merge;
use crate::failure::{ErrorCode, Failure};
use crate::io::output;
use crate::print::{self, Report};

/// Runs the verb.
pub fn run(args: &Merge) -> Result<Outcome, Failure> {
    if args.json && args.result.is_stdout() {
        return Err(ErrorCode::ConflictingArguments.usage(
            "--json and the table both go to standard output; give the table a file with -o",
        ));
    }
    let manifests = batch::manifests(&args.manifests)?;
    let taken: Vec<&Path> = manifests.iter().map(AsRef::as_ref).collect();
    let mut output = args.result.open(&taken)?;
    let merged = Merged::read(&manifests)?;
    if args.json {
        output::print(&merged.document(true))?;
    }
    print::say(&merged.problems());
    output.write(&merged.table()?)?;
    output.finish()?;
    if !args.json {
        print::note(&merged.document(false));
    }
    merged.ended()
}
