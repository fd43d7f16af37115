//! The crate from outside: oracles of its own, certified values, and properties.

mod util;

mod beam;
mod estimate;
mod fit;
mod nist;
mod quantity;
mod response;
