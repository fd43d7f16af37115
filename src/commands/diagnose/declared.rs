//! Declarations of the stand file of a diagnosis.

use std::sync::Arc;

use torqcomp_model::effects::Fixed;

use crate::diagnose::{DeclaredForm, EffectForm, PlainStand, SeveralModes};
use crate::failure::Failure;
use crate::identify::Motion;
use crate::stand::{DeclaredEffect, DeclaredMode, Given, Stand};
use crate::warning::{Warning, WarningCode};

/// The plain stand of a stand file.
pub(super) fn declared(stand: &Stand, gain: f64) -> Result<PlainStand, Failure> {
    let mode = stand.modes()?.first();
    Ok(PlainStand {
        natural_hz: mode.omega_rad_s / std::f64::consts::TAU,
        damping_ratio: mode.damping_ratio,
        gain,
    })
}

/// All modes of a stand that has several.
pub(super) fn several(stand: &Stand) -> Result<Option<SeveralModes>, Failure> {
    let mechanics = stand.mechanics()?;
    let Given::Modes(modes) = &mechanics.given else {
        return Ok(None);
    };
    let has_shapes = modes.iter().any(DeclaredMode::has_shape);
    Ok(SeveralModes::of(&stand.modes()?, has_shapes))
}

/// Recorded quantity of the stand's motion.
pub(super) fn measures(stand: &Stand) -> Result<Motion, Failure> {
    Ok(stand.mechanics()?.measures)
}

/// Reports that torques in the stand are not searched for if their effect on the record is unknown.
pub(super) fn torques_unknown(
    several: Option<&SeveralModes>,
    measures: Motion,
    rings: bool,
) -> Option<Warning> {
    let (why, remedy) = match (measures, several) {
        (Motion::Displacement, None) => return None,
        (Motion::Displacement, Some(several)) if several.show_torques() => match rings {
            false => return None,
            true => (
                "the initial motion of a decay is known only for all modes together".to_owned(),
                "give records with an applied torque, without decays",
            ),
        },
        (Motion::Displacement, Some(_)) => (
            "how far they move each mode at the gage does not follow from residues of both signs"
                .to_owned(),
            "give shape_at_load and shape_at_gage of [[modes]] instead of residue",
        ),
        (measures, _) => (
            format!(
                "the record is of the {}, but they depend on the displacement",
                measures.name()
            ),
            "record the displacement, strain or torque",
        ),
    };
    Some(WarningCode::NoTorquesTried.warning(format!(
        "friction, play, nonlinear springs and other torques in the stand were not tried: {why}; {remedy}"
    )))
}

/// The effects of the stand file.
pub(super) fn declared_effects(stand: Option<&Stand>) -> Vec<DeclaredForm> {
    let effects = stand.map_or(&[][..], |stand| &stand.effects);
    let form = |declared: &DeclaredEffect| DeclaredForm {
        effect: EffectForm {
            effect: declared.effect,
            form: declared.form,
        },
        values: declared.values.clone(),
    };
    effects.iter().map(form).collect()
}

/// The recorder as far as declared in the stand file.
pub(super) fn recorder(stand: &Stand) -> Option<Fixed> {
    let recorder = stand.recorder.recorder;
    let is_ideal = recorder.is_ideal();
    let response: Fixed = Arc::new(move |hz| recorder.response(hz));
    (!is_ideal).then_some(response)
}
