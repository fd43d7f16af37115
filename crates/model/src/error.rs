//! Errors of the mechanics.

use thiserror::Error;

/// An error in the numbers given to the mechanics.
///
/// Every message names the number, its unit, what was expected and what to do.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A number is NaN or infinite.
    #[error("{name} is {value}, but a finite number in {unit} is needed; check the input")]
    NotFinite {
        /// Name of the number.
        name: &'static str,
        /// Unit it is given in.
        unit: &'static str,
        /// The value.
        value: f64,
    },
    /// A number that must be greater than zero is not.
    #[error("{name} is {value} {unit}, but it must be greater than 0; check its value and sign")]
    NotPositive {
        /// Name of the number.
        name: &'static str,
        /// Unit it is given in.
        unit: &'static str,
        /// The value.
        value: f64,
    },
    /// A number that must not be negative is.
    #[error("{name} is {value} {unit}, but it must be 0 or greater; check its sign")]
    Negative {
        /// Name of the number.
        name: &'static str,
        /// Unit it is given in.
        unit: &'static str,
        /// The value.
        value: f64,
    },
    /// A number that is divided by is zero.
    #[error("{name} is 0 {unit}, but the result is divided by it; use a record where it is not 0")]
    Zero {
        /// Name of the number.
        name: &'static str,
        /// Unit it is given in.
        unit: &'static str,
    },
    /// One length must be less than another.
    #[error("{smaller} is {smaller_m} m, but it must be less than {larger} ({larger_m} m)")]
    NotSmaller {
        /// Name of the length that must be less.
        smaller: &'static str,
        /// Its value in m.
        smaller_m: f64,
        /// Name of the length that must be greater.
        larger: &'static str,
        /// Its value in m.
        larger_m: f64,
    },
    /// A list that needs at least one entry is empty.
    #[error("the {what} has no {entries}; give at least one")]
    Empty {
        /// Name of the list.
        what: &'static str,
        /// Required contents.
        entries: &'static str,
    },
    /// A position outside the beam.
    #[error(
        "position {position_m} m is not on the beam, which reaches from 0 m at the clamp to \
         {length_m} m at the load; measure the position from the clamp"
    )]
    OffBeam {
        /// The position in m from the clamp.
        position_m: f64,
        /// Length of the beam in m.
        length_m: f64,
    },
    /// No bending moment at the position of the gage.
    #[error(
        "a gage at {position_m} m is at the loaded end of the beam, where the bending moment is 0, so strain does not \
         depend on torque; move it towards the clamp"
    )]
    NoMoment {
        /// The position in m from the clamp.
        position_m: f64,
    },
    /// The amplitude of a free decay does not fall.
    #[error(
        "the amplitude goes from {first} to {second}, but a decay needs two amplitudes of one \
         sign, the later one smaller; pick two peaks of the same polarity"
    )]
    NotDecaying {
        /// Earlier amplitude.
        first: f64,
        /// Later amplitude.
        second: f64,
    },
    /// The inverse response is exactly zero, so its logarithm and phase do not exist.
    #[error(
        "the undamped stand has no defined inverse phase at its natural frequency \
         {frequency_hz} Hz; give a damping greater than 0"
    )]
    UndampedResonance {
        /// The frequency in Hz.
        frequency_hz: f64,
    },
}
