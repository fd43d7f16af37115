//! Mechanics of a reaction-torque stand.
//!
//! The stator of a machine sits on a stiff beam, a strain gage on the beam measures the reaction
//! torque, and the stator rings on the beam. This crate contains the mechanics of that stand:
//!
//! ```text
//! J θ'' + f θ' + K θ = T        stand, T the torque on the stator
//! T_o = K θ                     torque the gage shows
//! ```
//!
//! # Data path
//!
//! Text with units → [`Kind::parse`] → SI numbers, or an [`Estimate`] with its uncertainty →
//! constants from the drawing ([`beam`], [`inertia`], [`damping`]) or from measurements
//! ([`damping::FreeDecay`], [`calibration`]) → [`SecondOrder`] → [`SecondOrder::inverse`], the
//! factor that converts the measured torque to the applied torque.
//!
//! The crate does no file access and no signal processing.
//!
//! # Conventions
//!
//! - SI inside: kg, m, s, A, K, rad. Names of bare numbers end in the unit, as in
//!   `stiffness_n_m_per_rad`. Ratios have no suffix.
//! - Time factor e^{+jωt}: the response of a stand lags, so the phase of [`SecondOrder::forward`]
//!   runs from 0 to −π and the phase of [`SecondOrder::inverse`] from 0 to +π.
//! - Positive angle, force at the beam and torque on the stator have the same direction.
//! - Frequencies ending in `_hz` are cycles per second; ω = 2π·frequency is in rad/s.
//! - Uncertainties are standard uncertainties (one standard deviation) unless the name says
//!   otherwise. An unknown uncertainty is `None`, never 0.
//!
//! # Sources
//!
//! Equation numbers such as (16) or (C20) are those of T. P. Hertel, "The modeling, fabrication,
//! and testing of an instantaneous torque measuring system", master's thesis.
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | [`quantity`] | units, physical kinds, numbers with uncertainty |
//! | [`section`] | cross sections: area, second moment, shear coefficient |
//! | [`beam`] | stiffness of the beam and strain on its surface |
//! | [`inertia`] | mass moments of inertia of simple bodies |
//! | [`damping`] | viscous coefficient, free decay |
//! | [`response`] | transfer function and its inverse; [`ModalResponse`] is that of several modes |
//! | [`effects`] | effects that a plain stand lacks |
//! | [`chain`] | the links from the applied torque to the record, forward and inverse |
//! | [`simulate`] | the motion for a given input, integrated in time |
//! | [`uncertainty`] | uncertainty of the inverse |
//! | [`calibration`] | torque per volt from a static load |
//! | [`fit`] | least squares: parameters with uncertainties from data |
//! | [`error`] | errors of the mechanics |

pub mod beam;
pub mod calibration;
pub mod chain;
mod check;
pub mod damping;
pub mod effects;
pub mod error;
pub mod fit;
pub mod inertia;
mod modal;
mod mode;
pub mod quantity;
pub mod response;
pub mod section;
pub mod simulate;
pub mod uncertainty;

pub use beam::{Beam, Compliance, Segment};
pub use chain::{Chain, Link, StandRun};
pub use damping::FreeDecay;
pub use error::ModelError;
pub use inertia::Part;
pub use modal::{ModalPart, ModalResponse};
pub use mode::Mode;
pub use quantity::{
    Covariance, Dimension, Estimate, Estimates, Kind, Measure, QuantityError, RatioOf, Unit,
    UnitSystem,
};
pub use response::SecondOrder;
pub use section::CrossSection;
pub use uncertainty::{InverseGradient, InverseUncertainty, ParameterStd};
