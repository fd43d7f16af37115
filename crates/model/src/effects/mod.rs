//! What a plain stand can lack: one file for each effect, one line for it in [`EFFECTS`].
//!
//! The plain stand is `x'' + 2ζω₀ x' + ω₀² x = ω₀² G u` with the applied quantity `u` and the recorded
//! one `x` (for a torque stand `x = T_o = K θ` and `G = 1`). An effect sits at one of four places:
//!
//! | place | what it does |
//! |---|---|
//! | [`Stage::Stand`] | a torque `n(x, x', z)` beside `x`, in units of the record: `x'' + 2ζω₀ x' + ω₀² (x + n) = ω₀² G u` |
//! | [`Stage::Dynamics`] | a factor or a term of the linear response |
//! | [`Stage::Chain`] | what gage, amplifier and recorder make of `x` |
//! | [`Stage::Disturbance`] | something added that does not come from `u` |
//!
//! Of one effect there can be several forms, as the same name stands for different equations in
//! different texts.
//!
//! [`RIVALS`] are laws that stand beside the list, so that none of it is named in their place.

mod action;
mod curve;
mod lines;
mod parameter;
mod rivals;

mod backlash;
mod bouc_wen_hysteresis;
mod capacitive_coupling;
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
    Action, Distortion, Fixed, Frequency, Memory, SampleClock, Torque, Treatment, Unrecovered,
};
pub(crate) use backlash::bridge;
pub use capacitive_coupling::level;
pub use lines::{FoundLine, SpectralLine, subtract_lines};
pub use parameter::{EffectParameter, ParameterScale, RecordScales, Unit};
pub use rivals::RIVALS;
pub use thermal_drift::subtract_course;

/// All effects.
pub const EFFECTS: &[&Effect] = &[
    &second_mode::EFFECT,
    &structural_damping::EFFECT,
    // Before the low-pass: one whose corner cannot be seen is a delay.
    &time_delay::EFFECT,
    &recorder_lowpass::EFFECT,
    &capacitive_coupling::EFFECT,
    &gain_error::EFFECT,
    &mains_pickup::EFFECT,
    &thermal_drift::EFFECT,
    &rotor_imbalance::EFFECT,
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

/// Where in the chain from torque to record an effect sits.
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
    /// The last link: what cannot be recorded any more.
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
    /// Where the equation comes from.
    pub source: &'static str,
    /// Where it holds.
    pub validity: &'static str,
    /// What else can leave the same residual.
    pub mistaken_for: &'static [&'static str],
    /// The record that shows it apart from those.
    pub experiment: &'static str,
    /// Its forms, the usual one first.
    pub forms: &'static [Form],
}

/// One form of an effect.
#[derive(Debug)]
pub struct Form {
    /// Its name within the effect.
    pub name: &'static str,
    /// Its equation.
    pub law: &'static str,
    /// Where it sits in the chain.
    pub stage: Stage,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
    /// Values, in scales, from which a fit starts; several where the error has several minima.
    pub starts: &'static [&'static [f64]],
    /// The effect with these values, in units of the record, s and Hz.
    pub build: fn(&[f64]) -> Action,
}

impl Effect {
    /// Whether it and another one can leave the same residual.
    #[must_use]
    pub fn resembles(&self, other: &Self) -> bool {
        self.mistaken_for.contains(&other.name) || other.mistaken_for.contains(&self.name)
    }

    /// The effect of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        EFFECTS.iter().copied().find(|effect| effect.name == name)
    }

    /// The form of a name; the first one for none.
    #[must_use]
    pub fn form(&self, name: Option<&str>) -> Option<&'static Form> {
        match name {
            None => self.forms.first(),
            Some(name) => self.forms.iter().find(|form| form.name == name),
        }
    }
}
