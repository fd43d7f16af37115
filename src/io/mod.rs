//! Files in and out.

pub mod csv;
pub mod digits;
pub mod mcap;
pub mod number;
pub mod output;
pub mod text;
