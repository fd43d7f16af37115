//! Reading a stand file.

use std::path::Path;

use toml_edit::Document;
use torqcomp_model::{Estimate, Kind, ParameterStd, SecondOrder, Unit};

use super::drawing::{beam, friction, part, unusual_modulus};
use super::effects::effect;
use super::measured::calibration;
use super::measuring::{bridge, gage, recorder};
use super::section::{Section, SourceText};
use super::update::CORRELATIONS;
use super::{Diagnosed, Given, Mechanics, Stand, StaticGain, TransducerSignal};
use crate::failure::Failure;
use crate::io::storage;
use crate::print::short;
use crate::warning::Warning;

/// The schema of a stand file.
const SCHEMA: &str = "torqcomp.stand/1";

/// Reads a stand file.
///
/// # Errors
/// If it cannot be read, is no TOML, or holds a key or value that does not belong there; the
/// message names the line.
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
        Ok(text) => Ok((path.display().to_string(), text)),
        Err(error) => Err(Failure::reading(path, &error)),
    }
}

/// Reads a stand from text; `name` stands in messages.
///
/// # Errors
/// As [`read`].
pub fn parse(name: &str, text: &str) -> Result<Stand, Failure> {
    let source = SourceText { name, text };
    let document = Document::parse(text).map_err(|error| {
        let message = error.message().replace('\n', ", ");
        let hint = if text.contains(SCHEMA) {
            ""
        } else {
            "; this does not look like a stand file, which begins with schema = \"torqcomp.stand/1\""
        };
        source.at(error.span().map(|span| span.start), format_args!("{message}{hint}"))
    })?;
    let top = Section::new(&source, "", document.as_table(), Some(0));
    check_schema(&top)?;
    let mut stand = Stand {
        name: top.text("name")?.unwrap_or("unnamed stand").to_owned(),
        file: name.to_owned(),
        mechanics: one(&top, "mechanics", mechanics)?,
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
        recorder: recorder(top.section("recorder")?.as_ref())?,
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

/// A section that may be there once.
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

/// What can hardly be meant.
fn oddities(stand: &Stand) -> Vec<Warning> {
    let ratio = stand.mechanics.as_ref().map(|m| m.response.damping_ratio());
    let overdamped = ratio.filter(|ratio| *ratio > 1.0).map(|ratio| {
        Warning::new(
            "damping-above-one",
            format!(
                "{}: the damping ratio is {}, so that the stand does not ring; if a percentage is meant, write 7 % as 0.07",
                stand.file,
                short(ratio)
            ),
        )
    });
    let modulus = stand.beam.as_ref().and_then(unusual_modulus);
    overdamped.into_iter().chain(modulus).collect()
}

/// What would convert the record twice, or give its zero twice.
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
    Ok(())
}

fn mechanics(section: &Section) -> Result<Mechanics, Failure> {
    let modal = section.has("natural_frequency") || section.has("damping_ratio");
    let constants = ["inertia", "damping", "stiffness"];
    if modal && let Some(key) = constants.iter().find(|key| section.has(key)) {
        return Err(section.fail(
            key,
            "give either inertia, damping and stiffness, or natural_frequency and damping_ratio",
        ));
    }
    let mechanics = if modal {
        modal_mechanics(section)?
    } else {
        let inertia = section.positive("inertia", Kind::Inertia)?;
        let damping = section.not_negative("damping", Kind::AngularDamping)?;
        let stiffness = section.positive("stiffness", Kind::AngularStiffness)?;
        let common = common_std(section)?;
        let correlations = correlations(section)?;
        if common > 0.0 && correlations != [0.0; 3] {
            return Err(section.fail(
                "common_std",
                "the correlations include what the three constants share; keep one of them",
            ));
        }
        let own = |estimate: &Estimate| own_std(section, estimate, common);
        let response = SecondOrder::new(inertia.value(), damping.value(), stiffness.value())
            .map_err(|error| section.fail("", error))?;
        // So that the message about an unknown key lists those of both forms.
        let _ = (
            section.raw("natural_frequency"),
            section.raw("damping_ratio"),
        );
        Mechanics {
            response,
            std: ParameterStd {
                inertia_kg_m2: own(&inertia)?,
                damping_n_m_s_per_rad: own(&damping)?,
                stiffness_n_m_per_rad: own(&stiffness)?,
                static_gain_relative: None,
                correlations,
            },
            given: Given::Constants {
                inertia,
                damping,
                stiffness,
            },
        }
    };
    section.finish()?;
    Ok(mechanics)
}

/// Relative standard uncertainty that inertia, damping and stiffness share, since two of them follow from the third.
fn common_std(section: &Section) -> Result<f64, Failure> {
    let Some(common) = section.quantity("common_std", Kind::Ratio)? else {
        return Ok(0.0);
    };
    if common.value() >= 0.0 {
        return Ok(common.value());
    }
    Err(section.fail("common_std", "expected a ratio of zero or more"))
}

/// Correlation coefficients of inertia and damping, inertia and stiffness, damping and stiffness.
fn correlations(section: &Section) -> Result<[f64; 3], Failure> {
    let mut found = [0.0; 3];
    for (key, value) in CORRELATIONS.into_iter().zip(&mut found) {
        if let Some(given) = section.quantity(key, Kind::Ratio)? {
            *value = given.value();
        }
        if value.abs() > 1.0 {
            return Err(section.fail(key, "expected a correlation from -1 to 1"));
        }
    }
    Ok(found)
}

/// Largest part by which the common uncertainty may exceed the whole one: both are rounded.
const ROUNDED: f64 = 1e-6;

/// What is left of a standard uncertainty without the common part, which cancels in every ratio of the constants: the
/// stand's response follows from these alone.
fn own_std(section: &Section, estimate: &Estimate, common: f64) -> Result<Option<f64>, Failure> {
    let Some(std) = estimate.std_uncertainty() else {
        return Ok(None);
    };
    let shared = common * estimate.value();
    if shared > std * (1.0 + ROUNDED) {
        return Err(section.fail(
            "common_std",
            "expected no more than the relative std of inertia, damping and stiffness, which hold it",
        ));
    }
    Ok(Some((std * std - shared * shared).max(0.0).sqrt()))
}

/// Asks for a natural frequency in 1/s, which is one in Hz to some and an angular one to others.
fn refuse_bare_rate(section: &Section) -> Result<(), Failure> {
    let Some(text) = section.raw("natural_frequency")? else {
        return Ok(());
    };
    let (number, unit) = text.trim().split_once(' ').unwrap_or_default();
    match unit.replace([' ', '{', '}'], "").as_str() {
        "1/s" | "/s" | "s^-1" | "s-1" | "s⁻¹" => Err(section.fail(
            "natural_frequency",
            format_args!(
                "\"{text}\" can be read as cycles or as radians a second; write \"{number} Hz\" or \"{number} rad/s\""
            ),
        )),
        _ => Ok(()),
    }
}

fn modal_mechanics(section: &Section) -> Result<Mechanics, Failure> {
    refuse_bare_rate(section)?;
    let natural_frequency = section.positive("natural_frequency", Kind::Frequency)?;
    let damping_ratio = section.not_negative("damping_ratio", Kind::Ratio)?;
    let static_gain = static_gain(section)?;
    let response =
        SecondOrder::from_natural_frequency(natural_frequency.value(), damping_ratio.value())
            .map_err(|error| section.fail("", error))?;
    // With the stiffness fixed, J = 1/ω² and f = 2ζ/ω: u(J)/J = 2 u(ω)/ω, u(f)/f ≈ u(ζ)/ζ.
    let frequency_part = natural_frequency
        .std_uncertainty()
        .map(|std| std / natural_frequency.value());
    let std = ParameterStd {
        inertia_kg_m2: frequency_part.map(|part| 2.0 * part * response.inertia_kg_m2()),
        damping_n_m_s_per_rad: damping_ratio.std_uncertainty().map(|std| {
            2.0 * std * response.stiffness_n_m_per_rad()
                / (std::f64::consts::TAU * natural_frequency.value())
        }),
        ..ParameterStd::default()
    };
    Ok(Mechanics {
        response,
        std,
        given: Given::Modal {
            natural_frequency,
            damping_ratio,
            static_gain,
        },
    })
}

/// `"1 V/V"`: recorded over applied, each in its own unit.
fn static_gain(section: &Section) -> Result<Option<StaticGain>, Failure> {
    let Some((text, std)) = section.raw_with_std("static_gain")? else {
        return Ok(None);
    };
    let (value, recorded_unit, applied_unit) = gain(section, &text)?;
    if value == 0.0 || !value.is_finite() {
        return Err(section.fail(
            "static_gain",
            "the gain must be a finite number other than zero",
        ));
    }
    let std = std.map(|std| gain(section, &std)).transpose()?;
    if std.as_ref().is_some_and(|(std, ..)| *std < 0.0) {
        return Err(section.fail("static_gain", "std must be zero or more"));
    }
    Ok(Some(StaticGain {
        value,
        recorded_unit,
        applied_unit,
        relative_std: std.map(|(std, ..)| std / value.abs()),
    }))
}

/// A gain in SI units, and the units of record and applied quantity as written.
fn gain(section: &Section, text: &str) -> Result<(f64, String, String), Failure> {
    let expected = "expected recorded over applied unit, as in \"1 V/V\" or \"2.5 mV/N\"";
    let wrong = || section.fail("static_gain", format_args!("\"{text}\": {expected}"));
    let (number, units) = text.trim().split_once(' ').ok_or_else(wrong)?;
    let value: f64 = number.parse().map_err(|_| wrong())?;
    let (recorded, applied) = units.split_once('/').ok_or_else(wrong)?;
    let applied = applied.trim().trim_start_matches('(').trim_end_matches(')');
    let factor = |unit: &str| {
        Unit::parse(unit)
            .map(|unit| unit.factor())
            .map_err(|error| section.fail("static_gain", error))
    };
    let value = value * factor(recorded)? / factor(applied)?;
    Ok((value, recorded.trim().to_owned(), applied.to_owned()))
}

/// What a diagnosis wrote about itself; what is not used is for people.
fn diagnosed(section: &Section) -> Result<Diagnosed, Failure> {
    for key in ["applied_unit", "verdict", "records"] {
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
        offset: quantity("offset")?,
        shift: quantity("shift")?,
    };
    section.finish()?;
    Ok(found)
}

#[cfg(test)]
mod tests;
