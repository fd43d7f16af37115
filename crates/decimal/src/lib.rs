//! Decimal numbers in text: read exactly, and written with a fixed number of digits.
//!
//! Recordings of gigabytes go through these loops, number by number. They are a crate of their own so that they can be
//! compiled for speed, and the rest of the binary for size.

pub mod digits;
pub mod number;
mod pair;
mod span;
mod text;

pub use digits::Digits;
pub use pair::{NumberPair, PairFormat};
pub use span::Span;
pub use text::Text;
