//! Time stamps in seconds from columns.

use super::groups::Group;
use super::{SAME, Sources, is_counting};
use crate::failure::{ErrorCode, Failure};
use crate::recording::text::clock::{Clock, ClockOrigin, unwrap_periods};
use crate::recording::text::rows::{Column, ColumnKind};
use crate::recording::text::units;
use crate::recording::text::vocabulary::{has, meaning};
use crate::recording::{seconds_assumed, typical_step};
use crate::unit::{NamedUnit, scale_in};
use torqcomp_model::Unit;

/// Seconds per unit of time stamps, where their unit is unknown.
pub(super) const TIME_FACTORS: [f64; 6] = [1.0, 1e-3, 1e-6, 1e-9, 60.0, 3600.0];

/// Derivation of stamps from the columns of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct StampRule {
    /// Heading of the column.
    pub heading: String,
    /// Index of the column.
    pub place: usize,
    /// Seconds per unit of its values.
    pub seconds_per_unit: f64,
    /// Unit of its values, for messages.
    pub unit: &'static str,
    /// Origin of its values in ns.
    pub origin_ns: i64,
    /// What the clock showed at the origin of its values, if they are dates or times of day.
    pub clock: Option<ClockOrigin>,
    /// Seconds after which the clock starts again, if it has no date.
    pub period_s: Option<f64>,
    /// The column with the fractional seconds of each stamp, if separate.
    pub parts: Option<FractionColumn>,
    /// Whether each value is the time since the preceding row.
    pub is_sum: bool,
    /// Date and time of the first one as written.
    pub start_text: Option<String>,
    /// Assumption made.
    pub assumed: Option<String>,
}

/// A column with fractional seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FractionColumn {
    /// Index of the column.
    pub place: usize,
    /// Seconds per unit of its values.
    seconds_per_unit: f64,
    /// The whole seconds of the first row, subtracted from the others to preserve the precision of the fraction.
    whole: f64,
    /// Origin of its values.
    origin: f64,
}

impl StampRule {
    /// The stamps in seconds.
    pub fn stamps(&self, columns: &[Column]) -> Vec<f64> {
        let mut stamps: Vec<f64> = columns[self.place]
            .values
            .iter()
            .map(|stamp| stamp * self.seconds_per_unit)
            .collect();
        if let Some(period_s) = self.period_s {
            unwrap_periods(&mut stamps, period_s);
        }
        if let Some(rule) = self.parts {
            for (stamp, part) in stamps.iter_mut().zip(&columns[rule.place].values) {
                *stamp = *stamp - rule.whole + (part + rule.origin) * rule.seconds_per_unit;
            }
        }
        if self.is_sum {
            let mut sum = 0.0;
            for (row, stamp) in stamps.iter_mut().enumerate() {
                sum += if row == 0 { 0.0 } else { *stamp };
                *stamp = sum;
            }
        }
        stamps
    }

    /// Stamps of a column in seconds.
    pub fn of_seconds(heading: &str, place: usize) -> Self {
        Self {
            heading: heading.to_owned(),
            place,
            seconds_per_unit: 1.0,
            unit: "s",
            origin_ns: 0,
            clock: None,
            period_s: None,
            parts: None,
            is_sum: false,
            start_text: None,
            assumed: None,
        }
    }

    /// Whether each row has its stamp in one cell, independent of other rows.
    pub fn is_of_one_cell(&self) -> bool {
        !self.is_sum && self.parts.is_none()
    }
}

impl Sources<'_> {
    /// The stamps of a group: the finest format with a step.
    pub(super) fn stamp_rule(
        &self,
        group: &Group,
        header_hz: Option<f64>,
    ) -> Result<Option<StampRule>, Failure> {
        let mut found = Vec::new();
        if let Some(rule) = self.rule_of_two(group) {
            return Ok(Some(rule));
        }
        for place in &group.times {
            let rule = match self.kinds[*place] {
                ColumnKind::Clock(first) if first.nanoseconds.is_none() => None,
                ColumnKind::Clock(first) => Some(self.clock_rule(*place, first, group)),
                _ => self.number_rule(*place, header_hz)?,
            };
            found.extend(rule);
        }
        if found.len() < 2 {
            return Ok(found.pop());
        }
        let repeats = |stamps: &[f64]| stamps.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let best = (0..found.len())
            .map(|place| (place, found[place].stamps(self.columns)))
            .filter(|(_, stamps)| typical_step(stamps).is_some() && rises(stamps))
            .min_by_key(|(_, stamps)| repeats(stamps));
        let date = found.iter().find_map(|rule| rule.start_text.clone());
        let mut best = found.swap_remove(best.map_or(0, |(place, _)| place));
        best.start_text = best.start_text.or(date);
        Ok(Some(best))
    }

    /// Whether a column contains the time between samples, like `INTERVAL` of data loggers.
    pub(super) fn is_steps(&self, place: usize) -> bool {
        let (field, values) = (&self.fields[place], &self.columns[place].values);
        let usual = values.get(1).copied().unwrap_or(f64::NAN);
        let same = || values.iter().filter(|value| **value == usual).count();
        has("steps", &field.name.to_lowercase())
            && !self.is_clock(place)
            && self.fields.len() > 1
            && 2 * same() > values.len()
            && values.iter().all(|value| *value >= 0.0)
    }

    /// Stamps as the sum of the times between samples, if their unit is known.
    pub(super) fn rule_of_steps(&self) -> Option<StampRule> {
        let place = (0..self.fields.len()).find(|place| self.is_steps(*place))?;
        let field = &self.fields[place];
        let unit = field.unit.as_ref().filter(|unit| unit.is_time())?;
        Some(StampRule {
            seconds_per_unit: unit.unit.factor(),
            is_sum: true,
            ..StampRule::of_seconds(&field.heading, place)
        })
    }

    fn clock_rule(&self, place: usize, first: Clock, group: &Group) -> StampRule {
        // Seconds in one column, milliseconds or microseconds in the next.
        let beside = group.times.iter().copied().find(|p| *p == place + 1);
        let parts = beside
            .filter(|p| !self.is_clock(*p))
            .map(|beside| FractionColumn {
                place: beside,
                seconds_per_unit: self.own_seconds(beside).unwrap_or(1e-3),
                whole: 0.0,
                origin: self.origin(beside),
            })
            .filter(|parts| {
                let values = &self.absolute(parts.place);
                // Within the first second they rise, like milliseconds since the start: `Elapsed [ms]`.
                let name = self.fields[parts.place].name.to_lowercase();
                let is_unit = || meaning("time units", &name).is_some();
                let seconds = &self.columns[place].values;
                let is_one = || seconds.iter().all(|second| *second == seconds[0]);
                let is_part = |v: &f64| (0.0..1.0).contains(&(v * parts.seconds_per_unit));
                parts.seconds_per_unit < 1e-2
                    && values.iter().all(is_part)
                    && (!rises(values) || begin_anew(values, seconds) || is_unit() && is_one())
            });
        let text = self.clock_texts[place].clone().unwrap_or_default();
        let date = group
            .times
            .iter()
            .filter(|p| matches!(self.kinds[**p], ColumnKind::Clock(first) if first.nanoseconds.is_none()))
            .find_map(|p| self.clock_texts[*p].as_ref());
        StampRule {
            period_s: first.period_s(),
            clock: Some(first.as_origin()),
            parts,
            start_text: Some(match date.filter(|_| first.day.is_none()) {
                Some(date) => format!("{date} {text}"),
                None => text,
            }),
            ..StampRule::of_seconds(&self.fields[place].heading, place)
        }
    }

    /// Whole seconds in one column and their fraction in another, as in ROS: `sec` and `nanosec`.
    fn rule_of_two(&self, group: &Group) -> Option<StampRule> {
        let place = *group.times.iter().find(|p| self.parts_of(**p).is_some())?;
        let parts = self.parts_of(place)?;
        let is_there = group.times.contains(&parts.place);
        let origin_ns = ((self.origin(place) + parts.whole) * 1e9) as i64;
        Some(StampRule {
            origin_ns,
            clock: Some(ClockOrigin::utc(origin_ns)).filter(|_| origin_ns != 0),
            parts: Some(parts),
            ..StampRule::of_seconds(&self.fields[place].heading, place)
        })
        .filter(|_| is_there)
    }

    /// The fraction of a column of whole seconds, in the adjacent column.
    pub(super) fn parts_of(&self, place: usize) -> Option<FractionColumn> {
        let seconds_of_name = |place: usize| {
            let field = self.fields.get(place)?;
            let unit = field.unit.as_ref().filter(|_| field.is_named_time())?;
            unit.is_time().then(|| unit.unit.factor())
        };
        let seconds_of =
            |place: usize| seconds_of_name(place).or_else(|| self.stamp_without_heading(place));
        let numbers = |place: usize| &self.columns[place].values;
        let are_whole = numbers(place).iter().all(|value| value.fract() == 0.0);
        if seconds_of(place) != Some(1.0) || !are_whole || self.is_clock(place) {
            return None;
        }
        let whole = *numbers(place).first()?;
        let beside = [Some(place + 1), place.checked_sub(1)];
        let known = beside.into_iter().flatten().find_map(|beside| {
            let parts = FractionColumn {
                place: beside,
                seconds_per_unit: seconds_of(beside).filter(|seconds| *seconds < 1e-2)?,
                whole,
                origin: self.origin(beside),
            };
            let is_part = |value: &f64| {
                value.fract() == 0.0 && (0.0..1.0).contains(&(value * parts.seconds_per_unit))
            };
            let is_filled = numbers(beside).len() == numbers(place).len();
            (is_filled && !self.is_clock(beside) && self.absolute(beside).iter().all(is_part))
                .then_some(parts)
        })?;
        // A pair of two unrelated times would not rise.
        let rule = StampRule {
            parts: Some(known),
            ..StampRule::of_seconds("", place)
        };
        rises(&rule.stamps(self.columns)).then_some(known)
    }

    /// Origin of the values of a column.
    pub(super) fn origin(&self, place: usize) -> f64 {
        match self.kinds[place] {
            ColumnKind::Offset(origin) => origin as f64,
            _ => 0.0,
        }
    }

    /// The values of a column as they are in the file.
    fn absolute(&self, place: usize) -> Vec<f64> {
        let origin = self.origin(place);
        let values = self.columns[place].values.iter();
        values.map(|value| value + origin).collect()
    }

    fn number_rule(
        &self,
        place: usize,
        header_hz: Option<f64>,
    ) -> Result<Option<StampRule>, Failure> {
        let field = &self.fields[place];
        let Some((seconds_per_unit, assumed)) = self.seconds_per_unit(place, header_hz)? else {
            return Ok(None);
        };
        let origin_ns = match self.kinds[place] {
            ColumnKind::Offset(origin) => origin_ns(origin, seconds_per_unit),
            _ => 0,
        };
        Ok(Some(StampRule {
            seconds_per_unit,
            unit: name_of_unit(seconds_per_unit),
            origin_ns,
            clock: Some(ClockOrigin::utc(origin_ns)).filter(|_| origin_ns != 0),
            assumed,
            ..StampRule::of_seconds(&field.heading, place)
        }))
    }

    /// Seconds per unit of a column of stamps, and the assumption made; `None` if it is only an
    /// index.
    fn seconds_per_unit(
        &self,
        place: usize,
        header_hz: Option<f64>,
    ) -> Result<Option<(f64, Option<String>)>, Failure> {
        let field = &self.fields[place];
        if let Some(text) = &self.reading.time_unit {
            let unit = Unit::parse(text).map_err(|error| {
                ErrorCode::InvalidValue.usage(format_args!("--time-unit {text}: {error}"))
            })?;
            let named = NamedUnit {
                text: text.clone(),
                unit,
            };
            if !named.is_time() {
                return Err(ErrorCode::InvalidValue
                    .usage(format_args!("--time-unit {text} is not a unit of time")));
            }
            return Ok(Some((unit.factor(), None)));
        }
        if let Some(seconds) = units::scaled_time(&field.heading) {
            return Ok(Some((seconds, None)));
        }
        if let Some(scale) = scale_in(&field.heading) {
            return Err(ErrorCode::UnitUnclear.failed(format_args!(
                "the heading \"{}\" contains a scale factor, \"{scale}\", that may divide or multiply the time; \
                 give the unit of its numbers, for example --time-unit ms",
                field.heading
            )));
        }
        if let Some(unit) = field.unit.as_ref().filter(|unit| unit.is_time()) {
            return Ok(Some((unit.unit.factor(), None)));
        }
        let values = &self.columns[place].values;
        if let (Some(step), Some(hz)) = (typical_step(values), header_hz) {
            if let Some(factor) = seconds_of_step(step, hz) {
                return Ok(Some((factor, None)));
            }
            if is_counting(values) {
                return Ok(None);
            }
        }
        Ok(Some(self.seconds_by_size(place)))
    }

    /// Seconds per unit of a column of stamps by their magnitude or convention, and the assumption
    /// made.
    fn seconds_by_size(&self, place: usize) -> (f64, Option<String>) {
        let (field, values) = (&self.fields[place], &self.columns[place].values);
        let first = match self.kinds[place] {
            ColumnKind::Offset(origin) => origin as f64,
            _ => values.first().copied().unwrap_or(0.0).abs(),
        };
        if let Some(seconds) = epoch_unit(first) {
            return (seconds, None);
        }
        if is_spreadsheet_date(&field.name, values) {
            return (86_400.0, None);
        }
        if are_days(values) {
            let assumed = format!(
                "\"{}\" gives no unit: from its size and its steps it was assumed to be a date in days",
                field.heading
            );
            return (86_400.0, Some(assumed));
        }
        if let Some(unit) = self.default_time_unit.and_then(units::read) {
            return (unit.unit.factor(), None);
        }
        let assumed = seconds_assumed(&field.heading, field.unit_text.as_deref());
        (1.0, Some(assumed))
    }
}

/// Origin in ns of a time in units of `seconds_per_unit`: 1970 if it counts 100 ns since 1601, and the first value if
/// it is beyond all dates.
fn origin_ns(origin: i64, seconds_per_unit: f64) -> i64 {
    const FROM_1601_TO_1970: i128 = 11_644_473_600_000_000_000;
    let ns = i128::from(origin) * (seconds_per_unit * 1e9).round() as i128;
    let is_since_1601 =
        epoch_unit(origin as f64) == Some(seconds_per_unit) && seconds_per_unit == 1e-7;
    let ns = if is_since_1601 {
        ns - FROM_1601_TO_1970
    } else {
        ns
    };
    i64::try_from(ns).unwrap_or(0)
}

/// Name of a unit of time in messages.
fn name_of_unit(seconds: f64) -> &'static str {
    const UNITS: [(f64, &str); 7] = [
        (1.0, "s"),
        (1e-3, "ms"),
        (1e-6, "us"),
        (1e-9, "ns"),
        (60.0, "min"),
        (3600.0, "h"),
        (86_400.0, "d"),
    ];
    let known = UNITS.iter().find(|(factor, _)| *factor == seconds);
    known.map_or("units", |(_, name)| *name)
}

/// Seconds per unit of time stamps whose steps match a rate.
pub(super) fn seconds_of_step(step: f64, hz: f64) -> Option<f64> {
    TIME_FACTORS
        .into_iter()
        .find(|factor| (step * factor * hz - 1.0).abs() < SAME)
}

/// Seconds per unit of a time since 1970 (between 2001 and 2286), or since 1601 in units of 100 ns,
/// from its magnitude alone.
fn epoch_unit(first: f64) -> Option<f64> {
    match first {
        v if (1e9..1e10).contains(&v) => Some(1.0),
        v if (1e12..1e13).contains(&v) => Some(1e-3),
        v if (1e15..1e16).contains(&v) => Some(1e-6),
        v if (1e18..9e18).contains(&v) => Some(1e-9),
        v if (1e17..2e17).contains(&v) => Some(1e-7),
        _ => None,
    }
}

/// Whether a column contains spreadsheet dates in days since the end of 1899: between 1970 and 2100,
/// under a name that refers to a date.
fn is_spreadsheet_date(name: &str, values: &[f64]) -> bool {
    let name = name.to_lowercase();
    let is_date = ["date", "datum", "日付", "日時"]
        .iter()
        .any(|word| name.contains(word));
    is_date
        && values
            .iter()
            .all(|value| (25_569.0..73_051.0).contains(value))
}

/// Whether values are dates in days, of spreadsheets (1982 to 2064) or since year 0 (1971 to 2080): their
/// steps are then below 2 s, and would be below 20 µs if they were seconds.
fn are_days(values: &[f64]) -> bool {
    let is_date = |value: &f64| {
        (30_000.0..60_000.0).contains(value) || (720_000.0..760_000.0).contains(value)
    };
    let ends = [values.first(), values.last()];
    ends.iter().flatten().all(|value| is_date(value))
        && typical_step(values).is_some_and(|step| step < 2e-5)
}

/// Whether the fractions fall only where the seconds advance.
fn begin_anew(parts: &[f64], seconds: &[f64]) -> bool {
    let pairs = parts.windows(2).zip(seconds.windows(2));
    let mut falls = pairs.filter(|(part, _)| part[1] < part[0]).peekable();
    falls.peek().is_some() && falls.all(|(_, second)| second[1] > second[0])
}

pub(super) fn rises(values: &[f64]) -> bool {
    let rising = values.windows(2).filter(|pair| pair[1] >= pair[0]).count();
    // A clock that was set back once remains a clock.
    100 * rising >= 99 * values.len().saturating_sub(1)
}
