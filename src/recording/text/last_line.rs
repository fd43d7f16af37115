//! A last line without a line end where the other lines have one: the file may be truncated within it.

use super::cell::Cell;
use super::rows::{ColumnKind, RowPlan, cleaned};
use crate::recording::text::dialect::is_skipped;
use crate::warning::{Warning, WarningCode};

/// Kind of a last line without a line end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LastLine {
    /// Not a row: a remark, an empty line, the only line there is.
    Harmless,
    /// A complete row whose last number may be truncated.
    Suspect,
    /// A row with missing or unreadable cells; it is not used.
    Cut,
}

impl LastLine {
    /// Judges the last line of a text, which has no line end; `is_first` means that no line precedes the
    /// text.
    pub fn of(text: &[u8], is_first: bool, plan: &RowPlan) -> Self {
        let mut lines = text
            .rsplit(|byte| *byte == b'\n')
            .map(|line| cleaned(line).0);
        let last = lines.next().unwrap_or_default();
        let before = lines.find(|line| !is_skipped(line));
        if is_skipped(&last) || plan.end.is_at(&last) || before.is_none() && is_first {
            return Self::Harmless;
        }
        let cells = plan.dialect.cells(&last);
        let before = before.map(|line| plan.dialect.cells(&line));
        let usual = before.as_ref().map_or(plan.width, Vec::len);
        let is_wanted = |place: usize| {
            plan.kinds
                .get(place)
                .is_some_and(|kind| *kind != ColumnKind::Nothing)
        };
        let is_unreadable = |(place, cell): (usize, &String)| {
            is_wanted(place) && Cell::read(cell, plan.dialect.decimal) == Cell::Text
        };
        let is_short = |place: usize| match (
            cells.get(place),
            before.as_ref().and_then(|cells| cells.get(place)),
        ) {
            (Some(cell), Some(usual)) => cell.len() < usual.len() && place + 1 == plan.width,
            _ => false,
        };
        let is_empty = |cells: &Vec<String>| cells.last().is_some_and(String::is_empty);
        let ends_before_cell = is_empty(&cells) && !before.as_ref().is_some_and(is_empty);
        let is_cut = cells.len() < usual
            || ends_before_cell
            || cells.iter().enumerate().any(is_unreadable)
            || plan.stamps.is_some_and(is_short);
        if is_cut { Self::Cut } else { Self::Suspect }
    }

    /// Warning about it; `place` is the file and the line, `line` its text.
    pub fn warning(self, place: &str, line: &str) -> Option<Warning> {
        match self {
            Self::Harmless => None,
            Self::Cut => Some(truncated(place, line)),
            Self::Suspect => Some(WarningCode::UnendedLastLine.warning(format!(
                "{place}: this last line (\"{}\") has no line ending, unlike the others: its last number may be \
                 truncated. It was used; check the last sample, or copy the file again",
                shortened(line)
            ))),
        }
    }
}

/// Text after the last line feed.
pub fn last_line(text: &[u8]) -> &[u8] {
    &text[memchr::memrchr(b'\n', text).map_or(0, |place| place + 1)..]
}

/// Loss if a file ends within a line, `line 7`.
pub fn truncated(line: &str, text: &str) -> Warning {
    WarningCode::TruncatedLastLine.warning(format!(
        "{line}: the file ends in the middle of this line (\"{}\"); it was skipped, everything before it was used",
        shortened(text)
    ))
}

/// A text of at most 60 characters.
pub fn shortened(text: &str) -> String {
    let text = text.trim();
    if text.chars().count() <= 60 {
        text.to_owned()
    } else {
        text.chars().take(57).chain("...".chars()).collect()
    }
}
