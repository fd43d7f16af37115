//! Mains lines in records of free decays and hits.

use std::borrow::Cow;

use torqcomp_dsp::harmonics::{Harmonics, fit, refine_fundamental};
use torqcomp_dsp::quality::mains::mains;

use super::Identification;
use crate::print::rounded;
use crate::warning::WarningCode;

/// A steady line in addition to the decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SteadyLine {
    pub frequency_hz: f64,
    /// Largest amplitude over the segments.
    pub amplitude: f64,
    /// Whether its frequency is that of a mains line.
    pub is_of_mains: bool,
}

/// Relative tolerance of the mains frequency.
const OFF: f64 = 0.006;
/// Number of steps in which a window of half, and of a quarter, of the length moves from the beginning of a record to its end.
const STEPS: [usize; 2] = [3, 9];
/// Residual of the quietest quarter relative to that of the quietest half, below which the half contains a decay.
const QUIETER: f64 = 0.3;
/// Largest standard uncertainty of the phase over the record, in rad: beyond, the lines that are removed would be left as
/// beats, and they are fitted together with the decay instead.
const PHASE: f64 = 0.3;

/// A uniformly sampled record without significant mains lines, which would hide where a decay begins and ends, and
/// these lines. Unchanged if there are none, or the record is too short to detect them.
pub(super) fn without_mains(
    values: &[f64],
    rate_hz: Option<f64>,
) -> (Cow<'_, [f64]>, Vec<SteadyLine>) {
    let found = rate_hz.and_then(|rate_hz| Some((rate_hz, mains(values, rate_hz)?)));
    let Some((rate_hz, mains)) = found else {
        return (values.into(), Vec::new());
    };
    let orders: Vec<f64> = mains.lines.iter().map(|line| line.order as f64).collect();
    // A decay leaks into the lines, so they are estimated from the quietest half of the record, or from the quietest
    // quarter if decays are in every half.
    let quietest = |length: usize, count: usize| {
        let of_part = |start: usize| {
            let part = &values[start..start + length];
            let nominal_hz = mains.nominal_hz;
            let fundamental = refine_fundamental(part, rate_hz, nominal_hz, OFF, &orders).ok()?;
            let std_hz = fundamental.std_hz.unwrap_or(0.0);
            let fitted = fit(part, rate_hz, start as f64 / rate_hz, fundamental, &orders);
            Some((fitted.ok()?, std_hz))
        };
        let starts = (0..=count).map(|k| k * (values.len() - length) / count);
        let all = starts.filter_map(of_part);
        all.min_by(|a, b| a.0.residual_rms.total_cmp(&b.0.residual_rms))
    };
    let half = quietest(values.len() / 2, STEPS[0]);
    let quarter = quietest(values.len() / 4, STEPS[1]);
    let is_quieter = |(part, _): &(Harmonics, f64)| {
        let of_half = half
            .as_ref()
            .map_or(f64::INFINITY, |(fit, _)| fit.residual_rms);
        part.residual_rms < QUIETER * of_half
    };
    let found = quarter.filter(is_quieter).or(half);
    let length_s = values.len() as f64 / rate_hz;
    let is_known =
        |(_, std_hz): &(Harmonics, f64)| std::f64::consts::TAU * std_hz * length_s < PHASE;
    let Some((fitted, _)) = found.filter(is_known) else {
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
        is_of_mains: true,
    });
    (left.into(), lines.collect())
}

/// The lines as text, without duplicates.
pub(super) fn listed(lines: &[SteadyLine]) -> String {
    let each = |line: &SteadyLine| {
        let [frequency, amplitude] =
            [(line.frequency_hz, 5), (line.amplitude, 2)].map(|(v, digits)| rounded(v, digits));
        format!("{frequency} Hz (amplitude {amplitude})")
    };
    // The remainder of a line after the first fit is the same line.
    let is_same = |a: &SteadyLine, b: &SteadyLine| (a.frequency_hz - b.frequency_hz).abs() < 0.5;
    let first = |(i, line): &(usize, &SteadyLine)| !lines[..*i].iter().any(|l| is_same(l, line));
    let different = lines.iter().enumerate().filter(first);
    let each: Vec<String> = different.map(|(_, line)| each(line)).collect();
    each.join(", ")
}

/// Warns about removed lines.
pub(super) fn taken_off(result: &mut Identification, lines: &[SteadyLine]) {
    let (of_mains, others): (Vec<SteadyLine>, Vec<SteadyLine>) =
        lines.iter().partition(|line| line.is_of_mains);
    for (code, what, lines) in [
        (
            WarningCode::MainsTakenOff,
            "steady lines of the mains",
            of_mains,
        ),
        (
            WarningCode::ToneTakenOff,
            "steady lines, as from a running fan or motor,",
            others,
        ),
    ] {
        if !lines.is_empty() {
            result.warn(code.warning(format!(
                "{what} were fitted and removed: {}; if one of them is the stand's own, record for longer, until \
                 it has decayed",
                listed(&lines)
            )));
        }
    }
}
