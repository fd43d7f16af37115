//! Free decay of one mode with viscous damping and dry friction, half cycle by half cycle.
//!
//! With the displacement x about the zero of the spring, the decay rate σ, the damped frequency ω, and the friction F as
//! the displacement at which the spring balances it (J. P. Den Hartog, Mechanical Vibrations, 4th ed., 1956, 8.2):
//!
//! ```text
//! x'' + 2σ x' + (σ² + ω²) (x + F sign x') = 0
//! ```
//!
//! Between two turning points the motion is a decaying sine about −F sign x'. A turning point x is followed half a
//! period later by `c − (x − c) e^{−πσ/ω}`, c = F sign x; at one within ±F the stand sticks. The frequency does not depend on
//! the amplitude, which falls on average as `A' = −σA − 2Fω/π` (Nayfeh and Mook, as for [`super::laws`]).

use std::f64::consts::PI;

use torqcomp_model::fit::{self, Fit, FitError, Options, Parameter, minimize};

use super::modes::{self, ModesFit, Stretch, TREND};
use crate::identify::Pole;

/// Parameters of a segment: initial displacement, quadrature, offset and drift.
pub(super) const OF_STRETCH: usize = 2 + TREND;

/// Times up to which successive fits reach, in time constants of a decaying sine fitted to the whole decay; the last one is
/// of all samples. In the rest after the decay, every number of half cycles is a local minimum, so a fit of all samples must
/// start close to the result.
const STAGES: [f64; 6] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0];

/// Fall of the amplitude by dry friction at the start of the first fit, relative to that of the sine, and viscous part of its
/// decay rate: about a third and two thirds of the loss.
const FIRST_SHARES: [f64; 2] = [0.2, 0.6];

/// Least decay rate of the sine, relative to its frequency, for scales.
const LEAST_RATE: f64 = 1e-6;

/// The motion of a mode.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlidingMotion {
    pole: Pole,
    /// F, in the unit of the samples.
    friction: f64,
    /// Initial displacement a and, with the initial speed `ωb − σa`, quadrature b.
    start: [f64; 2],
}

/// The motion between two turning points: `c + e^{−σu} (p cos ωu + q sin ωu)`, u from its start.
#[derive(Debug, Clone, Copy)]
struct HalfCycle {
    from_s: f64,
    until_s: f64,
    centre: f64,
    sine: [f64; 2],
}

impl SlidingMotion {
    /// The motion of a segment by the parameters σ, ω, those of each segment, and F.
    pub fn of(parameters: &[f64], stretch: usize) -> Self {
        let own = &parameters[2 + OF_STRETCH * stretch..];
        Self {
            pole: Pole {
                rate_per_s: parameters[0],
                omega_rad_per_s: parameters[1],
            },
            friction: parameters[parameters.len() - 1],
            start: [own[0], own[1]],
        }
    }

    /// Calls a function with the index of each of ascending times and the displacement there.
    fn at(&self, times_s: &[f64], mut each: impl FnMut(usize, f64)) {
        let mut half = Some(self.first());
        let mut rest = 0.0;
        for (i, time_s) in times_s.iter().enumerate() {
            while let Some(ended) = half.filter(|half| *time_s >= half.until_s) {
                rest = self.within(&ended, ended.until_s);
                half = self.after(ended.until_s, rest);
            }
            each(i, half.map_or(rest, |half| self.within(&half, *time_s)));
        }
    }

    /// Time at which the stand sticks, if before `end_s`.
    pub fn stop_s(&self, end_s: f64) -> Option<f64> {
        let mut half = self.first();
        while half.until_s < end_s {
            let place = self.within(&half, half.until_s);
            match self.after(half.until_s, place) {
                Some(next) => half = next,
                None => return Some(half.until_s),
            }
        }
        None
    }

    /// Displacement in a half cycle.
    fn within(&self, half: &HalfCycle, time_s: f64) -> f64 {
        let u = time_s - half.from_s;
        let (sin, cos) = (self.pole.omega_rad_per_s * u).sin_cos();
        let [p, q] = half.sine;
        half.centre + (-self.pole.rate_per_s * u).exp() * (p * cos + q * sin)
    }

    /// The motion up to the first turning point.
    fn first(&self) -> HalfCycle {
        let (sigma, omega) = (self.pole.rate_per_s, self.pole.omega_rad_per_s);
        let [a, b] = self.start;
        let speed = omega * b - sigma * a;
        let centre = -self
            .friction
            .copysign(if speed == 0.0 { -a } else { speed });
        let p = a - centre;
        let q = (speed + sigma * p) / omega;
        // The speed is e^{−σu} [(ωq − σp) cos ωu − (ωp + σq) sin ωu].
        let turn = (omega * q - sigma * p).atan2(omega * p + sigma * q);
        HalfCycle {
            from_s: 0.0,
            until_s: turn.rem_euclid(PI) / omega,
            centre,
            sine: [p, q],
        }
    }

    /// The motion after a turning point; `None` if the stand sticks there.
    fn after(&self, turn_s: f64, place: f64) -> Option<HalfCycle> {
        let (sigma, omega) = (self.pole.rate_per_s, self.pole.omega_rad_per_s);
        let centre = self.friction.copysign(place);
        let p = place - centre;
        (place.abs() > self.friction).then(|| HalfCycle {
            from_s: turn_s,
            until_s: turn_s + PI / omega,
            centre,
            sine: [p, p * sigma / omega],
        })
    }
}

/// Fits the motion to segments, from a decaying sine fitted to them: its pole, and a, b, offset and drift of each segment.
/// Parameters as for [`SlidingMotion::of`].
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn fit(
    stretches: &[Stretch],
    (sine, own): (Pole, &[f64]),
    is_viscous: bool,
) -> Result<Fit, FitError> {
    let rate = sine.rate_per_s.max(LEAST_RATE * sine.omega_rad_per_s);
    let [dry, viscous] = FIRST_SHARES;
    let sizes = own.chunks_exact(OF_STRETCH).map(|own| own[0].hypot(own[1]));
    let fall = dry * rate * sizes.fold(f64::MIN_POSITIVE, f64::max);
    let mut values = vec![if is_viscous { viscous * rate } else { 0.0 }];
    values.push(sine.omega_rad_per_s);
    values.extend(own);
    // The drift of a sine fitted to a decay that ends is no guess for its own.
    let drifts = values[2..].chunks_exact_mut(OF_STRETCH);
    drifts.for_each(|own| own[OF_STRETCH - 1] = 0.0);
    values.push(fall * PI / (2.0 * sine.omega_rad_per_s));
    for stage in STAGES {
        let early: Vec<Stretch> = stretches.iter().map(|s| s.until(stage / rate)).collect();
        values = refit(&early, &values, (is_viscous, false))?.values;
    }
    refit(stretches, &values, (is_viscous, true))
}

/// Residuals, model minus data.
fn residuals(stretches: &[Stretch]) -> impl Fn(&[f64], &mut Vec<f64>) -> Result<(), FitError> {
    move |p, out| {
        for (s, stretch) in stretches.iter().enumerate() {
            let [offset, drift] = [2, 3].map(|i| p[2 + OF_STRETCH * s + i]);
            let from = out.len();
            let samples = stretch.times_s.iter().zip(&stretch.values);
            out.extend(samples.map(|(t, y)| offset + drift * t - y));
            let out = &mut out[from..];
            SlidingMotion::of(p, s).at(&stretch.times_s, |i, x| out[i] += x);
        }
        Ok(())
    }
}

/// Fits the motion from given parameters, with or without the drift of the segments.
fn refit(
    stretches: &[Stretch],
    start: &[f64],
    (is_viscous, drifts): (bool, bool),
) -> Result<Fit, FitError> {
    let options = Options {
        tolerance: 1e-9,
        most_evaluations: 3000,
        ..Options::default()
    };
    let parameters = parameters(stretches, start, (is_viscous, drifts));
    minimize(&residuals(stretches), &parameters, &options)
}

/// The parameters with their start values, bounds and scales.
fn parameters(
    stretches: &[Stretch],
    start: &[f64],
    (is_viscous, drifts): (bool, bool),
) -> Vec<Parameter> {
    let free = |parameter: Parameter, is_free: bool| match is_free {
        true => parameter,
        false => parameter.fixed(),
    };
    let omega = start[1];
    let rate = start[0].max(LEAST_RATE * omega);
    let rate = Parameter::new("viscous", start[0])
        .at_least(0.0)
        .scaled(rate);
    let mut all = vec![free(rate, is_viscous)];
    // A fit that loses the line must not reach zero.
    all.push(
        Parameter::new("omega", omega)
            .at_least(0.5 * omega)
            .at_most(2.0 * omega),
    );
    let mut largest = f64::MIN_POSITIVE;
    for (own, stretch) in start[2..].chunks_exact(OF_STRETCH).zip(stretches) {
        let size = own[0].hypot(own[1]).max(f64::MIN_POSITIVE);
        largest = largest.max(size);
        let length_s = stretch.times_s.last().copied().filter(|t| *t > 0.0);
        let names = ["displacement", "quadrature", "offset"]
            .into_iter()
            .zip(own);
        all.extend(names.map(|(name, value)| Parameter::new(name, *value).scaled(size)));
        let drift = Parameter::new("drift", own[OF_STRETCH - 1]);
        all.push(free(drift.scaled(size / length_s.unwrap_or(1.0)), drifts));
    }
    let friction = start[start.len() - 1];
    let scale = friction.max(LEAST_RATE * largest);
    all.push(
        Parameter::new("friction", friction)
            .at_least(0.0)
            .scaled(scale),
    );
    all
}

/// The fit continued on other segments of the same decays, as a fit of one mode with uncertainties that allow for coloured
/// noise.
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn continued(stretches: &[Stretch], start: &[f64]) -> Result<ModesFit, FitError> {
    let fit = refit(stretches, start, (true, true))?;
    let parameters = parameters(stretches, &fit.values, (true, true));
    let jacobian = fit::derivatives(&residuals(stretches), &parameters, &fit.values)?;
    let white = fit.clone();
    let mut found = modes::with_colour(fit, (stretches, 1), (&jacobian, 2));
    // The colour of few samples is uncertain: noise does not determine the constants better than white noise would.
    let is_too_small = |i: usize| found.fit.std[i] < white.std[i];
    if (0..2).any(is_too_small) {
        found.fit = white;
    }
    Ok(ModesFit {
        has_friction: true,
        ..found
    })
}
