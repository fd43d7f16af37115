//! Frequency and damping of a decay by manual methods: logarithmic decrement and half-power
//! bandwidth.

use std::f64::consts::{PI, TAU};

use torqcomp_dsp::peaks::vertex;

use super::modes::{ModesFit, Stretch};
use crate::identify::{Comparison, Identification, NamedEstimate};

/// Peaks smaller than this part of the first are ignored.
const SMALLEST: f64 = 0.05;
/// Minimum number of samples per period, so that half cycles have three samples for a parabola.
const FEWEST: f64 = 8.0;

/// Damped frequency in Hz and decay rate in 1/s from the heights of successive peaks: the slope of ln|peak| over time,
/// by ordinary regression over all of them. `None` with fewer than three peaks, or too few samples to resolve them.
pub(super) fn log_decrement(stretch: &Stretch, offset: f64, omega: f64) -> Option<(f64, f64)> {
    if TAU / omega < FEWEST * stretch.step_s() {
        return None;
    }
    let peaks = peaks_of(stretch, offset, PI / omega);
    if peaks.len() < 3 {
        return None;
    }
    let n = peaks.len() as f64;
    let (mean_t, mean_y) = peaks
        .iter()
        .fold((0.0, 0.0), |(t, y), p| (t + p.0 / n, y + p.1.ln() / n));
    let (top, bottom) = peaks.iter().fold((0.0, 0.0), |(a, b), p| {
        (
            a + (p.0 - mean_t) * (p.1.ln() - mean_y),
            b + (p.0 - mean_t).powi(2),
        )
    });
    let half_turns = n - 1.0;
    let frequency_hz = 0.5 * half_turns / (peaks[peaks.len() - 1].0 - peaks[0].0);
    Some((frequency_hz, -top / bottom))
}

/// Time and magnitude of the peak of every half cycle, from a parabola through three samples, down to [`SMALLEST`]
/// times the first.
fn peaks_of(stretch: &Stretch, offset: f64, half_period_s: f64) -> Vec<(f64, f64)> {
    let values: Vec<f64> = stretch.values.iter().map(|v| v - offset).collect();
    let times = &stretch.times_s;
    let mut found: Vec<(f64, f64)> = Vec::new();
    for i in 1..values.len().saturating_sub(1) {
        let (before, here, after) = (values[i - 1].abs(), values[i].abs(), values[i + 1].abs());
        let same_side = values[i - 1] * values[i] > 0.0 && values[i + 1] * values[i] > 0.0;
        if !(same_side && here >= before && here > after) {
            continue;
        }
        let (shift, size) = vertex([before, here, after]);
        let t = times[i] + shift * 0.5 * (times[i + 1] - times[i - 1]);
        match found.last_mut() {
            // Noise splits a peak into several; keep the largest.
            Some(last) if t - last.0 < 0.6 * half_period_s => {
                if size > last.1 {
                    *last = (t, size);
                }
            }
            _ => found.push((t, size)),
        }
    }
    let first = found.first().map_or(0.0, |p| p.1);
    let end = found
        .iter()
        .position(|p| p.1 < SMALLEST * first)
        .unwrap_or(found.len());
    found.truncate(end);
    found
}

/// Frequency in Hz and damping ratio from the half-power bandwidth of the spectral peak, ζ = Δf/2f.
/// Too large where the record ends before the decay does. `None` without a peak.
pub(super) fn half_power(stretch: &Stretch, offset: f64, omega: f64) -> Option<(f64, f64)> {
    let values: Vec<f64> = stretch.values.iter().map(|v| v - offset).collect();
    let near = omega / TAU;
    // Eightfold zero-padding resolves the peak.
    let mut padded = values;
    padded.resize(padded.len().min(1 << 17) * 8, 0.0);
    let peak = stretch.strongest(&padded, 0.7 * near..1.4 * near)?;
    Some((peak.frequency_hz, 0.5 * peak.width_hz / peak.frequency_hz))
}

/// Adds both for comparison.
pub(super) fn compare(
    result: &mut Identification,
    fit: &ModesFit,
    stretches: &[Stretch],
    main: usize,
) {
    let omega = fit.poles[main].omega_rad_per_s;
    let (offset, _) = fit.trend(0);
    let mut add = |method: &str, parameters: Vec<NamedEstimate>| {
        result.comparisons.push(Comparison {
            method: method.to_owned(),
            parameters,
            fit: None,
        });
    };
    if let Some((frequency_hz, rate)) = log_decrement(&stretches[0], offset, omega) {
        let natural = rate.hypot(TAU * frequency_hz);
        let parameters = vec![
            NamedEstimate::new("damped_frequency", "Hz", frequency_hz, None),
            NamedEstimate::new("decay_rate", "1/s", rate, None),
            NamedEstimate::new("damping_ratio", "", rate / natural, None),
        ];
        add("logarithmic decrement of successive peaks", parameters);
    }
    if let Some((frequency_hz, ratio)) = half_power(&stretches[0], offset, omega) {
        let parameters = vec![
            NamedEstimate::new("natural_frequency", "Hz", frequency_hz, None),
            NamedEstimate::new("damping_ratio", "", ratio, None),
        ];
        add("half-power width of the spectrum", parameters);
    }
}
