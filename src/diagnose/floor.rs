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
/// Time in which the motion settles, in s.
const SETTLED_S: f64 = 0.05;
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

/// The noise as [`noise_floor`] finds it in residuals of the model that was found: what does not repeat with the input,
/// as a line of the mains, is not in them.
#[must_use]
pub fn from_residuals(records: &[(&Record, &[f64])]) -> Option<Floor> {
    let squares: Option<Vec<(f64, usize)>> = records
        .iter()
        .map(|(record, residual)| differences(record, residual))
        .collect();
    let squares = squares.filter(|s| !s.is_empty())?;
    Some(Floor {
        rms: pooled(&squares),
        from: "periods",
    })
}

fn pooled(squares: &[(f64, usize)]) -> f64 {
    let count: usize = squares.iter().map(|(_, n)| n).sum();
    let sum: f64 = squares.iter().map(|(s, n)| s * *n as f64).sum();
    (sum / count as f64).sqrt()
}

/// Mean square of the noise from differences of periods, and the samples compared: those before which the input has
/// repeated for long enough that the motion has settled.
fn from_periods(record: &Record) -> Option<(f64, usize)> {
    differences(record, &record.measured[record.range.clone()])
}

fn differences(record: &Record, y: &[f64]) -> Option<(f64, usize)> {
    let u = &record.input.samples()[record.range.clone()];
    let period = period(u)?;
    let small = SAME * dot(u, u) / u.len() as f64;
    let settled = (SETTLED_S * record.input.rate_hz()) as usize;
    let (mut run, mut sum, mut count) = (0, 0.0, 0);
    for i in period..u.len() {
        run = if (u[i] - u[i - period]).powi(2) < 100.0 * small {
            run + 1
        } else {
            0
        };
        if run > settled {
            sum += (y[i] - y[i - period]).powi(2);
            count += 1;
        }
    }
    (count >= period).then(|| (0.5 * sum / f64::from(count as u32), count))
}

/// Length of the period of an input that repeats over a good part of it.
fn period(u: &[f64]) -> Option<usize> {
    let energy = dot(u, u) / u.len() as f64;
    if energy == 0.0 {
        return None;
    }
    // A piece of the second half is looked for further on.
    let from = u.len() / 2;
    let piece = &u[from..(from + 256).min(u.len())];
    let near = |lag: &usize| {
        let there = u[from + lag..].iter().zip(piece);
        there.map(|(a, b)| (a - b).powi(2)).sum::<f64>() < SAME * energy * piece.len() as f64
    };
    (64..(u.len() - from).saturating_sub(piece.len())).find(near)
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
