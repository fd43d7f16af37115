//! The `[[effects]]` of a stand file.

use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_dsp::compensate::Inverse;
use torqcomp_model::Unit as TextUnit;
use torqcomp_model::effects::{
    Action, EFFECTS, Effect, Form, Frequency, Mode, Parameter, Stage, Unit,
};

use super::section::Section;
use super::{Given, Stand};
use crate::failure::Failure;

/// Frequency, over the natural one, that is next to rest.
const NEAR_REST: f64 = 1e-6;
/// Step of a factor at rest, relative to the factor, that is none.
const LARGEST_STEP: f64 = 1e-4;

/// An effect that the stand file declares.
#[derive(Debug, Clone)]
pub struct DeclaredEffect {
    /// The effect.
    pub effect: &'static Effect,
    /// Its form.
    pub form: &'static Form,
    /// Its parameters, in SI units of the record, s and Hz.
    pub values: Vec<f64>,
}

impl DeclaredEffect {
    /// What it does.
    #[must_use]
    pub fn action(&self) -> (Stage, Action) {
        (self.form.stage, (self.form.build)(&self.values))
    }
}

/// Reads one effect; its parameters are in powers of the unit of the record.
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
    // Where the value comes from is for people.
    let _ = section.text("source")?;
    let values = form
        .parameters
        .iter()
        .map(|parameter| value(section, parameter, recorded_unit))
        .collect::<Result<_, _>>()?;
    section.finish()?;
    Ok(DeclaredEffect {
        effect,
        form,
        values,
    })
}

fn value(section: &Section, parameter: &Parameter, recorded_unit: &str) -> Result<f64, Failure> {
    let name = parameter.name;
    let unit = parameter.unit.text(recorded_unit);
    let example = || format!("{name} = \"0.01 {unit}\"").replace(" \"", "\"");
    let Some(text) = section.raw(name)? else {
        // Orders of a line that are not there have no amplitude.
        if name.starts_with("amplitude_") {
            return Ok(0.0);
        }
        return Err(section.fail("", format_args!("{name} is missing; write {}", example())));
    };
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
        return Err(wrong(&"the unit does not fit the record"));
    }
    // One hertz is one cycle, whatever its angle.
    let factor = match parameter.unit {
        Unit::Hertz => written.factor() / expected.factor(),
        _ => written.factor(),
    };
    Ok(number * factor)
}

impl Stand {
    /// Unit of what the stand's mechanics move the record by: that of the static gain, or torque.
    #[must_use]
    pub fn recorded_unit(&self) -> &str {
        match self.mechanics.as_ref().map(|m| &m.given) {
            Some(Given::Modal {
                static_gain: Some(gain),
                ..
            }) => &gain.recorded_unit,
            _ => "N m",
        }
    }

    /// The linear mode of the mechanics.
    ///
    /// # Errors
    /// If the stand file gives no mechanics.
    pub fn mode(&self) -> Result<Mode, Failure> {
        let response = self.mechanics()?.response;
        Ok(Mode {
            omega_rad_s: std::f64::consts::TAU * response.natural_frequency_hz(),
            damping_ratio: response.damping_ratio(),
        })
    }

    /// Whether a response over frequency describes the stand with all its effects, down to rest.
    #[must_use]
    pub fn is_a_response(&self) -> bool {
        let Ok(mode) = self.mode() else { return true };
        self.effects
            .iter()
            .all(|declared| match declared.action().1 {
                Action::Factor(factor) => is_smooth_at_rest(&factor, &mode),
                Action::Feedthrough(_) => true,
                _ => false,
            })
    }

    /// Recorded per applied quantity at rest, in SI units; 1 for a stand that records torque.
    #[must_use]
    pub fn gain(&self) -> f64 {
        match self.mechanics.as_ref().map(|m| &m.given) {
            Some(Given::Modal {
                static_gain: Some(gain),
                ..
            }) => gain.value,
            _ => 1.0,
        }
    }

    /// What a compensation divides by: the response of the stand and the recorder, linear effects included.
    ///
    /// # Errors
    /// If the stand file gives no mechanics, or an effect that no division takes out.
    pub fn inverse(&self) -> Result<Inverse, Failure> {
        let response = self.mechanics()?.response;
        let recorder = self.recorder.recorder.clone();
        if self.effects.is_empty() {
            return Ok(Arc::new(move |frequency_hz| {
                response.inverse(frequency_hz) / recorder.response(frequency_hz)
            }));
        }
        let mode = self.mode()?;
        let mut links = Vec::new();
        for declared in &self.effects {
            match declared.action() {
                (_, action @ (Action::Factor(_) | Action::Feedthrough(_))) => {
                    links.push((declared.form.stage, action));
                }
                (_, _) => {
                    return Err(Failure::failed(format_args!(
                        "{}: the effect \"{}\" is no response over frequency; leave it out to use the plain \
                         stand, or take it out of the record with compensate",
                        self.file, declared.effect.name
                    )));
                }
            }
        }
        links.sort_by_key(|(place, _)| *place);
        Ok(Arc::new(move |frequency_hz| {
            let omega = std::f64::consts::TAU * frequency_hz;
            let mut through = response.inverse(frequency_hz).inv();
            let mut recorded = false;
            for (place, action) in &links {
                if *place >= Stage::Chain && !recorded {
                    through *= recorder.response(frequency_hz);
                    recorded = true;
                }
                through = along(action, &mode, omega, through);
            }
            if !recorded {
                through *= recorder.response(frequency_hz);
            }
            through.inv()
        }))
    }
}

/// Whether a factor goes over into a constant at rest that is not zero, without a step: the impulse response of its
/// inverse then dies out.
#[must_use]
pub fn is_smooth_at_rest(factor: &Frequency, mode: &Mode) -> bool {
    let at_rest = factor(mode, 0.0);
    let near = factor(mode, NEAR_REST * mode.omega_rad_s);
    // Of both signs of frequency the constant is the same only if it is real.
    let step = (near - at_rest).norm().max(near.im.abs());
    at_rest.norm() > 0.0 && step < LARGEST_STEP * at_rest.norm()
}

fn along(action: &Action, mode: &Mode, omega_rad_s: f64, through: Complex64) -> Complex64 {
    match action {
        Action::Factor(factor) => through * factor(mode, omega_rad_s),
        Action::Feedthrough(term) => through + term(mode, omega_rad_s),
        _ => through,
    }
}
