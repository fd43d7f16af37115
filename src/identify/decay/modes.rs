//! Sums of decaying sines through one or several stretches of free ringing.
//!
//! ```text
//! x(t) = Σ e^{−σ_k t} (a_k cos ω_k t + b_k sin ω_k t) + c + d t
//! ```
//!
//! Decay rates and frequencies belong to the stand and are common to all stretches; amplitudes, offset
//! and drift belong to each stretch. Uncertainties allow for the colour of the noise ([`super::colour`]).

use std::ops::Range;

use nalgebra::DMatrix;
use torqcomp_dsp::peaks;
use torqcomp_model::Covariance;
use torqcomp_model::fit::{Fit, FitError, Options, Parameter, Residuals, linear, minimize};

use super::colour::{self, NoiseColour};
use crate::identify::Pole;

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
    fn step_s(&self) -> f64 {
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
    colours: Vec<NoiseColour>,
    /// Frequency in Hz of a line that was rejected as too close to a mode.
    pub close_hz: Option<f64>,
}

/// Which modes are searched for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ModeSearch {
    /// Their number, if it is known.
    pub count: Option<usize>,
    /// Maximum number otherwise.
    pub most: usize,
    /// Lowest and highest frequency in Hz.
    pub band_hz: (f64, f64),
}

/// Relative distance in frequency below which two lines are one mode, unless the number of modes is given: a frequency
/// or damping that changes with amplitude or time looks the same.
const CLOSE: f64 = 0.03;

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
fn linear_part(stretch: &Stretch, poles: &[Pole]) -> Result<(Vec<f64>, Vec<f64>), FitError> {
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
    with_colour(fit, &problem)
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
fn with_colour(mut fit: Fit, problem: &SineSum) -> Result<ModesFit, FitError> {
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
    let learnt = colour::learn(&residuals, &groups, &jacobian.select_columns(&free));
    let colours = match learnt {
        Some((colours, covariance)) => {
            fit.covariance = Covariance::of_some(&free, count, covariance);
            fit.std = (0..count).map(|i| fit.covariance.std(i)).collect();
            let each = colours.into_iter().zip(&groups);
            each.flat_map(|(c, group)| vec![c; group.len()]).collect()
        }
        None => vec![NoiseColour::white(fit.rms.powi(2)); stretches.len()],
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

/// Adds modes one by one as long as the criterion falls enough, each starting at the strongest line of the residual.
///
/// # Errors
/// [`FitError`] if there are too few samples. Without a significant mode the fit is empty.
pub(super) fn search(stretches: &[Stretch], wanted: &ModeSearch) -> Result<ModesFit, FitError> {
    let mut best = fit(stretches, &[])?;
    while best.poles.len() < wanted.count.unwrap_or(wanted.most) {
        let Some(pole) = next_pole(stretches, &best, wanted.band_hz) else {
            break;
        };
        let mut starts = best.poles.clone();
        starts.push(pole);
        let next = fit(stretches, &starts)?;
        let pays = gain(&best, &next, stretches) > LEAST_GAIN
            && next.fit.sum_of_squares < 0.98 * best.fit.sum_of_squares
            && physical(&next, stretches);
        if wanted.count.is_none() {
            if !pays {
                break;
            }
            if let Some(frequency_hz) = close(&next.poles) {
                best.close_hz = Some(frequency_hz);
                break;
            }
        }
        best = next;
    }
    Ok(best)
}

/// Minimum gain for one more mode.
const LEAST_GAIN: f64 = 20.0;

/// Gain of one more mode, the last of `after`: the reduction of the sum of squares over the power of the noise at the
/// mode's frequency, less ln n for each parameter (Bayesian information criterion, where that power is known). Noise that
/// is strongest at the frequency of the first mode counts with its mean power: a stand that rings has a mode.
fn gain(before: &ModesFit, after: &ModesFit, stretches: &[Stretch]) -> f64 {
    let Some(pole) = after.poles.last() else {
        return 0.0;
    };
    let squares = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
    let of_stretch = |s: usize| {
        let colour = &after.colours[s];
        let density = colour.density(pole.omega_rad_per_s * stretches[s].step_s());
        let density = match before.poles.is_empty() {
            true => density.min(colour.variance()),
            false => density,
        };
        (squares(&before.residuals[s]) - squares(&after.residuals[s])) / density
    };
    let n = after.fit.residuals.len() as f64;
    let more = (after.fit.values.len() - before.fit.values.len()) as f64;
    (0..stretches.len()).map(of_stretch).sum::<f64>() - more * n.ln()
}

/// Frequency in Hz of a mode that is too close to the last one, if there is one.
fn close(poles: &[Pole]) -> Option<f64> {
    let last = poles.last()?;
    let near = |p: &&Pole| (p.omega_rad_per_s / last.omega_rad_per_s - 1.0).abs() < CLOSE;
    let found = poles[..poles.len() - 1].iter().find(near)?;
    Some(found.frequency_hz())
}

/// Standard uncertainties by which the decay rate of the first mode and of any other one must differ from zero. A stand
/// that rings has a mode, even if the record is too short to say much of its damping.
const DECAYS: [f64; 2] = [1.0, 2.0];

/// Whether every mode decays significantly, swings more than once, and differs from the others.
fn physical(found: &ModesFit, stretches: &[Stretch]) -> bool {
    let length = stretches
        .iter()
        .filter_map(|s| s.times_s.last())
        .fold(0.0_f64, |m, t| m.max(*t));
    let one = |(k, pole): (usize, &Pole)| {
        let rate_std = found.fit.std[2 * k];
        let turns = pole.frequency_hz() * length;
        let least = match k {
            0 => DECAYS[0],
            _ => DECAYS[1],
        };
        let known = rate_std.is_some_and(|std| pole.rate_per_s > least * std);
        let rings = pole.omega_rad_per_s > pole.rate_per_s && turns > 1.5;
        let apart = found.poles[..k].iter().all(|other| {
            let near = (other.omega_rad_per_s - pole.omega_rad_per_s).abs();
            near > 0.2 * (other.rate_per_s + pole.rate_per_s) || near * length > 3.0
        });
        known && rings && apart
    };
    found.poles.iter().enumerate().all(one)
}

/// A start for one more mode.
fn next_pole(stretches: &[Stretch], so_far: &ModesFit, band_hz: (f64, f64)) -> Option<Pole> {
    let loudest = (0..stretches.len()).max_by(|a, b| {
        let power = |s: usize| so_far.residuals[s].iter().map(|r| r * r).sum::<f64>();
        power(*a).total_cmp(&power(*b))
    })?;
    let stretch = &stretches[loudest];
    let left: Vec<f64> = so_far.residuals[loudest].iter().map(|r| -r).collect();
    let length = *stretch.times_s.last()?;
    let rate_hz = (stretch.times_s.len() - 1) as f64 / length;
    let uniform = on_grid(&stretch.times_s, &left, rate_hz);
    let peak = peaks::strongest(
        &uniform,
        rate_hz,
        band_hz.0.max(1.5 / length),
        band_hz.1.min(0.49 * rate_hz),
    )?;
    let omega = std::f64::consts::TAU * peak.frequency_hz;
    let rest = Stretch::new(&stretch.times_s, left);
    let wide = std::f64::consts::PI * peak.width_hz;
    let rates = [0.05, 0.15, 0.4, 1.0, 2.0].map(|f| f * wide);
    let shifts = [-0.5, 0.0, 0.5].map(|f| f * wide);
    let mut best: Option<(f64, Pole)> = None;
    for (rate, shift) in rates
        .iter()
        .flat_map(|r| shifts.iter().map(move |s| (*r, *s)))
    {
        let pole = Pole {
            rate_per_s: rate,
            omega_rad_per_s: (omega + shift).max(0.1 * omega),
        };
        let Ok((_, residuals)) = linear_part(&rest, &[pole]) else {
            continue;
        };
        let sum: f64 = residuals.iter().map(|r| r * r).sum();
        if best.is_none_or(|(least, _)| sum < least) {
            best = Some((sum, pole));
        }
    }
    best.map(|(_, pole)| pole)
}

/// Values interpolated linearly at equal steps; good enough for a start.
fn on_grid(times_s: &[f64], values: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(values.len());
    let mut k = 0;
    for i in 0..values.len() {
        let t = (i as f64 / rate_hz).min(times_s[times_s.len() - 1]);
        while k + 2 < times_s.len() && times_s[k + 1] < t {
            k += 1;
        }
        let (t0, t1) = (times_s[k], times_s[k + 1]);
        let part = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        out.push(values[k] + part * (values[k + 1] - values[k]));
    }
    out
}
