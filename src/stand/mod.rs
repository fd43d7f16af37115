//! The stand as described by the stand file.

mod calibration;
mod drawing;
mod effects;
mod file;
mod gain;
mod gain_unit;
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
use std::fmt::Display;
use torqcomp_dsp::bridge::{BridgeLayout, Leads, Supply};
use torqcomp_dsp::recorder::{LowPass, Recorder};
use torqcomp_model::{Estimate, ModalResponse, Mode, ParameterStd, SecondOrder};

use crate::failure::{ErrorCode, Failure};
use crate::identify::Motion;
use crate::warning::Warning;

pub use calibration::{Calibration, RecordedLevels};
pub use effects::{DeclaredEffect, derivative};
pub use file::{calibration_of, parse, read, recorder_of, text};
pub(crate) use gain::gain_differs;
pub use measured::{AT_TORQUE, CalibrationLaw, MeasuredCalibration};
pub use modes::{DeclaredMode, MODE_CORRELATIONS};
pub use rated::{is_far_beyond_rated, off_rated};
pub use refine::{Refined, refine, si_unit};
pub use signal::TransducerSignal;
pub use uncertainty::{ConstantStd, TorqueStd};
pub(crate) use uncertainty::{VariedConstant, combined};

/// A stand: its mechanics, and the conversion of its record to torque.
#[derive(Debug, Clone)]
pub struct Stand {
    /// Source file.
    pub file: String,
    /// Inertia, damping and stiffness.
    pub mechanics: Option<Mechanics>,
    /// Measured calibration, torque over the recorded signal.
    pub calibration: Option<MeasuredCalibration>,
    /// Drawing of the beam.
    pub beam: Option<BeamDrawing>,
    /// Mass moments of inertia of its parts about the shaft.
    pub parts: Vec<Estimate>,
    /// Friction against speed.
    pub friction: Option<Friction>,
    /// The gage.
    pub gage: Option<GageData>,
    /// The bridge.
    pub bridge: Option<BridgeData>,
    /// The recorder.
    pub recorder: RecorderData,
    /// Declared effects, which the plain stand lacks.
    pub effects: Vec<DeclaredEffect>,
    /// Entries written by a diagnosis.
    pub diagnosed: Diagnosed,
    /// Warnings about the file.
    pub warnings: Vec<Warning>,
}

/// Entries written by a diagnosis about the records that it used.
#[derive(Debug, Clone, Default)]
pub struct Diagnosed {
    /// Unit of the record.
    pub measured_unit: Option<String>,
    /// Verdict of the diagnosis.
    pub verdict: Option<String>,
    /// Offset of the record, in SI units.
    pub offset: f64,
    /// Displacement under a constant load, in SI units of the record.
    pub shift: f64,
}

/// The stand's response, from measured constants.
#[derive(Debug, Clone)]
pub struct Mechanics {
    /// The response, with a static gain of 1.
    pub response: StandResponse,
    /// Uncertainties of its constants, if it is given by constants.
    pub std: ParameterStd,
    /// Static gain, record per applied quantity, if it is not a torque stand.
    pub static_gain: Option<StaticGain>,
    /// The recorded quantity: the displacement (or the torque of the beam), or a derivative of it.
    pub measures: Motion,
    /// Form in which it was given.
    pub given: Given,
}

/// Form in which the mechanics were given.
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

/// Linear response of a stand in the form of its file.
#[derive(Debug, Clone)]
pub enum StandResponse {
    /// By the constants of its one mode.
    Constants(SecondOrder),
    /// By its modes.
    Modes(ModalResponse),
}

impl StandResponse {
    /// Applied over recorded quantity, normalised to its static value.
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

/// Static gain, recorded per applied quantity, in any units.
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

/// The beam and the position of the gage on it.
#[derive(Debug, Clone)]
pub struct BeamDrawing {
    /// Angular stiffness as a slender beam of one section in a rigid clamp.
    pub slender_stiffness: Estimate,
    /// The beam with all details of the drawing: shear, clamp, threads.
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

/// A friction force proportional to speed, at a radius.
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
    /// Arrangement of the gages, if given.
    pub layout: Option<BridgeLayout>,
    /// Supply, if given.
    pub supply: Option<Supply>,
    /// Relative standard uncertainty of the supply, if known.
    pub supply_relative_std: Option<f64>,
    /// Wiring.
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
    /// Whether the order of the low-pass is assumed, not given in the file.
    pub is_order_assumed: bool,
    /// Relative standard uncertainty of the gain, if known.
    pub gain_relative_std: Option<f64>,
    /// Input resistance in Ω that loads the bridge.
    pub input_resistance_ohm: Option<f64>,
    /// Record at no load in SI units, if given.
    pub zero: Option<(TransducerSignal, Estimate)>,
}

impl Stand {
    /// A failure due to the stand file.
    pub(crate) fn failed(&self, code: ErrorCode, message: impl Display) -> Failure {
        code.failed(message).at(&self.file)
    }

    /// The mechanics, or a failure that says what to write.
    ///
    /// # Errors
    /// If the stand file gives none.
    pub fn mechanics(&self) -> Result<&Mechanics, Failure> {
        self.mechanics.as_ref().ok_or_else(|| {
            self.failed(
                ErrorCode::IncompleteStand,
                "the response of the stand is not given; add [mechanics] with inertia, damping \
                 and stiffness, or with natural_frequency and damping_ratio",
            )
        })
    }
}
