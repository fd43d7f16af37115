//! Stamps that several samples share because of their rounding.

use torqcomp_decimal::digits;

use super::axis::rounding;
use crate::failure::{ErrorCode, Failure};

/// Maximum number of copies of a row: more rows with one stamp indicate a coarse clock.
const MOST_COPIES: f64 = 4.0;
/// Number of samples with one stamp above which resampling would lose most of them.
const SHARED: f64 = 1.5;
/// Largest fraction of rows missing or written twice that explains rounded stamps as well as another rate: one in three.
const ODD_ROWS: f64 = 0.334;

/// Other possible reasons for rounded stamps that are in `rows` rows on average: every row written several times if that
/// is a whole number; a few rows missing or written twice if it is nearly one.
pub(crate) fn same_stamps(rows: f64, quantum_s: f64) -> String {
    let odd = (rows - 1.0).abs();
    if (1e-6..ODD_ROWS).contains(&odd) {
        let rate = digits::text(1.0 / quantum_s, 6);
        let (which, remedy) = match rows < 1.0 {
            true => ("is missing", format!("--resample --rate {rate}")),
            false => ("was written twice", "--resample".to_owned()),
        };
        return format!(
            "; the same stamps result at {rate} Hz if one row in {} {which}: compare the recorder's rate, and give {remedy} \
             if it is that one",
            digits::text(1.0 / odd, 3),
        );
    }
    let whole = rows.round();
    match (2.0..=MOST_COPIES).contains(&whole) && (rows / whole - 1.0).abs() < 1e-6 {
        true => format!(
            "; each stamp occurs in {whole} rows: if these also repeat their values, every row was written {whole} \
             times, and only one of each belongs to the record"
        ),
        false => String::new(),
    }
}

/// Rejects resampling where several samples share each stamp because of its rounding: all but one of each would be lost.
/// `of_seconds`: seconds per unit of the stamps.
///
/// # Errors
/// If the stamps are rounded to much more than their step.
pub(super) fn refuse_shared_stamps(
    stamps: &[f64],
    step: f64,
    origin: f64,
    of_seconds: f64,
) -> Result<(), Failure> {
    let rounded = rounding(stamps, step, origin);
    match rounded.filter(|line| line.quantum_s > SHARED * line.step_s) {
        Some(line) => Err(ErrorCode::IrregularTime.failed(format_args!(
            "the time stamps are rounded to {} s, and {} samples on average share one; --resample would keep only one \
             of them: omit it, and the samples are placed at the {} Hz that all stamps together give",
            digits::text(line.quantum_s * of_seconds, 3),
            digits::text(line.quantum_s / line.step_s, 3),
            digits::text(1.0 / (line.step_s * of_seconds), 7),
        ))),
        None => Ok(()),
    }
}
