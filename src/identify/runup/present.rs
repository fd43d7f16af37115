//! Names, method, charts and warnings of a run-up.

use super::directions::Directions;
use super::missing::{Missing, MissingTerm};
use super::resolution::too_few;
use super::windows::FittedRows;
use super::{COLOURED, FreeRun, GRAVITY, POOR, RunupOptions, Terms};
use crate::chart::{Chart, Series};
use crate::identify::{Identification, Motion};
use crate::print::{rounded, short};
use crate::warning::WarningCode;

/// Noise power in a measured term, relative to its total, above which a warning is given.
const NOISY: f64 = 0.2;

/// Names and units of the columns.
pub(super) fn names(
    run: &FreeRun,
    directions: &Directions,
    terms: Terms,
) -> Vec<(&'static str, &'static str)> {
    let body = run.body;
    let mut names = vec![body.inertia()];
    if terms.is_split {
        names.push(("viscous_friction_forward", body.viscous()));
        names.push(("viscous_friction_backward", body.viscous()));
    } else {
        names.push(("viscous_friction", body.viscous()));
    }
    if terms.angle.is_some() {
        names.extend(GRAVITY.map(|name| (name, body.effort())));
    }
    if directions.both() {
        names.push(("dry_friction", body.effort()));
        names.push(("offset", body.effort()));
    } else {
        names.push(("dry_friction_and_offset", body.effort()));
    }
    names
}

/// Describes the evaluation of the run.
pub(super) fn method(
    result: &mut Identification,
    run: &FreeRun,
    directions: &Directions,
    fitted: &FittedRows,
) {
    let all = fitted.used.len();
    let used = fitted.used.iter().filter(|u| **u).count();
    let rest = directions.moves.iter().filter(|m| !**m).count();
    if rest > 0 {
        result.method.push(format!(
            "the body is at rest, as far as the noise of the motion shows, for {} s in all, which were left out",
            short(rest as f64 / run.rate_hz)
        ));
    }
    let which = if used < all {
        format!("{used} of {all} windows; in the others the body reverses or is at rest")
    } else {
        format!("{all} windows")
    };
    result.method.push(format!(
        "least squares on the equation of motion averaged over windows of ±{} s ({which}); derivatives act on the \
         window function (weak form)",
        short(fitted.rows.half as f64 / run.rate_hz),
    ));
    if fitted.fit.coloured > COLOURED {
        result.method.push(format!(
            "the residual is autocorrelated, so the model is incomplete; uncertainties allow for it (up to {} times those \
             for white noise)",
            rounded(fitted.fit.coloured, 2)
        ));
    }
}

/// Measured torque, torque from the motion, and the residual.
pub(super) fn draw(result: &mut Identification, run: &FreeRun, fitted: &FittedRows) {
    let (half, stride) = (fitted.rows.half, fitted.rows.stride);
    let right = &fitted.rows.right;
    let time = |k: usize| (half + k * stride) as f64 / run.rate_hz;
    let times: Vec<f64> = (0..right.len()).map(time).collect();
    let residuals = &fitted.fit.residuals;
    let model: Vec<f64> = right.iter().zip(residuals).map(|(b, r)| b + r).collect();
    let left: Vec<f64> = residuals.iter().map(|r| -r).collect();
    let unit = run.body.effort();
    let both = vec![
        Series::line("measured", &times, right),
        Series::line("from the motion", &times, &model),
    ];
    let rest = vec![Series::line("measured − model", &times, &left)];
    let time = "time from the start, s";
    let quantity = if unit == "N m" { "torque" } else { "force" };
    let label = format!("{quantity}, {unit}");
    result.charts.extend([
        Chart::new("Torque or force, averaged", time, &label, both),
        Chart::new("Residual", time, &label, rest),
    ]);
}

/// Warns about unidentifiable terms, noise, and negative constants.
pub(super) fn warnings(
    result: &mut Identification,
    run: &FreeRun,
    directions: &Directions,
    (options, few_samples): (&RunupOptions, Option<String>),
    fitted: &FittedRows,
) {
    if run.kind == Motion::Acceleration {
        result.warn(WarningCode::SpeedUnknown.warning(
            "an acceleration gives the speed only up to a constant: dry friction counts as viscous friction, which is \
             too large then, and the offset includes a part of both; record position or speed to separate them",
        ));
    } else if !directions.both() {
        result.warn(WarningCode::OneDirection.warning(
            "the body moves in one direction only, so dry friction and offset cannot be separated; run it in both \
             directions",
        ));
    }
    if options.by_direction && directions.both() {
        result.warn(WarningCode::DryFrictionByDirection.warning(
            "dry friction that differs by direction cannot be distinguished from a torque offset: if the torque has no \
             offset, dry_friction ± offset is the dry friction in each direction",
        ));
    }
    if let Some(message) = few_samples {
        result.warn(WarningCode::FewSamplesPerSwing.warning(message));
    }
    coarse(result, run, directions, fitted);
    if fitted.fit.noise_share > NOISY {
        result.warn(WarningCode::NoisyMotion.warning(format!(
            "up to {} % of the power of a measured term (acceleration or speed) is noise; the resulting bias was \
             removed, but a longer --window or a better sensor is safer",
            rounded(100.0 * fitted.fit.noise_share, 2)
        )));
    }
    let found = fitted.missing();
    impossible(result, found.is_some());
    if let Some(found) = found {
        missing(result, run, &found);
    }
    poor(result);
}

/// Warns about windows shorter than a few new values of a channel.
fn coarse(
    result: &mut Identification,
    run: &FreeRun,
    directions: &Directions,
    fitted: &FittedRows,
) {
    let Some(few) = too_few(&directions.moving(run.motion), run.effort, fitted.rows.half) else {
        return;
    };
    let time_s = |samples: usize| short(samples as f64 / run.rate_hz);
    let (code, why, remedy) = if few.is_held {
        (
            WarningCode::RepeatedSamples,
            "they are held",
            "record at the rate of their source",
        )
    } else {
        (
            WarningCode::CoarseQuantisation,
            "of its coarse resolution",
            "record with a finer resolution",
        )
    };
    result.warn(code.warning(format!(
        "most values of the {} stay for {} s because {why}, too long for windows of ±{} s: their errors do not \
         average out, and the constants may be wrong by more than their uncertainty; {remedy}, or for longer with a \
         longer --window",
        few.channel,
        time_s(few.every),
        time_s(fitted.rows.half)
    )));
}

/// Warns about a term that the equation lacks, with the constants fitted together with it.
fn missing(result: &mut Identification, run: &FreeRun, found: &Missing) {
    let with = |term: &MissingTerm| {
        let pairs = result.parameters.iter().zip(&term.values);
        let each = pairs.map(|(constant, value)| {
            let unit = constant.estimate.unit();
            format!("{} {} {unit}", constant.name, rounded(*value, 4))
        });
        each.collect::<Vec<_>>().join(", ")
    };
    let (code, message) = match found {
        Missing::Delay(term) => {
            let which = match term.coefficient < 0.0 {
                true => ["torque", "motion"],
                false => ["motion", "torque"],
            };
            let message = format!(
                "the {} is about {} ms late relative to the {}, or is filtered, which the constants, viscous friction \
                 above all, do not allow for; with the delay as an additional parameter they are {}; record both channels \
                 with one recorder and the same filters",
                which[0],
                rounded(1e3 * term.coefficient.abs(), 2),
                which[1],
                with(term)
            );
            (WarningCode::ChannelsShifted, message)
        }
        Missing::Drag(term) => {
            let message = format!(
                "the residual shows a torque or force that grows with the square of the speed, as the drag of air does, \
                 which the constants do not allow for; with a drag of {} {} times the squared speed they are {}; take \
                 those, or record at speeds so low that drag is small",
                rounded(term.coefficient, 4),
                run.body.drag(),
                with(term)
            );
            (WarningCode::Drag, message)
        }
    };
    result.warn(code.warning(message));
}

/// Warns if the motion does not explain the torque.
fn poor(result: &mut Identification) {
    let Some(relative) = result.fit.as_ref().map(|fit| fit.relative) else {
        return;
    };
    if relative > POOR {
        result.warn(WarningCode::PoorFit.warning(format!(
            "the residual is {} % of the torque: the motion does not explain it; check the channels (a speed with \
             its sign, an angle that does not wrap at full turns, the torque on the same shaft) and that neither \
             is clipped, and select the part where the drive runs with --range",
            rounded(100.0 * relative, 2)
        )));
    }
}

/// Warns about constants that are significantly negative.
fn impossible(result: &mut Identification, lacks_term: bool) {
    let constants = result.parameters.iter();
    let impossible: Vec<&str> = constants
        .filter(|c| c.name != "offset" && c.name != "dry_friction_and_offset")
        .filter(|c| !GRAVITY.contains(&c.name.as_str()))
        .filter(|c| c.value() + 3.0 * c.std().unwrap_or(0.0) < 0.0)
        .map(|c| c.name.as_str())
        .collect();
    if !impossible.is_empty() {
        let why = match lacks_term {
            true => "the equation lacks a term, named below",
            false => "check the signs of both channels and whether something else drives the body",
        };
        let message = format!("negative: {}; {why}", impossible.join(", "));
        result.warn(WarningCode::Impossible.warning(message));
    }
}
