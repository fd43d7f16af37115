//! The noise floor, estimated without any model of the stand.

use serde::Serialize;

use super::fit::RecordResidual;
use super::record::{StandRecord, dot};
use super::spectra::spectra;

/// The noise of the held-out records.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFloor {
    pub rms: f64,
    pub from: NoiseFloorSource,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseFloorSource {
    /// Differences between periods of the record.
    Periods,
    /// Frequencies above the signal; white noise is assumed.
    OutOfBand,
}

/// Part of the input's power that may differ from period to period.
const SAME: f64 = 1e-5;
/// Time in which the motion settles, in s.
const SETTLED_S: f64 = 0.05;
/// Largest part of the power out of band that the signal may have.
const SIGNAL: f64 = 0.2;

/// Mean square of the noise, and the number of samples it is taken from.
type MeanSquare = (f64, usize);

impl NoiseFloor {
    /// The noise of records: from the differences of periods where every input repeats, otherwise from the top of the
    /// spectrum, where the plain stand's modelled record says that there is no signal.
    pub fn of(residuals: &[RecordResidual]) -> Option<Self> {
        let periods = residuals.iter().map(|r| {
            let record = &r.record;
            of_periods(record, record.measured_in_range())
        });
        Self::pooled(periods, NoiseFloorSource::Periods).or_else(|| {
            let found = residuals.iter().filter_map(out_of_band);
            Self::pooled(found.map(Some), NoiseFloorSource::OutOfBand)
        })
    }

    /// The noise in the residuals of a model, from differences of periods: disturbances that do not repeat with the input,
    /// such as mains pickup, are not in it if the model has them.
    pub fn of_residuals(residuals: &[RecordResidual]) -> Option<Self> {
        let found = residuals.iter().map(|r| of_periods(&r.record, &r.samples));
        Self::pooled(found, NoiseFloorSource::Periods)
    }

    /// The noise of several records together; `None` if it is unknown for one of them.
    fn pooled(
        found: impl Iterator<Item = Option<MeanSquare>>,
        from: NoiseFloorSource,
    ) -> Option<Self> {
        let found: Vec<MeanSquare> = found.collect::<Option<_>>()?;
        let count: usize = found.iter().map(|(_, n)| n).sum();
        let sum: f64 = found.iter().map(|(s, n)| s * *n as f64).sum();
        let rms = (sum / count as f64).sqrt();
        (count > 0).then_some(Self { rms, from })
    }
}

/// Noise from differences of periods, over the samples before which the input has repeated for long enough that the
/// motion has settled.
fn of_periods(record: &StandRecord, y: &[f64]) -> Option<MeanSquare> {
    let u = record.applied_in_range();
    let period = period(u)?;
    let small = SAME * dot(u, u) / u.len() as f64;
    let settled = (SETTLED_S * record.rate_hz()) as usize;
    let (mut run, mut sum, mut count) = (0, 0.0, 0);
    for i in period..u.len() {
        let repeats = (u[i] - u[i - period]).powi(2) < 100.0 * small;
        run = if repeats { run + 1 } else { 0 };
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
    // A piece from the middle is searched for in the second half.
    let from = u.len() / 2;
    let piece = &u[from..(from + 256).min(u.len())];
    let near = |lag: &usize| {
        let there = u[from + lag..].iter().zip(piece);
        there.map(|(a, b)| (a - b).powi(2)).sum::<f64>() < SAME * energy * piece.len() as f64
    };
    (64..(u.len() - from).saturating_sub(piece.len())).find(near)
}

/// White noise with the level that the top of the spectrum has.
fn out_of_band(residual: &RecordResidual) -> Option<MeanSquare> {
    let y = residual.record.measured_in_range();
    let length = (y.len() / 16).next_power_of_two().clamp(64, 2048);
    let length = length.min(y.len());
    let [measured, signal] = [y, &residual.modelled].map(|x| spectra(x, length).power());
    let lines = measured.len();
    let top = lines * 7 / 10..lines * 97 / 100;
    let is_noise = |k: &usize| signal[*k] < SIGNAL * measured[*k];
    let mut quiet: Vec<f64> = top.clone().filter(is_noise).map(|k| measured[k]).collect();
    if quiet.len() * 2 < top.len() || quiet.is_empty() {
        return None;
    }
    quiet.sort_by(f64::total_cmp);
    // The mean without the highest tenth, which may be lines.
    let kept = &quiet[..(quiet.len() * 9).div_ceil(10)];
    let level = kept.iter().sum::<f64>() / kept.len() as f64;
    Some((level * (lines - 1) as f64, y.len()))
}
