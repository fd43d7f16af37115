//! Splitting of records into blocks: hits, segments of noise, or periods.

use std::borrow::Cow;
use std::ops::Range;

use num_complex::Complex64;
use torqcomp_dsp::frf::{self, Block, Powers, Window};

use super::force::{StrokeNoise, force_of_hit};
use super::{Driven, Excitation, ResponseOptions, check, kind};
use crate::failure::{ErrorCode, Failure};
use crate::identify::hum::{self, without_mains};
use crate::identify::{Identification, rms};
use crate::print::{plural, rounded, short};
use crate::warning::WarningCode;

/// Blocks of all records, on a common frequency grid.
pub(super) struct Set {
    pub blocks: Vec<Block>,
    /// Number of lines, from 0 to half the sampling rate.
    pub lines: usize,
    /// The lines that are fitted.
    pub band: Range<usize>,
    /// Powers summed over all blocks.
    pub powers: Powers,
    /// Record of each block.
    pub record: Vec<usize>,
    pub step_hz: f64,
    /// Decay rate in 1/s that the window adds to every mode.
    pub added_rate: f64,
    pub window: Window,
    /// Whether the spectra are those of sample differences, divided by the response of the difference.
    pub of_differences: bool,
    /// Whether the blocks are periods.
    pub is_periodic: bool,
    /// Noise of the force within the stroke of each block, as far as it is known.
    pub strokes: Vec<(usize, StrokeNoise)>,
}

impl Set {
    fn new(cut: Vec<(usize, Block)>, step_hz: f64, window: Window) -> Self {
        let (record, blocks): (Vec<usize>, Vec<Block>) = cut.into_iter().unzip();
        Self {
            powers: Powers::of(blocks.iter(), 0..usize::MAX),
            lines: blocks.first().map_or(0, |block| block.applied.len()),
            band: 0..0,
            blocks,
            record,
            step_hz,
            added_rate: 0.0,
            window,
            of_differences: false,
            is_periodic: false,
            strokes: Vec::new(),
        }
    }

    /// Drops the lines of segments of noise above the band, which may be most of the memory. Those of the single
    /// blocks of other excitations show the error of the force.
    pub fn drop_lines_above(&mut self) {
        if self.window != Window::Hann {
            return;
        }
        for block in &mut self.blocks {
            for channel in [&mut block.applied, &mut block.measured] {
                channel.truncate(self.band.end);
                channel.shrink_to_fit();
            }
        }
    }

    /// Mean relative error over all blocks of a response given at the lines of the band.
    pub fn error(&self, response: &[Complex64]) -> f64 {
        let error = |block| frf::prediction_error(response, block, self.band.clone());
        self.blocks.iter().map(error).sum::<f64>() / self.blocks.len() as f64
    }
}

/// Amplitude at the end of a hit, relative to the largest, above which a window is needed.
const RINGING: f64 = 5e-3;

/// Value of the window at the end.
const WINDOW_END: f64 = 1e-2;

/// Splits all records.
pub(super) fn blocks(
    records: &[Driven],
    options: &ResponseOptions,
    result: &mut Identification,
) -> Result<Set, Failure> {
    check::records(records)?;
    let excitation = options
        .excitation
        .unwrap_or_else(|| kind::guess(records[0].applied));
    match excitation {
        Excitation::Impact => impacts(records, result),
        Excitation::Transient => Ok(whole_transients(records, result)),
        Excitation::Random => random(records, options, result),
        Excitation::Periodic => periodic(records, options, result),
    }
}

/// Divisor of the record length that gives the length at either end over which levels are
/// estimated.
pub(super) const END: usize = 10;

/// Mean of samples.
pub(super) fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

/// Applied and measured signal of each record without mains lines, which are not a response to a transient.
struct Clean<'a>(Vec<[Cow<'a, [f64]>; 2]>);

impl<'a> Clean<'a> {
    fn of(records: &[Driven<'a>], result: &mut Identification) -> Self {
        let mut lines = Vec::new();
        let mut clean = |samples, rate_hz| {
            let (left, of_mains) = without_mains(samples, Some(rate_hz));
            lines.extend(of_mains);
            left
        };
        let both = |r: &Driven<'a>| [r.applied, r.measured].map(|v| clean(v, r.rate_hz));
        let all = records.iter().map(both).collect();
        hum::taken_off(result, &lines);
        Self(all)
    }

    fn records<'b>(&'b self, recorded: &[Driven<'b>]) -> Vec<Driven<'b>> {
        let pairs = recorded.iter().zip(&self.0);
        let of = |(record, [applied, measured]): (&Driven<'b>, &'b [Cow<'a, [f64]>; 2])| Driven {
            applied,
            measured,
            ..*record
        };
        pairs.map(of).collect()
    }
}

/// A transient of a record.
struct Transient {
    record: usize,
    applied: Vec<f64>,
    measured: Vec<f64>,
}

fn impacts(recorded: &[Driven], result: &mut Identification) -> Result<Set, Failure> {
    // Hum hides the flat top of clipping.
    let good = good_hits(recorded, result)?;
    let clean = Clean::of(recorded, result);
    let records = &clean.records(recorded);
    let folded = |(r, range): &(usize, Range<usize>)| {
        frf::near_half_rate(&recorded[*r].applied[range.clone()])
    };
    check::short_pulses(result, mean(&good.iter().map(folded).collect::<Vec<f64>>()));
    let length = good.iter().map(|(_, range)| range.len()).min().unwrap_or(0);
    let of = |(r, range): &(usize, Range<usize>)| {
        let range = range.start..range.start + length;
        let force = force_of_hit(&records[*r].applied[range.clone()]);
        let (applied, noise) = (force.samples, (force.stroke, force.bias));
        let transient = Transient {
            record: *r,
            applied,
            measured: without_offset(&records[*r].measured[range]),
        };
        (transient, noise)
    };
    let rings = |(r, range): &(usize, Range<usize>)| {
        let measured = &records[*r].measured[range.start..range.start + length];
        // A constant level is no ringing.
        still_rings(&without_offset(measured))
    };
    let window = window_for(good.iter().any(rings), length);
    let (cut, noises): (Vec<Transient>, Vec<_>) = good.iter().map(of).unzip();
    let (strokes, biases): (Vec<Option<StrokeNoise>>, Vec<f64>) = noises.into_iter().unzip();
    check::noise_on_force(result, mean(&biases));
    let strokes = strokes.into_iter().enumerate();
    Ok(Set {
        strokes: strokes.filter_map(|(b, s)| Some((b, s?))).collect(),
        ..transients(&cut, records[0].rate_hz, window, result)
    })
}

/// A signal without its level before the hit.
pub(super) fn without_offset(signal: &[f64]) -> Vec<f64> {
    let level = mean(&signal[..8]);
    signal.iter().map(|v| v - level).collect()
}

/// Every record as one transient, whatever its shape. The spectra are those of sample differences over 1 − e^(−jω), as
/// the levels at start and end may differ.
fn whole_transients(recorded: &[Driven], result: &mut Identification) -> Set {
    let clean = Clean::of(recorded, result);
    let records = &clean.records(recorded);
    let length = records.iter().map(|r| r.applied.len()).min().unwrap_or(0);
    let differences = |v: &[f64]| -> Vec<f64> {
        let steps = v[..length].windows(2).map(|pair| pair[1] - pair[0]);
        std::iter::once(0.0).chain(steps).collect()
    };
    let of = |(record, driven): (usize, &Driven)| Transient {
        record,
        applied: differences(driven.applied),
        measured: differences(driven.measured),
    };
    let rings = |record: &Driven| {
        let end = &record.measured[length - (length / END).max(1)..length];
        let about: Vec<f64> = record.measured[..length]
            .iter()
            .map(|v| v - mean(end))
            .collect();
        still_rings(&about)
    };
    let window = window_for(records.iter().any(rings), length);
    let cut: Vec<Transient> = records.iter().enumerate().map(of).collect();
    let mut set = transients(&cut, records[0].rate_hz, window, result);
    for block in &mut set.blocks {
        for (k, (x, y)) in block
            .applied
            .iter_mut()
            .zip(&mut block.measured)
            .enumerate()
        {
            let turn = std::f64::consts::TAU * k as f64 / length as f64;
            let factor = match k {
                0 => Complex64::ZERO,
                _ => 1.0 / (1.0 - Complex64::cis(-turn)),
            };
            (*x, *y) = (*x * factor, *y * factor);
        }
    }
    set.powers = Powers::of(set.blocks.iter(), 0..usize::MAX);
    set.of_differences = true;
    result
        .method
        .push("each record treated as a single transient, of any shape".to_owned());
    set
}

/// Blocks of transients.
fn transients(cut: &[Transient], rate_hz: f64, window: Window, result: &mut Identification) -> Set {
    let added_rate = match window {
        Window::Exponential(tau) => {
            result.method.push(format!(
                "exponential window with a time constant of {} s on both channels, its damping subtracted",
                short(tau / rate_hz)
            ));
            rate_hz / tau
        }
        _ => 0.0,
    };
    let block = |t: &Transient| (t.record, frf::transform(&t.applied, &t.measured, window));
    let length = cut.first().map_or(1, |t| t.applied.len());
    let blocks = cut.iter().map(block).collect();
    Set {
        added_rate,
        ..Set::new(blocks, rate_hz / length as f64, window)
    }
}

/// Record and samples of each usable hit; the others are reported.
fn good_hits(
    records: &[Driven],
    result: &mut Identification,
) -> Result<Vec<(usize, Range<usize>)>, Failure> {
    let rate_hz = records[0].rate_hz;
    let apart = (0.05 * rate_hz) as usize;
    let mut good = Vec::new();
    let mut bad = Vec::new();
    let mut left = 0.0_f64;
    for (r, record) in records.iter().enumerate() {
        let hits = frf::find_hits(record.applied, record.measured, apart);
        for (k, hit) in hits.into_iter().enumerate() {
            if hit.faults.is_empty() {
                left = left.max(hit.left);
                if let Some(part) = hit.second {
                    result.warn(WarningCode::SecondStroke.warning(second_stroke(record, k, part)));
                }
                good.push((r, hit.range));
                continue;
            }
            let why: Vec<String> = hit.faults.iter().map(ToString::to_string).collect();
            bad.push(format!(
                "{}, hit {} at {} s is not used: {}",
                record.name,
                k + 1,
                short(hit.peak as f64 / rate_hz),
                why.join(" and ")
            ));
        }
    }
    if good.is_empty() {
        bad.push(
            "no usable hit; hit once, without overdriving the inputs, or choose another --excitation: transient takes \
             any record as it is"
                .to_owned(),
        );
        return Err(ErrorCode::TooFewSamples.failed(bad.join("; ")));
    }
    check::overlapping_hits(result, left);
    for message in bad {
        result.warn(WarningCode::HitLeftOut.warning(message));
    }
    Ok(good)
}

fn second_stroke(record: &Driven, k: usize, part: f64) -> String {
    format!(
        "{}, hit {}: second stroke with {} % of the force; the hit is used, as the recorded force includes both",
        record.name,
        k + 1,
        rounded(100.0 * part, 2)
    )
}

/// Whether a response is still ringing at its end.
fn still_rings(measured: &[f64]) -> bool {
    let top = measured.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    rms(&measured[measured.len() - measured.len() / 20..]) > RINGING * top
}

/// An exponential window, if a response is still ringing at the end.
fn window_for(still_rings: bool, length: usize) -> Window {
    match still_rings {
        true => Window::Exponential(length as f64 / -WINDOW_END.ln()),
        false => Window::None,
    }
}

fn random(
    records: &[Driven],
    options: &ResponseOptions,
    result: &mut Identification,
) -> Result<Set, Failure> {
    let rate_hz = records[0].rate_hz;
    let total: usize = records.iter().map(|r| r.applied.len()).sum();
    // About thirty segments: enough to average, long enough to resolve modes.
    let length = options
        .segment
        .unwrap_or_else(|| (total / 16).clamp(64, 1 << 14) & !1);
    let mut all = Vec::new();
    for (r, record) in records.iter().enumerate() {
        let cut = frf::segments(record.applied, record.measured, length);
        all.extend(cut.into_iter().map(|block| (r, block)));
    }
    if all.len() < 4 {
        return Err(ErrorCode::TooFewSamples.failed(format_args!(
            "only {} of {length} samples in the records, at least 4 are needed; choose a shorter --segment, or \
             record longer",
            plural(all.len(), "segment")
        )));
    }
    result.method.push(format!(
        "Hann-weighted segments of {length} samples, 50 % overlap"
    ));
    Ok(Set::new(all, rate_hz / length as f64, Window::Hann))
}

fn periodic(
    records: &[Driven],
    options: &ResponseOptions,
    result: &mut Identification,
) -> Result<Set, Failure> {
    let rate_hz = records[0].rate_hz;
    let period = options
        .period
        .or_else(|| frf::find_period(records[0].applied));
    let period = period.ok_or_else(|| {
        ErrorCode::TooFewSamples.failed(
            "no period found in the applied signal; give it with --period, or --excitation random",
        )
    })?;
    if period < 2 {
        return Err(ErrorCode::InvalidValue.usage(format_args!(
            "--period {period}: a period has two samples or more; count them in one period of the excitation"
        )));
    }
    let mut all = Vec::new();
    for (r, record) in records.iter().enumerate() {
        let block = |k: usize| {
            let samples = k * period..(k + 1) * period;
            let applied = &record.applied[samples.clone()];
            frf::transform(applied, &record.measured[samples], Window::None)
        };
        let mut cut: Vec<Block> = (0..record.applied.len() / period).map(block).collect();
        // The first period still contains the transient.
        if cut.len() > 2 {
            cut.remove(0);
        }
        if let Some(averaged) = frf::average_periods(&cut) {
            report_noise(result, record.name, &averaged);
        }
        all.extend(cut.into_iter().map(|block| (r, block)));
    }
    if all.is_empty() {
        return Err(ErrorCode::TooFewSamples.failed(format_args!(
            "the records are shorter than one period of {period} samples"
        )));
    }
    result
        .method
        .push(format!("periods of {period} samples, without the first"));
    Ok(Set {
        is_periodic: true,
        ..Set::new(all, rate_hz / period as f64, Window::None)
    })
}

/// Reports the level of noise and distortion.
fn report_noise(result: &mut Identification, name: &str, found: &frf::Periodic) {
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
    result.method.push(format!(
        "{name}: relative to the response, noise {} dB, distortion at unexcited lines {}",
        decibel(noise),
        if others > 0.0 {
            format!("{} dB", decibel(others))
        } else {
            "none".to_owned()
        }
    ));
    if others > 4.0 * noise && others > 1e-4 * signal {
        result.warn(WarningCode::Nonlinear.warning(format!(
            "{name}: at frequencies that were not excited the response has more power than noise explains ({} dB): \
             the stand is nonlinear at this level",
            decibel(others)
        )));
    }
}
