//! Signal processing for a reaction-torque stand: from recorded volts to the applied torque.
//!
//! The crate has no model of beams and inertias: the stand's response is given as a function of
//! frequency, and records are slices of uniformly sampled `f64`. It does no file I/O.
//!
//! ```text
//! volts ── conversion (gage, bridge) ──► torque as recorded ── compensate ──► torque that acted
//!                                              │
//!                                              └─ harmonics (sine fit, order by order)
//! ```
//!
//! # Conventions
//! * Time dependence `e^{+jωt}`; a response `H(f)` is output over input.
//! * A delay `τ` of the output is `H(f) = e^{-j2πfτ}`: a lagging phase is negative.
//! * Amplitudes are peak values; a component is `A cos(2πft + φ)`.
//! * Spectral densities are one-sided, in unit²/Hz. Transforms are unscaled forward, `1/N` inverse.
//! * "Standard uncertainty" is one standard deviation (JCGM 100:2008), never an expanded one.

pub mod band;
pub mod bridge;
pub mod compensate;
pub mod conversion;
pub mod curve;
pub mod decimate;
mod error;
pub mod frf;
pub mod gage;
pub mod harmonics;
pub mod noise;
mod noise_density;
pub mod onset;
mod order;
pub mod peaks;
pub mod quality;
pub mod recorder;
pub mod resample;
pub mod spectrum;
pub mod store;
#[cfg(test)]
mod test_noise;
pub mod undersample;
pub mod weak;
pub mod zero_phase;

pub use error::Error;
pub use order::sort_by_number;
pub use torqcomp_fourier::{dot, rms};
