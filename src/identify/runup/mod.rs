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

mod check;
mod classical;
mod directions;
mod regression;
mod scatter;
mod turns;
mod windows;
mod words;

use super::{Correlated, Outcome, Quality, STRONG, rms};
use crate::failure::Failure;
use directions::Directions;
use windows::{Fitted, Rows, plateau};

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

/// Growth of an uncertainty by colour that is said.
const COLOURED: f64 = 1.3;
/// Fewest windows that fit into a record.
const LEAST_WINDOWS: usize = 12;
/// Half of the shortest window tried, in samples.
const SHORTEST_HALF: usize = 8;

/// Evaluates a run.
///
/// # Errors
/// If the record is too short, holds no motion, or the channels do not have one length.
pub fn identify(run: &Run, options: &Options) -> Result<Outcome, Failure> {
    check::check(run)?;
    let directions = Directions::of(run)?;
    let split = options.by_direction && directions.both();
    let half = match options.half_window_s {
        Some(seconds) => ((seconds * run.rate_hz).round() as usize).max(4),
        None => plateau(run, &directions),
    };
    let fitted = Rows::of(run, &directions, half, split)?.fit()?;
    let mut outcome = Outcome {
        found: words::named(run, &directions, split, &fitted.fit),
        quality: Some(quality(run, &fitted)),
        ..Outcome::default()
    };
    outcome.method.push(method(run, &fitted));
    if fitted.fit.coloured > COLOURED {
        outcome.method.push(format!(
            "what is left is not white noise, so the equation lacks something: the uncertainties are taken from \
             how it hangs together, up to {} times those of noise",
            crate::print::rounded(fitted.fit.coloured, 2)
        ));
    }
    correlations(&mut outcome, &fitted);
    words::draw(&mut outcome, run, &fitted);
    words::say(&mut outcome, run, &directions, options, &fitted);
    if let Some(classical) = classical::identify(run, &directions, half, split)? {
        outcome.comparisons.push(classical);
    }
    Ok(outcome)
}

/// What is left of the torque over all windows, those that were not fitted included.
fn quality(run: &Run, fitted: &Fitted) -> Quality {
    let left = rms(&fitted.fit.residuals);
    Quality {
        rms: left,
        unit: run.body.effort().to_owned(),
        relative: left / rms(&fitted.rows.right),
    }
}

fn method(run: &Run, fitted: &Fitted) -> String {
    let all = fitted.used.len();
    let used = fitted.used.iter().filter(|u| **u).count();
    let which = if used < all {
        format!("{used} of {all} windows; in the others the body turns round or stands")
    } else {
        format!("{all} windows")
    };
    format!(
        "weighted averages of the equation of motion over windows of ±{} s ({which}), derivatives taken \
         from the weight",
        crate::print::short(fitted.rows.half as f64 / run.rate_hz),
    )
}

fn correlations(outcome: &mut Outcome, fitted: &Fitted) {
    let names: Vec<String> = outcome.found.iter().map(|f| f.name.clone()).collect();
    for i in 0..names.len() {
        for j in i + 1..names.len() {
            let coefficient = fitted.fit.correlation(i, j);
            if coefficient.abs() >= STRONG {
                outcome.correlated.push(Correlated {
                    first: names[i].clone(),
                    second: names[j].clone(),
                    coefficient,
                });
            }
        }
    }
}
