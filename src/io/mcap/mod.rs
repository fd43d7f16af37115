//! MCAP files: recordings of messages, <https://mcap.dev>.
//!
//! # Data path
//!
//! Bytes → [`record::frames`] (records, chunks unpacked, damage noted) → [`channels`] (what a
//! channel's messages are made of, by [`schema`]) → [`route`] (the way to the wanted number) →
//! [`decode`] ([`cdr`], [`protobuf`], [`json`]) → [`blocks`] and [`order`] (times) → [`Source`].
//!
//! # What is believed
//!
//! No length in a file is believed before the bytes are there: buffers grow with what is read.
//! Messages of a chunk whose checksum is wrong are left out and the loss is said; a file that is
//! cut off is used up to its last whole message. Memory is that of one chunk (1 GiB at most), of
//! the samples held back to be sorted, and of the schemas.

pub mod blocks;
pub mod cdr;
pub mod channels;
mod clock;
pub mod decode;
pub mod inventory;
pub mod json;
pub mod order;
pub mod path;
pub mod protobuf;
pub mod record;
pub mod route;
pub mod schema;
pub mod selection;
pub mod source;
pub mod summary;
#[cfg(test)]
pub(crate) mod testing;
pub mod time;
pub mod units;
pub mod writer;

pub use inventory::Inventory;
pub use selection::Selection;
pub use source::{Options, Source};
pub use summary::Summary;
pub use time::TimeChoice;
pub use writer::Writer;
