//! The motion of a stand under a given input, torques of its effects included: the first part of
//! [`Chain::simulate`](crate::Chain::simulate).
//!
//! Torques of the stand are integrated in time, everything linear is applied in the frequency domain, what
//! gage and recorder do follows sample by sample. Between samples the input is band-limited, not a
//! straight line, unless it is said to be ([`Between`]).
//!
//! A record of any length is simulated piece by piece ([`Pieces`]); the answer to an input that repeats, once it has settled,
//! is that of [`steady_answer`].

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
pub(crate) use integrate::{free_motion, held_response};
pub use pieces::{Diverges, Pieces};
pub(crate) use run::{MotionProgress, Torques};
pub(crate) use side_by_side::{OngoingMotion, integrate};
pub use steady::{NoSteadyAnswer, steady_answer};

#[cfg(test)]
mod tests;
