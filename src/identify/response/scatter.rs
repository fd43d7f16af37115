//! Covariance of the poles of a response.
//!
//! ```text
//! Cov p = (JᵀJ)⁻¹ · ½ Re(J̄ᵀ Γ J) · (JᵀJ)⁻¹,   Γ_kl = s_k s_l d(k − l) Σ_b X̄_kb X_lb / √(S_k S_l)
//! ```
//!
//! J: derivatives of the weighted model at each line, projected off those with respect to the other residues; Γ:
//! covariance of the weighted errors of H1 at lines k and l, where the noise of the measured signal changes little from
//! line to line; X_kb: applied signal at line k of block b, S_k = Σ_b |X_kb|²; d: transform of the squared window over
//! its value at 0, which correlates neighbouring lines; s_k²: power of the weighted errors, from the scatter of the
//! response between blocks, or from the residuals where they are larger or there is only one block. A single block does
//! not reveal the error of the applied signal, |H|² N/|X|², either: the fit follows it where it matters, at the
//! resonance. Its power N, of noise and aliasing, is that of the applied signal near the Nyquist frequency. (R.
//! Pintelon, J. Schoukens, System Identification, 2nd ed., 2012, 2.6 and 9; J. S. Bendat, A. G. Piersol, Random Data,
//! 4th ed., 2010, 9.2.)
//!
//! In addition, the noise of the force within each stroke, which is short and so correlates all lines ([`from_force`]);
//! and from the contribution of each block:
//!
//! ```text
//! Cov p = (JᵀJ)⁻¹ Σ_b u_b u_bᵀ (JᵀJ)⁻¹ n/(n − 1),   u_b = Re Σ_k J̄_k w_k X̄_kb (Y_kb − H1_k X_kb)/S_k
//! ```
//!
//! (the infinitesimal jackknife: B. Efron, The Jackknife, 1982, 6.3; overlapping segments together with their
//! neighbours). It needs no model of the noise and includes leakage and differences between hits, but is imprecise with
//! few blocks. So it is used alone from [`MANY`] blocks on, and below that where it is significantly larger.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use torqcomp_dsp::frf::Window;
use torqcomp_model::Covariance;

use super::blocks::Set;
use super::inverse::invert;
use super::line_noise;
use super::{Data, Modal};
use crate::failure::Failure;

/// Number of blocks from which their scatter alone gives the uncertainty.
const MANY: usize = 20;
/// Minimum number of blocks whose scatter is used.
const FEW: usize = 3;
/// Significance level of the test for scatter between blocks.
const CHANCE: f64 = 0.05;
/// Distance in lines beyond which errors count as independent.
const REACH: usize = 40;
/// Weight, relative to the largest, below which a line is ignored.
const SILENT: f64 = 1e-3;
/// Divisor of the number of lines that gives those, just below the Nyquist frequency, used for noise and aliasing
/// of the applied signal.
const TOP: usize = 10;

/// Covariance of poles and delay and, for a single mode, of the real and imaginary part of its residue.
///
/// # Errors
/// If the derivatives cannot be computed.
pub(super) fn of_poles(set: &Set, whole: &Data, fitted: &Modal) -> Result<Covariance, Failure> {
    let residue = if fitted.poles.len() == 1 { 2 } else { 0 };
    Ok(match Linearised::of(whole, fitted, residue)? {
        Some(fit) => {
            let matrix = covariance(set, whole, fitted, &fit);
            fit.covariance_of(fit.searched + 2, matrix)
        }
        None => Covariance::independent(&vec![None; 2 * fitted.poles.len() + 3]),
    })
}

/// Covariance of poles and delay, and of all linear parameters; `None` if these data do not separate them.
///
/// # Errors
/// If the derivatives cannot be computed.
pub(super) fn of_all(
    set: &Set,
    whole: &Data,
    fitted: &Modal,
) -> Result<Option<Covariance>, Failure> {
    let linear = fitted.linear().len();
    Ok(Linearised::of(whole, fitted, linear)?.map(|fit| {
        let matrix = covariance(set, whole, fitted, &fit);
        fit.covariance_of(fit.searched + linear, matrix)
    }))
}

fn covariance(set: &Set, whole: &Data, fitted: &Modal, solved: &Linearised) -> DMatrix<f64> {
    let noise = from_noise(set, whole, fitted, solved) + from_force(set, whole, fitted, solved);
    let blocks = set.blocks.len();
    if blocks < FEW {
        return noise;
    }
    let scattered = from_blocks(set, whole, solved);
    if blocks >= MANY {
        return scattered;
    }
    let freedom = (blocks - 1) as f64;
    let by_chance = ChiSquared::new(freedom)
        .map(|d| d.inverse_cdf(1.0 - CHANCE) / freedom)
        .unwrap_or(1.0);
    let factors: Vec<f64> = (0..noise.nrows())
        .map(|i| scattered[(i, i)] / noise[(i, i)])
        .map(|ratio| if ratio > by_chance { ratio.sqrt() } else { 1.0 })
        .collect();
    DMatrix::from_fn(noise.nrows(), noise.ncols(), |i, j| {
        noise[(i, j)] * factors[i] * factors[j]
    })
}

/// The fit, linearised at its minimum.
struct Linearised {
    /// Parameters not at a bound: poles and delay, then the first linear parameters, except those that are zero.
    free: Vec<usize>,
    /// Linear parameters that are zero.
    zero: Vec<usize>,
    /// Number of parameters for poles and delay.
    searched: usize,
    /// J of the free parameters.
    slopes: DMatrix<f64>,
    /// (JᵀJ)⁻¹.
    inverse: DMatrix<f64>,
    modes: usize,
}

impl Linearised {
    /// Includes the first `linear` linear parameters.
    fn of(data: &Data, fitted: &Modal, linear: usize) -> Result<Option<Self>, Failure> {
        let Some(fit) = &fitted.fit else {
            return Ok(None);
        };
        let searched = fit.values.len();
        let modes = fitted.poles.len();
        let is_zero = |i: &usize| *i >= searched && data.is_zero(*i - searched, modes);
        let (zero, others): (Vec<usize>, Vec<usize>) = (0..searched + linear).partition(is_zero);
        let free = others.into_iter();
        let free = free.filter(|i| fit.at_bound.get(*i) != Some(&true));
        let free: Vec<usize> = free.collect();
        let slopes = data.slopes_at(fitted, linear)?.select_columns(&free);
        let inverse = invert(&slopes.tr_mul(&slopes), 0.0);
        Ok(inverse.map(|inverse| Self {
            free,
            zero,
            searched,
            slopes,
            inverse,
            modes,
        }))
    }

    /// The covariance of `count` parameters from that of the free ones; the others that are known are zero without
    /// uncertainty.
    fn covariance_of(&self, count: usize, of_free: DMatrix<f64>) -> Covariance {
        let known = [&self.free[..], &self.zero].concat();
        let matrix = of_free.resize(known.len(), known.len(), 0.0);
        Covariance::of_some(&known, count, matrix)
    }

    fn slope(&self, k: usize, p: usize) -> Complex64 {
        Complex64::new(self.slopes[(2 * k, p)], self.slopes[(2 * k + 1, p)])
    }
}

/// Power of the applied signal at each line, summed over blocks.
pub(super) fn applied_power(set: &Set) -> Vec<f64> {
    let power = |k: usize| set.blocks.iter().map(|b| b.applied[k].norm_sqr()).sum();
    set.band.clone().map(power).collect()
}

/// Estimate from the contribution of each block.
fn from_blocks(set: &Set, data: &Data, solved: &Linearised) -> DMatrix<f64> {
    let (count, columns) = (set.band.len(), solved.free.len());
    let h1 = &data.response;
    let power = applied_power(set);
    let scores = DMatrix::from_fn(set.blocks.len(), columns, |b, p| {
        let block = &set.blocks[b];
        (0..count)
            .filter(|k| power[*k] > 0.0)
            .map(|k| {
                let at = set.band.start + k;
                let (x, y) = (block.applied[at], block.measured[at]);
                let error = x.conj() * (y - h1[k] * x) * (data.weight[k] / power[k]);
                (solved.slope(k, p).conj() * error).re
            })
            .sum()
    });
    let blocks = set.blocks.len();
    let mut sum = scores.tr_mul(&scores);
    if set.window == Window::Hann {
        let both = scores
            .rows(1, blocks - 1)
            .tr_mul(&scores.rows(0, blocks - 1));
        // Bartlett's weight keeps variances positive.
        sum += (&both + both.transpose()) * 0.5;
    }
    let freedom = blocks as f64 / (blocks - 1) as f64;
    &solved.inverse * sum * &solved.inverse * freedom
}

/// Part due to white noise of variance σ_b² in the samples i of the stroke of each block b, where the force has the
/// window w_i:
///
/// ```text
/// (JᵀJ)⁻¹ Σ_b σ_b² Σ_i u_bi u_biᵀ (JᵀJ)⁻¹,   u_bi = −Re Σ_k J̄_k w_k X̄_kb H_k w_i e^{−jω_k t_i}/S_k
/// ```
fn from_force(set: &Set, data: &Data, fitted: &Modal, solved: &Linearised) -> DMatrix<f64> {
    let columns = solved.free.len();
    let mut sum = DMatrix::zeros(columns, columns);
    let power = applied_power(set);
    let length = 2 * (set.lines - 1);
    for (b, stroke) in &set.strokes {
        let applied = &set.blocks[*b].applied[set.band.clone()];
        let weighted = |k: usize| match power[k] > 0.0 {
            true => applied[k].conj() * fitted.response[k] * (data.weight[k] / power[k]),
            false => Complex64::ZERO,
        };
        let weighted: Vec<Complex64> = (0..applied.len()).map(weighted).collect();
        let scores = DMatrix::from_fn(stroke.samples.len(), columns, |row, p| {
            let i = stroke.samples.start + row;
            let at = |k: usize| Complex64::cis(-TAU * (k * i) as f64 / length as f64);
            let (mut turn, step) = (at(set.band.start), at(1));
            let mut score = 0.0;
            for (k, error) in weighted.iter().enumerate() {
                score += (solved.slope(k, p).conj() * error * turn).re;
                turn *= step;
            }
            score * set.window.weight(i, length)
        });
        sum += scores.tr_mul(&scores) * stroke.variance;
    }
    &solved.inverse * sum * &solved.inverse
}

/// Estimate from the power of the errors and the window.
fn from_noise(set: &Set, data: &Data, fitted: &Modal, solved: &Linearised) -> DMatrix<f64> {
    let squares = fitted.fit.as_ref().map_or(0.0, |f| f.sum_of_squares);
    let top = data.weight.iter().copied().fold(0.0, f64::max);
    let counted = data.weight.iter().filter(|w| **w > SILENT * top).count();
    let linear = 0..2 * solved.modes + data.outside();
    let linear = linear.filter(|j| !data.is_zero(*j, solved.modes)).count();
    let searched = solved.free.iter().filter(|i| **i < solved.searched).count();
    let freedom = (2 * counted).saturating_sub(searched + linear).max(1);
    let power = 2.0 * squares / freedom as f64;
    let sizes = match set.blocks.len() {
        0 | 1 => sizes_of_one(set, data, &fitted.response, power),
        _ => line_noise::sizes(set, &data.weight, &fitted.response, (power, counted)),
    };
    let middle = gathered(set, solved, &sizes) * 0.5;
    &solved.inverse * middle * &solved.inverse
}

/// s_k of each line for one block; `power` is the mean power of the residuals over the lines that
/// count.
fn sizes_of_one(set: &Set, data: &Data, response: &[Complex64], power: f64) -> Vec<f64> {
    let unseen = power_of_force_error(set, data, response);
    unseen.into_iter().map(|u| (power + u).sqrt()).collect()
}

/// Power of the weighted errors due to the error of the applied signal in one block, by line.
fn power_of_force_error(set: &Set, data: &Data, response: &[Complex64]) -> Vec<f64> {
    let applied = set.blocks.first().map_or(&[][..], |block| &block.applied);
    let top = &applied[applied.len() - applied.len() / TOP..];
    let unseen = top.iter().map(Complex64::norm_sqr).sum::<f64>() / top.len().max(1) as f64;
    let size = |(k, line): (usize, usize)| match applied[line].norm_sqr() {
        of_applied if of_applied > 0.0 => {
            response[k].norm_sqr() * data.weight[k].powi(2) * unseen / of_applied
        }
        _ => 0.0,
    };
    set.band.clone().enumerate().map(size).collect()
}

/// Whether the error of the force dominates the uncertainty of a fit to one block.
pub(super) fn is_of_force(set: &Set, data: &Data, fitted: &Modal) -> bool {
    let squares = fitted.fit.as_ref().map_or(0.0, |f| f.sum_of_squares);
    let of_force = power_of_force_error(set, data, &fitted.response);
    set.blocks.len() == 1 && of_force.iter().sum::<f64>() > squares
}

/// Re(J̄ᵀ Γ J).
fn gathered(set: &Set, solved: &Linearised, sizes: &[f64]) -> DMatrix<f64> {
    let (count, columns) = (set.band.len(), solved.free.len());
    let slope = |k: usize, p: usize| solved.slope(k, p);
    let length = 2 * (set.lines - 1);
    let reach = match set.window {
        Window::None => 0,
        Window::Hann => 2,
        Window::Exponential(_) => REACH.min(count - 1),
    };
    let power = applied_power(set);
    let mut sum = DMatrix::zeros(columns, columns);
    for lag in 0..=reach {
        // E[z_k z̄_l] for l = k + lag; the other side is its conjugate.
        let window = line_correlation(set.window, lag, length).conj();
        for k in 0..count - lag {
            let (at, l) = (set.band.start + k, k + lag);
            let size = (power[k] * power[l]).sqrt();
            if size == 0.0 {
                continue;
            }
            let pairs = set
                .blocks
                .iter()
                .map(|b| b.applied[at].conj() * b.applied[at + lag]);
            let gamma = window * pairs.sum::<Complex64>() * (sizes[k] * sizes[l] / size);
            for p in 0..columns {
                let left = slope(k, p).conj() * gamma;
                for q in 0..columns {
                    let value = (left * slope(l, q)).re;
                    sum[(p, q)] += value;
                    if lag > 0 {
                        sum[(q, p)] += value;
                    }
                }
            }
        }
    }
    sum
}

/// d(lag): Σ w² e^{−j2π lag i/n} over Σ w².
pub(super) fn line_correlation(window: Window, lag: usize, length: usize) -> Complex64 {
    match (window, lag) {
        (_, 0) => Complex64::ONE,
        (Window::Hann, 1) => Complex64::new(-2.0 / 3.0, 0.0),
        (Window::Hann, 2) => Complex64::new(1.0 / 6.0, 0.0),
        (Window::Exponential(tau), _) => {
            let turn = std::f64::consts::TAU * lag as f64 / length as f64;
            let step = Complex64::new(-2.0 / tau, -turn).exp();
            (1.0 - (-2.0 / tau).exp()) / (1.0 - step)
        }
        _ => Complex64::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the transform of the squared window by direct summation.
    #[test]
    fn lines_are_correlated_by_the_window() {
        let n = 512;
        let turn = |lag: usize, i: usize| -std::f64::consts::TAU * (lag * i) as f64 / n as f64;
        let sum = |lag: usize, w: &dyn Fn(usize) -> f64| -> Complex64 {
            (0..n)
                .map(|i| Complex64::from_polar(w(i).powi(2), turn(lag, i)))
                .sum()
        };
        let hann = |i: usize| 0.5 - 0.5 * turn(1, i).cos();
        let tau = n as f64 / 100_f64.ln();
        let fall = |i: usize| (-(i as f64) / tau).exp();
        for lag in 0..4 {
            let want = sum(lag, &hann) / sum(0, &hann);
            assert!(
                (line_correlation(Window::Hann, lag, n) - want).norm() < 1e-9,
                "{lag}"
            );
            let want = sum(lag, &fall) / sum(0, &fall);
            // The window is truncated at 1 %, i.e. 1e-4 of the power.
            let got = line_correlation(Window::Exponential(tau), lag, n);
            assert!((got - want).norm() < 3e-4, "{lag}: {got} {want}");
        }
    }
}
