//! How sure the poles of a response are.
//!
//! ```text
//! Cov p = (JᵀJ)⁻¹ · ½ Re(J̄ᵀ Γ J) · (JᵀJ)⁻¹,   Γ_kl = s_k s_l d(k − l) Σ_b X̄_kb X_lb / √(S_k S_l)
//! ```
//!
//! J: derivatives of the weighted model, lines down, with what the residues make up for taken out; Γ:
//! covariance of the weighted errors of H1 at lines k and l where the noise of the measured signal changes
//! little from line to line; X_kb: applied signal at line k of block b, S_k = Σ_b |X_kb|²; d:
//! transform of the squared window over its value at 0, which makes neighbouring lines err together; s_k²:
//! power of the weighted errors, from what of the measured signal does not go with the applied one from block
//! to block, or from the residuals where that is more or there is one block alone. (R. Pintelon, J. Schoukens,
//! System Identification, 2nd ed., 2012, 2.6 and 9; J. S. Bendat, A. G. Piersol, Random Data, 4th ed.,
//! 2010, 9.2.)
//!
//! Beside it, groups of blocks are left out in turn (B. Efron, The Jackknife, 1982, 3), which also sees
//! what differs from hit to hit. Few groups tell it badly, so it counts only where it is larger than
//! chance allows.

use nalgebra::DMatrix;
use num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use torqcomp_dsp::frf::Window;

use super::blocks::Set;
use super::lines::{Lines, data};
use super::{Data, Effort, Modal, Options};
use crate::failure::Failure;
use crate::identify::decay::Pole;

/// Covariance of σ and ω of each mode.
pub(super) type Spread = Vec<Option<[[f64; 2]; 2]>>;

/// Groups that are left out in turn, at most.
const MOST_GROUPS: usize = 8;
/// Chance with which groups that differ by noise alone are taken to differ by more.
const CHANCE: f64 = 0.05;
/// Lines apart beyond which errors are taken as independent.
const REACH: usize = 40;
/// Weight over the largest below which a line tells nothing.
const SILENT: f64 = 1e-3;
/// Lines to both sides over which the power of the errors is averaged.
const NEIGHBOURS: usize = 5;
/// Part of the noise's amplitude that half-overlapping Hann-weighted segments share.
const SHARED: f64 = 1.0 / 6.0;

/// Covariance of the poles.
///
/// # Errors
/// If a part of the blocks cannot be fitted.
pub(super) fn of_poles(
    set: &Set,
    lines: &Lines,
    options: &Options,
    fitted: &Modal,
) -> Result<Spread, Failure> {
    let whole = data(set, lines, options, &|_| true);
    let mut spread = from_noise(set, lines, &whole, fitted)?;
    let groups = set.blocks.len().min(MOST_GROUPS);
    if groups < 3 {
        return Ok(spread);
    }
    let left_out = jackknife(set, lines, options, fitted, groups)?;
    let freedom = (groups - 1) as f64;
    let by_chance = ChiSquared::new(freedom)
        .map(|d| d.inverse_cdf(1.0 - CHANCE) / freedom)
        .unwrap_or(1.0);
    for (mode, other) in spread.iter_mut().zip(&left_out) {
        let Some(covariance) = mode else { continue };
        let factor = |i: usize| {
            let ratio = other[i] / covariance[i][i];
            if ratio > by_chance { ratio.sqrt() } else { 1.0 }
        };
        let factors = [factor(0), factor(1)];
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            covariance[i][j] *= factors[i] * factors[j];
        }
    }
    Ok(spread)
}

/// From the size of the residuals and the window.
fn from_noise(set: &Set, lines: &Lines, data: &Data, fitted: &Modal) -> Result<Spread, Failure> {
    let modes = fitted.poles.len();
    let Some(fit) = &fitted.fit else {
        return Ok(Vec::new());
    };
    let free: Vec<usize> = (0..fit.values.len())
        .filter(|i| !fit.at_bound[*i])
        .collect();
    let slopes = data.slopes_at(fitted)?.select_columns(&free);
    let Some(inverse) = slopes.tr_mul(&slopes).try_inverse() else {
        return Ok(vec![None; modes]);
    };
    let top = data.weight.iter().copied().fold(0.0, f64::max);
    let heard = data.weight.iter().filter(|w| **w > SILENT * top).count();
    let linear = 2 * modes + 2;
    let freedom = (2 * heard).saturating_sub(free.len() + linear).max(1);
    let power = 2.0 * fit.sum_of_squares / freedom as f64;
    let sizes = error_sizes(set, lines, &data.weight, power, heard);
    let middle = gathered(set, lines, &slopes, &sizes) * 0.5;
    let covariance = &inverse * middle * &inverse;
    let place = |i: usize| free.iter().position(|f| *f == i);
    let one = |k: usize| {
        let places = [place(2 * k)?, place(2 * k + 1)?];
        Some(places.map(|i| places.map(|j| covariance[(i, j)])))
    };
    Ok((0..modes).map(one).collect())
}

/// s_k of each line; `power` is that of the residuals, over the lines that are heard.
fn error_sizes(set: &Set, lines: &Lines, weight: &[f64], power: f64, heard: usize) -> Vec<f64> {
    let blocks = set.blocks.len();
    if blocks < 2 {
        return vec![power.sqrt(); weight.len()];
    }
    let scattered: Vec<f64> = lines
        .clone()
        .zip(weight)
        .map(|(k, w)| w * w * variance(set, k))
        .collect();
    let smooth: Vec<f64> = (0..scattered.len())
        .map(|k| {
            let from = k.saturating_sub(NEIGHBOURS);
            let part = &scattered[from..(k + NEIGHBOURS + 1).min(scattered.len())];
            part.iter().sum::<f64>() / part.len() as f64
        })
        .collect();
    let mean = smooth.iter().sum::<f64>() / heard.max(1) as f64;
    let overlap = match set.window {
        Window::Hann => 1.0 + 2.0 * SHARED * SHARED,
        _ => 1.0,
    };
    // What the model leaves may be more than the scatter from block to block.
    let more = if mean > 0.0 {
        (power / mean).max(overlap)
    } else {
        0.0
    };
    let least = if mean > 0.0 { 0.0 } else { power };
    smooth
        .iter()
        .map(|p| (p * more).max(least).sqrt())
        .collect()
}

/// Variance of H1 at a line from the scatter of its blocks.
fn variance(set: &Set, line: usize) -> f64 {
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, Complex64::ZERO);
    for block in &set.blocks {
        let (x, y) = (block.applied[line], block.measured[line]);
        xx += x.norm_sqr();
        yy += y.norm_sqr();
        xy += x.conj() * y;
    }
    if xx == 0.0 {
        return 0.0;
    }
    let left = (yy - xy.norm_sqr() / xx).max(0.0);
    left / (set.blocks.len() - 1) as f64 / xx
}

/// Re(J̄ᵀ Γ J).
fn gathered(set: &Set, lines: &Lines, slopes: &DMatrix<f64>, sizes: &[f64]) -> DMatrix<f64> {
    let (count, columns) = (lines.len(), slopes.ncols());
    let slope = |k: usize, p: usize| Complex64::new(slopes[(2 * k, p)], slopes[(2 * k + 1, p)]);
    let length = 2 * (set.blocks[0].applied.len() - 1);
    let reach = match set.window {
        Window::None => 0,
        Window::Hann => 2,
        Window::Exponential(_) => REACH.min(count - 1),
    };
    let power: Vec<f64> = lines
        .clone()
        .map(|k| set.blocks.iter().map(|b| b.applied[k].norm_sqr()).sum())
        .collect();
    let mut sum = DMatrix::zeros(columns, columns);
    for lag in 0..=reach {
        // E[z_k z̄_l] for l = k + lag; the other side is its conjugate.
        let window = together(set.window, lag, length).conj();
        for k in 0..count - lag {
            let (at, l) = (lines.start + k, k + lag);
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
fn together(window: Window, lag: usize, length: usize) -> Complex64 {
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

/// Variances of σ and ω of each mode.
fn jackknife(
    set: &Set,
    lines: &Lines,
    options: &Options,
    fitted: &Modal,
    groups: usize,
) -> Result<Vec<[f64; 2]>, Failure> {
    let count = set.blocks.len();
    let mut each: Vec<Vec<Pole>> = Vec::new();
    for g in 0..groups {
        let out = count * g / groups..count * (g + 1) / groups;
        let part = data(set, lines, options, &|i| !out.contains(&i));
        each.push(part.fit(&fitted.poles, Effort::Coarse)?.poles);
    }
    let n = groups as f64;
    let variance = |pick: fn(&Pole) -> f64, k: usize| {
        let mean = each.iter().map(|p| pick(&p[k])).sum::<f64>() / n;
        let sum: f64 = each.iter().map(|p| (pick(&p[k]) - mean).powi(2)).sum();
        (n - 1.0) / n * sum
    };
    Ok((0..fitted.poles.len())
        .map(|k| {
            [
                variance(|p| p.rate_per_s, k),
                variance(|p| p.omega_rad_per_s, k),
            ]
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The transform of the squared window, by its sum.
    #[test]
    fn lines_err_together_as_the_window_says() {
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
                (together(Window::Hann, lag, n) - want).norm() < 1e-9,
                "{lag}"
            );
            let want = sum(lag, &fall) / sum(0, &fall);
            // The window is cut off at 1 %, so at 1e-4 of the power.
            let got = together(Window::Exponential(tau), lag, n);
            assert!((got - want).norm() < 3e-4, "{lag}: {got} {want}");
        }
    }
}
