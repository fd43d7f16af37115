//! Numbers with units and with uncertainty.
//!
//! Text such as `"8.1e4 ft lbf/rad"` becomes an SI number through [`Kind::parse`]: the kind of
//! quantity expected says which units fit. A number without its unit is refused.
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
//! A product after a division, as in `N m/rad s`, is refused: write `N m/(rad s)` or
//! `N m s/rad`. Symbols are case-sensitive (`mN` is not `MN`), words (`volts`, `RPM`) are not.
//!
//! # Ratios
//!
//! `mV/V` and `ustrain` have no dimension, and a bridge makes them different things: [`Unit::ratio_of`] tells them apart.
//! `%` and `ppm` alone say neither; `% V/V` and `% strain` do.
//!
//! # Angles and cycles
//!
//! The radian is kept as a dimension of its own, and a hertz is one cycle of 2π rad per second.
//! So `3700 rad/s` read as a frequency is 588.87 Hz and never 3700 Hz, and `10 Hz` read as an
//! angular speed is 62.8 rad/s.

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
