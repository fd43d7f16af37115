//! Tables of known loads and readings, whose rows are no samples in time.

use std::collections::BTreeSet;

use super::{Channel, Hole, HoleKind, Recording, check_holes, check_size, unit_of};
use crate::failure::{ErrorCode, Failure};
use crate::io::{ChannelChoice, Fill, Input, Reading};
use crate::print::plural;
use crate::unit::NamedUnit;
use crate::warning::{Warning, WarningCode};

/// Whether there is nothing in the place of a number.
fn is_blank(hole: &Hole) -> bool {
    matches!(hole.what, HoleKind::Empty | HoleKind::Missing)
}

impl Recording {
    /// The rows of a table of loads: `set` are the columns of what is set for each step, such as the load, which may be
    /// written in its first row only, and `read` those of what is read in each row.
    ///
    /// # Errors
    /// If a set value is missing and not to be held, or the columns differ in length.
    pub(crate) fn of_loads(
        input: &Input,
        [set, read]: [&[ChannelChoice]; 2],
        reading: &Reading,
    ) -> Result<Self, Failure> {
        // A given rate prevents the search for a time axis.
        let reading = Reading {
            rate_hz: reading.rate_hz.or(Some(1.0)),
            keeps_rows: true,
            ..reading.clone()
        };
        let recording = Self::read(input, &[set, read].concat(), &reading)?;
        let mut recording = recording.without_blank_rows();
        let mut rows = 0;
        for choice in set.iter().chain(read) {
            rows = rows.max(recording.channel(choice)?.samples.len());
        }
        for choice in set {
            let place = recording.place(choice)?;
            let held = recording.channels[place].hold(rows, reading.fill);
            let held = held.map_err(|failure| failure.at(&recording.source))?;
            recording.warnings.extend(held);
        }
        for choice in read {
            let channel = recording.channel(choice)?;
            if channel.samples.len() != rows {
                return Err(ErrorCode::RecordsDiffer
                    .failed(format_args!(
                        "\"{}\" ends after {}, and the table has {rows}; each load needs a reading",
                        channel.name,
                        plural(channel.samples.len(), "row"),
                    ))
                    .at(&recording.source));
            }
        }
        Ok(recording)
    }

    /// A channel used without a time axis, with its unit and warnings.
    ///
    /// # Errors
    /// If it is missing, has holes or is too large.
    pub(crate) fn column(
        &self,
        choice: &ChannelChoice,
    ) -> Result<(&Channel, Option<NamedUnit>, Option<Warning>), Failure> {
        let channel = self.channel(choice)?;
        check_holes(channel)?;
        check_size(channel)?;
        let (unit, warning) = unit_of(choice, &channel.heading, channel.unit.as_ref())?;
        Ok((channel, unit, warning))
    }

    /// The same without rows that are blank in all channels, such as lines between the series of a table.
    fn without_blank_rows(mut self) -> Self {
        let blanks = |channel: &Channel| -> BTreeSet<usize> {
            let holes = channel.holes.iter().filter(|hole| is_blank(hole));
            holes.map(|hole| hole.index).collect()
        };
        let count = |channel: &Channel| channel.samples.len();
        if self
            .channels
            .windows(2)
            .any(|pair| count(&pair[0]) != count(&pair[1]))
        {
            return self;
        }
        let common = self.channels.iter().map(blanks);
        let common = common.reduce(|a, b| a.intersection(&b).copied().collect());
        let common = common.unwrap_or_default();
        for channel in &mut self.channels {
            let mut place = 0..;
            channel
                .samples
                .retain(|_| place.next().is_some_and(|k| !common.contains(&k)));
            channel.holes.retain(|hole| !common.contains(&hole.index));
            for hole in &mut channel.holes {
                hole.index -= common.range(..hole.index).count();
            }
        }
        self
    }
}

impl Channel {
    /// Gives blank cells up to a number of rows the value above them, if requested.
    fn hold(&mut self, rows: usize, fill: Option<Fill>) -> Result<Option<Warning>, Failure> {
        let after = rows - self.samples.len();
        let missing = self.holes.iter().filter(|hole| is_blank(hole)).count() + after;
        if missing == 0 {
            return Ok(None);
        }
        if fill != Some(Fill::Hold) {
            let first = self.holes.iter().find(|hole| is_blank(hole));
            let line =
                first.map_or_else(String::new, |hole| format!(", first in line {}", hole.line));
            return Err(ErrorCode::InvalidSample.failed(format_args!(
                "\"{}\" is empty in {missing} of {}{line}; if each value is written only in the first row of its step, \
                 give --fill hold; otherwise write it in every row, or delete the rows",
                self.name,
                plural(rows, "row"),
            )));
        }
        let samples = &mut self.samples;
        self.holes.retain(|hole| {
            let above = hole.index.checked_sub(1).map(|above| samples[above]);
            let above = above.filter(|value| is_blank(hole) && !value.is_nan());
            samples[hole.index] = above.unwrap_or(f64::NAN);
            above.is_none()
        });
        samples.resize(rows, samples.last().copied().unwrap_or(f64::NAN));
        Ok(Some(WarningCode::Filled.warning(format!(
            "\"{}\" is empty in {missing} of {}, which were given the value of the row above",
            self.name,
            plural(rows, "row"),
        ))))
    }
}
