//! Makers' recording formats. To add one: a line in the list `makers` of the vocabulary, or a file
//! with its rule and a line in [`RULES`].
//!
//! Most exports differ from a plain table only in the lines above it, and the general reader handles
//! them: their rule gives their name, and defaults that the files do not state. Those with a
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

/// A maker's recording format.
#[derive(Debug, Clone, Copy)]
pub struct Maker {
    /// Name, for messages.
    pub name: &'static str,
    /// Defaults that its files do not state.
    pub hints: Hints,
    /// Its reader, if the general one is not sufficient.
    pub read: Option<Reader>,
}

/// Reads a text into a recording without source and dialect.
pub type Reader = fn(&mut Chunks, &Reading) -> Result<Recording, Failure>;

/// A maker, and a predicate on the first lines of a file.
pub type Rule = (Maker, fn(&Head) -> bool);

/// The rules, most specific first.
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
    /// One whose tables the general reader handles.
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
pub fn recognise(head: &Head) -> Option<Maker> {
    let ruled = RULES.iter().copied().flatten().find(|(_, is)| is(head));
    ruled
        .map(|(maker, _)| *maker)
        .or_else(|| names::listed(head))
}
