//! Rounding errors that repeat: a load that is read again and again on a coarse display has the same rounding error
//! each time, which a mean over the rows does not reduce.
//!
//! With noise of standard deviation σ before rounding to a digit d, the part of the error that repeats falls as
//! `exp(−2π²σ²/d²)` (the first harmonic of the mean rounding error; B. Widrow, I. Kollár, Quantization Noise, 2008, 4),
//! from d/√12 without noise.

use std::f64::consts::PI;

use super::mixed::resolution;
use super::solve::Mixed;
use super::steps::LoadSteps;

/// Adds the repeated rounding errors to the standard uncertainties of coefficients.
pub(super) fn widen(std: &mut [Option<f64>], model: &Mixed, steps: &LoadSteps) {
    let Some(digit) = resolution(&model.readings).filter(|_| !model.is_known) else {
        return;
    };
    let Some(weights) = model.weights() else {
        return;
    };
    // Hysteresis gives each direction an error of its own.
    let one_way = |rising: bool| {
        let rows = steps.rows.iter().map(move |rows| {
            let own = rows.iter().filter(|i| steps.is_rising[**i] == rising);
            own.copied().collect::<Vec<usize>>()
        });
        rows.filter(|rows| !rows.is_empty())
    };
    let both_ways: Vec<Vec<usize>> = one_way(true).chain(one_way(false)).collect();
    let repeats = [steps.rows.as_slice(), both_ways.as_slice()].map(|groups| {
        let variance = repeating(&model.readings, groups, digit);
        (groups, variance)
    });
    for (k, std) in std.iter_mut().enumerate() {
        let row = weights.row(k);
        let own: f64 = row.iter().map(|a| a * a).sum();
        let together = |groups: &[Vec<usize>]| {
            let sums = groups
                .iter()
                .map(|rows| rows.iter().map(|i| row[*i]).sum::<f64>());
            sums.map(|sum| sum * sum).sum::<f64>()
        };
        let more = repeats
            .iter()
            .map(|(groups, variance)| variance * (together(groups) - own));
        let more = more.fold(0.0, f64::max);
        *std = std.map(|std| std.hypot(more.sqrt()));
    }
}

/// Variance of the rounding error that repeats within groups of rows.
fn repeating(readings: &[f64], groups: &[Vec<usize>], digit: f64) -> f64 {
    let (mut squares, mut freedom) = (0.0, 0);
    for rows in groups {
        let mean = rows.iter().map(|i| readings[*i]).sum::<f64>() / rows.len() as f64;
        squares += rows
            .iter()
            .map(|i| (readings[*i] - mean).powi(2))
            .sum::<f64>();
        freedom += rows.len() - 1;
    }
    let rounding = digit * digit / 12.0;
    // The scatter contains the rounding error.
    let noise = (squares / freedom.max(1) as f64 - rounding).max(0.0);
    rounding * (-4.0 * PI * PI * noise / (digit * digit)).exp()
}
