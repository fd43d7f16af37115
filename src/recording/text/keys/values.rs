//! Interpretation of values: rates, intervals, seconds, dates.

use super::{HeaderEntry, Topic};
use crate::recording::text::cell::Cell;
use crate::recording::text::clock::Clock;
use crate::recording::text::units;
use crate::recording::text::vocabulary::meaning;
use crate::unit::NamedUnit;

/// A number with a unit: `1.00E+09 Sa/s`, `20ms`, `1,000 Hz`, `10 000 Hz`.
pub fn quantity(text: &str, decimal: u8) -> Option<(f64, String)> {
    let text = text.trim().trim_matches('"').trim();
    let end = text
        .char_indices()
        .find(|(place, c)| {
            let is_exponent = matches!(c, 'e' | 'E')
                && text[place + 1..]
                    .starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+');
            let is_mark = matches!(c, '.' | ',' | '-' | '+' | '\'');
            !(c.is_ascii_digit() || is_mark || is_exponent || is_between_thousands(text, *place))
        })
        .map_or(text.len(), |(place, _)| place);
    let number = text[..end].trim();
    let other = if decimal == b'.' { b',' } else { b'.' };
    let value = [decimal, other]
        .into_iter()
        .find_map(|mark| match Cell::read(number, mark) {
            Cell::Number(value) | Cell::Grouped(value) => Some(value),
            _ => None,
        })?;
    Some((value, text[end..].trim().to_owned()))
}

/// Whether the character at a place is a space that separates thousands: between a digit and three more.
fn is_between_thousands(text: &str, place: usize) -> bool {
    let mut behind = text[place..].chars();
    let is_space = matches!(behind.next(), Some(' ' | '\u{a0}' | '\u{202f}'));
    let group = behind.take_while(char::is_ascii_digit).count();
    is_space && group == 3 && text[..place].ends_with(|c: char| c.is_ascii_digit())
}

/// Rate in Hz from a rate or an interval, depending on the unit; `default_unit` if there is none.
fn hertz(value: f64, unit: &str, is_interval: bool) -> Option<f64> {
    let lower = unit
        .trim_end_matches(['.', ':', ';', ','])
        .trim()
        .to_lowercase();
    let factor = meaning("units of rate", &lower).and_then(|hz| hz.parse::<f64>().ok());
    if let Some(factor) = factor {
        return Some(value * factor).filter(|hz| *hz > 0.0);
    }
    let seconds = match lower.as_str() {
        "" if is_interval => 1.0,
        "" => return Some(value).filter(|hz| *hz > 0.0),
        "ps" => 1e-12,
        "ns" => 1e-9,
        "us" | "\u{b5}s" | "\u{3bc}s" => 1e-6,
        "ms" => 1e-3,
        "s" => 1.0,
        _ => {
            let unit = units::read(unit)?;
            unit.is_time().then(|| unit.unit.factor())?
        }
    };
    Some(1.0 / (value * seconds)).filter(|hz| hz.is_finite() && *hz > 0.0)
}

/// Rate in Hz from an entry, at an index among its values (otherwise from the first nonempty one).
pub fn rate_hz(entry: &HeaderEntry, place: Option<usize>, decimal: u8) -> Option<f64> {
    let is_interval = match entry.topic()? {
        Topic::Rate => false,
        Topic::Interval => true,
        _ => return None,
    };
    let at = match place {
        Some(place) => place,
        None => entry.values.iter().position(|value| !value.is_empty())?,
    };
    let (value, own) = quantity(of_first_channel(entry.values.get(at)?), decimal)?;
    let in_key = in_brackets(&entry.key).unwrap_or_default();
    // Sample Interval,4e-10,s
    let next = entry
        .values
        .get(at + 1)
        .filter(|v| quantity(v, decimal).is_none());
    let unit = [Some(own.as_str()), Some(in_key), next.map(String::as_str)]
        .into_iter()
        .flatten()
        .find(|unit| !unit.is_empty() && hertz(1.0, unit, is_interval).is_some())
        .unwrap_or_default();
    if unit.is_empty() && !own.is_empty() {
        return None;
    }
    let hz = hertz(value, unit, is_interval)?;
    // A shorter decimal, if the reciprocal of an interval equals it within rounding.
    Some(crate::recording::without_rounding(hz)).filter(|hz| hz.is_finite())
}

/// Whether a unit is given with the first value of an entry.
pub fn has_unit(entry: &HeaderEntry, decimal: u8) -> bool {
    let mut values = entry.values.iter().filter(|value| !value.is_empty());
    let own = values.next().and_then(|value| quantity(value, decimal));
    own.is_some_and(|(_, unit)| !unit.is_empty())
        || in_brackets(&entry.key).is_some_and(|unit| !unit.is_empty())
        || values
            .next()
            .is_some_and(|text| quantity(text, decimal).is_none())
}

/// The first of values given per channel, `CH1:1.0E-06 CH2:1.0E-06`, or the value as it is.
fn of_first_channel(value: &str) -> &str {
    let first = value.split_whitespace().next().unwrap_or_default();
    match first.split_once(':') {
        Some((channel, value)) if channel.ends_with(|c: char| c.is_ascii_digit()) => value,
        _ => value,
    }
}

/// Seconds given by an entry.
pub fn seconds(entry: &HeaderEntry, place: Option<usize>, decimal: u8) -> Option<f64> {
    let text = match place {
        Some(place) => entry.values.get(place)?.as_str(),
        None => entry.value()?,
    };
    let (value, own) = quantity(text, decimal)?;
    let unit = if own.is_empty() {
        in_brackets(&entry.key).unwrap_or_default()
    } else {
        &own
    };
    match unit {
        "" => Some(value),
        unit => {
            let unit = units::read(unit).filter(NamedUnit::is_time)?;
            Some(value * unit.unit.factor())
        }
    }
}

fn in_brackets(text: &str) -> Option<&str> {
    [('(', ')'), ('[', ']')]
        .into_iter()
        .find_map(|(open, close)| {
            let start = text.find(open)?;
            let length = text[start..].find(close)?;
            Some(text[start + 1..start + length].trim())
        })
}

/// Date and time of the record from the entries.
pub fn date_text(entries: &[HeaderEntry]) -> Option<String> {
    let (mut date, mut time) = (None, None);
    for entry in entries {
        let about = entry.key.to_lowercase();
        let is_date = entry.topic() == Some(Topic::Date)
            || [
                "date", "time", "datum", "zeit", "start", "t0", "record", "begin",
            ]
            .iter()
            .any(|w| about.contains(w));
        if !is_date {
            continue;
        }
        let joined = entry
            .values
            .iter()
            .filter(|v| !v.is_empty())
            .cloned()
            .collect::<Vec<_>>();
        for text in joined.iter().cloned().chain([joined.join(" ")]) {
            match Clock::parse(&text) {
                Some(Clock {
                    day: Some(_),
                    nanoseconds: Some(_),
                    ..
                }) => return Some(text),
                Some(Clock { day: Some(_), .. }) => date = date.or(Some(text)),
                Some(Clock {
                    nanoseconds: Some(_),
                    ..
                }) => time = time.or(Some(text)),
                _ => {}
            }
        }
    }
    match (date, time) {
        (Some(date), Some(time)) => Some(format!("{date} {time}")),
        (date, time) => date.or(time),
    }
}
