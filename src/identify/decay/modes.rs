//! Sums of decaying sines through one or several stretches of free ringing.
//!
//! ```text
//! x(t) = Σ e^{−σ_k t} (a_k cos ω_k t + b_k sin ω_k t) + c + d t
//! ```
//!
//! Decay rates and frequencies belong to the stand and are common to all stretches; amplitudes, offset
//! and drift belong to each stretch. Uncertainties allow for the colour of the noise ([`crate::noise_colour`]).

use std::ops::Range;

use nalgebra::DMatrix;
use torqcomp_model::Covariance;
use torqcomp_model::fit::{Fit, FitError, Options, Parameter, Residuals, linear, minimize};

use crate::identify::Pole;
use crate::noise_colour::{self, NoiseColour};

/// A stretch of free ringing.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Start on the time axis of the recording, in seconds.
    pub start_s: f64,
    /// Times from the start, in seconds.
    pub times_s: Vec<f64>,
    /// Samples.
    pub values: Vec<f64>,
}

impl Stretch {
    /// Samples at these times, of which there is at least one.
    pub(super) fn new(times_s: &[f64], values: Vec<f64>) -> Self {
        let start_s = times_s[0];
        Self {
            start_s,
            times_s: times_s.iter().map(|t| t - start_s).collect(),
            values,
        }
    }

    /// Mean time between samples in s.
    pub(super) fn step_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or(1.0) / (self.times_s.len() - 1) as f64
    }
}

/// A fit of a number of modes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ModesFit {
    /// The modes, the strongest first.
    pub poles: Vec<Pole>,
    /// The fit; parameters are σ and ω of each mode, then for each stretch a and b of each mode, c, d.
    pub fit: Fit,
    /// Residuals of each stretch, model less data.
    pub residuals: Vec<Vec<f64>>,
    /// Colour of the noise in each stretch.
    pub colours: Vec<NoiseColour>,
    /// Frequency in Hz of a line that was rejected as too close to a mode.
    pub close_hz: Option<f64>,
}

/// Linear parameters of a stretch besides amplitudes: offset and drift.
const TREND: usize = 2;

/// The problem for the nonlinear fit.
struct SineSum<'a> {
    stretches: &'a [Stretch],
    modes: usize,
}

impl SineSum<'_> {
    fn amplitudes_at(&self, stretch: usize) -> usize {
        2 * self.modes + stretch * (2 * self.modes + TREND)
    }

    fn value(&self, p: &[f64], stretch: usize, t: f64) -> f64 {
        let at = self.amplitudes_at(stretch);
        let mut x = p[at + 2 * self.modes] + p[at + 2 * self.modes + 1] * t;
        for k in 0..self.modes {
            let (sin, cos) = (p[2 * k + 1] * t).sin_cos();
            x += (-p[2 * k] * t).exp() * (p[at + 2 * k] * cos + p[at + 2 * k + 1] * sin);
        }
        x
    }
}

impl Residuals for SineSum<'_> {
    fn residuals(&self, p: &[f64], out: &mut Vec<f64>) -> Result<(), FitError> {
        for (s, stretch) in self.stretches.iter().enumerate() {
            let pairs = stretch.times_s.iter().zip(&stretch.values);
            out.extend(pairs.map(|(t, y)| self.value(p, s, *t) - y));
        }
        Ok(())
    }

    fn has_jacobian(&self) -> bool {
        true
    }

    fn jacobian(&self, p: &[f64], out: &mut DMatrix<f64>) -> Result<(), FitError> {
        let mut row = 0;
        for (s, stretch) in self.stretches.iter().enumerate() {
            let at = self.amplitudes_at(s);
            for t in &stretch.times_s {
                for k in 0..self.modes {
                    let (sin, cos) = (p[2 * k + 1] * t).sin_cos();
                    let fall = (-p[2 * k] * t).exp();
                    let (a, b) = (p[at + 2 * k], p[at + 2 * k + 1]);
                    out[(row, 2 * k)] = -t * fall * (a * cos + b * sin);
                    out[(row, 2 * k + 1)] = t * fall * (b * cos - a * sin);
                    out[(row, at + 2 * k)] = fall * cos;
                    out[(row, at + 2 * k + 1)] = fall * sin;
                }
                out[(row, at + 2 * self.modes)] = 1.0;
                out[(row, at + 2 * self.modes + 1)] = *t;
                row += 1;
            }
        }
        Ok(())
    }
}

/// Amplitudes, offset and drift of a stretch for given poles, and the residuals.
pub(super) fn linear_part(
    stretch: &Stretch,
    poles: &[Pole],
) -> Result<(Vec<f64>, Vec<f64>), FitError> {
    let columns = 2 * poles.len() + TREND;
    let length = stretch
        .times_s
        .last()
        .copied()
        .unwrap_or(1.0)
        .max(f64::MIN_POSITIVE);
    let mut design = DMatrix::zeros(stretch.times_s.len(), columns);
    for (row, t) in stretch.times_s.iter().enumerate() {
        for (k, pole) in poles.iter().enumerate() {
            let (sin, cos) = (pole.omega_rad_per_s * t).sin_cos();
            let fall = (-pole.rate_per_s * t).exp();
            design[(row, 2 * k)] = fall * cos;
            design[(row, 2 * k + 1)] = fall * sin;
        }
        design[(row, columns - 2)] = 1.0;
        design[(row, columns - 1)] = t / length;
    }
    let fit = linear::solve(&design, &stretch.values, None, false)?;
    let mut values = fit.values;
    values[columns - 1] /= length;
    Ok((values, fit.residuals))
}

/// Fits the modes from given starts.
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn fit(stretches: &[Stretch], starts: &[Pole]) -> Result<ModesFit, FitError> {
    let problem = SineSum {
        stretches,
        modes: starts.len(),
    };
    let mut parameters = Vec::new();
    let fastest = fastest_rad_per_s(stretches);
    for (k, pole) in starts.iter().enumerate() {
        let (rate, omega) = (pole.rate_per_s, pole.omega_rad_per_s);
        // A free decay does not grow.
        parameters.push(Parameter::new(format!("rate {}", k + 1), rate).at_least(0.0));
        let omega = Parameter::new(format!("omega {}", k + 1), omega.min(0.999 * fastest));
        parameters.push(omega.at_least(0.0).at_most(fastest));
    }
    for (s, stretch) in stretches.iter().enumerate() {
        let (values, _) = linear_part(stretch, starts)?;
        let size = values
            .iter()
            .fold(0.0_f64, |m, v| m.max(v.abs()))
            .max(f64::MIN_POSITIVE);
        for (i, value) in values.into_iter().enumerate() {
            parameters.push(Parameter::new(format!("amplitude {s}.{i}"), value).scaled(size));
        }
    }
    let fit = minimize(
        &problem,
        &parameters,
        &Options {
            tolerance: 1e-11,
            ..Options::default()
        },
    )?;
    with_colour(fit, &problem, 0)
}

/// The same fit with standard uncertainties of frequencies and damping that also hold where the noise has the colour of the
/// modes. What is no noise, but a stand that is not linear, counts as such noise, so that nothing is judged by them.
///
/// # Errors
/// [`FitError`] as of a fit.
pub(super) fn with_honest_std(
    found: &ModesFit,
    stretches: &[Stretch],
) -> Result<ModesFit, FitError> {
    let modes = found.poles.len();
    let problem = SineSum { stretches, modes };
    with_colour(found.fit.clone(), &problem, 2 * modes)
}

/// Half the usual sampling rate, as an angular frequency.
fn fastest_rad_per_s(stretches: &[Stretch]) -> f64 {
    stretches
        .iter()
        .map(|s| 1.0 / s.step_s())
        .fold(f64::INFINITY, f64::min)
        * std::f64::consts::PI
}

/// The fit with its covariance for the colour of the noise.
fn with_colour(mut fit: Fit, problem: &SineSum, wanted: usize) -> Result<ModesFit, FitError> {
    let stretches = problem.stretches;
    let mut residuals = Vec::new();
    let mut from = 0;
    for stretch in stretches {
        residuals.push(fit.residuals[from..from + stretch.values.len()].to_vec());
        from += stretch.values.len();
    }
    let count = fit.values.len();
    let free: Vec<usize> = (0..count).filter(|i| fit.std[*i].is_some()).collect();
    let mut jacobian = DMatrix::zeros(from, count);
    problem.jacobian(&fit.values, &mut jacobian)?;
    let groups = of_one_rate(stretches);
    let wanted = free.iter().filter(|i| **i < wanted).count();
    let learnt = noise_colour::learn(
        &residuals,
        &groups,
        &jacobian.select_columns(&free),
        wanted,
        None,
    );
    let colours = match learnt {
        Some((colours, covariance)) => {
            fit.covariance = Covariance::of_some(&free, count, covariance);
            fit.std = (0..count).map(|i| fit.covariance.std(i)).collect();
            let each = colours.into_iter().zip(&groups);
            each.flat_map(|(c, group)| vec![c; group.len()]).collect()
        }
        None => vec![NoiseColour::white(fit.rms.powi(2), from); stretches.len()],
    };
    Ok(ModesFit {
        poles: Pole::all(&fit.values[..2 * problem.modes]),
        fit,
        residuals,
        colours,
        close_hz: None,
    })
}

/// Relative difference of sampling intervals that count as one.
const SAME_STEP: f64 = 1e-3;

/// Neighbouring stretches with the same sampling rate.
fn of_one_rate(stretches: &[Stretch]) -> Vec<Range<usize>> {
    let is_same = |a: &Stretch, b: &Stretch| (a.step_s() / b.step_s() - 1.0).abs() < SAME_STEP;
    let mut from = 0;
    let chunks = stretches.chunk_by(is_same);
    chunks
        .map(|chunk| {
            from += chunk.len();
            from - chunk.len()..from
        })
        .collect()
}

impl ModesFit {
    /// Power of the noise at a frequency over that of white noise with its variance, in a stretch.
    pub(super) fn relative_density(&self, stretches: &[Stretch], s: usize, pole: Pole) -> f64 {
        self.colours[s].relative_density(pole.omega_rad_per_s * stretches[s].step_s())
    }

    /// Initial amplitude of a mode in a stretch.
    pub fn amplitude(&self, mode: usize, stretch: usize) -> f64 {
        let modes = self.poles.len();
        let at = 2 * modes + stretch * (2 * modes + TREND) + 2 * mode;
        self.fit.values[at].hypot(self.fit.values[at + 1])
    }

    /// What a mode contributes to a stretch.
    pub fn part(&self, stretches: &[Stretch], mode: usize, stretch: usize) -> Vec<f64> {
        let modes = self.poles.len();
        let at = 2 * modes + stretch * (2 * modes + TREND) + 2 * mode;
        let (a, b, pole) = (
            self.fit.values[at],
            self.fit.values[at + 1],
            self.poles[mode],
        );
        let times = stretches[stretch].times_s.iter();
        times
            .map(|t| {
                let (sin, cos) = (pole.omega_rad_per_s * t).sin_cos();
                (-pole.rate_per_s * t).exp() * (a * cos + b * sin)
            })
            .collect()
    }

    /// Offset and drift per second of a stretch.
    pub fn trend(&self, stretch: usize) -> (f64, f64) {
        let modes = self.poles.len();
        let at = 2 * modes + stretch * (2 * modes + TREND) + 2 * modes;
        (self.fit.values[at], self.fit.values[at + 1])
    }

    /// The fitted curve of a stretch.
    pub fn curve(&self, stretches: &[Stretch], stretch: usize) -> Vec<f64> {
        let data = &stretches[stretch].values;
        data.iter()
            .zip(&self.residuals[stretch])
            .map(|(y, r)| y + r)
            .collect()
    }

    /// Modes by falling energy, amplitude²/σ, over all stretches.
    pub fn by_strength(&self, stretches: usize) -> Vec<usize> {
        let energy = |k: usize| -> f64 {
            (0..stretches)
                .map(|s| self.amplitude(k, s).powi(2))
                .sum::<f64>()
                / self.poles[k].rate_per_s.max(1e-12)
        };
        let mut order: Vec<usize> = (0..self.poles.len()).collect();
        order.sort_by(|a, b| energy(*b).total_cmp(&energy(*a)));
        order
    }
}
