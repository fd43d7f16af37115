//! MCAP files: recordings of messages, <https://mcap.dev>.
//!
//! # Data path
//!
//! Bytes → `record` (records, decompressed chunks, damage reports) → `channels` (structure of a
//! channel's messages, by [`schema`]) → [`route`] (path to the wanted number) → [`decode`] ([`cdr`],
//! `protobuf`, `json`) → `blocks` and `order` (times) → [`SignalReader`], or [`read_fields`] for several
//! numbers in one pass.
//!
//! # Trust
//!
//! No length in a file is trusted before the bytes are there: buffers grow with the data read. Messages
//! of a chunk with a wrong checksum are dropped and the loss is reported; a truncated file is used up to
//! its last complete message. Memory is limited to one chunk (1 GiB at most), the samples held back for
//! sorting, and the schemas.

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
