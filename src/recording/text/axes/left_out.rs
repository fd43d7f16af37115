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

    /// Warnings about further columns in a unit of time that rise like a clock, faster or slower than that of the rows.
    pub(super) fn other_clocks(&self, group: &Group, rule: &AxisRule) -> Vec<Warning> {
        let Some(rule) = &rule.stamps else {
            return Vec::new();
        };
        let stamps = rule.stamps(self.columns);
        let both = group.times.iter().chain(&group.channels);
        let others = both.filter(|place| **place != rule.place && !self.fields[**place].is_label);
        let warning = |place: &usize| {
            let named = self.fields[*place].unit.as_ref();
            let seconds = named.filter(|named| named.is_time())?.unit.factor();
            let faster = faster(&self.columns[*place].values, seconds, &stamps)?;
            Some(WarningCode::ClocksDisagree.warning(format!(
                "\"{}\" runs {} % {} than \"{}\", the time of the rows: find out which clock is right, and choose it \
                 with --time-column",
                self.fields[*place].heading,
                rounded(100.0 * faster.abs(), 2),
                if faster > 0.0 { "faster" } else { "slower" },
                rule.heading
            )))
        };
        others.filter_map(warning).collect()
    }
}

/// By how much values in a unit of time run faster than stamps in s, if both rise like clocks and differ by more than clocks
/// and the roughness of the stamps.
fn faster(values: &[f64], seconds: f64, stamps: &[f64]) -> Option<f64> {
    let count = values.len().min(stamps.len());
    let rises = |all: &[f64]| all.windows(2).all(|pair| pair[1] >= pair[0]);
    if count < ROWS || !rises(values) || !rises(stamps) || runs_otherwise(values, stamps) {
        return None;
    }
    let of = |all: &[f64]| {
        let largest = all
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .fold(0.0, f64::max);
        (all[count - 1] - all[0], largest)
    };
    let ((own, own_step), (other, other_step)) = (of(values), of(stamps));
    let faster = seconds * own / other - 1.0;
    let least = CLOCKS.max(STEPS * (own_step / own).max(other_step / other));
    (faster.abs() > least && faster.abs() < MOST).then_some(faster)
}

/// Whether two time columns differ in the middle.
fn runs_otherwise(values: &[f64], stamps: &[f64]) -> bool {
    let end = values.len().min(stamps.len()) - 1;
    let middle = |all: &[f64]| (all[end / 2] - all[0]) / (all[end] - all[0]);
    let difference = middle(values) - middle(stamps);
    difference.abs() > ALIKE
}
