//! Names of what a run tells, its drawings, and what a user should know about it.

use super::directions::Directions;
use super::regression::Corrected;
use super::windows::Fitted;
use super::{Motion, Options, Run};
use crate::identify::{Comparison, Found, Outcome, Quality};
use crate::report::chart::{Chart, Series};

/// Part of a regressor's power that noise may have before it is said.
const NOISY: f64 = 0.2;

/// Puts names and units to the columns.
pub(super) fn names(
    run: &Run,
    directions: &Directions,
    split: bool,
) -> Vec<(&'static str, &'static str)> {
    let body = run.body;
    let mut names = vec![body.inertia()];
    if split {
        names.push(("viscous_friction_forward", body.viscous()));
        names.push(("viscous_friction_backward", body.viscous()));
    } else {
        names.push(("viscous_friction", body.viscous()));
    }
    if directions.both() {
        names.push(("dry_friction", body.effort()));
        names.push(("offset", body.effort()));
    } else {
        names.push(("dry_friction_and_offset", body.effort()));
    }
    names
}

pub(super) fn named(
    run: &Run,
    directions: &Directions,
    split: bool,
    fitted: &Corrected,
) -> Vec<Found> {
    names(run, directions, split)
        .into_iter()
        .enumerate()
        .map(|(i, (name, unit))| Found::new(name, fitted.values[i], fitted.std(i), unit))
        .collect()
}

/// The torque and what the equation of motion makes of the motion, and the difference.
pub(super) fn draw(outcome: &mut Outcome, run: &Run, fitted: &Fitted) {
    let (half, stride) = (fitted.rows.half, fitted.rows.stride);
    let right = &fitted.rows.right;
    let time = |k: usize| (half + k * stride) as f64 / run.rate_hz;
    let times: Vec<f64> = (0..right.len()).map(time).collect();
    let model: Vec<f64> = fitted
        .rows
        .right
        .iter()
        .zip(&fitted.fit.residuals)
        .map(|(b, r)| b + r)
        .collect();
    let left: Vec<f64> = fitted.fit.residuals.iter().map(|r| -r).collect();
    let unit = run.body.effort();
    let both = vec![
        Series::line("measured", &times, right),
        Series::line("from the motion", &times, &model),
    ];
    outcome.charts.push(Chart::new(
        "Torque or force, averaged",
        "time from the start, s",
        unit,
        both,
    ));
    let rest = vec![Series::line("measured less model", &times, &left)];
    outcome
        .charts
        .push(Chart::new("Residual", "time from the start, s", unit, rest));
}

/// What a user should know about this run.
pub(super) fn say(
    outcome: &mut Outcome,
    run: &Run,
    directions: &Directions,
    options: &Options,
    fitted: &Fitted,
) {
    if run.kind == Motion::Acceleration {
        outcome.warn(
            "speed-unknown",
            "the speed follows from the acceleration only but for a constant, so that the offset holds \
             dry friction and part of the viscous one; record position or speed to tell them apart",
        );
    } else if !directions.both() {
        outcome.warn(
            "one-direction",
            "the body moves in one direction only: dry friction and offset are one number; run it both \
             ways to tell them apart",
        );
    }
    if options.by_direction && directions.both() {
        outcome.warn(
            "dry-friction-by-direction",
            "dry friction that differs by direction and an offset of the torque are the same thing: \
             dry_friction ± offset is that of either direction if the torque has no offset",
        );
    }
    if fitted.fit.noise_share > NOISY {
        outcome.warn(
            "noisy-motion",
            format!(
                "noise makes up {} % of a regressor's power; it was taken out, but a longer window \
                 or a better sensor would be safer",
                crate::print::rounded(100.0 * fitted.fit.noise_share, 2)
            ),
        );
    }
    impossible(outcome);
}

/// Says which numbers no body has.
fn impossible(outcome: &mut Outcome) {
    let impossible: Vec<String> = outcome
        .found
        .iter()
        .filter(|f| f.name != "offset" && f.name != "dry_friction_and_offset")
        .filter(|f| f.value + 3.0 * f.std.unwrap_or(0.0) < 0.0)
        .map(|f| f.name.clone())
        .collect();
    if !impossible.is_empty() {
        outcome.warn(
            "impossible",
            format!(
                "{} came out negative, which no body has: check the signs of both channels and whether \
                 something else drives the body",
                impossible.join(", ")
            ),
        );
    }
}

/// A comparison by another method over the same columns.
pub(super) fn comparison(
    method: String,
    run: &Run,
    names: &[(&'static str, &'static str)],
    values: &[f64],
    std: &[Option<f64>],
    quality: (f64, f64),
) -> Comparison {
    let found = names
        .iter()
        .zip(values.iter().zip(std))
        .map(|((name, unit), (value, std))| Found::new(*name, *value, *std, *unit))
        .collect();
    Comparison {
        method,
        found,
        quality: Some(Quality {
            rms: quality.0,
            unit: run.body.effort().to_owned(),
            relative: quality.1,
        }),
    }
}
