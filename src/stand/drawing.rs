//! Parsing of drawing data: the beam, the parts of the inertia, the friction.

use torqcomp_model::{Beam, CrossSection, Estimate, Kind, ModelError, Part, Segment};

use super::section::Section;
use super::{BeamDrawing, Friction};
use crate::failure::Failure;
use crate::print::short;
use crate::warning::{Warning, WarningCode};

/// Range of elastic moduli of solids, from rubber to diamond.
const SOLID_PA: std::ops::RangeInclusive<f64> = 1e6..=1.3e12;
/// Range of elastic moduli of beams, from plastics to hard metal.
const BEAM_PA: std::ops::RangeInclusive<f64> = 1e9..=7e11;

/// A warning about an unusual modulus.
pub(super) fn unusual_modulus(beam: &BeamDrawing) -> Option<Warning> {
    let modulus_pa = beam.modulus.value();
    (!BEAM_PA.contains(&modulus_pa)).then(|| {
        WarningCode::ModulusUnusual.warning(format!(
            "[beam] elastic_modulus is {} GPa, unlike any common beam material: steel has 200 GPa; check its unit",
            short(modulus_pa / 1e9)
        ))
    })
}

/// Shape of a beam's section and its dimensions.
struct BeamShape {
    word: &'static str,
    sizes: Vec<Estimate>,
    shear_coefficient: Option<f64>,
}

impl BeamShape {
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

    /// The section with these dimensions in m.
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

pub(super) fn beam(section: &Section) -> Result<BeamDrawing, Failure> {
    let wrong = |error| section.fail("", error);
    let shape = BeamShape::read(section)?;
    let length = section.positive("length", Kind::Length)?;
    let modulus = section.positive("elastic_modulus", Kind::Pressure)?;
    if !SOLID_PA.contains(&modulus.value()) {
        return Err(section.fail(
            "elastic_modulus",
            "impossible modulus; steel has \"200 GPa\", aluminium \"70 GPa\"",
        ));
    }
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
        strain_relative_std: strain_relative_std(
            section,
            &shape,
            [&length, &modulus, &radius],
            gage_position.as_ref(),
        )?,
        slender_stiffness: slender_stiffness(section, &shape, &length, &modulus, &radius)?,
        full,
        modulus,
        radius,
        gage_position,
    })
}

/// Stiffness as a slender beam, with the uncertainties of the drawing propagated.
fn slender_stiffness(
    section: &Section,
    shape: &BeamShape,
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

/// Relative standard uncertainty of the torque per strain of a slender beam, from lengths and modulus of the drawing.
fn strain_relative_std(
    section: &Section,
    shape: &BeamShape,
    [length, modulus, radius]: [&Estimate; 3],
    position: Option<&Estimate>,
) -> Result<Option<f64>, Failure> {
    let Some(position) = position else {
        return Ok(None);
    };
    let mut inputs = vec![length, modulus, radius, position];
    inputs.extend(&shape.sizes);
    let torque = |x: &[f64]| {
        let segment = Segment::new(x[0], shape.of(&x[4..])?)?;
        Beam::new(vec![segment], x[1])?.torque_per_strain_n_m(x[2], x[3])
    };
    Ok(derived(section, Kind::Torque, &inputs, torque)?.relative_std())
}

/// An estimate derived from others.
fn derived(
    section: &Section,
    kind: Kind,
    inputs: &[&Estimate],
    f: impl Fn(&[f64]) -> Result<f64, ModelError>,
) -> Result<Estimate, Failure> {
    let values: Vec<f64> = inputs.iter().map(|e| e.value()).collect();
    // The model reports errors of the inputs themselves.
    f(&values).map_err(|error| section.fail("", error))?;
    Estimate::derive(kind, "drawing", inputs, |x| f(x).unwrap_or(f64::NAN))
        .map_err(|error| section.fail("", error))
}

/// A thread: a segment of the beam with a circular section of the root diameter.
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

/// The inertia of a part. Its name is for readers of the file.
pub(super) fn part(section: &Section) -> Result<Estimate, Failure> {
    let kinds = ["thin-ring", "disc", "hollow-cylinder", "point-mass"];
    let Some(kind) = section.word("kind", &kinds)? else {
        return Err(section.fail(
            "",
            format_args!("kind is missing; one of {}", kinds.join(", ")),
        ));
    };
    section.text("name")?;
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
    derived(section, Kind::Inertia, &inputs, |x| {
        shaped(kind, x).inertia_kg_m2()
    })
}

/// A part from its mass in kg and its radii in m.
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

pub(super) fn friction(section: &Section) -> Result<Friction, Failure> {
    let friction = Friction {
        force_change: section.not_negative("force_change", Kind::Force)?,
        speed_change: section.positive("speed_change", Kind::AngularSpeed)?,
        radius: section.positive("radius", Kind::Length)?,
    };
    section.finish()?;
    Ok(friction)
}
