//! `diagnose`: what the stand lacks, and the error before and after it is added.

mod read;
mod refined;
mod render;

use std::io::IsTerminal;
use std::path::Path;

use super::{Outcome, conclude};
use crate::cli::Diagnose;
use crate::diagnose::{self, Diagnosis, Verdict};
use crate::failure::Failure;
use crate::io::output::Output;
use crate::print::{self};
use crate::stand::{self, Stand};
use crate::warning::Warning;

/// Runs the verb.
pub fn run(args: &Diagnose) -> Result<Outcome, Failure> {
    let stand: Option<(Stand, String)> = match &args.stand {
        None => None,
        Some(path) => {
            let (name, text) = stand::text(path)?;
            Some((stand::parse(&name, &text)?, text))
        }
    };
    let files: Vec<&Path> = args
        .train
        .iter()
        .chain(&args.holdout)
        .map(Path::new)
        .chain(args.stand.as_deref())
        .collect();
    let refined = match &args.output {
        Some(place) => Some(Output::open(Some(place), args.force, &files)?),
        None => None,
    };
    let page = match &args.html {
        Some(place) => Some(Output::open(Some(place), args.force, &files)?),
        None => None,
    };
    let mut output = Output::open(None, args.force, &files)?;
    let mut read = read::read(args, stand.as_ref().map(|(stand, _)| stand))?;
    let (frame, found) = diagnose::prepare(&mut read.case)?;
    diagnose::check(&read.case, &frame, found)?;
    read.refine(&found);
    let levels = read.levels();
    let shown = !args.work.quiet && std::io::stderr().is_terminal();
    let progress = |done: usize, of: usize| {
        if shown {
            print::say(&format!(
                "\r{done} of {of} fits{}",
                if done == of { "\r\x1b[K" } else { "" }
            ));
        }
    };
    let declared = read.case.declared;
    let diagnosis = diagnose::run(read.case, &frame, found, &progress)?;
    let mut warnings = read.warnings;
    warnings.extend(apart(&diagnosis));
    let rendered = render::Rendered {
        args,
        diagnosis: &diagnosis,
        units: &read.units,
        declared,
        levels,
        warnings,
    };
    let report = rendered.report();
    if let Some(mut refined) = refined {
        let text = rendered.stand(stand.as_ref().map(|(stand, text)| (stand, text.as_str())))?;
        refined.write(text.as_bytes())?;
        refined.finish()?;
    }
    if let Some(mut page) = page {
        page.write(report.page(&rendered.sights()).as_bytes())?;
        page.finish()?;
    }
    let text = if args.json {
        print::json(&report)
    } else {
        report.text()
    };
    output.write(text.as_bytes())?;
    output.finish()?;
    Ok(conclude(&report.warnings, false, args.strict))
}

/// Says so where training and held-out records do not follow one stand.
fn apart(diagnosis: &Diagnosis) -> Option<Warning> {
    if matches!(
        diagnosis.verdict,
        Verdict::Explained | Verdict::NothingMissing
    ) {
        return None;
    }
    let [train, hold] = diagnose::apart(diagnosis)?;
    Some(Warning::new(
        "records-apart",
        format!(
            "no one stand fits both: the training records alone give {:.5} Hz and a damping ratio of {:.4}, the held-out ones \
             {:.5} Hz and {:.4}; they are of two stands or settings, or the stand changes with the level",
            train.natural_hz, train.damping_ratio, hold.natural_hz, hold.damping_ratio
        ),
    ))
}
