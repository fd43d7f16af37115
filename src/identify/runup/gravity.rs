//! A torque that varies with the angle, as that of gravity on an unbalanced arm: `G sin θ + H cos θ`.

use std::borrow::Cow;

use super::directions::Directions;
use super::windows::{FittedRows, WindowRows, integral};
use super::{Body, FreeRun, RunupOptions, Terms};
use crate::failure::Failure;
use crate::identify::Motion;

/// Names of both constants.
pub(super) const GRAVITY: [&str; 2] = ["gravity_sine", "gravity_cosine"];

/// The angle at each sample, up to a constant, which sine and cosine allow for; `None` for a translation, and for an
/// acceleration, which gives the angle up to the initial speed only.
pub(super) fn angle<'a>(run: &FreeRun<'a>) -> Option<Cow<'a, [f64]>> {
    match (run.body, run.kind) {
        (Body::Turning, Motion::Displacement) => Some(run.motion.into()),
        (Body::Turning, Motion::Speed) => Some(integral(run.motion, run.rate_hz).into()),
        _ => None,
    }
}

/// The fit with the torque that varies with the angle if that matters, otherwise the plain one.
///
/// # Errors
/// That of the plain fit.
pub(super) fn fitted<'a>(
    run: &FreeRun,
    directions: &Directions,
    (plain, options): (Terms<'a>, &RunupOptions),
    (angle, found): (Option<&'a [f64]>, Result<FittedRows, Failure>),
) -> Result<(Terms<'a>, FittedRows), Failure> {
    let found = found?;
    let terms = Terms { angle, ..plain };
    if angle.is_some() && matters(run, directions, terms, &found)? {
        // Which terms are identifiable may differ.
        if let Ok(fitted) = super::fitted(run, directions, terms, options) {
            return Ok((terms, fitted));
        }
    }
    Ok((plain, found))
}

/// Whether the torque of gravity matters in the windows of a fit without.
fn matters(
    run: &FreeRun,
    directions: &Directions,
    terms: Terms,
    found: &FittedRows,
) -> Result<bool, Failure> {
    let rows = WindowRows::of(run, directions, found.rows.half, terms)?;
    let column = |name: &&'static str| {
        let place = rows.names.iter().position(|own| own == name);
        (*name, &rows.columns[place.expect("both are terms")])
    };
    Ok(found.lacks([column(&GRAVITY[0]), column(&GRAVITY[1])]))
}

/// Describes the term.
pub(super) fn method(run: &FreeRun, terms: Terms) -> Option<String> {
    terms.angle?;
    let zero = match run.kind {
        Motion::Speed => "θ being the integrated speed, zero at the start",
        _ => "θ being the recorded position",
    };
    Some(format!(
        "the torque varies significantly with the angle, as that of gravity on an unbalanced arm: the equation has the \
         terms gravity_sine sin θ + gravity_cosine cos θ, {zero}"
    ))
}
