//! `diagnose`: what the stand lacks, and the error before and after it is added.

mod page;
mod read;
mod refined;
mod text;

use std::io::IsTerminal;
use std::path::Path;

use super::{Outcome, conclude, publish};
use crate::cli::Diagnose;
use crate::diagnose::{self, Workers};
use crate::failure::Failure;
use crate::io::output::Output;
use crate::print;
use crate::stand::{self, Stand};

/// Runs the verb.
pub fn run(args: &Diagnose) -> Result<Outcome, Failure> {
    let stand: Option<(Stand, String)> = match &args.stand {
        None => None,
        Some(path) => {
            let (name, text) = stand::text(path)?;
            Some((stand::parse(&name, &text)?, text))
        }
    };
    let records = args.train.iter().chain(&args.holdout).map(Path::new);
    let files: Vec<&Path> = records.chain(args.stand.as_deref()).collect();
    let open = |place: &String| Output::open(Some(place), args.force, &files);
    let refined = args.output.as_ref().map(open).transpose()?;
    let html = args.html.as_ref().map(open).transpose()?;
    let output = Output::open(None, args.force, &files)?;
    let (case, is_lossy) = read::read(args, stand.as_ref().map(|(stand, _)| stand))?;
    let is_shown = !args.work.quiet && std::io::stderr().is_terminal();
    let progress = |done: usize, of: usize| {
        if is_shown {
            let end = if done == of { "\r\x1b[K" } else { "" };
            print::say(&format!("\r{done} of {of} fits{end}"));
        }
    };
    let workers = Workers {
        threads: args.work.thread_count(),
        progress: &progress,
    };
    let diagnosis = diagnose::run(case, workers)?;
    if let Some(refined) = refined {
        let declared = stand.as_ref().map(|(stand, text)| (stand, text.as_str()));
        write(refined, &refined::stand_file(&diagnosis, declared)?)?;
    }
    if let Some(html) = html {
        write(html, &page::page(&diagnosis))?;
    }
    publish(&diagnosis, args.json, output)?;
    Ok(conclude(&diagnosis.warnings, is_lossy, args.strict))
}

fn write(mut output: Output, text: &str) -> Result<(), Failure> {
    output.write(text.as_bytes())?;
    output.finish()
}
