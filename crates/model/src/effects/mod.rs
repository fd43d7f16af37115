//! Effects that a plain stand lacks: one file for each, one line for it in [`EFFECTS`].
//!
//! The plain stand is `x'' + 2ζω₀ x' + ω₀² x = ω₀² G u` with the applied quantity `u` and the recorded one `x` (for a
//! torque stand `x = T_o = K θ` and `G = 1`). An effect acts at one of four places:
//!
//! | place | what it does |
//! |---|---|
//! | [`Stage::Stand`] | a torque `n(x, x', z)` added to `x`, in record units: `x'' + 2ζω₀ x' + ω₀² (x + n) = ω₀² G u` |
//! | [`Stage::Dynamics`] | a factor or a term of the linear response, or a part of the motion on which torques act |
//! | [`Stage::Chain`] | the effect of gage, amplifier and recorder on `x` |
//! | [`Stage::Disturbance`] | an added signal independent of `u` |
//!
//! An effect can have several forms, as texts use the same name for different equations.
//!
//! [`RIVALS`] are further laws outside the list; they keep an effect from being named in their place.

mod action;
mod curve;
mod lines;
mod parameter;
mod rivals;
mod spike_search;
mod spike_trains;
mod spikes;

mod backlash;
mod bouc_wen_hysteresis;
mod capacitive_coupling;
mod commutation_spikes;
mod coulomb_friction;
mod cubic_stiffness;
mod end_stop;
mod gage_creep;
mod gage_nonlinearity;
mod gain_error;
mod mains_pickup;
mod position_dependent_friction;
mod quadratic_damping;
mod quadratic_stiffness;
mod recorder_lowpass;
mod rotor_imbalance;
mod saturation;
mod second_mode;
mod stribeck_friction;
mod structural_damping;
mod thermal_drift;
mod time_delay;

pub use crate::mode::Mode;
pub use action::{
    Action, Distortion, Fixed, Frequency, Memory, SampleClock, StiffnessChange, Torque, Treatment,
    Unrecovered, Zero,
};
pub(crate) use backlash::bridge;
pub use capacitive_coupling::level;
pub use lines::{FoundLine, SpectralLine, subtract_lines};
pub use parameter::{EffectParameter, History, ParameterScale, RecordScales, Unit};
pub use rivals::RIVALS;
pub use spike_search::{FoundTrain, SpikeSearch, subtract_spikes};
pub use spike_trains::find_trains;
pub use spikes::{SpikeMoments, SpikeShape, SpikeTrain};
pub use thermal_drift::subtract_course;

/// All effects.
pub const EFFECTS: &[&Effect] = &[
    &second_mode::EFFECT,
    &structural_damping::EFFECT,
    // Before the low-pass: a low-pass whose corner is out of reach is a delay.
    &time_delay::EFFECT,
    &recorder_lowpass::EFFECT,
    &capacitive_coupling::EFFECT,
    &gain_error::EFFECT,
    &mains_pickup::EFFECT,
    &thermal_drift::EFFECT,
    &rotor_imbalance::EFFECT,
    &commutation_spikes::EFFECT,
    &cubic_stiffness::EFFECT,
    &quadratic_stiffness::EFFECT,
    &coulomb_friction::EFFECT,
    &stribeck_friction::EFFECT,
    &position_dependent_friction::EFFECT,
    &end_stop::EFFECT,
    &backlash::EFFECT,
    &bouc_wen_hysteresis::EFFECT,
    &quadratic_damping::EFFECT,
    &gage_nonlinearity::EFFECT,
    &gage_creep::EFFECT,
    &saturation::EFFECT,
];

/// Place of an effect in the chain from torque to record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// A restoring or friction torque in the stand, integrated in time.
    Stand,
    /// A factor or a term of the linear response of the stand.
    Dynamics,
    /// The gage and its bridge, before the recorder.
    Gage,
    /// The recorder: lag, delay, coupling, drift.
    Chain,
    /// The last link: the limits of the recordable range.
    Limit,
    /// Added to the record, independent of the applied quantity.
    Disturbance,
}

/// An effect that a plain stand lacks.
#[derive(Debug)]
pub struct Effect {
    /// Its name in stand files and reports.
    pub name: &'static str,
    /// The equation of its first form.
    pub equation: &'static str,
    /// What happens, in a sentence for the user of the stand.
    pub meaning: &'static str,
    /// What to do about it at the stand, in a sentence.
    pub remedy: &'static str,
    /// Source of the equation.
    pub source: &'static str,
    /// Range of validity.
    pub validity: &'static str,
    /// Effects that can leave the same residual.
    pub mistaken_for: &'static [&'static str],
    /// The experiment that distinguishes it from those.
    pub experiment: &'static str,
    /// Its forms, the most common first.
    pub forms: &'static [Form],
}

/// One form of an effect.
#[derive(Debug)]
pub struct Form {
    /// Its name within the effect.
    pub name: &'static str,
    /// Its equation.
    pub law: &'static str,
    /// Its place in the chain.
    pub stage: Stage,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
    /// Start values of a fit, in scales; several where the error has several minima.
    pub starts: &'static [&'static [f64]],
    /// Builds the effect from parameters in units of the record, s and Hz.
    pub build: fn(&[f64]) -> Action,
}

impl Effect {
    /// Whether both can leave the same residual.
    #[must_use]
    pub fn resembles(&self, other: &Self) -> bool {
        self.mistaken_for.contains(&other.name) || other.mistaken_for.contains(&self.name)
    }

    /// The effect with the given name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        EFFECTS.iter().copied().find(|effect| effect.name == name)
    }

    /// The form with the given name; the first form for `None`.
    #[must_use]
    pub fn form(&self, name: Option<&str>) -> Option<&'static Form> {
        match name {
            None => self.forms.first(),
            Some(name) => self.forms.iter().find(|form| form.name == name),
        }
    }
}
