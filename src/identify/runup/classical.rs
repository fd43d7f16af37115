//! The classical method of robot identification, for comparison.

use nalgebra::DMatrix;
use torqcomp_dsp::zero_phase::low_pass;
use torqcomp_model::fit::linear;

use super::{FreeRun, Terms};
use crate::failure::Failure;
use crate::identify::{Comparison, FitQuality, Motion, NamedEstimate, rms};
use crate::print::short;

/// Order of the low-pass in each direction.
const ORDER: u32 = 4;

/// Low-pass on all channels, central differences, every n-th sample, least squares. `None` for an acceleration, which
/// needs no differences.
pub(super) fn identify(
    run: &FreeRun,
    moves: &[bool],
    (is_both, terms): (bool, Terms),
    half: usize,
    names: &[(&'static str, &'static str)],
) -> Result<Option<Comparison>, Failure> {
    if run.kind == Motion::Acceleration {
        return Ok(None);
    }
    let rate = run.rate_hz;
    let corner_hz = (rate / half as f64).min(0.2 * rate);
    let smooth = |samples: &[f64]| low_pass(samples, rate, corner_hz, ORDER);
    let step = (rate / (4.0 * corner_hz)).floor().max(1.0) as usize;
    let count = run.motion.len();
    // Without the ends, where differences and filters are inexact.
    let edge = (2 * half).min(count / 10);
    let rows: Vec<usize> = (edge..count - edge)
        .step_by(step)
        .filter(|r| moves[*r])
        .collect();
    let columns = columns(run, (is_both, terms), &rows, smooth)?;
    let design = DMatrix::from_fn(rows.len(), columns.len(), |r, c| columns[c][r]);
    let right = at(&rows, &smooth(run.effort)?);
    let fit = linear::solve(&design, &right, None, false)?;
    let left = rms(&fit.residuals);
    let constant = |(i, (name, unit)): (usize, &(&str, &'static str))| {
        NamedEstimate::new(*name, *unit, fit.values[i], fit.std[i])
    };
    Ok(Some(Comparison {
        method: format!(
            "classical: Butterworth low-pass at {} Hz forwards and backwards, central differences, every {step} \
             samples, least squares",
            short(corner_hz)
        ),
        parameters: names.iter().enumerate().map(constant).collect(),
        fit: Some(FitQuality {
            rms: left,
            unit: run.body.effort().to_owned(),
            relative: left / rms(&right),
        }),
    }))
}

/// Values at some rows.
fn at(rows: &[usize], samples: &[f64]) -> Vec<f64> {
    rows.iter().map(|r| samples[*r]).collect()
}

/// Terms of the equation from filtered samples at some rows.
fn columns(
    run: &FreeRun,
    (is_both, terms): (bool, Terms),
    rows: &[usize],
    smooth: impl Fn(&[f64]) -> Result<Vec<f64>, torqcomp_dsp::Error>,
) -> Result<Vec<Vec<f64>>, Failure> {
    let rate = run.rate_hz;
    let mut speed = smooth(run.motion)?;
    if run.kind == Motion::Displacement {
        speed = (0..speed.len())
            .map(|i| difference(&speed, i, rate))
            .collect();
    }
    let changes = rows.iter().map(|r| difference(&speed, *r, rate));
    let mut columns = vec![changes.collect()];
    let speeds = at(rows, &speed);
    if terms.is_split {
        columns.push(speeds.iter().map(|v| v.max(0.0)).collect());
        columns.push(speeds.iter().map(|v| v.min(0.0)).collect());
    } else {
        columns.push(speeds);
    }
    if let Some(angle) = terms.angle {
        for part in [f64::sin, f64::cos] {
            columns.push(rows.iter().map(|r| part(angle[*r])).collect());
        }
    }
    if is_both {
        speed.iter_mut().for_each(|v| *v = v.signum());
        columns.push(at(rows, &smooth(&speed)?));
    }
    columns.push(vec![1.0; rows.len()]);
    Ok(columns)
}

/// Central difference at a sample, one-sided at the ends.
fn difference(samples: &[f64], i: usize, rate_hz: f64) -> f64 {
    let (from, to) = (i.saturating_sub(1), (i + 1).min(samples.len() - 1));
    (samples[to] - samples[from]) * rate_hz / (to - from) as f64
}
