//! The `[[effects]]` of a stand file.

use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_dsp::compensate::Inverse;
use torqcomp_model::effects::{Action, EFFECTS, Effect, EffectParameter, Fixed, Form, Stage, Unit};
use torqcomp_model::{Chain, Link, ModalResponse, Unit as TextUnit};

use super::Stand;
use super::section::Section;
use crate::failure::{ErrorCode, Failure};
use crate::identify::Motion;
use crate::io::Reading;

/// Unit of the record of a stand without a static gain.
const TORQUE: &str = "N m";

/// An effect that the stand file declares.
#[derive(Debug, Clone)]
pub struct DeclaredEffect {
    /// The effect.
    pub effect: &'static Effect,
    /// Its form.
    pub form: &'static Form,
    /// Its parameters, in SI units of the record, s and Hz.
    pub values: Vec<f64>,
    /// Their standard uncertainties, if known.
    pub stds: Vec<Option<f64>>,
}

impl DeclaredEffect {
    fn link(&self) -> Link {
        Link::of(self.effect, self.form, &self.values)
    }
}

/// The derivative that gives speed or acceleration from displacement: `(jω)^m`; `None` for a
/// displacement record.
pub fn derivative(measures: Motion) -> Option<Link> {
    let order = measures.order();
    (order > 0).then(|| Link {
        effect: measures.name(),
        form: "",
        stage: Stage::Gage,
        action: Action::Factor(Box::new(move |_, omega| {
            Complex64::new(0.0, omega).powi(order)
        })),
    })
}

/// Parses one effect; its parameters are in powers of the record unit of the mechanics.
pub(super) fn effect(section: &Section, recorded_unit: &str) -> Result<DeclaredEffect, Failure> {
    let names: Vec<&str> = EFFECTS.iter().map(|e| e.name).collect();
    let kind = section
        .word("kind", &names)?
        .ok_or_else(|| section.fail("", "kind is missing; write kind = \"cubic-stiffness\""))?;
    let effect = Effect::named(kind)
        .ok_or_else(|| section.fail("kind", format_args!("\"{kind}\" is not known")))?;
    let forms: Vec<&str> = effect.forms.iter().map(|f| f.name).collect();
    let form = effect
        .form(section.word("form", &forms)?)
        .ok_or_else(|| section.fail("kind", format_args!("\"{kind}\" has no form")))?;
    // The source is informative only.
    let _ = section.text("source")?;
    let read = |parameter| value(section, parameter, recorded_unit);
    let parameters: Result<Vec<_>, Failure> = form.parameters.iter().map(read).collect();
    let (values, stds) = parameters?.into_iter().unzip();
    section.finish()?;
    Ok(DeclaredEffect {
        effect,
        form,
        values,
        stds,
    })
}

fn value(
    section: &Section,
    parameter: &EffectParameter,
    recorded_unit: &str,
) -> Result<(f64, Option<f64>), Failure> {
    let name = parameter.name;
    let unit = parameter.unit.text(recorded_unit);
    let example = || format!("{name} = \"0.01 {unit}\"").replace(" \"", "\"");
    let Some((text, std)) = section.raw_with_std(name)? else {
        // Missing orders of a line have zero amplitude.
        if name.starts_with("amplitude_") {
            return Ok((0.0, None));
        }
        return Err(section.fail("", format_args!("{name} is missing; write {}", example())));
    };
    let number = |text: &str| -> Result<f64, Failure> {
        let wrong = |why: &dyn std::fmt::Display| {
            section.fail(
                name,
                format_args!("\"{text}\": {why}; expected {}", example()),
            )
        };
        let (number, written) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
        let number: f64 = number.parse().map_err(|_| wrong(&"there is no number"))?;
        if !number.is_finite() {
            return Err(wrong(&"the number is not finite"));
        }
        let written = TextUnit::parse(written).map_err(|error| wrong(&error))?;
        let expected = TextUnit::parse(&unit).map_err(|error| wrong(&error))?;
        if written.dimension() != expected.dimension() {
            return Err(wrong(&match parameter.unit {
                Unit::Powers { recorded, .. } if recorded != 0 => format!(
                    "the unit does not fit: effects are in powers of {recorded_unit}, the unit of {}",
                    match recorded_unit {
                        TORQUE => "the torque, whatever the unit of the record",
                        _ => "the record in static_gain",
                    }
                ),
                _ => "the unit does not fit".to_owned(),
            }));
        }
        // One hertz is one cycle, whatever its angle.
        let factor = match parameter.unit {
            Unit::Hertz => written.factor() / expected.factor(),
            _ => written.factor(),
        };
        Ok(number * factor)
    };
    Ok((number(&text)?, std.map(|std| number(&std)).transpose()?))
}

impl Stand {
    /// Rejects a part of a record that starts later, if an effect counts time from the start of the record.
    ///
    /// # Errors
    /// If both are given.
    pub(crate) fn refuse_late_start(&self, reading: &Reading) -> Result<(), Failure> {
        let is_timed = |link: &Link| matches!(&link.action, Action::Distortion(distortion) if distortion.is_timed());
        let mut links = self.effects.iter().map(DeclaredEffect::link);
        match links.find(is_timed).filter(|_| reading.starts_later()) {
            Some(link) => Err(self.failed(
                ErrorCode::UnsuitableRecord,
                format_args!(
                    "\"{}\" depends on the time since the record began, and --range leaves out its beginning; use the \
                     whole record, or only the end of --range, as ..2",
                    link.effect
                ),
            )),
            None => Ok(()),
        }
    }

    /// Record unit of the stand's mechanics: that of the static gain, or torque.
    pub fn recorded_unit(&self) -> &str {
        self.static_gain()
            .map_or(TORQUE, |gain| gain.recorded_unit.as_str())
    }

    /// The modes of the mechanics.
    ///
    /// # Errors
    /// If the stand file gives no mechanics.
    pub fn modes(&self) -> Result<ModalResponse, Failure> {
        Ok(self.mechanics()?.response.modal())
    }

    /// Natural frequency in Hz and damping ratio of each mode; empty without mechanics.
    pub fn resonances(&self) -> Vec<(f64, f64)> {
        let modes = self.modes().ok();
        let parts = modes.iter().flat_map(|modes| modes.parts());
        let modes = parts.map(|part| part.mode);
        modes
            .map(|mode| (mode.natural_frequency_hz(), mode.damping_ratio))
            .collect()
    }

    /// Static gain, recorded per applied quantity, in SI units; 1 for a stand that records torque.
    pub fn gain(&self) -> f64 {
        self.static_gain().map_or(1.0, |gain| gain.value)
    }

    /// The chain from the applied quantity to the record in SI units, with all effects and the recorder.
    ///
    /// # Errors
    /// If the stand file gives no mechanics.
    pub fn chain(&self) -> Result<Chain, Failure> {
        let recorder = self.recorder.recorder;
        let is_ideal = recorder.is_ideal();
        let response: Fixed = Arc::new(move |frequency_hz| recorder.response(frequency_hz));
        let modes = self.modes()?;
        self.refuse_unknown_shapes(&modes)?;
        let measures = self.mechanics()?.measures;
        Ok(Chain::new(modes, self.gain())
            .with_shift(self.diagnosed.shift)
            .with_recorder(Some(response), is_ideal)
            .with_links(derivative(measures))
            .with_links(self.effects.iter().map(DeclaredEffect::link)))
    }

    /// Torques act on the gage with their own modal contributions, which cannot be inferred from
    /// residues of mixed signs.
    fn refuse_unknown_shapes(&self, modes: &ModalResponse) -> Result<(), Failure> {
        let torque = self.effects.iter().find(|e| e.form.stage == Stage::Stand);
        match (torque, modes.at_gage()) {
            (Some(torque), None) => Err(self.failed(
                ErrorCode::NotInvertible,
                format_args!(
                    "the effect \"{}\" acts at the gage, and how far it moves each mode there does not follow from \
                     residues of both signs; give shape_at_load and shape_at_gage of [[modes]] instead of residue, or \
                     leave the effect out",
                    torque.effect.name
                ),
            )),
            _ => Ok(()),
        }
    }

    /// The factor of a compensation: the inverse response of the chain.
    ///
    /// # Errors
    /// If the stand file gives no mechanics, or an effect that cannot be divided out.
    pub fn inverse(&self) -> Result<Inverse, Failure> {
        let plain = self.mechanics()?.response.clone();
        let chain = self.chain()?;
        if let Some(link) = chain.links().iter().find(|link| !link.is_linear()) {
            return Err(self.failed(
                ErrorCode::NotInvertible,
                format_args!(
                    "the effect \"{}\" has no frequency response; remove it to use the plain stand, or remove its \
                     effect from the record with compensate",
                    link.effect
                ),
            ));
        }
        Ok(Arc::new(move |frequency_hz| {
            chain.divide_out(plain.inverse(frequency_hz), frequency_hz)
        }))
    }
}
