//! Detection of time columns, and the axis of every other column.

mod counters;
mod groups;
mod header_rate;
mod left_out;
mod own_clocks;
mod places;
mod stamps;

use std::sync::Arc;

use torqcomp_dsp::quality::rounding::rounded;

use super::header::Field;
use super::keys::{self, HeaderEntry};
use super::rows::{Column, ColumnKind};
use super::vocabulary::has;
use crate::failure::Failure;
use crate::io::Reading;
use crate::recording::moment::Moment;
use crate::recording::{RateFrom, TimeAxis};
use crate::warning::Warning;
use counters::RowCounter;
use groups::{Group, groups};
use left_out::OtherClock;
pub use stamps::StampRule;

/// Largest relative difference of a header rate from that of the stamps, or from another one, for both to mean the
/// same.
const SAME: f64 = 0.02;
/// Relative difference of the two explained by rounding of the stamps.
const ROUNDED: f64 = 1e-6;
/// Largest effect of rounding on the last stamp relative to the first, in steps of their last
/// digit.
const QUANTA: f64 = 1.2;

/// Role of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A channel, and the index of the rule for its time.
    Channel(usize),
    /// Time stamps.
    Time,
    /// Sample number.
    Index,
    /// Not used: empty, or text.
    Nothing,
}

/// Roles of the columns of a table and rules for their time, from its first rows.
#[derive(Debug, Clone, Default)]
pub struct AxisPlan {
    /// One per column.
    pub roles: Vec<Role>,
    /// Rules for time.
    pub rules: Vec<AxisRule>,
    /// Warnings about columns named like time.
    pub warnings: Vec<Warning>,
    /// Column that counts the rows.
    counter: Option<RowCounter>,
    /// Clocks beside those of the rows.
    clocks: Vec<OtherClock>,
}

impl AxisPlan {
    /// Whether the last row shows that rows are missing, or clocks differ.
    pub fn needs_last_row(&self) -> bool {
        self.counter.is_some() || !self.clocks.is_empty()
    }

    /// Warnings about missing rows and different clocks; `last` has the values of the last of these rows.
    pub fn of_last_row(&self, rows: usize, last: &dyn Fn(usize) -> Option<f64>) -> Vec<Warning> {
        let counter = self.counter.iter();
        let counter = counter.filter_map(|counter| counter.warning(last(counter.place)?, rows));
        let clocks = self.clocks.iter().filter_map(|clock| clock.warning(last));
        counter.chain(clocks).collect()
    }
}

/// Rule for the time of channels.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisRule {
    /// The stamps, if any.
    pub stamps: Option<StampRule>,
    /// The header rate and the words that give it.
    header: Option<(String, f64)>,
    header_start_s: Option<f64>,
    given_hz: Option<f64>,
    start_text: Option<String>,
    assumed: Option<String>,
    frequencies_in: Option<String>,
}

/// Data for finding the axes.
pub struct Sources<'a> {
    /// Headings of the columns.
    pub fields: &'a [Field],
    /// Content of the columns.
    pub kinds: &'a [ColumnKind],
    /// First date or time of each column, as written.
    pub clock_texts: &'a [Option<String>],
    /// Values in the first rows.
    pub columns: &'a [Column],
    /// Header entries.
    pub entries: &'a [HeaderEntry],
    /// Decimal mark of the header.
    pub decimal: u8,
    /// Unit of time for makers whose files never name it.
    pub default_time_unit: Option<&'a str>,
    /// Settings of the user.
    pub reading: &'a Reading,
}

impl AxisRule {
    /// Assumption that should be confirmed.
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
            axis.clock = rule.clock;
        }
        axis.header_rate_hz = self.header.as_ref().map(|(_, hz)| *hz);
        self.prefer_header(&mut axis);
        axis.frequencies_in.clone_from(&self.frequencies_in);
        axis.assumed = self.assumed().map(str::to_owned);
        axis.start_text.clone_from(&self.start_text);
        if axis.start_text.is_none() {
            axis.start_text = axis.start.and_then(Moment::date);
        }
        axis.prefer_given(self.given_hz);
        axis
    }

    /// If stamps are too coarse for the rate but agree with the header overall, or differ from it only
    /// by rounding, the header rate is better.
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
            axis.set_rate(*hz, RateFrom::Header(words.clone()));
        }
    }
}

impl Sources<'_> {
    /// Determines the roles of the columns, and the rules for their time.
    ///
    /// # Errors
    /// If the user names a column that does not exist, or an invalid unit.
    pub fn find(&self) -> Result<AxisPlan, Failure> {
        let count = self.fields.len();
        let has_data = |place: &usize| !self.columns[*place].values.is_empty();
        let (steps, used): (Vec<usize>, Vec<usize>) =
            (0..count).filter(has_data).partition(|p| self.is_steps(*p));
        let mut roles = vec![Role::Nothing; count];
        steps.iter().for_each(|place| roles[*place] = Role::Time);
        let mut named = self.time_places(&used)?;
        let (index, rest): (Vec<usize>, Vec<usize>) = used.iter().partition(|place| {
            let counts = self.is_index(**place, &used)
                || !named.times.is_empty() && self.is_row_label(**place, &used);
            counts && !named.times.contains(place)
        });
        index.iter().for_each(|place| roles[*place] = Role::Index);
        if self.reading.time_column.is_none() {
            let own = self.own_times(&named.times, &rest);
            named.times.extend(own);
        }
        let (mut rules, mut warnings, mut clocks) = (Vec::new(), Vec::new(), Vec::new());
        warnings.extend(self.falling_time(&rest, &named.times));
        warnings.extend(self.sources_in_turn(&rest));
        for group in groups(&named.times, &rest) {
            group
                .times
                .iter()
                .for_each(|place| roles[*place] = Role::Time);
            let rule = self.rule(&group, named.assumed.as_deref())?;
            self.refuse_two_clocks(&group, &rule)?;
            warnings.extend(self.other_times(&group, &rule));
            clocks.extend(self.other_clocks(&group, &rule));
            warnings.extend(self.overridden_unit(&rule));
            // The time of columns without numbers is not a channel.
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
            counter: self.row_counter(&used, &named.times),
            clocks,
        })
    }

    /// Rule for the time of a group.
    fn rule(&self, group: &Group, assumed: Option<&str>) -> Result<AxisRule, Failure> {
        let header = self.header_rate(group.channels.first().or(group.times.first()).copied());
        let stamps = self.stamp_rule(group, header.as_ref().map(|(_, hz)| *hz))?;
        let stamps = stamps.or_else(|| self.rule_of_steps());
        let of_stamps = stamps.as_ref().and_then(|rule| rule.assumed.as_deref());
        let alone = header.as_ref().filter(|_| stamps.is_none());
        let of_header = alone.and_then(|(words, hz)| self.doubt_of_header(words, *hz));
        // A textual date and time is better than a tick count.
        let is_count = |text: &String| text.bytes().all(|byte| byte.is_ascii_digit());
        let mut start_text = stamps.as_ref().and_then(|rule| rule.start_text.clone());
        if start_text.as_ref().is_none_or(is_count) {
            start_text = keys::date_text(self.entries).or(start_text);
        }
        Ok(AxisRule {
            assumed: match (assumed.filter(|_| stamps.is_some()), of_stamps) {
                (Some(a), Some(b)) => Some(format!("{a}; {b}")),
                (a, b) => a.or(b).map(str::to_owned).or(of_header),
            },
            frequencies_in: self
                .frequencies_in()
                .filter(|_| stamps.is_none() && header.is_none()),
            header_start_s: self.header_start(),
            given_hz: self.reading.rate_hz,
            stamps,
            header,
            start_text,
        })
    }

    /// Heading of the first of several columns if it contains the frequencies of a frequency response.
    fn frequencies_in(&self) -> Option<String> {
        let (field, column) = (self.fields.first()?, self.columns.first()?);
        let is_named = has("frequencies", &field.name.to_lowercase());
        let is_frequency = match &field.unit {
            Some(named) => named.unit.is_hertz(),
            None => is_named,
        };
        let values = &column.values;
        let rises = values.len() > 2 && values.windows(2).all(|pair| pair[1] > pair[0]);
        (is_frequency && rises && self.fields.len() > 1).then(|| field.heading.clone())
    }

    /// The header rate for a single channel.
    fn with_own_rate(&self, mut rule: AxisRule, place: usize) -> AxisRule {
        if rule.stamps.is_none() {
            rule.header = self.header_rate(Some(place)).or(rule.header);
        }
        rule
    }

    fn header_start(&self) -> Option<f64> {
        // A bare "Start" may count samples, as in Keysight's Infiniium, which has it next to
        // "XOrg".
        let is_bare = |entry: &&keys::HeaderEntry| {
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

    /// Start as written by Rohde & Schwarz: position of the trigger minus the part of the record
    /// before the reference point.
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

/// Whether values are consecutive integers.
fn is_counting(values: &[f64]) -> bool {
    values.len() > 1
        && values[0].fract() == 0.0
        && values.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}
