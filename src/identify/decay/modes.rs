//! Sums of decaying sines fitted to one or several segments of free decay.
//!
//! ```text
//! x(t) = Σ e^{−σ_k t} (a_k cos ω_k t + b_k sin ω_k t) + c + d t
//! ```
//!
//! Decay rates and frequencies belong to the stand and are common to all segments; amplitudes, offset and drift
//! belong to each segment. Uncertainties allow for coloured noise ([`crate::noise_colour`]).

use std::ops::Range;
use torqcomp_dsp::sort_by_number;

use nalgebra::DMatrix;
use torqcomp_dsp::peaks::{self, Peak};
use torqcomp_dsp::undersample::folded;
use torqcomp_model::Covariance;
use torqcomp_model::fit::{Fit, FitError, Options, Parameter, Residuals, linear, minimize};

use super::turns::turns;
use crate::identify::Pole;
use crate::noise_colour::{self, NoiseColour};

/// A segment of a free decay.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Start on the time axis of the recording, in seconds.
    pub start_s: f64,
    /// Times from the start, in seconds.
    pub times_s: Vec<f64>,
    /// Samples.
    pub values: Vec<f64>,
    /// Frequency bands in Hz of an undersampled segment; empty if all frequencies below its Nyquist frequency are
    /// allowed.
    pub bands_hz: Vec<Range<f64>>,
}

impl Stretch {
    /// A segment from its times, at least one, and samples.
    pub(super) fn new(times_s: &[f64], values: Vec<f64>) -> Self {
        let start_s = times_s[0];
        Self {
            start_s,
            times_s: times_s.iter().map(|t| t - start_s).collect(),
            values,
            bands_hz: Vec::new(),
        }
    }

    /// The segment up to a time from its start.
    pub(super) fn until(&self, time_s: f64) -> Self {
        let start_s = self.start_s;
        let count = self.times_s.partition_point(|t| *t <= time_s);
        Self {
            start_s,
            ..self.part(0..count.max(1))
        }
    }

    /// Part of the segment.
    pub(super) fn part(&self, range: Range<usize>) -> Self {
        Self {
            bands_hz: self.bands_hz.clone(),
            ..Self::new(&self.times_s[range.clone()], self.values[range].to_vec())
        }
    }

    /// The segment without its first samples.
    pub(super) fn later(&self, first: usize) -> Self {
        let part = self.part(first..self.values.len());
        Self {
            start_s: self.start_s + self.times_s[first],
            ..part
        }
    }

    /// Time of the last sample.
    pub(super) fn end_s(&self) -> f64 {
        self.start_s + self.times_s.last().copied().unwrap_or(0.0)
    }

    /// Samples per second.
    pub(super) fn rate_hz(&self) -> f64 {
        (self.times_s.len() - 1) as f64 / self.times_s.last().copied().unwrap_or(1.0)
    }

    /// The strongest line of samples at its rate between two frequencies; with several bands, the most prominent
    /// one.
    pub(super) fn strongest(&self, samples: &[f64], within_hz: Range<f64>) -> Option<Peak> {
        let rate_hz = self.rate_hz();
        if self.bands_hz.is_empty() {
            let highest = within_hz.end.min(HIGHEST * rate_hz);
            return peaks::strongest(samples, rate_hz, within_hz.start, highest);
        }
        let of_band = |band: &Range<f64>| {
            let [start, end] = [band.start.max(within_hz.start), band.end.min(within_hz.end)];
            let (image, back) = folded(&(start / rate_hz..end / rate_hz));
            let [low, high] = [image.start, image.end].map(|place| place * rate_hz);
            let peak = peaks::strongest(samples, rate_hz, low, high).filter(|_| start < end)?;
            let frequency_hz = rate_hz * back(peak.frequency_hz / rate_hz);
            Some(Peak {
                frequency_hz,
                ..peak
            })
        };
        let peaks = self.bands_hz.iter().filter_map(of_band);
        peaks.max_by(|a, b| a.prominence.total_cmp(&b.prominence))
    }

    /// Lowest and highest angular frequency that the samples distinguish from this one.
    fn limits_rad_per_s(&self, omega: f64) -> (f64, f64) {
        let tau = std::f64::consts::TAU;
        let distance = |band: &&Range<f64>| {
            let hz = omega / tau;
            (band.start - hz).max(hz - band.end)
        };
        let nearest = self
            .bands_hz
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        match nearest {
            Some(band) => (tau * band.start, tau * band.end),
            None => (0.0, 0.5 * tau * self.rate_hz()),
        }
    }

    /// Mean time between samples in s.
    pub(super) fn step_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or(1.0) / (self.times_s.len() - 1) as f64
    }
}

/// Highest frequency of a line, relative to the sampling rate.
const HIGHEST: f64 = 0.49;

/// A fit of a number of modes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ModesFit {
    /// The modes, the strongest first.
    pub poles: Vec<Pole>,
    /// The fit; its parameters are σ and ω of each mode, then for each segment a and b of each mode,
    /// c, d.
    pub fit: Fit,
    /// Residuals of each segment, model minus data.
    pub residuals: Vec<Vec<f64>>,
    /// Colour of the noise in each segment.
    pub colours: Vec<NoiseColour>,
    /// Frequency in Hz of a line that was rejected as too close to a mode.
    pub close_hz: Option<f64>,
    /// Whether the last parameter of the fit is the dry friction of its only mode ([`super::friction`]).
    pub has_friction: bool,
}

/// Number of linear parameters of a segment other than amplitudes: offset and drift.
pub(super) const TREND: usize = 2;

/// The nonlinear fit problem.
struct SineSum<'a> {
    stretches: &'a [Stretch],
    modes: usize,
}

impl SineSum<'_> {
    fn amplitudes_at(&self, stretch: usize) -> usize {
        2 * self.modes + stretch * (2 * self.modes + TREND)
    }

    /// All derivatives at these parameters.
    fn derivatives(&self, p: &[f64]) -> Result<DMatrix<f64>, FitError> {
        let rows = self.stretches.iter().map(|s| s.values.len()).sum();
        let mut all = DMatrix::zeros(rows, p.len());
        self.jacobian(p, &mut all).map(|()| all)
    }
}

impl Residuals for SineSum<'_> {
    fn residuals(&self, p: &[f64], out: &mut Vec<f64>) -> Result<(), FitError> {
        for (s, stretch) in self.stretches.iter().enumerate() {
            let at = self.amplitudes_at(s);
            let [offset, drift] = [0, 1].map(|i| p[at + 2 * self.modes + i]);
            let from = out.len();
            out.extend(stretch.times_s.iter().map(|t| offset + drift * t));
            for (k, pole) in Pole::all(&p[..2 * self.modes]).into_iter().enumerate() {
                let (a, b) = (p[at + 2 * k], p[at + 2 * k + 1]);
                let out = &mut out[from..];
                turns(&stretch.times_s, pole, |i, turn| {
                    out[i] += a * turn.re + b * turn.im
                });
            }
            let pairs = out[from..].iter_mut().zip(&stretch.values);
            pairs.for_each(|(x, y)| *x -= y);
        }
        Ok(())
    }

    fn has_jacobian(&self) -> bool {
        true
    }

    fn jacobian(&self, p: &[f64], out: &mut DMatrix<f64>) -> Result<(), FitError> {
        let rows = out.nrows();
        let out = out.as_mut_slice();
        let mut from = 0;
        for (s, stretch) in self.stretches.iter().enumerate() {
            let (at, times) = (self.amplitudes_at(s), &stretch.times_s);
            for (k, pole) in Pole::all(&p[..2 * self.modes]).into_iter().enumerate() {
                let (a, b) = (p[at + 2 * k], p[at + 2 * k + 1]);
                let columns = [2 * k, 2 * k + 1, at + 2 * k, at + 2 * k + 1];
                let [by_rate, by_omega, by_a, by_b] = columns.map(|column| column * rows + from);
                turns(times, pole, |i, turn| {
                    let (cos, sin) = (turn.re, turn.im);
                    out[by_rate + i] = -times[i] * (a * cos + b * sin);
                    out[by_omega + i] = times[i] * (b * cos - a * sin);
                    out[by_a + i] = cos;
                    out[by_b + i] = sin;
                });
            }
            let [by_offset, by_drift] = [0, 1].map(|i| (at + 2 * self.modes + i) * rows + from);
            out[by_offset..][..times.len()].fill(1.0);
            out[by_drift..][..times.len()].copy_from_slice(times);
            from += times.len();
        }
        Ok(())
    }
}

/// Amplitudes, offset and drift of a segment for given poles, and the residuals.
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
    let rows = stretch.times_s.len();
    let mut design = DMatrix::zeros(rows, columns);
    for (k, pole) in poles.iter().enumerate() {
        let design = &mut design.as_mut_slice()[2 * k * rows..][..2 * rows];
        turns(&stretch.times_s, *pole, |i, turn| {
            design[i] = turn.re;
            design[rows + i] = turn.im;
        });
    }
    design.column_mut(columns - 2).fill(1.0);
    for (slot, t) in design
        .column_mut(columns - 1)
        .iter_mut()
        .zip(&stretch.times_s)
    {
        *slot = t / length;
    }
    let fit = linear::solve(&design, &stretch.values, None, false)?;
    let mut values = fit.values;
    values[columns - 1] /= length;
    Ok((values, fit.residuals))
}

/// Fits the modes from given start values.
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn fit(stretches: &[Stretch], starts: &[Pole]) -> Result<ModesFit, FitError> {
    let problem = SineSum {
        stretches,
        modes: starts.len(),
    };
    let mut parameters = Vec::new();
    for (k, pole) in starts.iter().enumerate() {
        let (rate, omega) = (pole.rate_per_s, pole.omega_rad_per_s);
        // A free decay does not grow.
        parameters.push(Parameter::new(format!("rate {}", k + 1), rate).at_least(0.0));
        let (slowest, fastest) = limits_rad_per_s(stretches, omega);
        let start = omega.clamp(slowest, 0.999 * fastest);
        let omega = Parameter::new(format!("omega {}", k + 1), start);
        parameters.push(omega.at_least(slowest).at_most(fastest));
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
    let jacobian = problem.derivatives(&fit.values)?;
    Ok(with_colour(fit, (stretches, starts.len()), (&jacobian, 0)))
}

/// The same fit with standard uncertainties of frequencies and damping that remain valid where the noise spectrum peaks
/// at the modes. Nonlinearity of the stand also counts as such noise, so these uncertainties are not used for
/// decisions.
///
/// # Errors
/// [`FitError`] as for a fit.
pub(super) fn with_honest_std(
    found: &ModesFit,
    stretches: &[Stretch],
) -> Result<ModesFit, FitError> {
    let modes = found.poles.len();
    if found.has_friction {
        return Ok(found.clone());
    }
    let problem = SineSum { stretches, modes };
    let jacobian = problem.derivatives(&found.fit.values)?;
    let wanted = (&jacobian, 2 * modes);
    Ok(with_colour(found.fit.clone(), (stretches, modes), wanted))
}

/// Lowest and highest angular frequency that all segments distinguish from this one.
fn limits_rad_per_s(stretches: &[Stretch], omega: f64) -> (f64, f64) {
    let each = stretches.iter().map(|s| s.limits_rad_per_s(omega));
    each.fold((0.0, f64::INFINITY), |all, one| {
        (all.0.max(one.0), all.1.min(one.1))
    })
}

/// A fit of modes with its covariance for coloured noise, from the derivatives of all parameters; see
/// [`noise_colour::learn`] for `wanted`.
pub(super) fn with_colour(
    mut fit: Fit,
    (stretches, modes): (&[Stretch], usize),
    (jacobian, wanted): (&DMatrix<f64>, usize),
) -> ModesFit {
    let mut residuals = Vec::new();
    let mut from = 0;
    for stretch in stretches {
        residuals.push(fit.residuals[from..from + stretch.values.len()].to_vec());
        from += stretch.values.len();
    }
    let count = fit.values.len();
    let free: Vec<usize> = (0..count).filter(|i| fit.std[*i].is_some()).collect();
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
    ModesFit {
        poles: Pole::all(&fit.values[..2 * modes]),
        fit,
        residuals,
        colours,
        close_hz: None,
        has_friction: false,
    }
}

/// Relative difference below which sampling intervals are equal.
const SAME_STEP: f64 = 1e-3;

/// Adjacent segments with the same sampling rate.
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
    /// Noise power at a mode in a segment, relative to white noise of the same variance.
    pub(super) fn relative_density(&self, stretches: &[Stretch], s: usize, pole: Pole) -> f64 {
        self.colours[s].relative_density(pole.omega_rad_per_s * stretches[s].step_s())
    }

    /// Initial amplitude of a mode in a segment.
    pub fn amplitude(&self, mode: usize, stretch: usize) -> f64 {
        let modes = self.poles.len();
        let at = 2 * modes + stretch * (2 * modes + TREND) + 2 * mode;
        self.fit.values[at].hypot(self.fit.values[at + 1])
    }

    /// Contribution of a mode to a segment.
    pub fn part(&self, stretches: &[Stretch], mode: usize, stretch: usize) -> Vec<f64> {
        let modes = self.poles.len();
        let at = 2 * modes + stretch * (2 * modes + TREND) + 2 * mode;
        let (a, b, pole) = (
            self.fit.values[at],
            self.fit.values[at + 1],
            self.poles[mode],
        );
        let times = &stretches[stretch].times_s;
        let mut part = Vec::with_capacity(times.len());
        turns(times, pole, |_, turn| part.push(a * turn.re + b * turn.im));
        part
    }

    /// The fitted curve of a stretch at a time from its start, which may lie before it.
    pub fn value_at(&self, stretch: usize, time_s: f64) -> f64 {
        let modes = self.poles.len();
        let at = 2 * modes + stretch * (2 * modes + TREND);
        let (offset, drift) = self.trend(stretch);
        let mut value = offset + drift * time_s;
        for (k, pole) in self.poles.iter().enumerate() {
            let (a, b) = (self.fit.values[at + 2 * k], self.fit.values[at + 2 * k + 1]);
            turns(&[time_s], *pole, |_, turn| {
                value += a * turn.re + b * turn.im
            });
        }
        value
    }

    /// Offset, and drift per second, of a segment.
    pub fn trend(&self, stretch: usize) -> (f64, f64) {
        let modes = self.poles.len();
        let at = 2 * modes + stretch * (2 * modes + TREND) + 2 * modes;
        (self.fit.values[at], self.fit.values[at + 1])
    }

    /// The samples of a segment about offset and drift.
    pub fn swing(&self, stretches: &[Stretch], stretch: usize) -> Vec<f64> {
        let (offset, drift) = self.trend(stretch);
        let Stretch {
            times_s, values, ..
        } = &stretches[stretch];
        let pairs = times_s.iter().zip(values);
        pairs.map(|(t, y)| y - offset - drift * t).collect()
    }

    /// The fitted curve of a segment.
    pub fn curve(&self, stretches: &[Stretch], stretch: usize) -> Vec<f64> {
        let data = &stretches[stretch].values;
        data.iter()
            .zip(&self.residuals[stretch])
            .map(|(y, r)| y + r)
            .collect()
    }

    /// Modes in descending order of energy, amplitude²/σ, over all segments.
    pub fn by_strength(&self, stretches: usize) -> Vec<usize> {
        let energy = |k: usize| -> f64 {
            (0..stretches)
                .map(|s| self.amplitude(k, s).powi(2))
                .sum::<f64>()
                / self.poles[k].rate_per_s.max(1e-12)
        };
        let mut order: Vec<usize> = (0..self.poles.len()).collect();
        sort_by_number(&mut order, |k| -energy(*k));
        order
    }
}
