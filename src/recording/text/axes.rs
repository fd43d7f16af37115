//! Which columns are time, and the axis of every other column.

use std::sync::Arc;

use super::clock::Clock;
use super::header::Field;
use super::keys::{self, Entry};
use super::rows::Column;
use super::units;
use crate::failure::Failure;
use crate::io::csv::{NamedUnit, Options, time_column};
use crate::recording::{Axis, RateFrom, typical_step};
use torqcomp_model::Unit;

/// Largest difference of a rate in the head from that of the stamps for both to mean the same.
const SAME: f64 = 0.02;
/// Fewest rows of a first column without a name that rises steadily for it to be taken for time.
const STEADY_ROWS: usize = 8;

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

/// A group of columns that hold the same time in different ways, and the channels it belongs to.
struct Group {
    times: Vec<usize>,
    channels: Vec<usize>,
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
        let mut axes = Vec::new();
        for group in groups(&named.times, &rest) {
            for place in &group.times {
                roles[*place] = Role::Time;
            }
            let axis = self.axis(&group, named.assumed.as_deref())?;
            for place in &group.channels {
                roles[*place] = Role::Channel(axes.len());
                axes.push(self.with_own_rate(axis.clone(), *place));
            }
        }
        Ok(Axes { roles, axes })
    }

    /// The columns of time: the one the user names, those named as time, the one with a unit of time,
    /// or a first column that can be nothing else.
    fn time_places(&self, used: &[usize]) -> Result<TimePlaces, Failure> {
        if self.options.time_column.is_some() {
            let columns: Vec<crate::io::csv::Column> = self
                .fields
                .iter()
                .map(|field| crate::io::csv::Column {
                    heading: field.heading.clone(),
                    name: field.name.clone(),
                    unit: field.unit.clone(),
                })
                .collect();
            let place = time_column(&columns, self.options)?;
            return Ok(TimePlaces::sure(place.into_iter().collect()));
        }
        let field = |place: usize| &self.fields[place];
        let named: Vec<usize> = used
            .iter()
            .copied()
            .filter(|place| {
                field(*place).is_label || field(*place).is_named_time() || self.is_clock(*place)
            })
            .collect();
        if !named.is_empty() {
            return Ok(TimePlaces::sure(named));
        }
        let by_unit: Vec<usize> = used
            .iter()
            .copied()
            .filter(|p| field(*p).has_time_unit())
            .collect();
        match (by_unit.as_slice(), used.first()) {
            ([first, ..], Some(first_used)) if first == first_used => {
                return Ok(TimePlaces::sure(vec![*first]));
            }
            ([one], _) => return Ok(TimePlaces::sure(vec![*one])),
            _ => {}
        }
        Ok(self.unnamed_time(used))
    }

    /// A first column called X, or one without a heading whose values rise steadily.
    fn unnamed_time(&self, used: &[usize]) -> TimePlaces {
        let Some(&first) = used.first().filter(|_| used.len() > 1) else {
            return TimePlaces::sure(Vec::new());
        };
        let values = &self.columns[first].values;
        let field = &self.fields[first];
        if units::is_axis_name(&field.name) && field.unit.is_none() && !is_counting(values) {
            return TimePlaces::sure(vec![first]);
        }
        let no_headings = self
            .fields
            .iter()
            .enumerate()
            .all(|(place, field)| field.heading == Field::unnamed(place).heading);
        let steady = values.len() >= STEADY_ROWS
            && values.windows(2).all(|pair| pair[1] > pair[0])
            && typical_step(values).is_some()
            && !is_counting(values);
        if no_headings && steady {
            return TimePlaces {
                times: vec![first],
                assumed: Some(format!(
                    "column {} has no heading but rises steadily: it was taken for the time",
                    first + 1
                )),
            };
        }
        TimePlaces::sure(Vec::new())
    }

    fn is_clock(&self, place: usize) -> bool {
        self.columns[place].first_clock.is_some()
    }

    /// Whether a column only counts the samples.
    fn is_index(&self, place: usize, used: &[usize]) -> bool {
        let field = &self.fields[place];
        let is_named = units::is_index_name(&field.name) || field.is_label;
        let is_first = used.first() == Some(&place);
        is_counting(&self.columns[place].values)
            && field.unit.is_none()
            && (is_named || is_first && units::is_axis_name(&field.name))
            && used.len() > 1
    }

    /// The axis of a group.
    fn axis(&self, group: &Group, assumed: Option<&str>) -> Result<Axis, Failure> {
        let header = self.header_rate(group.channels.first().or(group.times.first()).copied());
        let mut axis = match self.stamps(group, header.as_ref().map(|(_, hz)| *hz))? {
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
        if axis.start_text.is_none() {
            axis.start_text = keys::date_text(self.entries);
        }
        Ok(axis)
    }

    /// Where stamps are too coarse to give the rate but agree with the head on the whole, the head's
    /// rate is the better one.
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
        if coarse && (mean_hz / hz - 1.0).abs() < SAME {
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
        self.entries.iter().find_map(|entry| {
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

    /// Stamps of a group in seconds: of the ways the file writes them, the first that has a step.
    fn stamps(&self, group: &Group, header_hz: Option<f64>) -> Result<Option<Stamps>, Failure> {
        let mut found = Vec::new();
        for place in &group.times {
            let column = &self.columns[*place];
            let stamps = match &column.first_clock {
                Some((clock, text)) => self.clock_stamps(*place, *clock, text, group),
                None => self.number_stamps(*place, header_hz)?,
            };
            found.extend(stamps);
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
        if found.is_empty() {
            return Ok(None);
        }
        let date = found.iter().find_map(|stamps| stamps.start_text.clone());
        let mut best = found.swap_remove(best.unwrap_or(0));
        best.start_text = best.start_text.or(date);
        Ok(Some(best))
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
        let values = &self.columns[place].values;
        if let (Some(step), Some(hz)) = (typical_step(values), header_hz) {
            let said = |factor: &&f64| (step * **factor * hz - 1.0).abs() < SAME;
            if let Some(factor) = [1.0, 1e-3, 1e-6, 1e-9, 60.0, 3600.0].iter().find(said) {
                return Ok(Some((*factor, None)));
            }
            if is_counting(values) {
                return Ok(None);
            }
        }
        let first = match self.columns[place].first_ticks {
            Some(ticks) => ticks as f64,
            None => values.first().copied().unwrap_or(0.0).abs(),
        };
        if let Some(seconds) = epoch_unit(first) {
            return Ok(Some((seconds, None)));
        }
        if let Some(unit) = self.default_time_unit.and_then(units::read) {
            return Ok(Some((unit.unit.factor(), None)));
        }
        let assumed = format!("\"{}\" gives no unit: seconds were assumed", field.heading);
        Ok(Some((1.0, Some(assumed))))
    }
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

/// Columns of time, and what was taken for granted about them.
struct TimePlaces {
    times: Vec<usize>,
    assumed: Option<String>,
}

impl TimePlaces {
    fn sure(times: Vec<usize>) -> Self {
        Self {
            times,
            assumed: None,
        }
    }
}

/// Stamps as one column gives them.
struct Stamps {
    heading: String,
    stamps_s: Vec<f64>,
    start_text: Option<String>,
    assumed: Option<String>,
}

/// Puts channels to their columns of time: neighbouring ones are ways to write the same time; where
/// several stand apart, each belongs to the channels after it.
fn groups(times: &[usize], used: &[usize]) -> Vec<Group> {
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    for place in used.iter().filter(|place| times.contains(place)) {
        let before = used.iter().rev().find(|p| *p < place);
        match blocks.last_mut() {
            Some(block) if block.last() == before => block.push(*place),
            _ => blocks.push(vec![*place]),
        }
    }
    let channels: Vec<usize> = used
        .iter()
        .copied()
        .filter(|p| !times.contains(p))
        .collect();
    let first_is_time = used.first().is_some_and(|place| times.contains(place));
    if blocks.len() < 2 || !first_is_time {
        // All share one axis; further columns of time are channels like others.
        let mut blocks = blocks.into_iter();
        let times = blocks.next().unwrap_or_default();
        let mut channels: Vec<usize> = channels.into_iter().chain(blocks.flatten()).collect();
        channels.sort_unstable();
        return vec![Group { times, channels }];
    }
    let ends: Vec<usize> = blocks
        .iter()
        .skip(1)
        .map(|b| b[0])
        .chain([usize::MAX])
        .collect();
    let mut groups: Vec<Group> = Vec::new();
    for (times, end) in blocks.into_iter().zip(ends) {
        let first = times[0];
        let own: Vec<usize> = channels
            .iter()
            .copied()
            .filter(|p| *p > first && *p < end)
            .collect();
        match groups.last_mut() {
            Some(group) if own.is_empty() => group.channels.extend(times),
            _ => groups.push(Group {
                times,
                channels: own,
            }),
        }
    }
    groups
}

/// Whether values count up by one.
fn is_counting(values: &[f64]) -> bool {
    values.len() > 1
        && values[0].fract() == 0.0
        && values.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

fn rises(values: &[f64]) -> bool {
    let rising = values.windows(2).filter(|pair| pair[1] >= pair[0]).count();
    // A clock that was set back once does not make a column another one.
    100 * rising >= 99 * values.len().saturating_sub(1)
}
