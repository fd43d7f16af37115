//! Laws that are not offered as effects, but put to the records beside them: where one of them explains more than every
//! effect of the list, the effect that comes nearest is not named.
//!
//! Each is the plainest law of its kind, which tells that kind apart from the list and no more.

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
