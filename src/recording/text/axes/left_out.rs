//! Columns named like time whose values are not used as such.

use super::groups::Group;
use super::{AxisRule, Sources};
use crate::print::rounded;
use crate::warning::{Warning, WarningCode};

/// Minimum number of rows for comparing two time columns.
const ROWS: usize = 20;
/// Least relative difference of the durations by two time columns, in which clocks do not differ, and in steps of the coarser
/// one.
const CLOCKS: f64 = 0.002;
const STEPS: f64 = 3.0;
/// Relative difference from which they are not both clocks.
const MOST: f64 = 0.5;
/// Largest difference of the middle of two formats of the same time, relative to the range.
const ALIKE: f64 = 0.05;

impl Sources<'_> {
    /// A warning about a column named like time whose values fall, if no other column gives the
    /// time.
    pub(super) fn falling_time(&self, used: &[usize], times: &[usize]) -> Option<Warning> {
        let named = |place: &&usize| self.fields[**place].is_named_time();
        let place = used.iter().find(named).filter(|_| times.is_empty())?;
        Some(WarningCode::TimeFalls.warning(format!(
            "\"{}\" is named like time but decreases too often to be time: it was read as a channel; choose the \
             time with --time-column, or give --rate HZ",
            self.fields[*place].heading
        )))
    }

    /// A warning if --time-unit contradicts the heading of the time.
    pub(super) fn overridden_unit(&self, rule: &AxisRule) -> Option<Warning> {
        let (given, rule) = self.reading.time_unit.as_ref().zip(rule.stamps.as_ref())?;
        let field = &self.fields[rule.place];
        let named = field.unit.as_ref().filter(|named| named.is_time())?;
        let differs = (named.unit.factor() / rule.seconds_per_unit - 1.0).abs() > 1e-9;
        let message = format!(
            "\"{}\" says {}, --time-unit says {given}; {given} was used",
            field.heading, named.text
        );
        differs.then(|| WarningCode::UnitOverridesHeading.warning(message))
    }

    /// Warnings about numeric columns that were left out because of their names, but differ from the
    /// time.
    pub(super) fn other_times(&self, group: &Group, rule: &AxisRule) -> Vec<Warning> {
        let Some(rule) = &rule.stamps else {
            return Vec::new();
        };
        let stamps = rule.stamps(self.columns);
        let is_other = |place: &&usize| {
            let values = &self.columns[**place].values;
            let is_used = rule.parts.is_some() && rule.place == **place;
            !is_used
                && !self.fields[**place].is_label
                && !self.is_clock(**place)
                && values.len() >= ROWS
                && values.windows(2).all(|pair| pair[1] >= pair[0])
                && runs_otherwise(values, &stamps)
        };
        let warning = |place: &usize| {
            WarningCode::TimeLeftOut.warning(format!(
                "\"{}\" is named like time but disagrees with the time of the rows; it was ignored (choose another \
                 time with --time-column)",
                self.fields[*place].heading
            ))
        };
        group.times.iter().filter(is_other).map(warning).collect()
    }

    /// Further columns in a unit of time that rise like the clock of the rows.
    pub(super) fn other_clocks(&self, group: &Group, rule: &AxisRule) -> Vec<OtherClock> {
        let Some(rule) = &rule.stamps else {
            return Vec::new();
        };
        let stamps = rule.stamps(self.columns);
        let both = group.times.iter().chain(&group.channels);
        let others = both.filter(|place| **place != rule.place && !self.fields[**place].is_label);
        let clock = |place: &usize| {
            let named = self.fields[*place].unit.as_ref();
            let seconds = named.filter(|named| named.is_time())?.unit.factor();
            let values = &self.columns[*place].values;
            let values: Vec<f64> = values.iter().map(|value| value * seconds).collect();
            Some(OtherClock {
                heading: self.fields[*place].heading.clone(),
                own: ClockColumn {
                    // The time keeps its origin in all rows.
                    origin: match group.times.contains(place) {
                        true => 0.0,
                        false => self.origin(*place),
                    },
                    ..ClockColumn::of(*place, seconds, &values)?
                },
                of_rows: rule.heading.clone(),
                other: ClockColumn::of(rule.place, rule.seconds_per_unit, &stamps)?,
                is_of_one_cell: rule.is_of_one_cell() && rule.period_s.is_none(),
            })
            .filter(|_| !runs_otherwise(&values, &stamps))
        };
        others.filter_map(clock).collect()
    }
}

/// A column that rises like a clock.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ClockColumn {
    place: usize,
    seconds_per_unit: f64,
    /// Origin of the first rows only.
    origin: f64,
    /// The first and last value in the first rows, and the largest step between them, in s.
    first: f64,
    last: f64,
    step: f64,
}

impl ClockColumn {
    fn of(place: usize, seconds_per_unit: f64, seconds: &[f64]) -> Option<Self> {
        let steps = || seconds.windows(2).map(|pair| pair[1] - pair[0]);
        let rises = seconds.len() >= ROWS && steps().all(|step| step >= 0.0);
        rises.then(|| Self {
            place,
            seconds_per_unit,
            origin: 0.0,
            first: seconds[0],
            last: seconds[seconds.len() - 1],
            step: steps().fold(0.0, f64::max),
        })
    }
}

/// A column in a unit of time beside the one used for the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherClock {
    heading: String,
    own: ClockColumn,
    of_rows: String,
    other: ClockColumn,
    /// Whether the last row alone gives its time.
    is_of_one_cell: bool,
}

impl OtherClock {
    /// A warning if it is faster or slower than the clock of the rows, by more than clocks and the roughness of the stamps;
    /// `last` has the values of the last row.
    pub(super) fn warning(&self, last: &dyn Fn(usize) -> Option<f64>) -> Option<Warning> {
        let at_end = |clock: &ClockColumn| {
            Some((last(clock.place)? - clock.origin) * clock.seconds_per_unit)
        };
        let ends = at_end(&self.own).zip(at_end(&self.other));
        let ends = ends.filter(|_| self.is_of_one_cell);
        let (own, other) = ends.unwrap_or((self.own.last, self.other.last));
        let (own, other) = (own - self.own.first, other - self.other.first);
        let faster = own / other - 1.0;
        let least = CLOCKS.max(STEPS * (self.own.step / own).max(self.other.step / other));
        (faster.abs() > least && faster.abs() < MOST).then(|| {
            WarningCode::ClocksDisagree.warning(format!(
                "\"{}\" runs {} % {} than \"{}\", the time of the rows: find out which clock is right, and choose it \
                 with --time-column",
                self.heading,
                rounded(100.0 * faster.abs(), 2),
                if faster > 0.0 { "faster" } else { "slower" },
                self.of_rows
            ))
        })
    }
}

/// Whether two time columns differ in the middle.
fn runs_otherwise(values: &[f64], stamps: &[f64]) -> bool {
    let end = values.len().min(stamps.len()) - 1;
    let middle = |all: &[f64]| (all[end / 2] - all[0]) / (all[end] - all[0]);
    let difference = middle(values) - middle(stamps);
    difference.abs() > ALIKE
}
