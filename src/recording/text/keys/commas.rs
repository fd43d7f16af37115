//! Rates and intervals cut at a comma within the number: `Sample Rate,10,000 Hz`.

use super::{HeaderEntry, Topic};

/// An entry whose first value is joined with the cells after it, if only this makes sense: `10`, `000` and `10`, `5 kHz`.
/// `12`, `500` may also be two rates.
pub(super) fn joined(mut entry: HeaderEntry) -> HeaderEntry {
    if !matches!(entry.topic(), Some(Topic::Rate | Topic::Interval)) {
        return entry;
    }
    let Some(first) = entry.values.iter().position(|value| !value.is_empty()) else {
        return entry;
    };
    let parts = parts(&entry.values[first..]);
    let Some((last, groups)) = parts.split_last().filter(|(_, before)| !before.is_empty()) else {
        return entry;
    };
    let is_group = |part: &&str| digits(part) == 3;
    let is_thousands = parts[1..].iter().all(is_group) && !parts[0].starts_with('0');
    let is_padded = parts[1..].iter().any(|part| part.starts_with('0'));
    let has_unit = unit(last).is_some();
    if is_thousands && (has_unit || is_padded) || groups.len() == 1 && has_unit {
        let number = parts.join(",");
        let count = parts.len();
        entry.values.splice(first..first + count, [number]);
    } else {
        entry.is_number_split = parts[1..].iter().any(|part| *part != parts[0]);
    }
    entry
}

/// The cells from the first on that may be parts of one number: up to three digits each, the last with decimals and a
/// unit or not.
fn parts(values: &[String]) -> Vec<&str> {
    let mut parts = Vec::new();
    for value in values {
        let is_whole = digits(value) == value.len();
        let ends = !parts.is_empty() && (unit(value).is_some() || unit_text(value).is_empty());
        if !(1..=3).contains(&digits(value)) || !is_whole && !ends {
            break;
        }
        parts.push(value.as_str());
        if !is_whole {
            break;
        }
    }
    parts
}

/// Number of digits that a text begins with.
fn digits(text: &str) -> usize {
    text.bytes().take_while(u8::is_ascii_digit).count()
}

/// What follows the digits of a text and its decimals.
fn unit_text(text: &str) -> &str {
    let behind = &text[digits(text)..];
    let decimals = behind.strip_prefix('.').filter(|rest| digits(rest) > 0);
    decimals.map_or(behind, |rest| &rest[digits(rest)..])
}

/// The same, if it begins like a unit.
fn unit(text: &str) -> Option<&str> {
    let text = unit_text(text);
    let begins_a_unit = |c: char| c.is_alphabetic() || c == ' ';
    text.starts_with(begins_a_unit).then_some(text)
}
