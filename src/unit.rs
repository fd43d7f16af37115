//! Units as files write them.

use torqcomp_decimal::digits;
use torqcomp_model::{Dimension, Kind, Unit};

use crate::failure::{ErrorCode, Failure};

/// A unit and its spelling in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedUnit {
    /// As written.
    pub text: String,
    /// Its meaning.
    pub unit: Unit,
}

/// Unit of samples of unknown full scale.
pub(crate) const OF_FULL_SCALE: &str = "of full scale";

impl NamedUnit {
    /// Factor from values in a unit to values in another; `None` if only one of them is known, or they are of different
    /// kinds.
    pub(crate) fn factor_between(from: Option<&Self>, to: Option<&Self>) -> Option<f64> {
        match [from, to].map(|unit| unit.map(|named| named.unit)) {
            [None, None] => Some(1.0),
            [Some(from), Some(to)] if from.dimension() == to.dimension() => {
                Some(from.factor() / to.factor())
            }
            _ => None,
        }
    }

    /// Reads a unit as recorders write it, without words in brackets after it
    /// (`Voltage (unscaled)` names no unit).
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let text = match inside_brackets(text) {
            Some(("", inside)) => inside,
            _ => text,
        };
        // A bare number is not a unit, although "1" denotes a ratio.
        if text.is_empty() || text.chars().all(|c| c.is_ascii_digit() || c == '.') {
            return None;
        }
        Unit::parse(text).ok().map(|unit| Self {
            text: text.to_owned(),
            unit,
        })
    }

    /// Reads a unit given with a flag.
    pub(crate) fn given(flag: &str, text: &str) -> Result<Self, Failure> {
        match Unit::parse(text) {
            Ok(unit) => Ok(Self {
                text: text.to_owned(),
                unit,
            }),
            Err(error) => {
                Err(ErrorCode::InvalidValue.usage(format_args!("{flag} {text}: {error}")))
            }
        }
    }

    /// The unit with its masses read as weights, if that makes it one of this dimension: `kgf cm` for `kg cm` as a
    /// torque.
    pub(crate) fn weight_as(&self, dimension: Dimension) -> Option<String> {
        let [force, _] = Unit::readings_of_weight(&self.text)?;
        let is_weight = |text: &String| Unit::parse(text).is_ok_and(|u| u.dimension() == dimension);
        Some(force).filter(|force| self.unit.dimension() != dimension && is_weight(force))
    }

    /// Whether it is a unit of time.
    pub fn is_time(&self) -> bool {
        self.unit.dimension() == Dimension::TIME
    }
}

/// A channel of a record: its name, its unit, and its unit as written, known or not.
#[derive(Debug, Clone, Copy)]
pub struct RecordedChannel<'a> {
    /// Name of the channel.
    pub name: &'a str,
    /// Its unit, if known.
    pub unit: Option<&'a NamedUnit>,
    /// Its unit as spelled in the file.
    pub unit_text: Option<&'a str>,
}

impl RecordedChannel<'_> {
    /// Failure for a unit that is unknown as spelled in the file, with what to do.
    pub(crate) fn unknown_unit(&self, text: &str, advice: &str) -> Failure {
        let why = match (scale_in(text), Unit::parse(text)) {
            (Some(scale), _) => format!(
                ": its factor \"{scale}\" may multiply or divide the numbers (thousands of rpm are krpm)"
            ),
            (None, Err(error)) => format!(": {error}"),
            (None, Ok(_)) => String::new(),
        };
        ErrorCode::UnitUnclear.failed(format_args!(
            "the unit \"{text}\" of the channel \"{}\" is unknown{why}; {advice}",
            self.name
        ))
    }

    /// Failure for a unit between force and mass, such as oz-in, where a torque is expected.
    pub(crate) fn unclear_weight(&self, unit: &NamedUnit) -> Option<Failure> {
        let text = &unit.text;
        let [force, mass] = Unit::readings_of_weight(text)?;
        let size = Kind::Torque.parse(&format!("1 {force}"));
        let torque = size.map_or_else(
            |_| format!("as a force, write --unit \"{force}\""),
            |size| {
                let size = digits::text(size, 5);
                format!("if it is a torque, give --unit \"{force}\" (1 {force} = {size} N m)")
            },
        );
        Some(ErrorCode::UnitUnclear.failed(format_args!(
            "the channel \"{}\" is in \"{text}\", which can be read with a force or with a mass; {torque}; \
             \"{mass}\" cannot be converted to torque",
            self.name
        )))
    }
}

/// Text before and inside brackets at the end of a heading.
pub(crate) fn inside_brackets(heading: &str) -> Option<(&str, &str)> {
    [('(', ')'), ('[', ']'), ('{', '}'), ('<', '>')]
        .into_iter()
        .find_map(|(open, close)| {
            let body = heading.trim_end().strip_suffix(close)?;
            // The matching bracket: units may contain brackets.
            let mut depth = 1;
            for (place, c) in body.char_indices().rev() {
                depth += i32::from(c == close) - i32::from(c == open);
                if depth == 0 {
                    return Some((body[..place].trim(), body[place + 1..].trim()));
                }
            }
            None
        })
}

/// The factor at the start of a text, and the rest: `1/100 s`, `x10ms`, `1e-3 s`, `10^-3 s`, `0,1 ms`.
pub(crate) fn factor(text: &str) -> Option<(f64, &str)> {
    let text = text
        .trim()
        .trim_start_matches(['x', '×', '*', '·'])
        .trim_start();
    let is_part =
        |c: char| c.is_ascii_digit() || matches!(c, '.' | ',' | '/' | 'e' | 'E' | '^' | '-' | '+');
    let end = text.find(|c: char| !is_part(c)).unwrap_or(text.len());
    let (number, rest) = text.split_at(end);
    let number = number.replace(',', ".");
    let factor: f64 = match (number.split_once('/'), number.split_once('^')) {
        (Some((above, below)), _) => above.parse::<f64>().ok()? / below.parse::<f64>().ok()?,
        (_, Some((base, power))) => base.parse::<f64>().ok()?.powi(power.parse().ok()?),
        _ => number.parse().ok()?,
    };
    (factor > 0.0 && factor.is_finite()).then(|| (factor, rest.trim()))
}

/// A power of ten next to a multiplication or division sign in a heading, as written there.
pub(crate) fn scale_in(heading: &str) -> Option<String> {
    let is_mark = |c: char| matches!(c, 'x' | 'X' | '×' | '·' | '*' | '/');
    let is_power = |number: &str| {
        let exponent = match number.strip_prefix("10^") {
            Some(exponent) => exponent.parse().unwrap_or(f64::NAN),
            None => number.parse().map_or(f64::NAN, f64::log10),
        };
        exponent != 0.0 && (exponent - exponent.round()).abs() < 1e-9
    };
    let words: Vec<&str> = heading
        .split(|c: char| c.is_whitespace() || "()[]{},;_".contains(c))
        .filter(|word| !word.is_empty())
        .collect();
    let is_alone = |word: &&str| word.chars().count() == 1 && word.chars().all(is_mark);
    let is_scale = |word: &&&str| {
        let mut marks = word.char_indices().filter(|(_, c)| is_mark(*c));
        let is_beside = marks.any(|(at, mark)| {
            let (left, right) = (&word[..at], &word[at + mark.len_utf8()..]);
            // In `Torque*100` the sign is between words; in `box10` or the topic `motor/10` it is part of one.
            let is_between = !matches!(mark, 'x' | 'X' | '/');
            (is_power(right) && (is_between || left.is_empty()))
                || (is_power(left) && (is_between || right.is_empty()))
        });
        is_beside || (word.contains(['e', 'E', '^']) && is_power(word))
    };
    let pairs = words.windows(2).find(|pair| {
        (is_alone(&pair[0]) && is_power(pair[1])) || (is_power(pair[0]) && is_alone(&pair[1]))
    });
    let single = words.iter().find(is_scale);
    pairs
        .map(|pair| pair.join(" "))
        .or_else(|| single.map(|word| (*word).to_owned()))
}
