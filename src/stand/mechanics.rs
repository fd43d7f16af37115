//! `[mechanics]` and `[[modes]]`: the response of the stand.

use torqcomp_model::{Estimate, Kind, ModalResponse, ParameterStd, SecondOrder, Unit};

use super::modes::{DeclaredMode, declared_modes};
use super::section::Section;
use super::update::{CONSTANTS, CORRELATIONS, MODAL};
use super::{Given, Mechanics, StandResponse, StaticGain};
use crate::failure::Failure;
use crate::identify::Motion;
use crate::print::short;
use crate::warning::{Warning, WarningCode};

/// Implausibly large contribution of modes above the band to the static response.
const MUCH: f64 = 0.5;

/// The mechanics, if given.
pub(super) fn mechanics(top: &Section) -> Result<Option<Mechanics>, Failure> {
    let section = top.section("mechanics")?;
    let modes = declared_modes(&top.sections("modes")?)?;
    match (section, modes.is_empty()) {
        (None, true) => Ok(None),
        (Some(section), true) => one_mode(&section).map(Some),
        (section, false) => several_modes(top, section.as_ref(), modes).map(Some),
    }
}

/// `[[modes]]`, with the related keys of `[mechanics]`.
fn several_modes(
    top: &Section,
    section: Option<&Section>,
    modes: Vec<DeclaredMode>,
) -> Result<Mechanics, Failure> {
    let (mut found_gain, mut measured) = (None, Motion::Displacement);
    if let Some(section) = section {
        let mut single = CONSTANTS.iter().chain(&MODAL);
        if let Some(key) = single.find(|key| section.has(key)) {
            return Err(section.fail(
                key,
                "[[modes]] give the response of the stand, too; keep one of them",
            ));
        }
        found_gain = static_gain(section)?;
        measured = measures(section)?;
        section.finish()?;
    }
    let parts = modes.iter().map(DeclaredMode::part).collect();
    let response = ModalResponse::new(parts).map_err(|error| top.fail("modes", error))?;
    Ok(Mechanics {
        response: StandResponse::Modes(response),
        std: ParameterStd::default(),
        static_gain: found_gain,
        measures: measured,
        given: Given::Modes(modes),
    })
}

/// The recorded quantity: the displacement, or a derivative of it.
fn measures(section: &Section) -> Result<Motion, Failure> {
    let words = Motion::ALL.map(Motion::name);
    let word = section.word("measures", &words)?;
    let found = Motion::ALL
        .into_iter()
        .find(|motion| Some(motion.name()) == word);
    Ok(found.unwrap_or(Motion::Displacement))
}

impl Mechanics {
    /// Damping ratio of each mode.
    pub(super) fn damping_ratios(&self) -> Vec<f64> {
        match &self.response {
            StandResponse::Constants(constants) => vec![constants.damping_ratio()],
            StandResponse::Modes(modes) => {
                let parts = modes.parts().iter();
                parts.map(|part| part.mode.damping_ratio).collect()
            }
        }
    }

    /// A warning if the residues leave an implausibly large remainder to 1.
    pub(super) fn much_left(&self, file: &str) -> Option<Warning> {
        let StandResponse::Modes(modes) = &self.response else {
            return None;
        };
        let left = modes.residual();
        (left.abs() > MUCH && self.measures == Motion::Displacement).then(|| {
            WarningCode::ResiduesDoNotAddUp.warning(format!(
                "{file}: the residues of [[modes]] add up to {}, which leaves {} of the static response to modes \
                 above the band; check them: residues are fractions of 1",
                short(1.0 - left),
                short(left)
            ))
        })
    }
}

/// `[mechanics]` alone.
fn one_mode(section: &Section) -> Result<Mechanics, Failure> {
    let modal = MODAL.iter().any(|key| section.has(key));
    if modal && let Some(key) = CONSTANTS.iter().find(|key| section.has(key)) {
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
                "the correlations already include common_std; keep one of them",
            ));
        }
        let own = |estimate: &Estimate| own_std(section, estimate, common);
        let response = SecondOrder::new(inertia.value(), damping.value(), stiffness.value())
            .map_err(|error| section.fail("", error))?;
        // Marks these keys as read, so that the message about an unknown key lists those of both
        // forms.
        let _ = MODAL.map(|key| section.raw(key));
        Mechanics {
            response: StandResponse::Constants(response),
            static_gain: None,
            measures: Motion::Displacement,
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

/// Relative standard uncertainty common to inertia, damping and stiffness, as two of them follow from the third.
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
        *value = section.correlation(key)?;
    }
    Ok(found)
}

/// Relative amount by which the common uncertainty may exceed the total one, as both are rounded.
const ROUNDED: f64 = 1e-6;

/// Standard uncertainty without the common part, which cancels in every ratio of the constants, and so in the stand's
/// response.
fn own_std(section: &Section, estimate: &Estimate, common: f64) -> Result<Option<f64>, Failure> {
    let Some(std) = estimate.std_uncertainty() else {
        return Ok(None);
    };
    let shared = common * estimate.value();
    if shared > std * (1.0 + ROUNDED) {
        return Err(section.fail(
            "common_std",
            "expected no more than the relative std of inertia, damping and stiffness, which include it",
        ));
    }
    Ok(Some((std * std - shared * shared).max(0.0).sqrt()))
}

/// Rejects a natural frequency in 1/s, which may mean Hz or an angular frequency.
pub(super) fn refuse_bare_rate(section: &Section) -> Result<(), Failure> {
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
        response: StandResponse::Constants(response),
        std,
        static_gain,
        measures: measures(section)?,
        given: Given::Modal {
            natural_frequency,
            damping_ratio,
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
    let expected =
        "expected recorded over applied unit, as in \"1 V/V\", \"2.5 mV/N\" or \"3e-7 (m/s^2)/N\"";
    let wrong = || section.fail("static_gain", format_args!("\"{text}\": {expected}"));
    let (number, units) = text.trim().split_once(' ').ok_or_else(wrong)?;
    let value: f64 = number.parse().map_err(|_| wrong())?;
    let (recorded, applied) = match units.trim_start().strip_prefix('(') {
        Some(rest) => rest.split_once(")/").ok_or_else(wrong)?,
        None => units.split_once('/').ok_or_else(wrong)?,
    };
    let applied = applied.trim().trim_start_matches('(').trim_end_matches(')');
    let factor = |unit: &str| {
        Unit::parse(unit)
            .map(|unit| unit.factor())
            .map_err(|error| section.fail("static_gain", error))
    };
    let value = value * factor(recorded)? / factor(applied)?;
    Ok((value, recorded.trim().to_owned(), applied.to_owned()))
}
