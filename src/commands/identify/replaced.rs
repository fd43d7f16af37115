//! Plausibility of a calibration with weights against the stand file that it changes.

use super::stand_text;
use crate::cli::identify::Findings;
use crate::failure::Failure;
use crate::identify::Identification;
use crate::print::{rounded, short};
use crate::stand::{self, TransducerSignal, is_far_beyond_rated};
use crate::warning::{Warning, WarningCode};

/// Relative difference of a new calibration from the one that it replaces, above which it is questioned: far more than the
/// drift of a bridge.
const DIFFERS: f64 = 0.1;

/// Constants of a calibration: name, signal, unit and size of that unit in SI units.
const CONSTANTS: [(&str, TransducerSignal, &str, f64); 2] = [
    ("torque_per_volt", TransducerSignal::Voltage, "N m/V", 1.0),
    (
        "torque_per_ratio",
        TransducerSignal::Ratio,
        "N m/(mV/V)",
        1e3,
    ),
];

/// Warnings about a calibration in N m that differs from the one in the stand file, or whose loads are far beyond the rated
/// torque given there.
///
/// # Errors
/// If the stand file cannot be read.
pub(super) fn warnings(
    result: &Identification,
    findings: &Findings,
) -> Result<Vec<Warning>, Failure> {
    let Some((name, text)) = stand_text(findings)? else {
        return Ok(Vec::new());
    };
    let Some(declared) = stand::calibration_of(&name, &text)? else {
        return Ok(Vec::new());
    };
    let differs = CONSTANTS.iter().find_map(|(key, signal, unit, size)| {
        let found = result.get(key)?.value();
        let known = declared.constant_of(*signal)?.value() / size;
        let times = found / known;
        ((times - 1.0).abs() > DIFFERS).then(|| {
            format!(
                "the loads give {} {unit}, {} times the {} {unit} of {name}{}: check --radius, --gravity, the unit of the \
                 loads and the gain of the amplifier",
                rounded(found, 5),
                rounded(times, 3),
                rounded(known, 5),
                match findings.result.output {
                    Some(_) => ", which they replace",
                    None => "",
                }
            )
        })
    });
    let largest = result
        .steps
        .iter()
        .fold(0.0_f64, |m, s| m.max(s.load.abs()));
    let rated = declared
        .rated_n_m
        .filter(|rated| is_far_beyond_rated(largest, *rated));
    let beyond = rated.map(|rated| {
        format!(
            "the loads reach {} N m, {} times the rated torque of {} N m in {name}: check --radius, --gravity and the \
             unit of the loads, or the rated torque",
            short(largest),
            rounded(largest / rated, 3),
            short(rated)
        )
    });
    let differs = differs.map(|text| WarningCode::CalibrationDiffers.warning(text));
    let beyond = beyond.map(|text| WarningCode::BeyondRatedTorque.warning(text));
    Ok(differs.into_iter().chain(beyond).collect())
}
