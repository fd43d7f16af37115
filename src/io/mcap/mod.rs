//! MCAP files: recordings of messages, <https://mcap.dev>.
//!
//! # Data path
//!
//! Bytes → `record` (records, chunks unpacked, damage noted) → `channels` (what a channel's messages
//! are made of, by [`schema`]) → [`route`] (the way to the wanted number) → [`decode`] ([`cdr`],
//! `protobuf`, `json`) → `blocks` and `order` (times) → [`SignalReader`], or [`read_fields`] for several
//! numbers in one pass.
//!
//! # What is believed
//!
//! No length in a file is believed before the bytes are there: buffers grow with what is read.
//! Messages of a chunk whose checksum is wrong are left out and the loss is said; a file that is
//! cut off is used up to its last whole message. Memory is that of one chunk (1 GiB at most), of
//! the samples held back to be sorted, and of the schemas.

#[cfg(test)]
mod attack_tests;
mod blocks;
pub mod cdr;
mod channels;
mod choosable;
mod clock;
pub mod decode;
mod index;
pub mod inventory;
mod json;
mod mixed;
mod order;
pub mod path;
mod protobuf;
mod record;
pub mod route;
pub mod schema;
mod selection;
mod signal;
mod source;
mod summary;
#[cfg(test)]
pub(crate) mod testing;
pub mod time;
mod tree;
mod units;
pub mod writer;

pub use index::SignalEnd;
pub use inventory::Inventory;
pub(crate) use record::file::limit_metadata;
pub use selection::FieldChoice;
pub use signal::{SelectedSignal, TimeOptions};
pub use source::{SignalReader, read_fields};
pub use summary::SignalSummary;
pub use time::TimeChoice;
pub use writer::Writer;
