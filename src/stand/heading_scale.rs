//! Scale factors in the heading of a channel.

use crate::unit::{NamedUnit, inside_brackets, scale_in};
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
