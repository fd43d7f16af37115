//! Which columns are time, and the axis of every other column.

mod groups;
mod left_out;
mod places;
mod stamps;

use std::sync::Arc;

use torqcomp_dsp::quality::rounding::rounded;

use super::header::Field;
use super::keys::{self, Entry};
use super::rows::{Column, ColumnKind};
use crate::failure::Failure;
use crate::io::Reading;
use crate::recording::moment::Moment;
use crate::recording::{RateFrom, TimeAxis};
use crate::warning::Warning;
use groups::{Group, groups};
pub use stamps::StampRule;

/// Largest difference of a rate in the head from that of the stamps for both to mean the same.
const SAME: f64 = 0.02;
/// Relative difference of the two that is nothing but the rounding of the stamps.
const ROUNDED: f64 = 1e-6;
/// Most that rounding moves the last stamp against the first, in steps of their last digit.
const QUANTA: f64 = 1.2;

/// What a column is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A channel, and the place among the rules of its time.
    Channel(usize),
    /// Time stamps.
    Time,
    /// The number of the sample.
    Index,
    /// Nothing of use: empty, or texts.
    Nothing,
}

/// What the columns of a table are and where their time comes from, as its first rows show.
#[derive(Debug, Clone, Default)]
pub struct AxisPlan {
    /// One for each column.
    pub roles: Vec<Role>,
    /// Where time comes from.
    pub rules: Vec<AxisRule>,
    /// What should be known of columns named as time.
    pub warnings: Vec<Warning>,
}

/// Where the time of channels comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisRule {
    /// The stamps, if there are any.
    pub stamps: Option<StampRule>,
    /// The rate in the head and the words that give it.
    header: Option<(String, f64)>,
    header_start_s: Option<f64>,
    given_hz: Option<f64>,
    start_text: Option<String>,
    assumed: Option<String>,
}

/// What the axes are found from.
pub struct Sources<'a> {
    /// The columns' headings.
    pub fields: &'a [Field],
    /// What they hold.
    pub kinds: &'a [ColumnKind],
    /// The first date or time of each, as written.
    pub clock_texts: &'a [Option<String>],
    /// Their values in the first rows.
    pub columns: &'a [Column],
    /// What the head says.
    pub entries: &'a [Entry],
    /// Decimal mark of the head.
    pub decimal: u8,
    /// Unit of time where a maker's files never name it.
    pub default_time_unit: Option<&'a str>,
    /// What the user says.
    pub reading: &'a Reading,
}

impl AxisRule {
    /// What was taken for granted and should be confirmed.
    pub fn assumed(&self) -> Option<&str> {
        self.assumed.as_deref().filter(|_| self.given_hz.is_none())
    }

    /// The axis of columns.
    pub fn axis(&self, columns: &[Column]) -> TimeAxis {
        let mut axis = match &self.stamps {
            Some(rule) => TimeAxis::of_stamps_after(
                rule.origin_ns,
                &rule.heading,
                Arc::new(rule.stamps(columns)),
            ),
            None => match &self.header {
                Some((words, hz)) => TimeAxis::of_header(words, *hz, self.header_start_s),
                None => TimeAxis::default(),
            },
        };
        if let Some(rule) = &self.stamps {
            axis.holes.clone_from(&columns[rule.place].holes);
            axis.clock_ns = rule.clock_ns;
        }
        axis.header_rate_hz = self.header.as_ref().map(|(_, hz)| *hz);
        self.prefer_header(&mut axis);
        axis.assumed = self.assumed().map(str::to_owned);
        axis.start_text.clone_from(&self.start_text);
        if axis.start_text.is_none() {
            axis.start_text = axis.start.and_then(Moment::date);
        }
        if let Some(rate_hz) = self.given_hz {
            axis.rate_hz = Some(rate_hz);
            axis.rate_from = RateFrom::Given;
        }
        axis
    }

    /// Where stamps are too coarse to give the rate but agree with the head on the whole, or differ from
    /// it by their rounding only, the head's rate is the better one.
    fn prefer_header(&self, axis: &mut TimeAxis) {
        let (Some(stamps), Some((words, hz))) = (&axis.stamps_s, &self.header) else {
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
            axis.rate_hz = Some(*hz);
            axis.rate_from = RateFrom::Header(words.clone());
        }
    }
}

impl Sources<'_> {
    /// Finds what the columns are, and the rules of their time.
    ///
    /// # Errors
    /// If the user names a column that is not there, or a unit that is none.
    pub fn find(&self) -> Result<AxisPlan, Failure> {
        let count = self.fields.len();
        let has_data = |place: &usize| !self.columns[*place].values.is_empty();
        let (steps, used): (Vec<usize>, Vec<usize>) =
            (0..count).filter(has_data).partition(|p| self.is_steps(*p));
        let mut roles = vec![Role::Nothing; count];
        steps.iter().for_each(|place| roles[*place] = Role::Time);
        let named = self.time_places(&used)?;
        let (index, rest): (Vec<usize>, Vec<usize>) = used.iter().partition(|place| {
            let counts = self.is_index(**place, &used)
                || !named.times.is_empty() && self.is_row_label(**place, &used);
            counts && !named.times.contains(place)
        });
        index.iter().for_each(|place| roles[*place] = Role::Index);
        let (mut rules, mut warnings) = (Vec::new(), Vec::new());
        warnings.extend(self.falling_time(&rest, &named.times));
        for group in groups(&named.times, &rest) {
            group
                .times
                .iter()
                .for_each(|place| roles[*place] = Role::Time);
            let rule = self.rule(&group, named.assumed.as_deref())?;
            warnings.extend(self.other_times(&group, &rule));
            // The time of columns without numbers is no channel.
            let is_channel = |place: &&usize| !self.fields[**place].is_label;
            for place in group.channels.iter().filter(is_channel) {
                roles[*place] = Role::Channel(rules.len());
                rules.push(self.with_own_rate(rule.clone(), *place));
            }
        }
        Ok(AxisPlan {
            roles,
            rules,
            warnings,
        })
    }

    /// Where the time of a group comes from.
    fn rule(&self, group: &Group, assumed: Option<&str>) -> Result<AxisRule, Failure> {
        let header = self.header_rate(group.channels.first().or(group.times.first()).copied());
        let stamps = self.stamp_rule(group, header.as_ref().map(|(_, hz)| *hz))?;
        let stamps = stamps.or_else(|| self.rule_of_steps());
        let of_stamps = stamps.as_ref().and_then(|rule| rule.assumed.as_deref());
        // Date and time in words are better than a count of ticks.
        let is_count = |text: &String| text.bytes().all(|byte| byte.is_ascii_digit());
        let mut start_text = stamps.as_ref().and_then(|rule| rule.start_text.clone());
        if start_text.as_ref().is_none_or(is_count) {
            start_text = keys::date_text(self.entries).or(start_text);
        }
        Ok(AxisRule {
            assumed: match (assumed.filter(|_| stamps.is_some()), of_stamps) {
                (Some(a), Some(b)) => Some(format!("{a}; {b}")),
                (a, b) => a.or(b).map(str::to_owned),
            },
            header_start_s: self.header_start(),
            given_hz: self.reading.rate_hz,
            stamps,
            header,
            start_text,
        })
    }

    /// The rate of a channel that the head gives for it alone.
    fn with_own_rate(&self, mut rule: AxisRule, place: usize) -> AxisRule {
        if rule.stamps.is_none() {
            rule.header = self.header_rate(Some(place)).or(rule.header);
        }
        rule
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
        // "Start" alone may count samples, as Keysight's Infiniium has it beside "XOrg".
        let is_bare = |entry: &&keys::Entry| {
            entry
                .key
                .trim_end_matches(':')
                .eq_ignore_ascii_case("start")
        };
        let starts = || {
            self.entries
                .iter()
                .filter(|entry| entry.topic() == Some(keys::Topic::Start))
        };
        let mut ordered = starts()
            .filter(|e| !is_bare(e))
            .chain(starts().filter(is_bare));
        ordered
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
