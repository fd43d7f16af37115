//! Channels that are shifted in time against each other.

use super::blocks::Set;
use super::lines::Lines;
use super::order::grow;
use super::{Data, Effort, Modal, ResponseOptions};
use crate::failure::Failure;
use crate::identify::Identification;
use crate::print::rounded;

/// Most modes beside a delay that are tried.
const MOST_MODES: usize = 3;

/// The fit with a delay, if that explains the response with fewer modes at least as well as `coarse` does without: a delay
/// is no sum of modes, so that many of them stand for one.
///
/// # Errors
/// If there are too few lines.
pub(super) fn of(
    set: &Set,
    lines: &Lines,
    options: &ResponseOptions,
    (data, coarse): (&Data, &Modal),
) -> Result<Option<Modal>, Failure> {
    if data.with_delay || options.modes.is_some() {
        return Ok(None);
    }
    let data = Data {
        with_delay: true,
        ..data.clone()
    };
    let enough = set.error(&coarse.response, lines);
    let mut late = data.fit(&[], Effort::Coarse)?;
    for _ in 1..coarse.poles.len().min(MOST_MODES + 1) {
        let Some(next) = grow(&data, &late, options)? else {
            break;
        };
        late = next;
        if set.error(&late.response, lines) <= enough {
            return Ok(Some(late));
        }
    }
    Ok(None)
}

/// Says which channel is late.
pub(super) fn warn(result: &mut Identification, delay_s: f64) {
    let which = match delay_s < 0.0 {
        true => "applied",
        false => "measured",
    };
    result.warn(
        "channels-shifted",
        format!(
            "the {which} channel is about {} ms late against the other: a delay was fitted, as with --delay, which explains \
             what took more modes without; check that one recorder takes both channels, with the same filters",
            rounded(1e3 * delay_s.abs(), 3)
        ),
    );
}
