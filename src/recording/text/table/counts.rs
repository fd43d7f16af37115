//! Content of a column, from its cells in the first rows.

use crate::recording::text::cell::Cell;
use crate::recording::text::clock::Clock;
use crate::recording::text::rows::ColumnKind;

/// Threshold above which stamps are stored as differences: seconds since 1973, within the range of an
/// `i64`.
const LARGE: f64 = 1e8;
const LARGEST: f64 = 9e18;

/// Frequencies of the kinds of content of a column in the first rows.
#[derive(Clone, Default)]
pub(super) struct Counts {
    numbers: usize,
    texts: usize,
    /// Number of dates and times, and the first of them.
    clocks: usize,
    first_clock: Option<(Clock, String)>,
    /// Number of values so large that a time loses its last digits in an `f64`, and the integer part of the
    /// first.
    large: usize,
    origin: Option<i64>,
}

impl Counts {
    pub fn add(&mut self, text: &str, decimal: u8) {
        let cell = Cell::read(text, decimal);
        match cell {
            Cell::Number(_) | Cell::Grouped(_) | Cell::NonFinite => {
                self.numbers += 1;
                let Cell::Number(value) = cell else { return };
                if (LARGE..LARGEST).contains(&value) {
                    self.origin.get_or_insert(value.trunc() as i64);
                    self.large += 1;
                }
            }
            Cell::Clock(clock) => {
                self.clocks += 1;
                self.first_clock
                    .get_or_insert_with(|| (clock, text.to_owned()));
            }
            Cell::Text => self.texts += 1,
            Cell::Empty => {}
        }
    }

    /// Content of the column, `None` if empty, and its first date or time, as written.
    pub fn kind(self) -> (Option<ColumnKind>, Option<String>) {
        if self.numbers + self.clocks + self.texts == 0 {
            return (None, None);
        }
        if self.texts > self.numbers + self.clocks {
            return (Some(ColumnKind::Nothing), None);
        }
        match self.first_clock {
            Some((first, text)) if self.clocks > self.numbers => {
                (Some(ColumnKind::Clock(first)), Some(text))
            }
            _ => match self.origin.filter(|_| self.large == self.numbers) {
                Some(origin) => (Some(ColumnKind::Offset(origin)), None),
                None => (Some(ColumnKind::Numbers), None),
            },
        }
    }
}
