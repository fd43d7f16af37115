//! What the records of a diagnosis have in common: rate and units, but not their samples.

use super::read::Pair;
use crate::failure::{ErrorCode, Failure};
use crate::print::short;
use crate::unit::NamedUnit;

/// Converts a record to the units of the first; rejects it if they are of different kinds, or its rate differs.
pub(super) fn make_alike(first: &Pair, other: &mut Pair) -> Result<(), Failure> {
    if (first.rate_hz / other.rate_hz - 1.0).abs() > 1e-4 {
        return Err(ErrorCode::RecordsDiffer.failed(format_args!(
            "{} is sampled at {} Hz, {} at {} Hz: all records of a diagnosis must have the same sampling rate; \
             resample one of them",
            first.source,
            short(first.rate_hz),
            other.source,
            short(other.rate_hz)
        )));
    }
    let differ = || {
        ErrorCode::RecordsDiffer.failed(format_args!(
            "{} and {} have their channels in units of different kinds, or only one of them says its units; choose \
             the channels of one kind, or write the units into its headings",
            first.source, other.source
        ))
    };
    let factor = |of: fn(&Pair) -> &Option<NamedUnit>| {
        let [from, to] = [&*other, first].map(|pair| of(pair).as_ref());
        NamedUnit::factor_between(from, to).ok_or_else(differ)
    };
    let of_measured = factor(|pair| &pair.measured_unit)?;
    // A free decay has none.
    if first.applied.is_some() && other.applied.is_some() {
        let of_applied = factor(|pair| &pair.applied_unit)?;
        let applied = other.applied.iter_mut().flatten();
        applied.for_each(|value| *value *= of_applied);
        other.applied_unit.clone_from(&first.applied_unit);
    }
    let measured = other.measured.iter_mut();
    measured.for_each(|value| *value *= of_measured);
    other.measured_unit.clone_from(&first.measured_unit);
    Ok(())
}

/// Rejects a hold-out record that is also a training record.
pub(super) fn refuse_same_samples(train: &[Pair], holdout: &[Pair]) -> Result<(), Failure> {
    let is_same = |a: &Pair, b: &Pair| a.measured == b.measured && a.applied == b.applied;
    let mut pairs = holdout
        .iter()
        .flat_map(|h| train.iter().map(move |t| (h, t)));
    match pairs.find(|(h, t)| is_same(h, t)) {
        None => Ok(()),
        Some((h, t)) => {
            let omit = match h.applied {
                Some(_) => "omit --holdout to hold out the last 30 % of each training record",
                None => "omit --holdout-decay to hold out the last of several decays",
            };
            Err(ErrorCode::RecordsDiffer.failed(format_args!(
                "{} has the same samples as the training record {}; give another hold-out record, or {omit}",
                h.source, t.source
            )))
        }
    }
}
