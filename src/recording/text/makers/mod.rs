//! Makers' ways to write recordings. To add one: a file with its rule, and a line in [`MAKERS`].
//!
//! Most exports differ from a plain table only by what stands above it, and the general reader takes
//! them as they are: their rule tells their name, and what the files leave unsaid. Those with a
//! structure of their own have a reader.

use std::sync::Arc;

use super::decode::Text;
use super::head::Head;
use super::header::Field;
use super::rows::Column;
use super::sparse;
use super::table::Hints;
use crate::failure::Failure;
use crate::io::csv::Options;
use crate::recording::{Axis, Channel, Recording};

mod gwinstek;
mod lecroy;
mod lvm;
mod names;
mod rigol;
mod tektronix;

/// A way to write recordings.
pub struct Maker {
    /// Its name, for people.
    pub name: &'static str,
    /// Whether a file is written so, by its first lines.
    pub is: fn(&Head) -> bool,
    /// What its files leave unsaid.
    pub hints: Hints,
    /// Its reader, if the general one does not do.
    pub read: Option<Reader>,
}

/// Reads a text into a recording without source and dialect.
pub type Reader = fn(&Text, &Options) -> Result<Recording, Failure>;

/// All ways that have a name, the most particular first.
pub const MAKERS: &[&[Maker]] = &[
    lvm::ALL,
    lecroy::ALL,
    tektronix::ALL,
    rigol::ALL,
    gwinstek::ALL,
    names::ALL,
];

/// The maker of a file.
#[must_use]
pub fn recognise(head: &Head) -> Option<&'static Maker> {
    MAKERS
        .iter()
        .copied()
        .flatten()
        .find(|maker| (maker.is)(head))
}

/// A channel out of a column.
pub fn channel(
    field: &Field,
    mut column: Column,
    mut axis: Axis,
    segment: Option<usize>,
) -> Channel {
    sparse::thin(&mut column, &mut axis);
    if let Some(stamps) = &axis.stamps_s
        && stamps.len() > column.values.len()
    {
        axis.stamps_s = Some(Arc::new(stamps[..column.values.len()].to_vec()));
    }
    Channel {
        name: field.name.clone(),
        heading: field.heading.clone(),
        unit: field.unit.clone(),
        unit_text: field.unit_text.clone(),
        samples: column.values,
        holes: column.holes,
        axis,
        segment,
    }
}
