//! A moving baseline during a decay: an AC-coupled or settling amplifier, a part that warms up.

use nalgebra::DMatrix;
use torqcomp_model::fit::linear;

use super::modes::{ModesFit, Stretch};
use super::turns::turns;
use crate::identify::Pole;

/// Spacing of the baseline's knots in periods of the slowest mode, so that it cannot follow a mode.
const PERIODS: f64 = 6.0;
/// Frequency ratio to a mode, and damping ratio, beyond which a line is more likely a baseline than a
/// mode.
const SETTLES: (f64, f64) = (3.0, 0.1);
/// Maximum number of intervals of a baseline.
const MOST_INTERVALS: usize = 100;
/// Power of the interval means, relative to that for white noise with the residual's power, above which the baseline
/// moves.
const MOVES: f64 = 10.0;
/// Minimum fraction of the residual's power that a baseline must explain.
const WORTH: f64 = 0.2;

/// Whether a line next to a mode looks like part of a baseline.
pub(super) fn is_slow(line: Pole, mode: Pole) -> bool {
    SETTLES.0 * line.omega_rad_per_s < mode.omega_rad_per_s && line.damping_ratio() > SETTLES.1
}

/// Removes the baselines from the segments in which offset and drift are not sufficient: cubic splines (uniform
/// B-splines; C. de Boor, A Practical Guide to Splines, 1978), fitted together with the amplitudes of the modes; the
/// remaining baselines, if some were removed before. Returns whether there were any.
pub(super) fn take_off(stretches: &mut [Stretch], found: &ModesFit, is_known: bool) -> bool {
    let mut is_any = false;
    for (stretch, residuals) in stretches.iter_mut().zip(&found.residuals) {
        if let Some(baseline) = baseline(stretch, &found.poles, residuals, is_known) {
            let values = stretch.values.iter_mut();
            values
                .zip(baseline)
                .for_each(|(value, base)| *value -= base);
            is_any = true;
        }
    }
    is_any
}

/// The baseline of a segment, if it moves or is known to.
fn baseline(
    stretch: &Stretch,
    poles: &[Pole],
    residuals: &[f64],
    is_known: bool,
) -> Option<Vec<f64>> {
    let n = stretch.values.len();
    let intervals = intervals(stretch, poles, residuals)?;
    if !is_known && !moves(residuals, intervals) {
        return None;
    }
    let columns = 2 * poles.len();
    let mut design = DMatrix::zeros(n, columns + intervals + 3);
    for (k, pole) in poles.iter().enumerate() {
        let design = &mut design.as_mut_slice()[2 * k * n..][..2 * n];
        turns(&stretch.times_s, *pole, |i, turn| {
            design[i] = turn.re;
            design[n + i] = turn.im;
        });
    }
    let length_s = stretch.times_s.last()?;
    for (i, time_s) in stretch.times_s.iter().enumerate() {
        let (first, weights) = cubic(time_s / length_s * intervals as f64, intervals);
        for (j, weight) in weights.into_iter().enumerate() {
            design[(i, columns + first + j)] = weight;
        }
    }
    let fit = linear::solve(&design, &stretch.values, None, false).ok()?;
    let squares = |values: &[f64]| values.iter().map(|r| r * r).sum::<f64>();
    let is_worth = squares(&fit.residuals) < (1.0 - WORTH) * squares(residuals);
    (is_known || is_worth).then(|| {
        let splines = design.columns(columns, intervals + 3);
        let base = splines * nalgebra::DVector::from_column_slice(&fit.values[columns..]);
        base.as_slice().to_vec()
    })
}

/// Number of intervals of a baseline that is slow compared with the modes; without modes, compared with the strongest
/// line of the sample differences, which suppress slow components.
fn intervals(stretch: &Stretch, poles: &[Pole], residuals: &[f64]) -> Option<usize> {
    let slowest_hz = poles.iter().map(Pole::frequency_hz).reduce(f64::min);
    let slowest_hz = slowest_hz.or_else(|| {
        let differences: Vec<f64> = residuals.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let line = stretch.strongest(&differences, 0.0..f64::INFINITY)?;
        Some(line.frequency_hz)
    })?;
    let periods = slowest_hz * stretch.times_s.last()?;
    let intervals = ((periods / PERIODS) as usize).min(MOST_INTERVALS);
    (intervals > 0 && stretch.bands_hz.is_empty()).then_some(intervals)
}

/// Whether the means over intervals scatter more than for white noise.
fn moves(residuals: &[f64], intervals: usize) -> bool {
    let length = residuals.len().div_ceil(intervals.max(2));
    let mean_square =
        |values: &[f64]| values.iter().map(|r| r * r).sum::<f64>() / values.len() as f64;
    let means = residuals.chunks(length);
    let means: Vec<f64> = means
        .map(|part| part.iter().sum::<f64>() / part.len() as f64)
        .collect();
    mean_square(&means) * length as f64 > MOVES * mean_square(residuals)
}

/// The four cubic B-splines at a position in units of the interval: index of the first, and their values.
fn cubic(place: f64, intervals: usize) -> (usize, [f64; 4]) {
    let first = (place as usize).min(intervals - 1);
    let x = place - first as f64;
    let y = 1.0 - x;
    let side = |x: f64| x * x * x / 6.0;
    let middle = |x: f64| (4.0 - 6.0 * x * x + 3.0 * x * x * x) / 6.0;
    (first, [side(y), middle(x), middle(y), side(x)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_hold_straight_lines() {
        for place in [0.0, 0.3, 1.0, 2.5, 4.0] {
            let (first, weights) = cubic(place, 4);
            let sum: f64 = weights.iter().sum();
            let line = weights.iter().enumerate();
            let line: f64 = line.map(|(j, w)| w * ((first + j) as f64 - 1.0)).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{place}: {sum}");
            assert!((line - place).abs() < 1e-12, "{place}: {line}");
        }
    }
}
