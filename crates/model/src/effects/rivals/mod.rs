//! Laws that are not offered as effects, but fitted to the records alongside them: where one of them explains more than
//! every effect of the list, the closest effect is not named.
//!
//! Each is the simplest law of its kind, enough to distinguish that kind from the list.

mod changing_gain;
mod cubic_damping;
mod quintic_stiffness;
mod squeezed_damping;

use super::Effect;

/// All of them.
pub const RIVALS: &[&Effect] = &[
    &quintic_stiffness::EFFECT,
    &cubic_damping::EFFECT,
    &squeezed_damping::EFFECT,
    &changing_gain::EFFECT,
];
