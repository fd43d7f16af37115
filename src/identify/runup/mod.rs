//! Inertia and friction of a free body from its motion and the driving torque (or force).
//!
//! ```text
//! T = J θ'' + f θ' + F_c sgn θ' + C          (C1) with dry friction
//! ```
//!
//! and, where it is significant, G sin θ + H cos θ, the torque of gravity on an unbalanced arm.
//!
//! The equation is averaged over smooth windows ([`torqcomp_dsp::weak`]), which gives derivatives without finite
//! differences, and solved by least squares, with the bias from motion noise removed from the normal equations. For
//! comparison, the classical method of robot identification: zero-phase low-pass, central differences, least squares
//! (M. Gautier, Dynamic identification of robots with power model, ICRA 1997).

mod check;
mod classical;
mod directions;
mod gravity;
mod missing;
mod present;
mod regression;
mod resolution;
mod scatter;
mod turns;
mod windows;
mod wrapped;

use super::{FitQuality, Identification, Motion, NamedEstimates, rms};
use crate::failure::{ErrorCode, Failure};
use crate::print::short;
use directions::Directions;
use gravity::{GRAVITY, angle};
use windows::{FittedRows, WindowRows, plateau};

/// Type of motion, which determines names and units of the constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// Rotation: angles and torques.
    Turning,
    /// Translation: lengths and forces.
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

    /// Unit of the drag over the squared speed.
    fn drag(self) -> &'static str {
        match self {
            Self::Turning => "N m s^2/rad^2",
            Self::Sliding => "N s^2/m^2",
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
pub struct FreeRun<'a> {
    /// Sampling rate in Hz.
    pub rate_hz: f64,
    /// Motion signal.
    pub motion: &'a [f64],
    /// Quantity of the motion signal.
    pub kind: Motion,
    /// Torque or force.
    pub effort: &'a [f64],
    /// Rotation or translation.
    pub body: Body,
}

/// Options for the evaluation of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct RunupOptions {
    /// Whether viscous friction may depend on direction.
    pub by_direction: bool,
    /// Half of the averaging window in seconds; chosen from the data if not given.
    pub half_window_s: Option<f64>,
}

/// Which terms the equation of motion has besides those of every run.
#[derive(Debug, Clone, Copy)]
struct Terms<'a> {
    /// Whether viscous friction depends on direction.
    is_split: bool,
    /// Angle at each sample, if the torque varies with it.
    angle: Option<&'a [f64]>,
}

/// Minimum reported increase of an uncertainty due to autocorrelation.
const COLOURED: f64 = 1.3;
/// Residual relative to the torque above which the motion does not explain it.
const POOR: f64 = 0.3;
/// Minimum number of windows in a record.
const LEAST_WINDOWS: usize = 12;
/// Half of the shortest window tried, in samples.
const SHORTEST_HALF: usize = 8;

/// Half of the shortest window that can be given, in samples.
const LEAST_HALF: usize = 4;

/// Half of a given window, in samples.
fn given_half(seconds: f64, run: &FreeRun) -> Result<usize, Failure> {
    let most = (run.motion.len() - 1) / 2;
    let half = (seconds * run.rate_hz).round();
    match (LEAST_HALF as f64..=most as f64).contains(&half) {
        true => Ok(half as usize),
        false => Err(ErrorCode::InvalidValue.usage(format_args!(
            "--window {seconds}: expected a half-width from {} s, {LEAST_HALF} samples, to {} s, half of the record",
            short(LEAST_HALF as f64 / run.rate_hz),
            short(most as f64 / run.rate_hz)
        ))),
    }
}

/// Evaluates a run.
///
/// # Errors
/// If the record is too short, contains no motion, or the channels differ in length.
pub fn identify(run: &FreeRun, options: &RunupOptions) -> Result<Identification, Failure> {
    check::check(run)?;
    let (motion, wraps) = wrapped::continuous(run)?;
    let run = &FreeRun {
        motion: &motion,
        ..*run
    };
    let few_samples = check::swings(run)?;
    let directions = Directions::of(run)?;
    let plain = Terms {
        is_split: options.by_direction && directions.both(),
        angle: None,
    };
    let angle = angle(run);
    let fitted = fitted(run, &directions, plain, options);
    let (terms, fitted) = gravity::fitted(
        run,
        &directions,
        (plain, options),
        (angle.as_deref(), fitted),
    )?;
    let half = fitted.rows.half;
    let mut result = Identification::new("runup");
    let names = present::names(run, &directions, terms);
    result.add(NamedEstimates::new(&names, &fitted.fit.numbers));
    let left = rms(&fitted.moving(&fitted.fit.residuals));
    result.fit = Some(FitQuality {
        rms: left,
        unit: run.body.effort().to_owned(),
        relative: left / rms(&fitted.moving(&fitted.rows.right)),
    });
    result.method.extend(wraps);
    result.method.extend(gravity::method(run, terms));
    present::method(&mut result, run, &directions, &fitted);
    present::draw(&mut result, run, &fitted);
    present::warnings(
        &mut result,
        run,
        &directions,
        (options, few_samples),
        &fitted,
    );
    let is_both = directions.both();
    // The comparison takes the most memory.
    drop(fitted);
    let moves = directions.into_moves();
    let classical = classical::identify(run, &moves, (is_both, terms), half, &names)?;
    result.comparisons.extend(classical);
    Ok(result)
}

/// The fit with these terms, in the given window or the one found.
fn fitted(
    run: &FreeRun,
    directions: &Directions,
    terms: Terms,
    options: &RunupOptions,
) -> Result<FittedRows, Failure> {
    let half = match options.half_window_s {
        Some(seconds) => given_half(seconds, run)?,
        None => plateau(run, directions, terms),
    };
    WindowRows::of(run, directions, half, terms)?.fit()
}
