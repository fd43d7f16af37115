//! Which columns are time, and the axis of every other column.

mod groups;
mod left_out;
mod places;
mod stamps;

use std::sync::Arc;

use torqcomp_dsp::quality::rounding::rounded;

use super::header::Field;
use super::keys::{self, Entry};
use super::rows::Column;
use crate::failure::Failure;
use crate::io::csv::Options;
use crate::recording::{Axis, RateFrom};
use crate::warning::Warning;
use groups::{Group, groups};

/// Largest difference of a rate in the head from that of the stamps for both to mean the same.
const SAME: f64 = 0.02;
/// Relative difference of the two that is nothing but the rounding of the stamps.
const ROUNDED: f64 = 1e-6;
/// Most that rounding moves the last stamp against the first, in steps of their last digit.
const QUANTA: f64 = 1.2;

/// What a column is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A channel, and the place among the axes of its time.
    Channel(usize),
    /// Time stamps.
    Time,
    /// The number of the sample.
    Index,
    /// Nothing of use: empty, or texts.
    Nothing,
}

/// The roles of all columns and the axes they refer to.
#[derive(Debug, Clone)]
pub struct Axes {
    /// One for each column.
    pub roles: Vec<Role>,
    /// The axes.
    pub axes: Vec<Axis>,
    /// What should be known of columns named as time.
    pub warnings: Vec<Warning>,
}

/// What the axes are found from.
pub struct Sources<'a> {
    /// The columns' headings.
    pub fields: &'a [Field],
    /// Their values.
    pub columns: &'a [Column],
    /// What the head says.
    pub entries: &'a [Entry],
    /// Decimal mark of the head.
    pub decimal: u8,
    /// Unit of time where a maker's files never name it.
    pub default_time_unit: Option<&'a str>,
    /// What the user says.
    pub options: &'a Options,
}

impl Sources<'_> {
    /// Finds roles and axes.
    ///
    /// # Errors
    /// If the user names a column that is not there, or a unit that is none.
    pub fn find(&self) -> Result<Axes, Failure> {
        let count = self.fields.len();
        let has_data = |place: &usize| !self.columns[*place].values.is_empty();
        let used: Vec<usize> = (0..count).filter(has_data).collect();
        let mut roles = vec![Role::Nothing; count];
        let steps: Vec<usize> = used.iter().copied().filter(|p| self.is_steps(*p)).collect();
        for place in &steps {
            roles[*place] = Role::Time;
        }
        let used: Vec<usize> = used.into_iter().filter(|p| !steps.contains(p)).collect();
        let named = self.time_places(&used)?;
        let index: Vec<usize> = used
            .iter()
            .copied()
            .filter(|place| !named.times.contains(place) && self.is_index(*place, &used))
            .collect();
        for place in &index {
            roles[*place] = Role::Index;
        }
        let rest: Vec<usize> = used
            .iter()
            .copied()
            .filter(|p| !index.contains(p))
            .collect();
        let (mut axes, mut warnings) = (Vec::new(), Vec::new());
        warnings.extend(self.falling_time(&rest, &named.times));
        for group in groups(&named.times, &rest) {
            for place in &group.times {
                roles[*place] = Role::Time;
            }
            let axis = self.axis(&group, named.assumed.as_deref())?;
            warnings.extend(self.other_times(&group, &axis));
            // The time of columns without numbers is no channel.
            let is_channel = |place: &&usize| !self.fields[**place].is_label;
            for place in group.channels.iter().filter(is_channel) {
                roles[*place] = Role::Channel(axes.len());
                axes.push(self.with_own_rate(axis.clone(), *place));
            }
        }
        Ok(Axes {
            roles,
            axes,
            warnings,
        })
    }

    /// The axis of a group.
    fn axis(&self, group: &Group, assumed: Option<&str>) -> Result<Axis, Failure> {
        let header = self.header_rate(group.channels.first().or(group.times.first()).copied());
        let stamps = self.stamps(group, header.as_ref().map(|(_, hz)| *hz))?;
        let mut axis = match stamps.or_else(|| self.stamps_of_steps()) {
            Some(found) => {
                let mut axis = Axis::of_stamps(&found.heading, Arc::new(found.stamps_s));
                axis.assumed = match (assumed, found.assumed) {
                    (Some(a), Some(b)) => Some(format!("{a}; {b}")),
                    (a, b) => a.map(str::to_owned).or(b),
                };
                axis.start_text = found.start_text;
                axis
            }
            None => match &header {
                Some((words, hz)) => Axis::of_header(words, *hz, self.header_start()),
                None => Axis::default(),
            },
        };
        axis.header_rate_hz = header.as_ref().map(|(_, hz)| *hz);
        self.prefer_header(&mut axis, header);
        if let Some(rate_hz) = self.options.rate_hz {
            axis.rate_hz = Some(rate_hz);
            axis.rate_from = RateFrom::Given;
            axis.assumed = None;
        }
        // Date and time in words are better than a count of ticks.
        let is_count = |text: &String| text.bytes().all(|byte| byte.is_ascii_digit());
        if axis.start_text.as_ref().is_none_or(is_count) {
            axis.start_text = keys::date_text(self.entries).or(axis.start_text);
        }
        Ok(axis)
    }

    /// Where stamps are too coarse to give the rate but agree with the head on the whole, or differ from
    /// it by their rounding only, the head's rate is the better one.
    fn prefer_header(&self, axis: &mut Axis, header: Option<(String, f64)>) {
        let (Some(stamps), Some((words, hz))) = (&axis.stamps_s, header) else {
            return;
        };
        let (Some(first), Some(last)) = (stamps.first(), stamps.last()) else {
            return;
        };
        let mean_hz = (stamps.len().saturating_sub(1)) as f64 / (last - first);
        let repeats = stamps.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let coarse = axis.rate_hz.is_none() || 10 * repeats > stamps.len();
        let difference = (mean_hz / hz - 1.0).abs();
        let is_rounding = difference < SAME
            && rounded(stamps).is_some_and(|line| {
                let ahead_s = (last - first) * difference;
                ahead_s <= QUANTA * line.quantum_s
            });
        if coarse && difference < SAME || difference < ROUNDED || is_rounding {
            axis.rate_hz = Some(hz);
            axis.rate_from = RateFrom::Header(words);
        }
    }

    /// The rate of a channel that the head gives for it alone.
    fn with_own_rate(&self, mut axis: Axis, place: usize) -> Axis {
        if axis.stamps_s.is_none()
            && self.options.rate_hz.is_none()
            && let Some((words, hz)) = self.header_rate(Some(place))
        {
            axis.rate_hz = Some(hz);
            axis.header_rate_hz = Some(hz);
            axis.rate_from = RateFrom::Header(words);
        }
        axis
    }

    /// Rate in the head for a column (or for all), and the words that give it.
    fn header_rate(&self, place: Option<usize>) -> Option<(String, f64)> {
        // The frequency of a signal may stand above the rate.
        let is_vague = |entry: &&Entry| keys::is_vague(&entry.key);
        let clear = self.entries.iter().filter(|entry| !is_vague(entry));
        clear
            .chain(self.entries.iter().filter(is_vague))
            .find_map(|entry| {
                let filled = entry.values.iter().filter(|v| !v.is_empty()).count();
                let own = place
                    .and_then(|place| place.checked_sub(1))
                    .filter(|_| filled > 1)
                    .and_then(|value| keys::rate_hz(entry, Some(value), self.decimal));
                let hz = own.or_else(|| keys::rate_hz(entry, None, self.decimal))?;
                Some((entry.key.clone(), hz))
            })
    }

    fn header_start(&self) -> Option<f64> {
        self.entries
            .iter()
            .filter(|entry| entry.topic() == Some(keys::Topic::Start))
            .find_map(|entry| keys::seconds(entry, None, self.decimal))
            .or_else(|| self.start_of_position())
    }

    /// Start as Rohde & Schwarz write it: position of the trigger, less the part of the record before
    /// the reference point.
    fn start_of_position(&self) -> Option<f64> {
        let value = |key: &str| {
            let entry = self
                .entries
                .iter()
                .find(|e| e.key.eq_ignore_ascii_case(key))?;
            keys::quantity(entry.value()?, self.decimal)
        };
        let (position, _) = value("Horizontal Position")?;
        let (reference, unit) = value("Reference Point")?;
        let (length, _) = value("Record Length")?;
        let (_, hz) = self.header_rate(None)?;
        (unit == "%").then(|| position - reference / 100.0 * length / hz)
    }
}

/// Whether values count up by one.
fn is_counting(values: &[f64]) -> bool {
    values.len() > 1
        && values[0].fract() == 0.0
        && values.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}
