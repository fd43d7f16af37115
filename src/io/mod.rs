//! Files in and out.

pub mod digits;
mod input;
pub mod mcap;
pub mod number;
pub mod output;
mod parts;
mod reading;
pub mod text;

pub use input::Input;
pub use parts::remove_when_interrupted;
pub use reading::{ChannelChoice, Delimiter, DialectOverride, Flags, Reading};
pub(crate) use reading::{frequency, positive_frequency};
