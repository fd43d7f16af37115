//! Time stamps in seconds, as columns give them.

use super::groups::Group;
use super::{SAME, Sources, is_counting};
use crate::failure::Failure;
use crate::recording::text::clock::Clock;
use crate::recording::text::units;
use crate::recording::typical_step;
use crate::unit::NamedUnit;
use torqcomp_model::Unit;

/// Stamps as one column gives them.
pub(super) struct Stamps {
    pub(super) heading: String,
    pub(super) stamps_s: Vec<f64>,
    pub(super) start_text: Option<String>,
    pub(super) assumed: Option<String>,
}

impl Sources<'_> {
    /// Stamps of a group in seconds: of the ways the file writes them, the first that has a step.
    pub(super) fn stamps(
        &self,
        group: &Group,
        header_hz: Option<f64>,
    ) -> Result<Option<Stamps>, Failure> {
        let mut found = Vec::new();
        for place in &group.times {
            let column = &self.columns[*place];
            let stamps = match &column.first_clock {
                Some((clock, text)) => self.clock_stamps(*place, *clock, text, group),
                None => self.number_stamps(*place, header_hz)?,
            };
            found.extend(stamps);
        }
        if found.len() < 2 {
            return Ok(found.pop());
        }
        // The finest is the one that repeats the fewest stamps.
        let repeats = |stamps: &Stamps| {
            stamps
                .stamps_s
                .windows(2)
                .filter(|pair| pair[0] == pair[1])
                .count()
        };
        let best = (0..found.len())
            .filter(|place| typical_step(&found[*place].stamps_s).is_some())
            .filter(|place| rises(&found[*place].stamps_s))
            .min_by_key(|place| repeats(&found[*place]));
        let date = found.iter().find_map(|stamps| stamps.start_text.clone());
        let mut best = found.swap_remove(best.unwrap_or(0));
        best.start_text = best.start_text.or(date);
        Ok(Some(best))
    }

    /// Whether a column holds the time from one sample to the next, as `INTERVAL` of data loggers.
    pub(super) fn is_steps(&self, place: usize) -> bool {
        const NAMES: [&str; 4] = [
            "interval",
            "intervall",
            "obtaining interval",
            "interval time",
        ];
        let (field, values) = (&self.fields[place], &self.columns[place].values);
        let usual = values.get(1).copied().unwrap_or(f64::NAN);
        let same = || values.iter().filter(|value| **value == usual).count();
        NAMES.contains(&field.name.to_lowercase().as_str())
            && !self.is_clock(place)
            && self.fields.len() > 1
            && 2 * same() > values.len()
            && values.iter().all(|value| *value >= 0.0)
    }

    /// Stamps as the sum of the times from sample to sample, where their unit is known.
    pub(super) fn stamps_of_steps(&self) -> Option<Stamps> {
        let place = (0..self.fields.len()).find(|place| self.is_steps(*place))?;
        let unit = self.fields[place]
            .unit
            .as_ref()
            .filter(|unit| units::is_time(unit))?;
        let mut sum = 0.0;
        let stamps_s = self.columns[place]
            .values
            .iter()
            .enumerate()
            .map(|(row, step)| {
                sum += if row == 0 { 0.0 } else { *step };
                sum * unit.unit.factor()
            });
        Some(Stamps {
            heading: self.fields[place].heading.clone(),
            stamps_s: stamps_s.collect(),
            start_text: None,
            assumed: None,
        })
    }

    fn clock_stamps(
        &self,
        place: usize,
        clock: Clock,
        text: &str,
        group: &Group,
    ) -> Option<Stamps> {
        clock.nanoseconds?;
        let mut stamps_s = self.columns[place].values.clone();
        // Seconds in one column, milliseconds in the next.
        let part = group.times.iter().find(|p| **p == place + 1).filter(|p| {
            let values = &self.columns[**p].values;
            !self.is_clock(**p)
                && values.iter().all(|v| (0.0..1000.0).contains(v))
                && !rises(values)
        });
        if let Some(part) = part {
            let first = self.columns[*part].values.first().copied().unwrap_or(0.0);
            for (stamp, part) in stamps_s.iter_mut().zip(&self.columns[*part].values) {
                *stamp += (part - first) * 1e-3;
            }
        }
        let date = group.times.iter().find_map(|p| {
            let (clock, text) = self.columns[*p].first_clock.as_ref()?;
            (clock.nanoseconds.is_none()).then_some(text)
        });
        Some(Stamps {
            heading: self.fields[place].heading.clone(),
            stamps_s,
            start_text: Some(match date.filter(|_| clock.day.is_none()) {
                Some(date) => format!("{date} {text}"),
                None => text.to_owned(),
            }),
            assumed: None,
        })
    }

    fn number_stamps(
        &self,
        place: usize,
        header_hz: Option<f64>,
    ) -> Result<Option<Stamps>, Failure> {
        let (field, column) = (&self.fields[place], &self.columns[place]);
        let Some((seconds_per_unit, assumed)) = self.seconds_per_unit(place, header_hz)? else {
            return Ok(None);
        };
        Ok(Some(Stamps {
            heading: field.heading.clone(),
            stamps_s: column
                .values
                .iter()
                .map(|stamp| stamp * seconds_per_unit)
                .collect(),
            start_text: column.first_ticks.map(|ticks| ticks.to_string()),
            assumed,
        }))
    }

    /// Seconds per unit of a column of stamps, and what was assumed; `None` if it only counts.
    fn seconds_per_unit(
        &self,
        place: usize,
        header_hz: Option<f64>,
    ) -> Result<Option<(f64, Option<String>)>, Failure> {
        let field = &self.fields[place];
        if let Some(text) = &self.options.time_unit {
            let unit = Unit::parse(text)
                .map_err(|error| Failure::usage(format_args!("--time-unit {text}: {error}")))?;
            let named = NamedUnit {
                text: text.clone(),
                unit,
            };
            if !units::is_time(&named) {
                return Err(Failure::usage(format_args!(
                    "--time-unit {text} is no unit of time"
                )));
            }
            return Ok(Some((unit.factor(), None)));
        }
        if let Some(unit) = field.unit.as_ref().filter(|unit| units::is_time(unit)) {
            return Ok(Some((unit.unit.factor(), None)));
        }
        if let Some(seconds) = units::scaled_time(&field.heading) {
            return Ok(Some((seconds, None)));
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

    /// Seconds per unit of a column of stamps by how large they are, or what is usual, and what was
    /// assumed.
    fn seconds_by_size(&self, place: usize) -> (f64, Option<String>) {
        let (field, values) = (&self.fields[place], &self.columns[place].values);
        let first = match self.columns[place].first_ticks {
            Some(ticks) => ticks as f64,
            None => values.first().copied().unwrap_or(0.0).abs(),
        };
        if let Some(seconds) = epoch_unit(first) {
            return (seconds, None);
        }
        if is_spreadsheet_date(&field.name, values) {
            return (86_400.0, None);
        }
        if are_days(values) {
            let assumed = format!(
                "\"{}\" gives no unit: by its size and its steps it was taken for a date in days",
                field.heading
            );
            return (86_400.0, Some(assumed));
        }
        if let Some(unit) = self.default_time_unit.and_then(units::read) {
            return (unit.unit.factor(), None);
        }
        let assumed = format!("\"{}\" gives no unit: seconds were assumed", field.heading);
        (1.0, Some(assumed))
    }
}

/// Seconds per unit of time stamps whose steps are those of a rate.
pub(super) fn seconds_of_step(step: f64, hz: f64) -> Option<f64> {
    [1.0, 1e-3, 1e-6, 1e-9, 60.0, 3600.0]
        .into_iter()
        .find(|factor| (step * factor * hz - 1.0).abs() < SAME)
}

/// Seconds per unit of a time since 1970 (between 2001 and 2286), or since 1601 in units of 100 ns, by
/// its size alone.
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

/// Whether a column holds dates as spreadsheets count them, in days since the end of 1899: between 1970
/// and 2100, under a name that speaks of a date.
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

/// Whether values are dates in days, of spreadsheets (1982 to 2064) or since the year 0 (1971 to 2080): their
/// steps are below 2 s then, and would be below 20 µs were they seconds.
fn are_days(values: &[f64]) -> bool {
    let is_date = |value: &f64| {
        (30_000.0..60_000.0).contains(value) || (720_000.0..760_000.0).contains(value)
    };
    let ends = [values.first(), values.last()];
    ends.iter().flatten().all(|value| is_date(value))
        && typical_step(values).is_some_and(|step| step < 2e-5)
}

fn rises(values: &[f64]) -> bool {
    let rising = values.windows(2).filter(|pair| pair[1] >= pair[0]).count();
    // A clock that was set back once does not make a column another one.
    100 * rising >= 99 * values.len().saturating_sub(1)
}
