//! Numbers with units and with uncertainty.
//!
//! Text such as `"8.1e4 ft lbf/rad"` becomes an SI number through [`Kind::parse`]: the expected kind of quantity
//! determines the accepted units. A number without its unit is rejected.
//!
//! # Grammar of unit text
//!
//! | written | meaning |
//! |---|---|
//! | `ft lbf`, `N*m`, `N·m`, `N.m`, `N-m` | product |
//! | `V/V`, `rad per s`, `1/K`, `/degF` | division |
//! | `m^2`, `m²`, `m2`, `s^-1`, `s⁻¹`, `s-1` | power |
//! | `N m/(rad/s)` | parentheses |
//!
//! A product after a division, as in `N m/rad s`, is rejected: write `N m/(rad s)` or `N m s/rad`. Symbols are
//! case-sensitive (`mN` is not `MN`), words (`volts`, `RPM`) are not.
//!
//! # Ratios
//!
//! `mV/V` and `ustrain` are both dimensionless, but mean different things for a bridge: [`Unit::ratio_of`]
//! distinguishes them. `%` and `ppm` alone are neither; `% V/V` and `% strain` are.
//!
//! # Angles and cycles
//!
//! The radian is a dimension of its own, and one hertz is one cycle of 2π rad per second. So `3700 rad/s` read as a
//! frequency is 588.87 Hz, not 3700 Hz, and `10 Hz` read as an angular speed is 62.8 rad/s.

mod dimension;
mod error;
mod estimate;
mod estimates;
mod grammar;
mod kind;
mod kind_table;
mod symbols;
mod unit;

pub use dimension::Dimension;
pub use error::QuantityError;
pub use estimate::{Estimate, Measure};
pub use estimates::{Covariance, Estimates};
pub use kind::{Kind, UnitSystem};
pub use unit::{RatioOf, Unit};
