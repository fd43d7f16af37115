//! The classical method of robot identification, for comparison.

use nalgebra::DMatrix;
use torqcomp_dsp::zero_phase::low_pass;
use torqcomp_model::fit::linear;

use super::FreeRun;
use super::directions::Directions;
use crate::failure::Failure;
use crate::identify::{Comparison, FitQuality, Motion, NamedEstimate, rms};
use crate::print::short;

/// Order of the low-pass in each direction.
const ORDER: u32 = 4;

/// Low-pass on all channels, central differences, every n-th sample, least squares. `None` for an acceleration, which
/// needs no differences.
pub(super) fn identify(
    run: &FreeRun,
    directions: &Directions,
    half: usize,
    split: bool,
    names: &[(&'static str, &'static str)],
) -> Result<Option<Comparison>, Failure> {
    if run.kind == Motion::Acceleration {
        return Ok(None);
    }
    let rate = run.rate_hz;
    let corner_hz = (rate / half as f64).min(0.2 * rate);
    let smooth = |samples: &[f64]| low_pass(samples, rate, corner_hz, ORDER);
    let columns = columns(run, directions, split, smooth)?;
    let effort = smooth(run.effort)?;
    let step = (rate / (4.0 * corner_hz)).floor().max(1.0) as usize;
    // Without the ends, where differences and filters are inexact.
    let edge = (2 * half).min(effort.len() / 10);
    let rows: Vec<usize> = (edge..effort.len() - edge).step_by(step).collect();
    let design = DMatrix::from_fn(rows.len(), columns.len(), |r, c| columns[c][rows[r]]);
    let right: Vec<f64> = rows.iter().map(|r| effort[*r]).collect();
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

/// Terms of the equation from filtered samples.
fn columns(
    run: &FreeRun,
    directions: &Directions,
    split: bool,
    smooth: impl Fn(&[f64]) -> Result<Vec<f64>, torqcomp_dsp::Error>,
) -> Result<Vec<Vec<f64>>, Failure> {
    let rate = run.rate_hz;
    let filtered = smooth(run.motion)?;
    let speed = match run.kind {
        Motion::Displacement => differences(&filtered, rate),
        _ => filtered,
    };
    let mut columns = vec![differences(&speed, rate)];
    if split {
        columns.push(speed.iter().map(|v| v.max(0.0)).collect());
        columns.push(speed.iter().map(|v| v.min(0.0)).collect());
    } else {
        columns.push(speed.clone());
    }
    if directions.both() {
        let signs: Vec<f64> = speed.iter().map(|v| v.signum()).collect();
        columns.push(smooth(&signs)?);
    }
    columns.push(vec![1.0; speed.len()]);
    Ok(columns)
}

fn differences(samples: &[f64], rate_hz: f64) -> Vec<f64> {
    let last = samples.len() - 1;
    (0..=last)
        .map(|i| {
            let (from, to) = (i.saturating_sub(1), (i + 1).min(last));
            (samples[to] - samples[from]) * rate_hz / (to - from) as f64
        })
        .collect()
}
