//! Columns named like time whose values are not used as such.

use super::groups::Group;
use super::{AxisRule, Sources};
use crate::warning::{Warning, WarningCode};

/// Minimum number of rows for comparing two time columns.
const ROWS: usize = 20;
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
}

/// Whether two time columns differ in the middle.
fn runs_otherwise(values: &[f64], stamps: &[f64]) -> bool {
    let end = values.len().min(stamps.len()) - 1;
    let middle = |all: &[f64]| (all[end / 2] - all[0]) / (all[end] - all[0]);
    let difference = middle(values) - middle(stamps);
    difference.abs() > ALIKE
}
