//! Reading a stand file.

use std::path::Path;

use toml_edit::Document;
use torqcomp_dsp::bridge::{BridgeLayout, Leads, Supply};
use torqcomp_dsp::gage::Gage;
use torqcomp_dsp::recorder::{LowPass, Recorder};
use torqcomp_model::{
    Beam, Estimate, Kind, ModelError, ParameterStd, Part, SecondOrder, Section as CrossSection,
    Segment, Unit,
};

use super::section::{Section, SourceText};
use super::{
    BeamDrawing, BridgeData, Friction, GageData, Given, Mechanics, NamedPart, RecorderData, Stand,
    StaticGain,
};
use crate::failure::Failure;

/// The schema of a stand file.
const SCHEMA: &str = "torqcomp.stand/1";

/// Reads a stand file.
///
/// # Errors
/// If it cannot be read, is no TOML, or holds a key or value that does not belong there; the
/// message names the line.
pub fn read(path: &Path) -> Result<Stand, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| Failure::reading(path, &error))?;
    parse(&path.display().to_string(), &text)
}

/// Reads a stand from text; `name` stands in messages.
///
/// # Errors
/// As [`read`].
pub fn parse(name: &str, text: &str) -> Result<Stand, Failure> {
    let source = SourceText { name, text };
    let document = Document::parse(text).map_err(|error| {
        let message = error.message().replace('\n', ", ");
        source.at(error.span().map(|span| span.start), message)
    })?;
    let top = Section::new(&source, "", document.as_table(), Some(0));
    match top.text("schema")? {
        Some(SCHEMA) => {}
        Some(other) => {
            return Err(top.fail(
                "schema",
                format_args!("\"{other}\" is not known; this version reads \"{SCHEMA}\""),
            ));
        }
        None => {
            return Err(top.fail(
                "",
                format_args!("schema is missing; write schema = \"{SCHEMA}\""),
            ));
        }
    }
    let stand_name = top.text("name")?.unwrap_or("unnamed stand").to_owned();
    let mechanics = top
        .section("mechanics")?
        .map(|s| mechanics(&s))
        .transpose()?;
    let torque_per_volt = top
        .section("calibration")?
        .map(|s| calibration(&s))
        .transpose()?;
    let beam = top.section("beam")?.map(|s| beam(&s)).transpose()?;
    let parts = top
        .sections("parts")?
        .iter()
        .map(part)
        .collect::<Result<_, _>>()?;
    let friction = top.section("friction")?.map(|s| friction(&s)).transpose()?;
    let gage = top.section("gage")?.map(|s| gage(&s)).transpose()?;
    let bridge = top.section("bridge")?.map(|s| bridge(&s)).transpose()?;
    let recorder = recorder(top.section("recorder")?.as_ref())?;
    if let Some(effect) = top.sections("effects")?.first() {
        let kind = effect.text("kind")?.unwrap_or("");
        return Err(effect.fail(
            "kind",
            format_args!(
                "this version cannot apply the effect \"{kind}\"; leave it out to use the plain \
                 stand"
            ),
        ));
    }
    top.finish()?;
    let stand = Stand {
        name: stand_name,
        file: name.to_owned(),
        mechanics,
        torque_per_volt,
        beam,
        parts,
        friction,
        gage,
        bridge,
        recorder,
    };
    one_calibration(&top, &stand)?;
    Ok(stand)
}

/// A static gain and a torque per volt would say the same thing twice.
fn one_calibration(top: &Section, stand: &Stand) -> Result<(), Failure> {
    let has_gain = matches!(
        &stand.mechanics,
        Some(Mechanics {
            given: Given::Modal {
                static_gain: Some(_),
                ..
            },
            ..
        })
    );
    if has_gain && stand.torque_per_volt.is_some() {
        return Err(top.fail(
            "calibration",
            "torque_per_volt and the static_gain of [mechanics] both tell how the record follows \
             the torque; keep one of them",
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
        let response = SecondOrder::new(inertia.value(), damping.value(), stiffness.value())
            .map_err(|error| section.fail("", error))?;
        // So that a wrong key is told the right ones of both forms.
        let _ = (
            section.raw("natural_frequency"),
            section.raw("damping_ratio"),
        );
        Mechanics {
            response,
            std: ParameterStd {
                inertia_kg_m2: inertia.std_uncertainty(),
                damping_n_m_s_per_rad: damping.std_uncertainty(),
                stiffness_n_m_per_rad: stiffness.std_uncertainty(),
                static_gain_relative: None,
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

fn modal_mechanics(section: &Section) -> Result<Mechanics, Failure> {
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
        stiffness_n_m_per_rad: None,
        static_gain_relative: None,
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
    let Some(text) = section.raw("static_gain")? else {
        return Ok(None);
    };
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
    if value == 0.0 || !value.is_finite() {
        return Err(section.fail(
            "static_gain",
            "the gain must be a finite number other than zero",
        ));
    }
    Ok(Some(StaticGain {
        value,
        recorded_unit: recorded.trim().to_owned(),
        applied_unit: applied.to_owned(),
    }))
}

fn calibration(section: &Section) -> Result<Estimate, Failure> {
    let constant = section.required("torque_per_volt", Kind::TorquePerVolt)?;
    if constant.value() == 0.0 {
        return Err(section.fail("torque_per_volt", "the constant must not be zero"));
    }
    section.finish()?;
    Ok(constant)
}

/// The shape of a beam's section and the lengths that it is made of.
struct Shape {
    word: &'static str,
    sizes: Vec<Estimate>,
    shear_coefficient: Option<f64>,
}

impl Shape {
    fn read(section: &Section) -> Result<Self, Failure> {
        let words = ["rectangle", "circle", "tube"];
        let (word, keys): (_, &[_]) = match section.word("section", &words)? {
            Some("circle") => ("circle", &["diameter"]),
            Some("tube") => ("tube", &["outer_diameter", "inner_diameter"]),
            _ => ("rectangle", &["width", "depth"]),
        };
        let sizes: Result<_, _> = keys
            .iter()
            .map(|key| section.positive(key, Kind::Length))
            .collect();
        let coefficient = section.positive_if_any("shear_coefficient", Kind::Ratio)?;
        Ok(Self {
            word,
            sizes: sizes?,
            shear_coefficient: coefficient.map(|e| e.value()),
        })
    }

    /// The section with those sizes in m.
    fn of(&self, sizes: &[f64]) -> Result<CrossSection, ModelError> {
        let made = match self.word {
            "circle" => CrossSection::circle(sizes[0]),
            "tube" => CrossSection::tube(sizes[0], sizes[1]),
            _ => CrossSection::rectangle(sizes[0], sizes[1]),
        }?;
        match self.shear_coefficient {
            Some(coefficient) => made.with_shear_coefficient(coefficient),
            None => Ok(made),
        }
    }
}

fn beam(section: &Section) -> Result<BeamDrawing, Failure> {
    let wrong = |error| section.fail("", error);
    let shape = Shape::read(section)?;
    let length = section.positive("length", Kind::Length)?;
    let modulus = section.positive("elastic_modulus", Kind::Pressure)?;
    let radius = section.positive("radius", Kind::Length)?;
    let gage_position = section.quantity("gage_position", Kind::Length)?;
    let shear_modulus = section.positive_if_any("shear_modulus", Kind::Pressure)?;
    let clamp = section.positive_if_any("clamp_stiffness", Kind::AngularStiffness)?;
    let sizes: Vec<f64> = shape.sizes.iter().map(Estimate::value).collect();
    let whole = shape.of(&sizes).map_err(wrong)?;
    let segments = match section.section("thread")? {
        Some(thread) => threaded(&thread, length.value(), whole)?,
        None => vec![Segment::new(length.value(), whole).map_err(wrong)?],
    };
    section.finish()?;

    let mut full = Beam::new(segments, modulus.value()).map_err(wrong)?;
    if let Some(shear) = shear_modulus {
        full = full.with_shear_modulus(shear.value()).map_err(wrong)?;
    }
    if let Some(clamp) = clamp {
        full = full.with_clamp_stiffness(clamp.value()).map_err(wrong)?;
    }
    if let Some(position) = &gage_position
        && !(0.0..length.value()).contains(&position.value())
    {
        return Err(section.fail(
            "gage_position",
            format_args!(
                "the gage must sit between the clamp (0) and the end of the beam ({} m)",
                length.value()
            ),
        ));
    }
    Ok(BeamDrawing {
        slender_stiffness: slender_stiffness(section, &shape, &length, &modulus, &radius)?,
        full,
        radius,
        gage_position,
    })
}

/// Stiffness of the beam as a slender one, uncertainties of the drawing carried through.
fn slender_stiffness(
    section: &Section,
    shape: &Shape,
    length: &Estimate,
    modulus: &Estimate,
    radius: &Estimate,
) -> Result<Estimate, Failure> {
    let mut inputs = vec![length, modulus, radius];
    inputs.extend(&shape.sizes);
    let stiffness = |x: &[f64]| {
        let segment = Segment::new(x[0], shape.of(&x[3..])?)?;
        Beam::new(vec![segment], x[1])?.angular_stiffness_n_m_per_rad(x[2])
    };
    derived(section, Kind::AngularStiffness, &inputs, stiffness)
}

/// An estimate that follows from others.
fn derived(
    section: &Section,
    kind: Kind,
    inputs: &[&Estimate],
    f: impl Fn(&[f64]) -> Result<f64, ModelError>,
) -> Result<Estimate, Failure> {
    let values: Vec<f64> = inputs.iter().map(|e| e.value()).collect();
    // The model says what is wrong with the inputs themselves.
    f(&values).map_err(|error| section.fail("", error))?;
    Estimate::derive(kind, "drawing", inputs, |x| f(x).unwrap_or(f64::NAN))
        .map_err(|error| section.fail("", error))
}

/// A thread: a piece of the beam with a circular section of the root diameter.
fn threaded(thread: &Section, length: f64, whole: CrossSection) -> Result<Vec<Segment>, Failure> {
    let wrong = |error| thread.fail("", error);
    let threaded_length = thread.positive("length", Kind::Length)?.value();
    let root = thread.positive("root_diameter", Kind::Length)?.value();
    let at = thread.word("at", &["clamp", "stator"])?.unwrap_or("stator");
    thread.finish()?;
    if threaded_length >= length {
        return Err(thread.fail("length", "the thread must be shorter than the beam"));
    }
    let section = CrossSection::circle(root).map_err(wrong)?;
    let threaded = Segment::new(threaded_length, section).map_err(wrong)?;
    let rest = Segment::new(length - threaded_length, whole).map_err(wrong)?;
    Ok(if at == "clamp" {
        vec![threaded, rest]
    } else {
        vec![rest, threaded]
    })
}

fn part(section: &Section) -> Result<NamedPart, Failure> {
    let kinds = ["thin-ring", "disc", "hollow-cylinder", "point-mass"];
    let Some(kind) = section.word("kind", &kinds)? else {
        return Err(section.fail(
            "",
            format_args!("kind is missing; one of {}", kinds.join(", ")),
        ));
    };
    let name = section.text("name")?.unwrap_or(kind).to_owned();
    let mass = section.positive("mass", Kind::Mass)?;
    let keys: &[_] = match kind {
        "hollow-cylinder" => &["inner_radius", "outer_radius"],
        _ => &["radius"],
    };
    let radii: Result<Vec<Estimate>, _> = keys
        .iter()
        .map(|key| section.positive(key, Kind::Length))
        .collect();
    let radii = radii?;
    section.finish()?;
    let mut inputs = vec![&mass];
    inputs.extend(&radii);
    let inertia = derived(section, Kind::Inertia, &inputs, |x| {
        shaped(kind, x).inertia_kg_m2()
    })?;
    Ok(NamedPart { name, inertia })
}

/// A part out of its mass in kg and its radii in m.
fn shaped(kind: &str, x: &[f64]) -> Part {
    match kind {
        "thin-ring" => Part::ThinRing {
            mass_kg: x[0],
            radius_m: x[1],
        },
        "disc" => Part::Disc {
            mass_kg: x[0],
            radius_m: x[1],
        },
        "hollow-cylinder" => Part::HollowCylinder {
            mass_kg: x[0],
            inner_radius_m: x[1],
            outer_radius_m: x[2],
        },
        _ => Part::PointMass {
            mass_kg: x[0],
            radius_m: x[1],
        },
    }
}

fn friction(section: &Section) -> Result<Friction, Failure> {
    let friction = Friction {
        force_change: section.not_negative("force_change", Kind::Force)?,
        speed_change: section.positive("speed_change", Kind::AngularSpeed)?,
        radius: section.positive("radius", Kind::Length)?,
    };
    section.finish()?;
    Ok(friction)
}

fn gage(section: &Section) -> Result<GageData, Failure> {
    let value = |key, kind| section.required(key, kind).map(|e: Estimate| e.value());
    let optional = |key, kind| section.quantity(key, kind).map(|e| e.map(|e| e.value()));
    // A metal-foil gage is linear, and temperature does not enter its law.
    let room = 298.15;
    let reference = optional("reference_temperature", Kind::TemperatureAbsolute)?.unwrap_or(room);
    let temperature_k = optional("temperature", Kind::TemperatureAbsolute)?.unwrap_or(reference);
    let bonding = optional("bonding_temperature", Kind::TemperatureAbsolute)?;
    let drift = optional("resistance_drift", Kind::Ratio)?.unwrap_or(0.0);
    let gage = Gage::new(
        value("gage_factor", Kind::Ratio)?,
        optional("quadratic_coefficient", Kind::Ratio)?.unwrap_or(0.0),
        reference,
        section.positive("resistance", Kind::Resistance)?.value(),
    )
    .map_err(|error| section.fail("", error))?;
    let bonded = section.positive_if_any("bonded_resistance", Kind::Resistance)?;
    section.finish()?;
    Ok(GageData {
        gage,
        bonded_resistance_ohm: bonded.map(|e| e.value()),
        bonding_temperature_k: bonding.unwrap_or(temperature_k),
        temperature_k,
        resistance_drift: drift,
    })
}

fn bridge(section: &Section) -> Result<BridgeData, Failure> {
    let layouts = [
        "quarter",
        "half",
        "half-opposite",
        "half-poisson",
        "full",
        "full-poisson",
    ];
    let Some(layout) = section.word("layout", &layouts)? else {
        return Err(section.fail(
            "",
            format_args!("layout is missing; one of {}", layouts.join(", ")),
        ));
    };
    let poisson = || {
        section
            .positive("poisson_ratio", Kind::Ratio)
            .map(|e| e.value())
    };
    let layout = match layout {
        "half" => BridgeLayout::HalfBending,
        "half-opposite" => BridgeLayout::HalfOpposite,
        "half-poisson" => BridgeLayout::HalfPoisson {
            poisson_ratio: poisson()?,
        },
        "full" => BridgeLayout::Full,
        "full-poisson" => BridgeLayout::FullPoisson {
            poisson_ratio: poisson()?,
        },
        _ => BridgeLayout::Quarter,
    };
    let volts = section.positive_if_any("excitation", Kind::Voltage)?;
    let amperes = section.positive_if_any("excitation_current", Kind::Current)?;
    let supply = match (volts, amperes) {
        (Some(volts), None) => Supply::ConstantVoltage {
            volts: volts.value(),
        },
        (None, Some(amperes)) => Supply::ConstantCurrent {
            amperes: amperes.value(),
        },
        _ => {
            return Err(section.fail(
                "",
                "give either excitation = \"22.5 V\" or excitation_current = \"2 mA\"",
            ));
        }
    };
    let wires = ["two-wire", "three-wire", "four-wire"];
    let wiring = section.word("wiring", &wires)?;
    let lead_ohm = section
        .quantity("lead_resistance", Kind::Resistance)?
        .map(|e| e.value());
    let leads = match (wiring, lead_ohm) {
        (_, None) => Leads::None,
        (Some("two-wire"), Some(lead_ohm)) => Leads::TwoWire { lead_ohm },
        (Some("three-wire"), Some(lead_ohm)) => Leads::ThreeWire { lead_ohm },
        (Some(_), Some(lead_ohm)) => Leads::FourWire { lead_ohm },
        (None, Some(_)) => {
            return Err(section.fail(
                "lead_resistance",
                format_args!(
                    "say how the wires run: wiring = one of {}",
                    wires.join(", ")
                ),
            ));
        }
    };
    section.finish()?;
    Ok(BridgeData {
        layout,
        supply,
        leads,
    })
}

fn recorder(section: Option<&Section>) -> Result<RecorderData, Failure> {
    let Some(section) = section else {
        let recorder = Recorder::new(1.0, None, 0.0).expect("a plain recorder is a recorder");
        return Ok(RecorderData {
            recorder,
            input_resistance_ohm: None,
            zero_v: 0.0,
        });
    };
    let optional = |key, kind| {
        section
            .positive_if_any(key, kind)
            .map(|e| e.map(|e| e.value()))
    };
    let gain = optional("gain", Kind::Gain)?.unwrap_or(1.0);
    let cutoff = optional("low_pass", Kind::Frequency)?;
    let order = section.whole("low_pass_order")?;
    if order.is_some() && cutoff.is_none() {
        return Err(section.fail(
            "low_pass_order",
            "say where the low-pass is: low_pass = \"5 kHz\"",
        ));
    }
    let order = u32::try_from(order.unwrap_or(1))
        .map_err(|_| section.fail("low_pass_order", "expected a whole number from 1 to 16"))?;
    let delay_s = match section.quantity("delay", Kind::Time)? {
        Some(delay) => delay.value(),
        None => 0.0,
    };
    let low_pass = cutoff.map(|cutoff_hz| LowPass { cutoff_hz, order });
    let recorder =
        Recorder::new(gain, low_pass, delay_s).map_err(|error| section.fail("", error))?;
    let input_resistance_ohm = optional("input_resistance", Kind::Resistance)?;
    let zero_v = section
        .quantity("zero", Kind::Voltage)?
        .map_or(0.0, |zero| zero.value());
    section.finish()?;
    Ok(RecorderData {
        recorder,
        input_resistance_ohm,
        zero_v,
    })
}

#[cfg(test)]
mod tests;
