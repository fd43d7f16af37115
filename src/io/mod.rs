//! Files in and out.

mod fault;
mod input;
pub(crate) mod json_lines;
mod mark;
pub mod mcap;
pub mod output;
pub(crate) mod packed;
mod parts;
mod reading;
mod standard_output;
pub(crate) mod storage;
pub(crate) mod sum;

pub use input::Input;
pub(crate) use input::{HEAD, MCAP_START};
pub(crate) use mark::{COMPENSATED, already_compensated, names_compensated};
pub use parts::remove_when_interrupted;
pub use reading::{
    ChannelChoice, Delimiter, DialectOverride, Fill, Flags, FullScale, Reading, TimeRange,
};
pub(crate) use reading::{frequency, positive_frequency};
