//! Final fit of noise-driven records, with leakage as part of the model.
//!
//! ```text
//! Y(k) = H(jω_k) U(k) + T(k) + E(k),   T(k) = Σ r/(jω_k − p) + r*/(jω_k − p*) + Σ_l t_l P_l(x_k)
//! ```
//!
//! Y, U: discrete Fourier transforms of a whole record without a window; H: the response, with modes at p; T: transient
//! of both ends of the record, a sum of the same modes with other residues r and a smooth part in Legendre polynomials
//! P_l of the position x_k in the band, for modes outside it and the motion between samples; E: noise of the measured
//! signal, independent from line to line, with a slowly varying variance. The equation is exact for any excitation, so
//! no resonance is broadened, however short the record. (R. Pintelon, J. Schoukens, G. Vandersteen, Frequency domain
//! system identification using arbitrary signals, IEEE Trans. Automatic Control 42 (1997), 1717; Pintelon & Schoukens,
//! System Identification, 2nd ed., 2012, 6.3.2 and 9.)
//!
//! Weighted least squares (the maximum-likelihood estimate), by Gauss–Newton steps in all parameters, starting from the
//! fit of the averaged response. The variance of the noise is that of the residual ([`noise`]); the covariance is the
//! inverse of the information matrix.
//!
//! Noise that enters before the resonance may be in the recorded input. That biases H low, up to the factor g = (1 +
//! √(1 − 4ρ))/2 for ρ = r/S_u, where S_u is the mean power of the recorded input: the gain's uncertainty allows for it
//! with the second moment of a factor uniform between g and 1, (1 − g)²/3.

mod line;
mod noise;
mod normal;

use std::ops::Range;

use num_complex::Complex64;
use torqcomp_dsp::frf::{Window, lines_of};
use torqcomp_model::Covariance;

use super::blocks::Set;
use super::{Data, Driven, FinalFit, Modal, foreign};
use crate::identify::Pole;
use crate::parallel::{in_parts, threads};
use line::{ParameterValues, Parameters};
use noise::NoiseParts;
use normal::{Gram, PART, Solved};

/// The lines of a record in the band.
struct Spectra {
    omega: Vec<f64>,
    applied: Vec<Complex64>,
    measured: Vec<Complex64>,
    /// Inverse standard deviation of the real and of the imaginary part of the noise.
    weight: Vec<f64>,
}

/// Maximum number of steps, before and after the noise is estimated.
const MOST_STEPS: usize = 12;
/// Maximum number of halvings of a step.
const HALVINGS: usize = 8;
/// Convergence: largest step relative to its standard uncertainty, before and after the noise is estimated; the
/// remaining error is a small fraction of it.
const LAST_STEP: (f64, f64) = (1.0, 0.1);
/// Fraction of the lines, on each side, over which the noise is smoothed; and limits of their number.
const SMOOTHED: f64 = 0.04;
const NEIGHBOURS: (usize, usize) = (20, 400);
/// Minimum number of lines per parameter.
const LEAST_LINES: usize = 2;
/// Minimum significant noise before the resonance: in standard uncertainties, and relative to the power of the
/// input.
const BEFORE: (f64, f64) = (4.0, 1e-6);
/// Number of lines per parameter in the first search.
const ENOUGH: usize = 500;
/// Number of lines within the half-width of a mode in the first search.
const WITHIN: f64 = 25.0;

/// Whole records as fitted.
pub(super) struct Whole {
    records: Vec<Spectra>,
}

impl Whole {
    /// The records at the lines of the averaged response; `None` unless that has a Hann window and so leakage.
    pub fn of(records: &[Driven], set: &Set, shape: &Data) -> Option<Self> {
        let spectra = |r| Spectra::of(r, shape.band_rad_per_s());
        (set.window == Window::Hann).then(|| Self {
            records: records.iter().map(spectra).collect(),
        })
    }

    /// Fits the records, starting from a fit of the averaged response; `None` if it does not converge or there are
    /// too few lines.
    pub fn refine(&mut self, shape: &Data, start: &Modal, set: &Set) -> Option<FinalFit> {
        let all = &mut self.records;
        all.iter_mut().for_each(|spectra| spectra.weight.fill(1.0));
        let layout = Parameters::of(shape, start.poles.len());
        let enough = |s: &Spectra| s.omega.len() >= LEAST_LINES * layout.columns();
        if start.poles.is_empty() || !all.iter().all(enough) {
            return None;
        }
        let state = ParameterValues::start(&layout, start, all.len());
        let some: Vec<Spectra> = all.iter().map(|s| s.thinned(&layout, &state)).collect();
        let (state, _) = descend(&layout, &some, state, LAST_STEP.0)?;
        let mut before: f64 = 0.0;
        for (record, spectra) in all.iter_mut().enumerate() {
            let parts = spectra.learn_noise(&layout, &state, record);
            before = before.max(spectra.before_resonance(&parts));
        }
        let (state, solved) = descend(&layout, all, state, LAST_STEP.1)?;
        let delay_s = (state.delay_s, solved.delay_std(&layout));
        let gain_error = largest_gain_error(before);
        let mut covariance = solved.covariance;
        for (i, a) in state.linear.iter().enumerate() {
            for (j, b) in state.linear.iter().enumerate() {
                let at = (layout.searched() + i, layout.searched() + j);
                covariance[at] += a * b * gain_error * gain_error / 3.0;
            }
        }
        let mut modal = shape.modal_of(&state.poles, delay_s, &state.linear);
        let covariance = Covariance::of(covariance);
        foreign::mark(&mut modal, &covariance, set);
        Some(FinalFit {
            relative: residual_over_measured(&layout, all, &state),
            static_gain_std: super::static_gain_std(&modal, &covariance, layout.searched()),
            modal,
            linear: layout.searched(),
            has_residues: true,
            covariance,
            gain_error,
            criterion: criterion(&layout, all),
            residual: residual_response(&layout, all, &state, shape),
        })
    }
}

/// Response in the residual, H1 over the lines of all records about each line of the averaged response.
fn residual_response(
    layout: &Parameters,
    all: &[Spectra],
    state: &ParameterValues,
    shape: &Data,
) -> Vec<Complex64> {
    let last = shape.omega.len() - 1;
    let step = (shape.omega[last] - shape.omega[0]) / last as f64;
    let mut sums = vec![(Complex64::ZERO, 0.0); last + 1];
    for (record, spectra) in all.iter().enumerate() {
        for (k, omega) in spectra.omega.iter().enumerate() {
            let place = ((omega - shape.omega[0]) / step).round().max(0.0) as usize;
            let (cross, power) = &mut sums[place.min(last)];
            *cross += layout.left(spectra, state, record, k) * spectra.applied[k].conj();
            *power += spectra.applied[k].norm_sqr();
        }
    }
    let of = |(cross, power): &(Complex64, f64)| match *power > 0.0 {
        true => cross / power,
        false => Complex64::ZERO,
    };
    sums.iter().map(of).collect()
}

/// Bayesian information criterion without constant terms, `Σ ln σ² + p ln N`, with the variances σ² of the noise of N
/// real numbers, learnt from the residual, and p parameters (G. Schwarz, Annals of Statistics 6 (1978), 461).
fn criterion(layout: &Parameters, all: &[Spectra]) -> f64 {
    let parameters = layout.own() * all.len() + layout.free().len();
    let weights = || all.iter().flat_map(|s| &s.weight);
    let variances: f64 = weights().map(|weight| -4.0 * weight.ln()).sum();
    variances + parameters as f64 * (2.0 * weights().count() as f64).ln()
}

/// 1 − g, the largest relative error of the gain for noise before the resonance of this power relative to the input.
fn largest_gain_error(before: f64) -> f64 {
    0.5 * (1.0 - (1.0 - 4.0 * before).max(0.0).sqrt())
}

impl Spectra {
    fn of(record: &Driven, band_rad_per_s: (f64, f64)) -> Self {
        let count = easily_transformed(record.applied.len());
        let step = std::f64::consts::TAU * record.rate_hz / count as f64;
        let close = 1e-9 * band_rad_per_s.1;
        let from = ((band_rad_per_s.0 - close) / step).ceil() as usize;
        let to = ((band_rad_per_s.1 + close) / step).floor() as usize;
        let lines = from.max(1)..(to + 1).min(count / 2 + 1);
        // One after the other: a transform takes three times the memory of its channel.
        let spectrum = |channel: &[f64]| lines_of(&channel[..count], lines.clone());
        let (applied, measured) = (spectrum(record.applied), spectrum(record.measured));
        Self {
            applied,
            measured,
            omega: lines.clone().map(|k| step * k as f64).collect(),
            weight: vec![1.0; lines.len()],
        }
    }

    /// Evenly decimated lines for the first search, with enough of them within the narrowest mode.
    fn thinned(&self, layout: &Parameters, state: &ParameterValues) -> Self {
        let rates = state.poles.iter().map(|p| p.rate_per_s);
        let narrowest = rates.fold(f64::INFINITY, f64::min) / (self.omega[1] - self.omega[0]);
        let step = self.omega.len() / (ENOUGH * layout.columns());
        let step = step.min((narrowest / WITHIN) as usize).max(1);
        fn thinned<T: Copy>(all: &[T], step: usize) -> Vec<T> {
            all.iter().step_by(step).copied().collect()
        }
        Self {
            omega: thinned(&self.omega, step),
            applied: thinned(&self.applied, step),
            measured: thinned(&self.measured, step),
            weight: thinned(&self.weight, step),
        }
    }

    /// Power of the residual at each line.
    fn left(&self, layout: &Parameters, state: &ParameterValues, record: usize) -> Vec<f64> {
        let left = |k: usize| layout.left(self, state, record, k).norm_sqr();
        let part = |lines: Range<usize>| lines.map(left).collect::<Vec<f64>>();
        in_parts(self.omega.len(), PART, threads(), part).concat()
    }

    /// Weights from the residual, corrected for the noise absorbed by the fit; and the components of the noise.
    fn learn_noise(
        &mut self,
        layout: &Parameters,
        state: &ParameterValues,
        record: usize,
    ) -> NoiseParts {
        let count = self.omega.len();
        let taken = layout.columns() as f64 / (2 * count) as f64;
        let power = self.left(layout, state, record);
        let response = |omega: &f64| layout.response(*omega, state).norm_sqr();
        let shape: Vec<f64> = self.omega.iter().map(response).collect();
        let parts = NoiseParts::of(&power, &shape);
        let mut sums = vec![0.0; count + 1];
        for (k, power) in power.iter().enumerate() {
            sums[k + 1] = sums[k] + power / parts.at(shape[k]).max(f64::MIN_POSITIVE);
        }
        let reach = ((SMOOTHED * count as f64) as usize).clamp(NEIGHBOURS.0, NEIGHBOURS.1);
        for (k, weight) in self.weight.iter_mut().enumerate() {
            let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(count));
            let smooth = (sums[to] - sums[from]) / (to - from) as f64 / (1.0 - taken);
            let power = smooth * parts.at(shape[k]);
            *weight = (2.0 / power.max(f64::MIN_POSITIVE)).sqrt();
        }
        parts
    }

    /// Power of the noise before the resonance relative to the applied signal; 0 if not significant.
    fn before_resonance(&self, parts: &NoiseParts) -> f64 {
        let applied: f64 = self.applied.iter().map(|u| u.norm_sqr()).sum();
        let part = parts.shaped * self.applied.len() as f64 / applied;
        let is_significant = parts.shaped > BEFORE.0 * parts.shaped_std && part > BEFORE.1;
        if is_significant { part } else { 0.0 }
    }
}

/// RMS residual relative to the measured signal, over all lines and records.
fn residual_over_measured(layout: &Parameters, all: &[Spectra], state: &ParameterValues) -> f64 {
    let (mut left, mut whole) = (0.0, 0.0);
    for (record, spectra) in all.iter().enumerate() {
        left += spectra.left(layout, state, record).iter().sum::<f64>();
        whole += spectra.measured.iter().map(|y| y.norm_sqr()).sum::<f64>();
    }
    (left / whole).sqrt()
}

/// Gauss–Newton steps until the last is small compared with the uncertainty; `None` if they do not converge.
fn descend(
    layout: &Parameters,
    all: &[Spectra],
    start: ParameterValues,
    last_step: f64,
) -> Option<(ParameterValues, Solved)> {
    let lines: usize = all.iter().map(|s| s.omega.len()).sum();
    let numbers = layout.own() * all.len() + layout.shared();
    let freedom = (2 * lines - numbers) as f64;
    let mut state = start;
    let mut grams = Gram::all(layout, all, &state);
    for _ in 0..MOST_STEPS {
        let solved = Solved::of(layout, &grams)?;
        let cost = Gram::cost(&grams);
        if solved.largest_step(layout, cost / freedom) < last_step {
            return Some((solved.moved(layout, &state, 1.0), solved));
        }
        let lower = (0..HALVINGS).find_map(|halvings| {
            let next = solved.moved(layout, &state, 0.5_f64.powi(halvings as i32));
            let possible = next.poles.iter().all(possible);
            let grams = possible.then(|| Gram::all(layout, all, &next))?;
            (Gram::cost(&grams) <= cost).then_some((next, grams))
        });
        (state, grams) = lower?;
    }
    None
}

fn possible(pole: &Pole) -> bool {
    pole.rate_per_s > 0.0 && pole.omega_rad_per_s > 0.0
}

/// The largest number up to `count` with only the prime factors 2, 3, 5 and 7: its transform is fast, and at most a few
/// per cent of the samples are lost.
fn easily_transformed(count: usize) -> usize {
    let easy = |n: &usize| {
        let rest = [2, 3, 5, 7].iter().fold(*n, |mut n, factor| {
            while n % factor == 0 {
                n /= factor;
            }
            n
        });
        rest == 1
    };
    (1..=count).rev().find(easy).unwrap_or(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn easy_numbers_are_found_and_near() {
        // 1009 is prime; 1008 = 2⁴·3²·7.
        assert_eq!(easily_transformed(1009), 1008);
        assert_eq!(easily_transformed(1_000_000), 1_000_000);
        for count in 1000..20_000 {
            let easy = easily_transformed(count);
            assert!(easy * 100 > count * 95, "{count}: {easy}");
        }
    }
}
