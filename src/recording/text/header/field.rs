//! A column as described by its headings.

use crate::recording::choice::Label;
use crate::recording::text::units::{self, Heading};
use crate::unit::NamedUnit;

/// A column as described by its headings.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its heading as written, or `column N`.
    pub heading: String,
    /// Its name without the unit.
    pub name: String,
    /// Its unit, if known.
    pub unit: Option<NamedUnit>,
    /// Its unit as written.
    pub unit_text: Option<String>,
    /// Whether the cells above it name the rows of the header: it then contains the time of the
    /// columns that follow, if anything.
    pub is_label: bool,
}

/// A unit, also of time for makers who write seconds as S.
fn unit_of(name: &str, unit: &str) -> Option<NamedUnit> {
    match unit.trim() {
        "S" if units::is_time_name(name) || units::is_axis_name(name) => units::read("s"),
        unit => units::read(unit),
    }
}

/// A unit without the name of its channel: `CH1:V`.
pub(super) fn without_name<'a>(unit: &'a str, name: &str) -> &'a str {
    let Some((channel, rest)) = unit.split_once(':') else {
        return unit;
    };
    let is_channel = channel == name
        || channel.starts_with(|c: char| c.is_ascii_alphabetic())
            && channel.ends_with(|c: char| c.is_ascii_digit());
    if is_channel { rest.trim() } else { unit }
}

impl Field {
    /// A column without a heading, with its index from 0.
    pub fn unnamed(place: usize) -> Self {
        let name = format!("column {}", place + 1);
        Self {
            heading: name.clone(),
            name,
            unit: None,
            unit_text: None,
            is_label: false,
        }
    }

    /// A column with a heading, and a unit in a separate row.
    pub fn new(heading: &str, unit: Option<&str>) -> Self {
        let unquoted = heading.replace('"', "");
        let heading = unquoted.trim();
        let Heading {
            name,
            unit: own,
            unit_text,
        } = units::heading(heading);
        let below = unit.and_then(|unit| unit_of(&name, unit));
        let below_text = unit.and_then(units::as_written);
        // With a unit below the name, an apparent unit at its end may not be one, unless it is in
        // brackets and the same.
        let is_plain = !heading.contains(['[', '(', '/']);
        let is_own = |own: &NamedUnit| match &below {
            Some(below) => !is_plain && own.unit == below.unit,
            None => true,
        };
        let own = own.filter(is_own);
        let name = match &below {
            Some(_) if own.is_none() => heading.to_owned(),
            _ => name,
        };
        let unit_text = unit_text.filter(|_| own.is_some() || below.is_none());
        Self {
            heading: heading.to_owned(),
            name,
            unit_text: unit_text
                .or(below.as_ref().map(|u| u.text.clone()))
                .or(below_text),
            unit: own.or(below),
            is_label: false,
        }
    }

    /// A column whose heading is only a name.
    pub fn with_unit(name: &str, unit: Option<&str>) -> Self {
        let unit = unit.map(|unit| without_name(unit, name));
        Self {
            heading: name.to_owned(),
            name: name.to_owned(),
            unit: unit.and_then(|unit| unit_of(name, unit)),
            unit_text: unit.and_then(units::as_written),
            is_label: false,
        }
    }

    /// Its identification for selection.
    pub(crate) fn label(&self) -> Label<'_> {
        Label {
            heading: &self.heading,
            name: &self.name,
            segment: None,
        }
    }

    /// Whether its unit is a unit of time.
    pub fn has_time_unit(&self) -> bool {
        self.unit.as_ref().is_some_and(NamedUnit::is_time)
    }

    /// Whether it is named like time, or has an axis name with a unit of time: `T1 [s]`, `X [s]`.
    pub fn is_named_time(&self) -> bool {
        let can_be = || units::is_axis_name(&self.name) || units::is_weak_time_name(&self.name);
        match self.has_time_unit() {
            true => units::is_time_name(&self.name) || can_be(),
            false => units::is_time_name(&self.name) && self.unit.is_none(),
        }
    }
}
