//! Scale factors in the heading of a channel.

use crate::unit::{NamedUnit, RecordedChannel, factor, inside_brackets, scale_in};
use crate::warning::{Warning, WarningCode};

/// A warning if the heading of a channel contains a scale factor, as in `x10`, `*1000`, `× 0.1`, `(x100)`, `/10`,
/// `0.1 x`, `[0.1 N m]` or `(Nm/10)`.
pub(super) fn unapplied(channel: RecordedChannel) -> Option<Warning> {
    let heading = channel.name;
    let scale = scaled_unit(channel).or_else(|| scale_in(heading))?;
    Some(WarningCode::ScaleInHeading.warning(format!(
        "the heading of \"{heading}\" contains a scale factor, \"{scale}\", which was not applied to the numbers; if \
         it should be, scale the column and rename it"
    )))
}

/// The unit of a channel, or what stands in brackets behind its name, if it is a unit with a scale.
pub(super) fn scaled_unit(channel: RecordedChannel) -> Option<String> {
    let behind = inside_brackets(channel.name).map(|(_, inside)| inside);
    let mut texts = [channel.unit_text, behind].into_iter().flatten();
    texts.find(|text| is_scaled(text)).map(str::to_owned)
}

/// Whether a text is a number before, or a sign and a number behind, a unit.
fn is_scaled(text: &str) -> bool {
    let is_unit = |text: &str| NamedUnit::parse(text.trim()).is_some();
    let is_before = || factor(text).is_some_and(|(scale, unit)| scale != 1.0 && is_unit(unit));
    let is_behind = || {
        let sign = text.rfind(['/', '*', '·', 'x', '×']);
        let (unit, behind) = text.split_at(sign.unwrap_or(text.len()));
        let number = factor(behind.trim_start_matches('/'));
        is_unit(unit) && number.is_some_and(|(scale, rest)| scale != 1.0 && rest.is_empty())
    };
    is_before() || is_behind()
}
