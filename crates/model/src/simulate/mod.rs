//! The stand's answer to a given input, effects included.
//!
//! Torques of the stand are integrated in time, everything linear is applied in the frequency domain, what
//! gage and recorder do follows sample by sample. Between samples the input is band-limited, not a
//! straight line, unless it is said to be ([`Between`]).

mod between;
mod input;
mod integrate;
mod model;
mod run;

pub use between::Between;
pub use input::Excitation;
pub use integrate::{State, substeps};
pub use model::{Fixed, Model};

#[cfg(test)]
mod tests;
