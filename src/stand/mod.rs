//! The stand as the stand file describes it.

mod calibration;
mod drawing;
mod effects;
mod file;
mod gain;
mod heading_scale;
pub(crate) mod keys;
mod measured;
mod measuring;
mod mechanics;
mod modes;
mod rated;
mod refine;
mod section;
mod signal;
mod static_law;
mod uncertainty;
pub mod update;

use num_complex::Complex64;
use std::f64::consts::TAU;
use torqcomp_dsp::bridge::{BridgeLayout, Leads, Supply};
use torqcomp_dsp::recorder::{LowPass, Recorder};
use torqcomp_model::{Estimate, ModalResponse, Mode, ParameterStd, SecondOrder};

use crate::failure::{ErrorCode, Failure};
use crate::identify::Motion;
use crate::warning::Warning;

pub use calibration::{Applied, Calibration, RecordedLevels, applied_by_unit};
pub use effects::{DeclaredEffect, derivative};
pub use file::{parse, read, text};
pub use measured::{CalibrationLaw, MeasuredCalibration};
pub use modes::{DeclaredMode, MODE_CORRELATIONS};
pub use rated::off_rated;
pub use refine::{Refined, refine, si_unit};
pub use signal::TransducerSignal;
pub use uncertainty::{ConstantStd, TorqueStd};
pub(crate) use uncertainty::{VariedConstant, combined};

/// A stand: its mechanics, and how its record becomes torque.
#[derive(Debug, Clone)]
pub struct Stand {
    /// Name of the stand.
    pub name: String,
    /// File it was read from.
    pub file: String,
    /// Inertia, damping and stiffness.
    pub mechanics: Option<Mechanics>,
    /// Measured torque over the recorded signal.
    pub calibration: Option<MeasuredCalibration>,
    /// The beam's drawing.
    pub beam: Option<BeamDrawing>,
    /// Parts that make up the inertia.
    pub parts: Vec<NamedPart>,
    /// Friction against speed.
    pub friction: Option<Friction>,
    /// The gage.
    pub gage: Option<GageData>,
    /// The bridge.
    pub bridge: Option<BridgeData>,
    /// The recorder.
    pub recorder: RecorderData,
    /// What the plain stand lacks.
    pub effects: Vec<DeclaredEffect>,
    /// What a diagnosis wrote about itself.
    pub diagnosed: Diagnosed,
    /// What is odd about the file.
    pub warnings: Vec<Warning>,
}

/// What a diagnosis wrote about the records that it refined the stand with.
#[derive(Debug, Clone, Default)]
pub struct Diagnosed {
    /// Unit of the record.
    pub measured_unit: Option<String>,
    /// How the diagnosis ended.
    pub verdict: Option<String>,
    /// Constant in the record, in SI units.
    pub offset: f64,
    /// Displacement by a constant load, in SI units of the record.
    pub shift: f64,
}

/// The stand's response, from measured constants.
#[derive(Debug, Clone)]
pub struct Mechanics {
    /// The response, its static gain being 1.
    pub response: StandResponse,
    /// Uncertainties of its constants, if it is given by them.
    pub std: ParameterStd,
    /// Record per applied quantity at rest, if it is not a torque stand.
    pub static_gain: Option<StaticGain>,
    /// What is recorded: the displacement (or the torque of the beam), or a derivative of it.
    pub measures: Motion,
    /// How it was given.
    pub given: Given,
}

/// How the mechanics were given.
#[derive(Debug, Clone)]
pub enum Given {
    /// As inertia, damping and stiffness.
    Constants {
        /// Mass moment of inertia.
        inertia: Estimate,
        /// Viscous damping.
        damping: Estimate,
        /// Angular stiffness.
        stiffness: Estimate,
    },
    /// As natural frequency and damping ratio.
    Modal {
        /// Natural frequency.
        natural_frequency: Estimate,
        /// Damping ratio.
        damping_ratio: Estimate,
    },
    /// As several modes.
    Modes(Vec<DeclaredMode>),
}

/// The linear response of a stand as its file gives it.
#[derive(Debug, Clone)]
pub enum StandResponse {
    /// By the constants of its one mode.
    Constants(SecondOrder),
    /// By its modes.
    Modes(ModalResponse),
}

impl StandResponse {
    /// Applied over recorded quantity, relative to that at rest.
    pub(crate) fn inverse(&self, frequency_hz: f64) -> Complex64 {
        match self {
            Self::Constants(constants) => constants.inverse(frequency_hz),
            Self::Modes(modes) => modes.inverse(TAU * frequency_hz),
        }
    }

    /// As a sum of modes.
    pub(crate) fn modal(&self) -> ModalResponse {
        match self {
            Self::Constants(constants) => ModalResponse::from(Mode {
                omega_rad_s: TAU * constants.natural_frequency_hz(),
                damping_ratio: constants.damping_ratio(),
            }),
            Self::Modes(modes) => modes.clone(),
        }
    }
}

/// Recorded quantity per applied quantity at zero frequency, in any units.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticGain {
    /// The number in SI units.
    pub value: f64,
    /// Unit of the record, as written.
    pub recorded_unit: String,
    /// Unit of the applied quantity, as written.
    pub applied_unit: String,
    /// Relative standard uncertainty, if known.
    pub relative_std: Option<f64>,
}

/// The beam and where the gage sits on it.
#[derive(Debug, Clone)]
pub struct BeamDrawing {
    /// Angular stiffness as a slender beam, of one section, in a rigid clamp.
    pub slender_stiffness: Estimate,
    /// The beam with all that the drawing gives: shear, clamp, threads.
    pub full: torqcomp_model::Beam,
    /// Elastic modulus.
    pub modulus: Estimate,
    /// Relative standard uncertainty of the torque per strain at the gage, if known.
    pub strain_relative_std: Option<f64>,
    /// Radius at which the beam meets the stator.
    pub radius: Estimate,
    /// Distance of the gage from the clamp.
    pub gage_position: Option<Estimate>,
}

/// A part with its name.
#[derive(Debug, Clone)]
pub struct NamedPart {
    /// What it is.
    pub name: String,
    /// Its mass moment of inertia about the shaft.
    pub inertia: Estimate,
}

/// A friction force that rises with speed, at a radius.
#[derive(Debug, Clone)]
pub struct Friction {
    /// Rise of the friction force.
    pub force_change: Estimate,
    /// Rise of the speed.
    pub speed_change: Estimate,
    /// Radius at which the force acts.
    pub radius: Estimate,
}

/// A strain gage.
#[derive(Debug, Clone)]
pub struct GageData {
    /// The gage before it was bonded.
    pub gage: torqcomp_dsp::gage::Gage,
    /// Relative standard uncertainty of the gage factor, if known.
    pub factor_relative_std: Option<f64>,
    /// Resistance after bonding, in Ω.
    pub bonded_resistance_ohm: Option<f64>,
    /// Temperature at which the bonded resistance was measured, in K.
    pub bonding_temperature_k: f64,
    /// Temperature at which the gage is used, in K.
    pub temperature_k: f64,
    /// Change of the unbonded resistance from bonding to use, as a fraction.
    pub resistance_drift: f64,
}

/// A bridge.
#[derive(Debug, Clone)]
pub struct BridgeData {
    /// Which arms are gages, if it is given.
    pub layout: Option<BridgeLayout>,
    /// What drives it, if it is given.
    pub supply: Option<Supply>,
    /// Relative standard uncertainty of the supply, if known.
    pub supply_relative_std: Option<f64>,
    /// Its wires.
    pub leads: Leads,
}

/// A recorder.
#[derive(Debug, Clone)]
pub struct RecorderData {
    /// Gain, low-pass and delay.
    pub recorder: Recorder,
    /// Its low-pass.
    pub low_pass: Option<LowPass>,
    /// Standard uncertainty of the low-pass's cut-off in Hz, if known.
    pub cutoff_std_hz: Option<f64>,
    /// Standard uncertainty of the delay in s, if known.
    pub delay_std_s: Option<f64>,
    /// Whether the file gives the gain.
    pub has_gain: bool,
    /// Whether the order of the low-pass is not in the file.
    pub is_order_assumed: bool,
    /// Relative standard uncertainty of the gain, if known.
    pub gain_relative_std: Option<f64>,
    /// Input resistance in Ω that loads the bridge.
    pub input_resistance_ohm: Option<f64>,
    /// Record at no load in SI units, if it is given.
    pub zero: Option<(TransducerSignal, Estimate)>,
}

impl Stand {
    /// The mechanics, or what to write to have them.
    ///
    /// # Errors
    /// If the stand file gives none.
    pub fn mechanics(&self) -> Result<&Mechanics, Failure> {
        self.mechanics.as_ref().ok_or_else(|| {
            Failure::failed(
                ErrorCode::IncompleteStand,
                "the response of the stand is not given; add [mechanics] with inertia, damping \
                 and stiffness, or with natural_frequency and damping_ratio",
            )
            .at(&self.file)
        })
    }
}
