//! `diagnose`: effects missing from the stand model, and the error before and after adding them.

mod alike;
mod checks;
mod decays;
mod declared;
mod loads;
mod memory;
mod page;
mod read;
mod refined;
mod running;
mod text;

use std::path::{Path, PathBuf};

use super::{Outcome, conclude};
use crate::cli::Diagnose;
use crate::diagnose::{self, Case, Diagnosis, Workers};
use crate::failure::Failure;
use crate::io::output;
use crate::print::Report;
use crate::progress::{Amount, Progress, Task};
use crate::provenance::Provenance;
use crate::stand::{self, Stand};

/// Runs the verb.
pub fn run(args: &Diagnose) -> Result<Outcome, Failure> {
    decays::check_arguments(args)?;
    let stand: Option<(Stand, String)> = match &args.stand {
        None => None,
        Some(path) => {
            let (name, text) = stand::text(path)?;
            let stand = stand::parse(&name, &text)?;
            stand.refuse_late_start(&args.reading)?;
            Some((stand, text))
        }
    };
    let records = args.records();
    let files = records.iter().map(PathBuf::as_path);
    let files: Vec<&Path> = files.chain(args.stand.as_deref()).collect();
    let result = &args.result;
    let mut refined = result
        .output
        .as_ref()
        .map(|_| result.open(&files))
        .transpose()?;
    let mut html = result.open_beside(args.html.as_deref(), &files)?;
    let provenance = html.as_ref().map(|_| provenance(args, stand.as_ref()));
    let provenance = provenance.transpose()?;
    let read = read::read(args, stand.as_ref().map(|(stand, _)| stand))?;
    let has_gain = !args.train.is_empty() || !read.loads.is_empty() || read.case.units.is_torque;
    if refined.is_some() && stand.is_none() && !has_gain {
        return Err(decays::no_gain());
    }
    let mut diagnosis = fitted(read.case, args.work.thread_count())?;
    diagnosis.check_loads(&read.loads, read.declared_gain)?;
    diagnosis.check_running(&read.running);
    diagnosis.shows_all = args.all;
    if let Some(refined) = &mut refined {
        let declared = stand.as_ref().map(|(stand, text)| (stand, text.as_str()));
        refined.write(refined::stand_file(&diagnosis, declared)?.as_bytes())?;
    }
    if let (Some(html), Some(provenance)) = (&mut html, provenance) {
        html.write(page::page(&diagnosis, &provenance).as_bytes())?;
    }
    output::print(&diagnosis.document(args.json))?;
    output::finish_all(refined.into_iter().chain(html))?;
    Ok(conclude(
        &diagnosis.warnings,
        read.is_lossy,
        &args.strictness,
    ))
}

/// The diagnosis, with its progress.
fn fitted(case: Case, threads: usize) -> Result<Diagnosis, Failure> {
    let fits = Progress::new(Task::Fits);
    let progress = |done: usize, of: usize| {
        fits.report(Amount::of_count(done), Some(Amount::of_count(of)));
    };
    let progress = &progress;
    diagnose::run(case, Workers { threads, progress })
}

/// Provenance of the page.
fn provenance(args: &Diagnose, stand: Option<&(Stand, String)>) -> Result<Provenance, Failure> {
    let stand = stand.map(|(stand, text)| (stand.file.as_str(), text.as_str()));
    Provenance::of(&args.records(), stand)
}
