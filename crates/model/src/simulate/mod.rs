//! Motion of a stand for a given input, including the torques of its effects: the first part of
//! [`Chain::simulate`](crate::Chain::simulate).
//!
//! Torques of the stand are integrated in time, everything linear is applied in the frequency domain, and gage and
//! recorder follow sample by sample. Between samples the input is band-limited, not linearly interpolated, unless
//! specified otherwise ([`Between`]).
//!
//! A record of any length is simulated piece by piece ([`Pieces`]); [`steady_answer`] is the steady-state response to a
//! periodic input.

mod between;
mod input;
mod integrate;
mod modes;
mod pieces;
mod run;
mod side_by_side;
mod steady;

pub use between::Between;
pub use input::Excitation;
pub use integrate::{MotionState, substeps};
pub(crate) use integrate::{free_motion, sampled_response};
pub use pieces::{Diverges, Pieces};
pub(crate) use run::{MotionProgress, Torques};
pub(crate) use side_by_side::{OngoingMotion, integrate};
pub use steady::{NoSteadyAnswer, steady_answer};

#[cfg(test)]
mod tests;
