//! Free-decay records of the measured quantity alone.

use std::ops::Range;
use std::path::Path;

use torqcomp_dsp::onset;

use super::read::{FEWEST, Pair};
use super::running::measured_alone;
use crate::cli::Diagnose;
use crate::failure::{ErrorCode, Failure};
use crate::identify::decay::{self, Ringing};
use crate::warning::Warning;

/// The decays in a record of the measured quantity alone, each from its largest swing.
pub fn decays(args: &Diagnose, file: &Path) -> Result<Vec<Pair>, Failure> {
    let read = measured_alone(args, file)?;
    let ranges = onset::decays(&read.measured).into_iter();
    let long: Vec<Range<usize>> = ranges.filter(|range| range.len() >= FEWEST).collect();
    if long.is_empty() {
        return Err(ErrorCode::TooFewSamples.failed(format_args!(
            "no free decay of at least {FEWEST} samples is found; try another channel or --range, or record for longer"
        ))
        .at(&read.source));
    }
    let times_s = (0..read.measured.len()).map(|i| read.start_s + i as f64 / read.rate_hz);
    let ringing = Ringing {
        name: &read.source,
        times_s: &times_s.collect::<Vec<_>>(),
        rate_hz: Some(read.rate_hz),
        values: &read.measured,
    };
    let doubts = decay::check(&ringing).map_err(|failure| failure.at(&read.source))?;
    let named = doubts.into_iter().map(|doubt| Warning {
        message: format!("{}: {}", read.source, doubt.message),
        ..doubt
    });
    let mut warnings = read.warnings;
    warnings.extend(named);
    let pairs = long.into_iter().map(|range| Pair {
        source: read.source.clone(),
        applied: None,
        measured: read.measured[range.clone()].to_vec(),
        rate_hz: read.rate_hz,
        start_s: read.start_s + range.start as f64 / read.rate_hz,
        applied_unit: None,
        measured_unit: read.measured_unit.clone(),
        warnings: std::mem::take(&mut warnings),
        is_lossy: read.is_lossy,
    });
    Ok(pairs.collect())
}

/// Rejects arguments that do not apply to free-decay records.
pub fn check_arguments(args: &Diagnose) -> Result<(), Failure> {
    if args.training_files().is_empty() {
        return Err(ErrorCode::MissingArgument.usage(
            "--holdout-decay and --running only check a fit, and no record to fit is given: add a free decay with \
             --decay FILE, or a record with an applied quantity with --train FILE and --applied COL",
        ));
    }
    let of_applied = [
        ("--applied", &args.applied),
        ("--applied-unit", &args.applied_unit),
    ];
    let given = of_applied.into_iter().find(|(_, value)| value.is_some());
    match given {
        Some((flag, _)) if args.train.is_empty() && args.static_loads.is_empty() => {
            Err(ErrorCode::ConflictingArguments.usage(format_args!(
                "{flag} does not apply to --decay, as nothing acts on a stand during a free decay: omit {flag}, or \
                 give records with an applied quantity with --train or --static"
            )))
        }
        _ => Ok(()),
    }
}

/// The last decay, removed from the training records, which must contain another one.
pub fn last(train: &mut Vec<Pair>) -> Result<Option<Pair>, Failure> {
    if let [only] = train.as_slice() {
        return Err(ErrorCode::TooFewSamples.failed(
            "the only decay is fitted, and none is left to check the result: record another one, preferably of another \
             size, and give it with --holdout-decay",
        )
        .at(&only.source));
    }
    Ok(train.pop())
}

/// A stand file from free decays alone would lack the gain that its effects need.
pub fn no_gain() -> Failure {
    ErrorCode::MissingArgument.usage(
        "a free decay does not determine the gain, without which a stand file cannot express an effect in the unit of \
         the record as a torque: give known loads with --static FILE and --applied COL, or --stand FILE with a \
         static_gain or a [calibration], or omit -o",
    )
}
