//! Lines of the mains in a record of decays.

use std::borrow::Cow;

use torqcomp_dsp::harmonics::{fit, refine_fundamental};
use torqcomp_dsp::quality::mains::mains;

use super::search::SteadyLine;

/// How far the mains may be off their nominal frequency, over it.
const OFF: f64 = 0.006;
/// Steps in which the half of a record moves from its beginning to its end.
const HALVES: usize = 3;

/// A uniformly sampled record without the lines of the mains that stand out of it, which would hide where a decay begins
/// and ends; and these lines. Without any, or in a record too short to tell them, it is unchanged.
pub(super) fn without_mains(
    values: &[f64],
    rate_hz: Option<f64>,
) -> (Cow<'_, [f64]>, Vec<SteadyLine>) {
    let found = rate_hz.and_then(|rate_hz| Some((rate_hz, mains(values, rate_hz)?)));
    let Some((rate_hz, mains)) = found else {
        return (values.into(), Vec::new());
    };
    let orders: Vec<f64> = mains.lines.iter().map(|line| line.order as f64).collect();
    // A decay leaks into the lines: they are taken from the half of the record where least else happens.
    let half = values.len() / 2;
    let of_half = |start: usize| {
        let part = &values[start..start + half];
        let fundamental = refine_fundamental(part, rate_hz, mains.nominal_hz, OFF, &orders).ok()?;
        fit(part, rate_hz, start as f64 / rate_hz, fundamental, &orders).ok()
    };
    let starts = (0..=HALVES).map(|k| k * (values.len() - half) / HALVES);
    let quietest = starts
        .filter_map(of_half)
        .min_by(|a, b| a.residual_rms.total_cmp(&b.residual_rms));
    let Some(fitted) = quietest else {
        return (values.into(), Vec::new());
    };
    let at = |(i, value): (usize, &f64)| {
        let t = i as f64 / rate_hz;
        let line = |c: &torqcomp_dsp::harmonics::Component| {
            let angle = std::f64::consts::TAU * c.frequency_hz * t;
            c.phasor.re * angle.cos() - c.phasor.im * angle.sin()
        };
        value - fitted.components.iter().map(line).sum::<f64>()
    };
    let left: Vec<f64> = values.iter().enumerate().map(at).collect();
    let lines = fitted.components.iter().map(|c| SteadyLine {
        frequency_hz: c.frequency_hz,
        amplitude: c.phasor.norm(),
    });
    (left.into(), lines.collect())
}
