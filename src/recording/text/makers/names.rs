//! Exports that the general reader takes as they are: how each is told.

use super::Maker;
use crate::recording::text::head::Head;
use crate::recording::text::table::Hints;

const PLAIN: Hints = Hints {
    time_unit: None,
    unit: None,
};

const fn plain(name: &'static str, is: fn(&Head) -> bool) -> Maker {
    Maker {
        name,
        is,
        hints: PLAIN,
        read: None,
    }
}

/// One line for each.
pub const ALL: &[Maker] = &[
    plain("TwinCAT Scope", |head| {
        head.starts(0, "Name\t") && head.any(|line| line.starts_with("Starttime of export"))
    }),
    plain("Campbell TOA5", |head| {
        head.starts(0, "TOA5") || head.starts(0, "\"TOA5\"")
    }),
    plain("CASSY Lab", |head| {
        head.starts(0, "MIN=") && head.any(|line| line.starts_with("DEF="))
    }),
];
