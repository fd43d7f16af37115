//! Parsing of a stand file.

use std::path::Path;

use toml_edit::{Document, Table};
use torqcomp_model::Unit;

use super::drawing::{beam, friction, part, unusual_modulus};
use super::effects::effect;
use super::measured::{MeasuredCalibration, calibration};
use super::measuring::{bridge, gage, recorder, unusual_gage_factor};
use super::mechanics::mechanics;
use super::section::{Section, SourceText};
use super::{Diagnosed, Mechanics, RecorderData, Stand, TransducerSignal};
use crate::failure::Failure;
use crate::file_name::ShowPath;
use crate::io::storage;
use crate::print::short;
use crate::warning::{Warning, WarningCode};

/// The schema of a stand file.
const SCHEMA: &str = "torqcomp.stand/1";

/// Reads a stand file.
///
/// # Errors
/// If it cannot be read, is not TOML, or contains an invalid key or value; the message names the
/// line.
pub fn read(path: &Path) -> Result<Stand, Failure> {
    let (name, text) = text(path)?;
    parse(&name, &text)
}

/// Name and text of a stand file.
///
/// # Errors
/// If it cannot be read.
pub fn text(path: &Path) -> Result<(String, String), Failure> {
    match storage::read_to_string(path) {
        Ok(text) => Ok((path.shown().to_string(), text)),
        Err(error) => Err(Failure::reading(path, &error)),
    }
}

/// Parses a stand from text; `name` is used in messages.
///
/// # Errors
/// As for [`read`].
pub fn parse(name: &str, text: &str) -> Result<Stand, Failure> {
    let source = SourceText { name, text };
    let document = document(&source)?;
    let top = Section::new(&source, "", document.as_table(), Some(0));
    check_schema(&top)?;
    let nothing = Table::new();
    let plain_recorder = Section::new(&source, "[recorder]", &nothing, None);
    // For readers of the file.
    top.text("name")?;
    let mut stand = Stand {
        file: name.to_owned(),
        mechanics: mechanics(&top)?,
        calibration: one(&top, "calibration", calibration)?,
        beam: one(&top, "beam", beam)?,
        parts: top
            .sections("parts")?
            .iter()
            .map(part)
            .collect::<Result<_, _>>()?,
        friction: one(&top, "friction", friction)?,
        gage: one(&top, "gage", gage)?,
        bridge: one(&top, "bridge", bridge)?,
        recorder: recorder(&top.section("recorder")?.unwrap_or(plain_recorder))?,
        effects: Vec::new(),
        diagnosed: Diagnosed::default(),
        warnings: Vec::new(),
    };
    let effect_sections = top.sections("effects")?;
    stand.diagnosed = one(&top, "diagnosed", diagnosed)?.unwrap_or_default();
    top.finish()?;
    one_calibration(&top, &stand)?;
    stand.warnings = oddities(&stand);
    stand.effects = effect_sections
        .iter()
        .map(|section| effect(section, stand.recorded_unit()))
        .collect::<Result<_, _>>()?;
    Ok(stand)
}

fn document<'a>(source: &SourceText<'a>) -> Result<Document<&'a str>, Failure> {
    Document::parse(source.text).map_err(|error| {
        let message = error.message().replace('\n', ", ");
        let hint = if source.text.contains(SCHEMA) {
            ""
        } else {
            "; this does not look like a stand file, which starts with schema = \"torqcomp.stand/1\""
        };
        source.at(error.span().map(|span| span.start), format_args!("{message}{hint}"))
    })
}

/// A section of a possibly incomplete stand file.
fn section_of<T>(
    (name, text): (&str, &str),
    key: &'static str,
    read: impl Fn(&Section) -> Result<T, Failure>,
) -> Result<Option<T>, Failure> {
    let source = SourceText { name, text };
    let document = document(&source)?;
    one(
        &Section::new(&source, "", document.as_table(), Some(0)),
        key,
        read,
    )
}

/// The recorder of a possibly incomplete stand file.
///
/// # Errors
/// If its section contains an invalid key or value.
pub fn recorder_of(name: &str, text: &str) -> Result<Option<RecorderData>, Failure> {
    section_of((name, text), "recorder", recorder)
}

/// The calibration of a possibly incomplete stand file.
///
/// # Errors
/// As for [`recorder_of`].
pub fn calibration_of(name: &str, text: &str) -> Result<Option<MeasuredCalibration>, Failure> {
    section_of((name, text), "calibration", calibration)
}

/// An optional section.
fn one<T>(
    top: &Section,
    key: &'static str,
    read: impl Fn(&Section) -> Result<T, Failure>,
) -> Result<Option<T>, Failure> {
    top.section(key)?.map(|section| read(&section)).transpose()
}

fn check_schema(top: &Section) -> Result<(), Failure> {
    match top.text("schema")? {
        Some(SCHEMA) => Ok(()),
        Some(other) => Err(top.fail(
            "schema",
            format_args!("\"{other}\" is not known; this version reads \"{SCHEMA}\""),
        )),
        None => Err(top.fail(
            "",
            format_args!("schema is missing; write schema = \"{SCHEMA}\""),
        )),
    }
}

/// Implausible settings.
fn oddities(stand: &Stand) -> Vec<Warning> {
    let modes = stand.mechanics.iter().flat_map(Mechanics::damping_ratios);
    let overdamped = modes.filter(|ratio| *ratio > 1.0).map(|ratio| {
        WarningCode::DampingAboveOne.warning(format!(
            "{}: the damping ratio is {}, so the stand does not ring; if this is a percentage, write 7 % as 0.07",
            stand.file,
            short(ratio)
        ))
    });
    let modulus = stand.beam.as_ref().and_then(unusual_modulus);
    let left = stand
        .mechanics
        .as_ref()
        .and_then(|m| m.much_left(&stand.file));
    let factor = stand.gage.as_ref().and_then(unusual_gage_factor);
    let gage = modulus.into_iter().chain(factor);
    let order = assumed_order(stand);
    let open = left_unexplained(stand);
    overdamped
        .chain(gage)
        .chain(left)
        .chain(order)
        .chain(open)
        .collect()
}

/// A warning if the diagnosis that refined the stand did not explain its records.
fn left_unexplained(stand: &Stand) -> Option<Warning> {
    let Diagnosed { verdict, .. } = &stand.diagnosed;
    let ending = match verdict.as_deref()? {
        "unexplained" => "did not explain its records",
        "partly-explained" => "explained its records only in part",
        _ => return None,
    };
    Some(WarningCode::DiagnosisIncomplete.warning(format!(
        "{}: the diagnosis that wrote this file {ending} ({}): its constants and effects compensate for model \
         errors, so torque may be less accurate than with the previous file; compare both on a record with a known \
         torque",
        stand.file,
        verdict.as_deref().unwrap_or_default(),
    )))
}

/// A warning if the order of a low-pass was assumed to be 1 (RC).
fn assumed_order(stand: &Stand) -> Option<Warning> {
    stand.recorder.is_order_assumed.then(|| {
        WarningCode::LowPassOrderAssumed.warning(format!(
            "{}: the order of [recorder] low_pass is not given: 1, an RC low-pass, was assumed; give \
             low_pass_order (anti-aliasing filters have 2 to 8)",
            stand.file
        ))
    })
}

/// Rejects settings that would convert the record twice, or give its zero twice.
fn one_calibration(top: &Section, stand: &Stand) -> Result<(), Failure> {
    if stand.static_gain().is_some() && stand.calibration.is_some() {
        return Err(top.fail(
            "calibration",
            "this section and the static_gain of [mechanics] both convert the record to torque; keep one of them",
        ));
    }
    let of_calibration = stand.calibration.as_ref();
    let of_recorder = stand.recorder.zero.as_ref();
    if of_calibration.is_some_and(|calibration| calibration.zero.is_some())
        && of_recorder.is_some_and(|(of, _)| *of == TransducerSignal::Frequency)
    {
        return Err(top.fail(
            "recorder",
            "zero and zero_frequency of [calibration] both give the record at no load; keep one of them",
        ));
    }
    let change = of_calibration.and_then(MeasuredCalibration::change_at_rated);
    if let (Some((signal, change)), Some((of, zero))) = (change, of_recorder)
        && signal == *of
        && let Some(why) = signal.beyond_loop(change, zero.value())
    {
        return Err(top.fail(
            "calibration",
            format_args!("the sensitivity does not match the zero of [recorder]: {why}"),
        ));
    }
    Ok(())
}

/// Entries written by a diagnosis; unused ones are informative only.
fn diagnosed(section: &Section) -> Result<Diagnosed, Failure> {
    for key in ["applied_unit", "records"] {
        let _ = section.text(key)?;
    }
    let quantity = |key: &'static str| -> Result<f64, Failure> {
        let Some(text) = section.raw(key)? else {
            return Ok(0.0);
        };
        let (number, unit) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
        let wrong = || {
            section.fail(
                key,
                format_args!("\"{text}\": expected a number and the unit of the record"),
            )
        };
        let number: f64 = number.parse().map_err(|_| wrong())?;
        let unit = Unit::parse(unit).map_err(|error| section.fail(key, error))?;
        Ok(number * unit.factor())
    };
    let found = Diagnosed {
        measured_unit: section.text("measured_unit")?.map(str::to_owned),
        verdict: section.text("verdict")?.map(str::to_owned),
        offset: quantity("offset")?,
        shift: quantity("shift")?,
    };
    section.finish()?;
    Ok(found)
}

#[cfg(test)]
mod tests;
