//! Records cut into blocks: hits, segments of noise, or periods.

use std::ops::Range;

use torqcomp_dsp::frf::{self, Block, Powers, Window};

use super::{Driven, Excitation, Options, check};
use crate::failure::Failure;
use crate::identify::{Outcome, rms};
use crate::print::{rounded, short};

/// Blocks of all records, on one grid of frequencies.
pub(super) struct Set {
    pub blocks: Vec<Block>,
    /// Powers of all blocks together.
    pub powers: Powers,
    /// Record that each block is from.
    pub record: Vec<usize>,
    pub step_hz: f64,
    /// Decay rate that the window adds, 1/s.
    pub added_rate: f64,
    /// What the blocks are weighted with.
    pub window: Window,
}

/// Part of the samples that a hammer leaves at rest.
const AT_REST: f64 = 0.95;

/// Swing at the end of a hit's record, over the largest, from which on a window is needed.
const RINGING: f64 = 5e-3;

/// The window falls to this at the end.
const WINDOW_END: f64 = 1e-2;

/// Cuts all records.
pub(super) fn blocks(
    records: &[Driven],
    options: &Options,
    outcome: &mut Outcome,
) -> Result<Set, Failure> {
    check::records(records)?;
    let excitation = options
        .excitation
        .unwrap_or_else(|| guess(records[0].applied));
    match excitation {
        Excitation::Impact => impacts(records, outcome),
        Excitation::Random => random(records, options, outcome),
        Excitation::Periodic => periodic(records, options, outcome),
    }
}

fn guess(applied: &[f64]) -> Excitation {
    let largest = applied.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let quiet = applied.iter().filter(|v| v.abs() < 0.1 * largest).count();
    if quiet as f64 > AT_REST * applied.len() as f64 {
        Excitation::Impact
    } else if frf::find_period(applied).is_some() {
        Excitation::Periodic
    } else {
        Excitation::Random
    }
}

fn impacts(records: &[Driven], outcome: &mut Outcome) -> Result<Set, Failure> {
    let rate_hz = records[0].rate_hz;
    let good = good_hits(records, outcome)?;
    let length = good.iter().map(|(_, range)| range.len()).min().unwrap_or(0);
    let window = window_for(records, &good, length);
    let added_rate = match window {
        Window::Exponential(tau) => {
            outcome.method.push(format!(
                "exponential window with a time constant of {} s on both channels, taken out of the damping",
                short(tau / rate_hz)
            ));
            rate_hz / tau
        }
        _ => 0.0,
    };
    let block = |(r, range): &(usize, Range<usize>)| {
        let range = range.start..range.start + length;
        let record = &records[*r];
        // What stands before the hit is offset.
        let level = |v: &[f64]| v[..8].iter().sum::<f64>() / 8.0;
        let without = |v: &[f64]| v.iter().map(|x| x - level(v)).collect::<Vec<f64>>();
        let applied = without(&record.applied[range.clone()]);
        frf::transform(&applied, &without(&record.measured[range]), window)
    };
    let blocks: Vec<Block> = good.iter().map(block).collect();
    Ok(Set {
        powers: Powers::of(blocks.iter(), 0..usize::MAX),
        blocks,
        record: good.iter().map(|(r, _)| *r).collect(),
        step_hz: rate_hz / length as f64,
        added_rate,
        window,
    })
}

/// Record and samples of each hit that can be used; the others are named.
fn good_hits(
    records: &[Driven],
    outcome: &mut Outcome,
) -> Result<Vec<(usize, Range<usize>)>, Failure> {
    let rate_hz = records[0].rate_hz;
    let apart = (0.05 * rate_hz) as usize;
    let mut good = Vec::new();
    let mut bad = Vec::new();
    for (r, record) in records.iter().enumerate() {
        let hits = frf::find_hits(record.applied, record.measured, apart);
        for (k, hit) in hits.into_iter().enumerate() {
            if hit.faults.is_empty() {
                if let Some(part) = hit.second {
                    outcome.warn("second-stroke", second_stroke(record, k, part));
                }
                good.push((r, hit.range));
                continue;
            }
            let why: Vec<String> = hit.faults.iter().map(ToString::to_string).collect();
            bad.push(format!(
                "{}, hit {} at {} s was left out: {}",
                record.name,
                k + 1,
                short(hit.peak as f64 / rate_hz),
                why.join(" and ")
            ));
        }
    }
    if good.is_empty() {
        bad.push(
            "no usable hit is in the records; hit again, once, without overdriving the inputs, or choose \
             another --excitation"
                .to_owned(),
        );
        return Err(Failure::failed(bad.join("; ")));
    }
    for message in bad {
        outcome.warn("hit-left-out", message);
    }
    Ok(good)
}

fn second_stroke(record: &Driven, k: usize, part: f64) -> String {
    format!(
        "{}, hit {}: the hammer struck again with {} % of the force; both strokes are in the force, so that the hit \
         is used, but a clean one is better",
        record.name,
        k + 1,
        rounded(100.0 * part, 2)
    )
}

/// An exponential window, if a response still rings at its end.
fn window_for(records: &[Driven], good: &[(usize, Range<usize>)], length: usize) -> Window {
    let still_rings = good.iter().any(|(r, range)| {
        let part = &records[*r].measured[range.start..range.start + length];
        let top = part.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        rms(&part[length - length / 20..]) > RINGING * top
    });
    if still_rings {
        Window::Exponential(length as f64 / -WINDOW_END.ln())
    } else {
        Window::None
    }
}

fn random(records: &[Driven], options: &Options, outcome: &mut Outcome) -> Result<Set, Failure> {
    let rate_hz = records[0].rate_hz;
    let total: usize = records.iter().map(|r| r.applied.len()).sum();
    // Some thirty segments: enough to average, long enough to resolve.
    let length = options
        .segment
        .unwrap_or_else(|| (total / 16).clamp(64, 1 << 14) & !1);
    let mut blocks = Vec::new();
    let mut of = Vec::new();
    for (r, record) in records.iter().enumerate() {
        let cut = frf::segments(record.applied, record.measured, length);
        of.extend(std::iter::repeat_n(r, cut.len()));
        blocks.extend(cut);
    }
    if blocks.len() < 4 {
        return Err(Failure::failed(format_args!(
            "segments of {length} samples fit only {} times into the records; make them shorter with \
             --segment, or record longer",
            blocks.len()
        )));
    }
    outcome.method.push(format!(
        "Hann-weighted segments of {length} samples, half overlapping"
    ));
    Ok(Set {
        powers: Powers::of(blocks.iter(), 0..usize::MAX),
        blocks,
        record: of,
        step_hz: rate_hz / length as f64,
        added_rate: 0.0,
        window: Window::Hann,
    })
}

fn periodic(records: &[Driven], options: &Options, outcome: &mut Outcome) -> Result<Set, Failure> {
    let rate_hz = records[0].rate_hz;
    let period = options.period.or_else(|| frf::find_period(records[0].applied)).ok_or_else(|| {
        Failure::failed("no period is found in the applied signal; give it with --period, or --excitation random")
    })?;
    let mut blocks = Vec::new();
    let mut of = Vec::new();
    for (r, record) in records.iter().enumerate() {
        let cut: Vec<Block> = (0..record.applied.len() / period)
            .map(|k| k * period..(k + 1) * period)
            .map(|p| {
                frf::transform(
                    &record.applied[p.clone()],
                    &record.measured[p],
                    Window::None,
                )
            })
            .collect();
        // The first period still holds what went before.
        let steady = if cut.len() > 2 { &cut[1..] } else { &cut[..] };
        if let Some(found) = frf::average_periods(steady) {
            say_noise(outcome, record.name, &found);
        }
        of.extend(std::iter::repeat_n(r, steady.len()));
        blocks.extend_from_slice(steady);
    }
    if blocks.is_empty() {
        return Err(Failure::failed(format_args!(
            "no period of {period} samples fits into the records"
        )));
    }
    outcome.method.push(format!(
        "periods of {period} samples, the first one left out"
    ));
    Ok(Set {
        powers: Powers::of(blocks.iter(), 0..usize::MAX),
        blocks,
        record: of,
        step_hz: rate_hz / period as f64,
        added_rate: 0.0,
        window: Window::None,
    })
}

fn say_noise(outcome: &mut Outcome, name: &str, found: &frf::Periodic) {
    let lines = found.excited.len();
    let sum = |keep: &dyn Fn(usize) -> bool, of: &dyn Fn(usize) -> f64| -> f64 {
        (1..lines).filter(|k| keep(*k)).map(of).sum()
    };
    let signal = sum(&|k| found.excited[k], &|k| {
        found.mean.measured[k].norm_sqr()
    });
    let noise = sum(&|_| true, &|k| found.noise_power[k]);
    let others = sum(&|k| !found.excited[k], &|k| {
        found.mean.measured[k].norm_sqr() - found.noise_power[k]
    });
    let decibel = |power: f64| rounded(10.0 * (power.max(1e-300) / signal).log10(), 3);
    outcome.method.push(format!(
        "{name}: noise {} dB below the response, distortion at lines that are not excited {}",
        decibel(noise),
        if others > 0.0 {
            format!("{} dB", decibel(others))
        } else {
            "none".to_owned()
        }
    ));
    if others > 4.0 * noise && others > 1e-4 * signal {
        outcome.warn(
            "nonlinear",
            format!(
                "{name}: the response has power at frequencies that were not applied, more than noise explains \
                 ({} dB): the stand is not linear at this level",
                decibel(others)
            ),
        );
    }
}
