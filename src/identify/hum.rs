//! Mains lines in records of free decays and hits.

use std::borrow::Cow;

use torqcomp_dsp::harmonics::{fit, refine_fundamental};
use torqcomp_dsp::quality::mains::mains;

use super::Identification;
use crate::print::rounded;

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
/// Number of steps in which the half-length window moves from the beginning of a record to its end.
const HALVES: usize = 3;

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
    // A decay leaks into the lines, so they are estimated from the quietest half of the record.
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
        ("mains-taken-off", "steady lines of the mains", of_mains),
        (
            "tone-taken-off",
            "steady lines, as from a running fan or motor,",
            others,
        ),
    ] {
        if !lines.is_empty() {
            result.warn(
                code,
                format!(
                    "{what} were fitted and removed: {}; if one of them is the stand's own, record for longer, until \
                     it has decayed",
                    listed(&lines)
                ),
            );
        }
    }
}
