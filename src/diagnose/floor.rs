//! The noise floor, estimated without any model of the stand.

use super::record::{Record, dot};
use super::spectra::pieces;

/// How the floor was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// Rms of the noise.
    pub rms: f64,
    /// From where: `periods` or `out-of-band`.
    pub from: &'static str,
}

/// Part of the input that may differ from period to period.
const SAME: f64 = 1e-5;
/// Part of the power out of band that the signal may have.
const SIGNAL: f64 = 0.2;

/// The noise of the records: from the differences of periods where the input repeats, otherwise from the top of the
/// spectrum, where `modelled` (the plain stand's record over the range) says that there is no signal; white noise is
/// assumed there.
#[must_use]
pub fn noise_floor(records: &[(&Record, &[f64])]) -> Option<Floor> {
    let periodic: Vec<(f64, usize)> = records
        .iter()
        .filter_map(|(record, _)| from_periods(record))
        .collect();
    if periodic.len() == records.len() && !records.is_empty() {
        return Some(Floor {
            rms: pooled(&periodic),
            from: "periods",
        });
    }
    let found: Vec<(f64, usize)> = records
        .iter()
        .filter_map(|(record, modelled)| Some((out_of_band(record, modelled)?, record.count())))
        .collect();
    (!found.is_empty()).then(|| Floor {
        rms: pooled(&found),
        from: "out-of-band",
    })
}

fn pooled(squares: &[(f64, usize)]) -> f64 {
    let count: usize = squares.iter().map(|(_, n)| n).sum();
    let sum: f64 = squares.iter().map(|(s, n)| s * *n as f64).sum();
    (sum / count as f64).sqrt()
}

/// Mean square of the noise from differences of periods, and the samples compared.
fn from_periods(record: &Record) -> Option<(f64, usize)> {
    let u = &record.input.samples()[record.range.clone()];
    let y = &record.measured[record.range.clone()];
    let period = period(u)?;
    // The motion must have settled: the last two periods are compared.
    let count = y.len().min(3 * period) - period;
    let tail = &y[y.len() - count - period..];
    let sum: f64 = tail[period..]
        .iter()
        .zip(tail)
        .map(|(a, b)| (a - b).powi(2))
        .sum();
    Some((0.5 * sum / count as f64, count))
}

/// Length of the period of an input that repeats at least twice.
fn period(u: &[f64]) -> Option<usize> {
    let energy = dot(u, u) / u.len() as f64;
    if energy == 0.0 {
        return None;
    }
    let apart = |lag: usize, count: usize| {
        let sum: f64 = u[lag..]
            .iter()
            .zip(u)
            .take(count)
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        sum / count.min(u.len() - lag) as f64
    };
    (16..u.len() / 2).find(|lag| {
        apart(*lag, 64) < 10.0 * SAME * energy && apart(*lag, usize::MAX) < SAME * energy
    })
}

/// Mean square of white noise with the level that the top of the spectrum has.
fn out_of_band(record: &Record, modelled: &[f64]) -> Option<f64> {
    let y = &record.measured[record.range.clone()];
    let length = (y.len() / 16)
        .next_power_of_two()
        .clamp(64, 2048)
        .min(y.len());
    let (measured, signal) = (pieces(y, length).power(), pieces(modelled, length).power());
    let lines = measured.len();
    let top = lines * 7 / 10..lines * 97 / 100;
    let mut quiet: Vec<f64> = top
        .clone()
        .filter(|k| signal[*k] < SIGNAL * measured[*k])
        .map(|k| measured[k])
        .collect();
    if quiet.len() * 2 < top.len() || quiet.is_empty() {
        return None;
    }
    quiet.sort_by(f64::total_cmp);
    // The mean without the highest tenth, which may be lines.
    let kept = &quiet[..(quiet.len() * 9).div_ceil(10)];
    let level = kept.iter().sum::<f64>() / kept.len() as f64;
    Some(level * (lines - 1) as f64)
}
