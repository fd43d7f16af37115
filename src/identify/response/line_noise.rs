//! Power of the errors of H1 that are independent from line to line, for several blocks.
//!
//! ```text
//! s_k² = w_k² Σ_b |Y_kb − H1_k X_kb|² / ((n − 1) S_k),   S_k = Σ_b |X_kb|²
//! ```
//!
//! averaged over neighbouring lines. Noise of the force within a stroke is an error of all lines alike, as the
//! stroke is short, and is counted for itself (`scatter::from_force`). So where there are strokes, the second
//! difference from line to line of the errors over H takes the place of the errors: what is smooth over the lines
//! is not in it.

use num_complex::Complex64;
use torqcomp_dsp::frf::Window;

use super::blocks::Set;
use super::scatter::{applied_power, line_correlation};

/// Number of lines on each side over which the power of the errors is averaged.
const NEIGHBOURS: usize = 5;
/// Correlation of the noise amplitude of half-overlapping Hann-weighted segments.
const SHARED: f64 = 1.0 / 6.0;
/// Minimum power of the second difference of unit errors: with a short window, neighbouring lines hardly differ.
const DIFFERENT: f64 = 2.0;

/// s_k of each line; `power` is the mean power of the residuals over the `counted` lines.
pub(super) fn sizes(
    set: &Set,
    weight: &[f64],
    response: &[Complex64],
    (power, counted): (f64, usize),
) -> Vec<f64> {
    let of_lines = without_strokes(set, response);
    let (variances, of_force) = match of_lines {
        Some(variances) => (
            variances,
            of_force(set, weight, response) / counted.max(1) as f64,
        ),
        None => (set.band.clone().map(|k| variance(set, k)).collect(), 0.0),
    };
    let pairs = variances.iter().zip(weight);
    let scattered: Vec<f64> = pairs.map(|(variance, w)| w * w * variance).collect();
    let smooth: Vec<f64> = (0..scattered.len())
        .map(|k| {
            let from = k.saturating_sub(NEIGHBOURS);
            let part = &scattered[from..(k + NEIGHBOURS + 1).min(scattered.len())];
            part.iter().sum::<f64>() / part.len() as f64
        })
        .collect();
    let mean = smooth.iter().sum::<f64>() / counted.max(1) as f64;
    let overlap = match set.window {
        Window::Hann => 1.0 + 2.0 * SHARED * SHARED,
        _ => 1.0,
    };
    // The residual may be larger than the scatter between blocks.
    let power = (power - of_force).max(0.0);
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

/// Variance of H1 at a line from the scatter between blocks.
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

/// The same without what is smooth over the lines; `None` without strokes, or if neighbouring lines hardly differ.
fn without_strokes(set: &Set, response: &[Complex64]) -> Option<Vec<f64>> {
    let length = 2 * (set.blocks.first()?.applied.len() - 1);
    let [near, far] = [1, 2].map(|lag| line_correlation(set.window, lag, length).re);
    let unit = 6.0 - 8.0 * near + 2.0 * far;
    let count = set.band.len();
    if set.strokes.is_empty()
        || unit < DIFFERENT
        || count < 3
        || response.contains(&Complex64::ZERO)
    {
        return None;
    }
    let power = applied_power(set);
    let h1 = |k: usize| {
        let line = set.band.start + k;
        let products = set
            .blocks
            .iter()
            .map(|b| b.applied[line].conj() * b.measured[line]);
        products.sum::<Complex64>() / power[k]
    };
    let h1: Vec<Complex64> = (0..count).map(h1).collect();
    let mut sums = vec![0.0; count];
    for block in &set.blocks {
        let error = |k: usize| {
            let line = set.band.start + k;
            (block.measured[line] - h1[k] * block.applied[line]) / response[k]
        };
        let errors: Vec<Complex64> = (0..count).map(error).collect();
        for (k, sum) in sums.iter_mut().enumerate() {
            let middle = k.clamp(1, count - 2);
            let second = errors[middle - 1] - errors[middle] * 2.0 + errors[middle + 1];
            *sum += second.norm_sqr() / unit;
        }
    }
    let freedom = (set.blocks.len() - 1) as f64;
    let of_line = |(k, sum): (usize, &f64)| match power[k] > 0.0 {
        true => response[k].norm_sqr() * sum / (freedom * power[k]),
        false => 0.0,
    };
    Some(sums.iter().enumerate().map(of_line).collect())
}

/// Sum over the lines of the power of the weighted errors from the noise of the force within the strokes.
fn of_force(set: &Set, weight: &[f64], response: &[Complex64]) -> f64 {
    let length = 2 * (set.blocks[0].applied.len() - 1);
    let power = applied_power(set);
    let mut sum = 0.0;
    for (b, stroke) in &set.strokes {
        let weights = stroke
            .samples
            .clone()
            .map(|i| set.window.weight(i, length).powi(2));
        let of_stroke = stroke.variance * weights.sum::<f64>();
        for (k, line) in set
            .band
            .clone()
            .enumerate()
            .filter(|(k, _)| power[*k] > 0.0)
        {
            let share = set.blocks[*b].applied[line].norm_sqr() / power[k].powi(2);
            sum += weight[k].powi(2) * response[k].norm_sqr() * share * of_stroke;
        }
    }
    sum
}
