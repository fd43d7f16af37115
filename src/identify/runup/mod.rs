//! Inertia and friction of a free body from its motion and the torque (or force) that drives it.
//!
//! ```text
//! T = J θ'' + f θ' + F_c sgn θ' + C          (C1) with dry friction
//! ```
//!
//! The equation is averaged over smooth windows ([`torqcomp_dsp::weak`]), which takes derivatives
//! without differences, and solved by least squares with the noise of the motion taken out of the
//! normal equations. Beside it stands the classical way of robot identification: zero-phase
//! low-pass, central differences, least squares (M. Gautier, Dynamic identification of robots with
//! power model, ICRA 1997).

mod classical;
mod regression;

use torqcomp_dsp::weak::{Window, white_noise_variance};

use super::{Comparison, Correlated, Found, Outcome, Quality, STRONG, rms};
use crate::failure::Failure;
use crate::report::chart::{Chart, Series};
use regression::{Corrected, solve};

/// What the motion channel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Angle or position.
    Position,
    /// Speed.
    Speed,
    /// Acceleration.
    Acceleration,
}

impl Motion {
    /// Derivatives still to be taken to reach the acceleration.
    fn to_acceleration(self) -> usize {
        match self {
            Self::Position => 2,
            Self::Speed => 1,
            Self::Acceleration => 0,
        }
    }
}

/// Names and units of what comes out, which differ between turning and sliding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// Angles and torques.
    Turning,
    /// Lengths and forces.
    Sliding,
}

impl Body {
    fn inertia(self) -> (&'static str, &'static str) {
        match self {
            Self::Turning => ("inertia", "kg m^2"),
            Self::Sliding => ("mass", "kg"),
        }
    }

    fn viscous(self) -> &'static str {
        match self {
            Self::Turning => "N m s/rad",
            Self::Sliding => "N s/m",
        }
    }

    fn effort(self) -> &'static str {
        match self {
            Self::Turning => "N m",
            Self::Sliding => "N",
        }
    }
}

/// A record of a run, in SI units.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// Samples a second.
    pub rate_hz: f64,
    /// The motion.
    pub motion: &'a [f64],
    /// What the motion is.
    pub kind: Motion,
    /// Torque or force.
    pub effort: &'a [f64],
    /// Turning or sliding.
    pub body: Body,
}

/// How a run is evaluated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Whether viscous friction may differ by direction.
    pub by_direction: bool,
    /// Half of the averaging window in seconds; chosen from the data if not given.
    pub half_window_s: Option<f64>,
}

/// Fewest windows that fit into a record.
const LEAST_WINDOWS: usize = 12;
/// Half of the shortest window tried, in samples.
const SHORTEST_HALF: usize = 8;
/// Part of a regressor's power that noise may have before it is said.
const NOISY: f64 = 0.2;

/// Evaluates a run.
///
/// # Errors
/// If the record is too short, holds no motion, or the channels do not have one length.
pub fn identify(run: &Run, options: &Options) -> Result<Outcome, Failure> {
    check(run)?;
    let directions = Directions::of(run)?;
    let split = options.by_direction && directions.both();
    let (half, fitted) = match options.half_window_s {
        Some(seconds) => {
            let half = ((seconds * run.rate_hz).round() as usize).max(4);
            (half, evaluate(run, &directions, half, split)?)
        }
        None => {
            let half = plateau(run, &directions)?;
            (half, evaluate(run, &directions, half, split)?)
        }
    };
    let mut outcome = Outcome {
        found: named(run, &directions, split, &fitted),
        ..Outcome::default()
    };
    let effort_rms = rms(&fitted.right);
    outcome.quality = Some(Quality {
        rms: rms(&fitted.residuals),
        unit: run.body.effort().to_owned(),
        relative: rms(&fitted.residuals) / effort_rms,
    });
    outcome.method.push(format!(
        "weighted averages of the equation of motion over windows of ±{} s ({} windows), derivatives \
         taken from the weight",
        crate::report::short(half as f64 / run.rate_hz),
        fitted.right.len()
    ));
    let names: Vec<String> = outcome.found.iter().map(|f| f.name.clone()).collect();
    for i in 0..names.len() {
        for j in i + 1..names.len() {
            let coefficient = fitted.correlation(i, j);
            if coefficient.abs() >= STRONG {
                outcome.correlated.push(Correlated {
                    first: names[i].clone(),
                    second: names[j].clone(),
                    coefficient,
                });
            }
        }
    }
    draw(&mut outcome, run, half, &fitted);
    say(&mut outcome, run, &directions, options, &fitted);
    if let Some(classical) = classical::identify(run, &directions, half, split)? {
        outcome.comparisons.push(classical);
    }
    Ok(outcome)
}

fn check(run: &Run) -> Result<(), Failure> {
    if run.motion.len() != run.effort.len() {
        return Err(Failure::failed(format_args!(
            "the motion has {} samples and the torque {}; both must be of one recording",
            run.motion.len(),
            run.effort.len()
        )));
    }
    let least = 2 * SHORTEST_HALF * LEAST_WINDOWS / 2;
    if run.motion.len() < least {
        return Err(Failure::failed(format_args!(
            "{} samples are too few for a run; record at least {least}",
            run.motion.len()
        )));
    }
    for (what, samples) in [("motion", run.motion), ("torque", run.effort)] {
        if let Some(i) = samples.iter().position(|v| !v.is_finite()) {
            return Err(Failure::failed(format_args!(
                "sample {} of the {what} is not a number; cut the record there",
                i + 1
            )));
        }
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        if samples.iter().all(|v| *v == samples[0]) && (what == "motion" || mean == 0.0) {
            return Err(Failure::failed(format_args!(
                "the {what} does not change; nothing can be learnt of the body"
            )));
        }
    }
    Ok(())
}

/// Speed at every sample and its direction.
pub(super) struct Directions {
    /// Speed, if the motion tells it absolutely.
    pub speed: Option<Vec<f64>>,
    /// −1 to 1 at each sample: the sign of the speed, with a slope where it drowns in noise.
    pub sign: Vec<f64>,
    forward: bool,
    backward: bool,
}

impl Directions {
    fn of(run: &Run) -> Result<Self, Failure> {
        let count = run.motion.len();
        if run.kind == Motion::Acceleration {
            return Ok(Self {
                speed: None,
                sign: vec![1.0; count],
                forward: true,
                backward: false,
            });
        }
        let order = run.kind.to_acceleration() - 1;
        let half = SHORTEST_HALF.max(count / 2000).min(20);
        let window = Window::new(half, run.rate_hz)?;
        let mut speed = window.slide(run.motion, order);
        let (first, last) = (speed[0], speed[speed.len() - 1]);
        speed.splice(0..0, vec![first; half]);
        speed.resize(count, last);
        let variance = white_noise_variance(run.motion).unwrap_or(0.0);
        let noise = (variance * window.noise(order, order)).sqrt();
        let largest = speed.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let dead = (3.0 * noise).max(1e-9 * largest);
        let sign: Vec<f64> = speed.iter().map(|v| (v / dead).clamp(-1.0, 1.0)).collect();
        let share = |s: f64| sign.iter().filter(|v| **v == s).count() as f64 / count as f64;
        let (forward, backward) = (share(1.0) > 0.02, share(-1.0) > 0.02);
        Ok(Self {
            speed: Some(speed),
            sign,
            forward,
            backward,
        })
    }

    /// Whether the body moved both ways.
    pub fn both(&self) -> bool {
        self.forward && self.backward
    }
}

/// The columns of the regression for windows of that half-length.
fn evaluate(
    run: &Run,
    directions: &Directions,
    half: usize,
    split: bool,
) -> Result<Corrected, Failure> {
    let window = Window::new(half, run.rate_hz)?;
    let count = run.motion.len();
    let centres: Vec<usize> = (half..count.saturating_sub(half))
        .step_by((half / 2).max(1))
        .collect();
    if centres.len() < LEAST_WINDOWS {
        return Err(Failure::failed(format_args!(
            "windows of ±{half} samples fit only {} times into the record; make them shorter",
            centres.len()
        )));
    }
    let top = run.kind.to_acceleration();
    let column = |samples: &[f64], order: usize| -> Vec<f64> {
        centres
            .iter()
            .map(|c| window.at(samples, *c, order))
            .collect()
    };
    let mut columns = vec![column(run.motion, top)];
    let mut noisy = vec![Some(top)];
    match (&directions.speed, split) {
        (Some(speed), true) => {
            for keep in [|v: f64| v.max(0.0), |v: f64| v.min(0.0)] {
                let part: Vec<f64> = speed.iter().map(|v| keep(*v)).collect();
                columns.push(column(&part, 0));
                noisy.push(None);
            }
        }
        (Some(_), false) => {
            columns.push(column(run.motion, top - 1));
            noisy.push(Some(top - 1));
        }
        (None, _) => {
            // Speed but for a constant, which the offset takes up.
            columns.push(column(&integral(run.motion, run.rate_hz), 0));
            noisy.push(None);
        }
    }
    if directions.both() {
        columns.push(column(&directions.sign, 0));
        noisy.push(None);
    }
    columns.push(vec![1.0; centres.len()]);
    noisy.push(None);
    let variance = white_noise_variance(run.motion).unwrap_or(0.0);
    let noise = |i: usize, j: usize| match (noisy[i], noisy[j]) {
        (Some(a), Some(b)) => variance * window.noise(a, b),
        _ => 0.0,
    };
    solve(&columns, column(run.effort, 0), noise)
}

fn integral(samples: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut last = samples[0];
    samples
        .iter()
        .map(|v| {
            sum += 0.5 * (v + last) / rate_hz;
            last = *v;
            sum
        })
        .collect()
}

/// The first window from which the answer changes less than from those around it: shorter ones are
/// noisy, longer ones average over what the equation does not hold for. Told with one viscous
/// friction, whatever is asked for.
fn plateau(run: &Run, directions: &Directions) -> Result<usize, Failure> {
    let longest = (run.motion.len() / (LEAST_WINDOWS / 2 + 2)).max(SHORTEST_HALF);
    let mut tried: Vec<(usize, Corrected)> = Vec::new();
    let mut half = SHORTEST_HALF;
    while half <= longest {
        if let Ok(fitted) = evaluate(run, directions, half, false) {
            tried.push((half, fitted));
        }
        half = half * 3 / 2;
    }
    let changes: Vec<f64> = tried
        .windows(2)
        .map(|pair| pair[0].1.change_to(&pair[1].1.values))
        .collect();
    let first = changes.windows(2).position(|pair| pair[0] < pair[1]);
    let best = first.unwrap_or(changes.len().saturating_sub(1));
    Ok(tried.get(best).map_or(SHORTEST_HALF, |(half, _)| *half))
}

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

fn named(run: &Run, directions: &Directions, split: bool, fitted: &Corrected) -> Vec<Found> {
    names(run, directions, split)
        .into_iter()
        .enumerate()
        .map(|(i, (name, unit))| Found::new(name, fitted.values[i], fitted.std(i), unit))
        .collect()
}

/// The torque and what the equation of motion makes of the motion, and the difference.
fn draw(outcome: &mut Outcome, run: &Run, half: usize, fitted: &Corrected) {
    let stride = (half / 2).max(1);
    let time = |k: usize| (half + k * stride) as f64 / run.rate_hz;
    let times: Vec<f64> = (0..fitted.right.len()).map(time).collect();
    let model: Vec<f64> = fitted
        .right
        .iter()
        .zip(&fitted.residuals)
        .map(|(b, r)| b + r)
        .collect();
    let left: Vec<f64> = fitted.residuals.iter().map(|r| -r).collect();
    let unit = run.body.effort();
    let both = vec![
        Series::line("measured", &times, &fitted.right),
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
fn say(
    outcome: &mut Outcome,
    run: &Run,
    directions: &Directions,
    options: &Options,
    fitted: &Corrected,
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
    if fitted.noise_share > NOISY {
        outcome.warn(
            "noisy-motion",
            format!(
                "noise makes up {} % of a regressor's power; it was taken out, but a longer window \
                 or a better sensor would be safer",
                crate::report::rounded(100.0 * fitted.noise_share, 2)
            ),
        );
    }
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
