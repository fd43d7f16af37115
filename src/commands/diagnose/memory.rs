//! Memory of a diagnosis.

use super::read::Pair;
use crate::cli::Diagnose;
use crate::failure::Failure;
use crate::file_name;
use crate::recording::MemoryNeed;

/// Memory of a diagnosis per row of two channels, in bytes: of the records and one fit, and as measured for a linear
/// stand.
const LEAST_PER_ROW: u64 = 100;
const USUAL_PER_ROW: u64 = 600;

/// Warns if the fits to records take more memory than is free, and rejects those that exceed the limit of the process.
pub(super) fn must_fit<'a>(
    args: &Diagnose,
    pairs: impl Iterator<Item = &'a Pair>,
) -> Result<(), Failure> {
    let rows: u64 = pairs.map(|pair| pair.measured.len() as u64).sum();
    let need = MemoryNeed {
        name: &file_name::list(&args.records()),
        takes: [": the diagnosis takes", "the fits take"],
        remedy: "choose a shorter part with --range",
        least: LEAST_PER_ROW.saturating_mul(rows),
        usual: USUAL_PER_ROW.saturating_mul(rows),
    };
    need.look()
}
