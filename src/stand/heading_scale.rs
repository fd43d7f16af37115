//! Scale factors in the heading of a channel.

use crate::unit::{NamedUnit, inside_brackets};
use crate::warning::Warning;

/// A warning if the heading of a channel contains a scale factor, as in `x10`, `*1000`, `× 0.1`, `(x100)`, `/10`,
/// `0.1 x` or `[0.1 N m]`.
pub(super) fn unapplied(heading: &str) -> Option<Warning> {
    let scale = scaled_unit(heading).or_else(|| scale_in(heading))?;
    Some(Warning::new(
        "scale-in-heading",
        format!(
            "the heading \"{heading}\" contains a scale factor, \"{scale}\", which was not applied to the numbers; if \
             it should be, scale the column and rename it"
        ),
    ))
}

/// A number before the unit in brackets.
fn scaled_unit(heading: &str) -> Option<String> {
    let (_, inside) = inside_brackets(heading)?;
    let end = inside.find(|c: char| !c.is_ascii_digit() && !".,".contains(c))?;
    let number: f64 = inside[..end].replace(',', ".").parse().ok()?;
    let is_scale = number != 1.0 && NamedUnit::parse(inside[end..].trim()).is_some();
    is_scale.then(|| inside.to_owned())
}

/// A power of ten next to a multiplication or division sign.
fn scale_in(heading: &str) -> Option<String> {
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
