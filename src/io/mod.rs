//! Files in and out.

pub mod csv;
pub mod digits;
mod input;
pub mod mcap;
pub mod number;
pub mod output;
pub mod text;

pub use input::Input;
