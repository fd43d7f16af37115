//! Makers' ways to write recordings. To add one: a line in the list `makers`
//! of the vocabulary, or a file with its rule and a line in [`RULES`].
//!
//! Most exports differ from a plain table only by what stands above it, and the general reader takes
//! them as they are: their rule tells their name, and what the files leave unsaid. Those with a
//! structure of their own have a reader.

use super::chunks::Chunks;
use super::head::Head;
use super::table::Hints;
use crate::failure::Failure;
use crate::io::Reading;
use crate::recording::Recording;

mod gwinstek;
mod lecroy;
mod lvm;
mod mathcad;
mod names;
mod rigol;
mod rohde;
mod tektronix;

/// A way to write recordings.
#[derive(Debug, Clone, Copy)]
pub struct Maker {
    /// Its name, for people.
    pub name: &'static str,
    /// What its files leave unsaid.
    pub hints: Hints,
    /// Its reader, if the general one does not do.
    pub read: Option<Reader>,
}

/// Reads a text into a recording without source and dialect.
pub type Reader = fn(&mut Chunks, &Reading) -> Result<Recording, Failure>;

/// A maker, and whether a file is written so, by its first lines.
pub type Rule = (Maker, fn(&Head) -> bool);

/// The rules, the most particular first.
const RULES: &[&[Rule]] = &[
    lvm::ALL,
    lecroy::ALL,
    tektronix::ALL,
    rigol::ALL,
    gwinstek::ALL,
    rohde::ALL,
    mathcad::ALL,
    names::ALL,
];

impl Maker {
    /// One whose tables the general reader takes as they are.
    const fn plain(name: &'static str) -> Self {
        Self {
            name,
            hints: Hints {
                time_unit: None,
                unit: None,
            },
            read: None,
        }
    }

    /// One that never names the unit of time, which is the second.
    const fn of_seconds(name: &'static str) -> Self {
        Self {
            hints: Hints {
                time_unit: Some("s"),
                unit: None,
            },
            ..Self::plain(name)
        }
    }

    /// One with a reader of its own.
    const fn with_reader(self, read: Reader) -> Self {
        Self {
            read: Some(read),
            ..self
        }
    }
}

/// The maker of a file.
#[must_use]
pub fn recognise(head: &Head) -> Option<Maker> {
    let ruled = RULES.iter().copied().flatten().find(|(_, is)| is(head));
    ruled
        .map(|(maker, _)| *maker)
        .or_else(|| names::listed(head))
}
