//! Faults of a recording, as text with stable codes.
//!
//! The criteria are those of [`torqcomp_dsp::quality`], applied here to the channels and time axes of
//! a recording. `docs/inspect.md` lists the codes.

pub mod copies;
pub mod excerpt;
pub(crate) mod resonance;
pub mod samples;
pub mod time;

use std::collections::HashMap;

use torqcomp_dsp::quality::clipping::Clipping;
use torqcomp_dsp::quality::mains::MainsLine;
use torqcomp_dsp::quality::quantisation::{Quantisation, quantisation};
use torqcomp_dsp::quality::repeats::repeats;
use torqcomp_dsp::quality::spikes::{Spikes, spikes};

use crate::recording::{AlignedChannels, Channel, TimeAxis};
use crate::warning::{Warning, WarningCode};

pub use samples::{Findings, clipped_ends, interpolated_by, repeats_of};
pub use time::TimeFindings;

/// Warnings about samples to be used by a command, and about their time axis.
///
/// `name` is the name of the channel, `unit` the unit of the samples.
///
/// ```
/// use torqcomp::quality;
/// use torqcomp::recording::TimeAxis;
/// let samples: Vec<f64> = (0..1000).map(|i| (0.1 * f64::from(i)).sin().min(0.7)).collect();
/// let axis = TimeAxis::of_header("Delta_X", 1000.0, None);
/// let found = quality::warnings("torque", "N m", &samples, &axis);
/// assert_eq!(found[0].code, "clipped");
/// ```
pub fn warnings(name: &str, unit: &str, samples: &[f64], axis: &TimeAxis) -> Vec<Warning> {
    of_findings(name, unit, Findings::of(samples, axis.rate_hz), axis)
}

/// The same from existing findings.
fn of_findings(name: &str, unit: &str, mut findings: Findings, axis: &TimeAxis) -> Vec<Warning> {
    let mut found = TimeFindings::of(axis).warnings(&format!("\"{name}\""), axis);
    // Here the lines are most likely the measured signal: a machine synchronous with the mains has even multiples, hum
    // hardly any.
    let is_odd = |line: &MainsLine| line.order % 2 == 1;
    findings.mains = findings
        .mains
        .filter(|mains| mains.lines.iter().all(is_odd));
    found.extend(findings.warnings(name, unit, axis, &[]));
    found.extend(findings.dead().map(|value| constant(&[(name, value)])));
    found.extend(findings.coarse().map(|q| coarse(&[(name, unit, q)])));
    found
}

/// Warnings about clipping of channels sampled together.
pub(crate) fn clipped(aligned: &AlignedChannels) -> Vec<Warning> {
    let axis = TimeAxis::uniform(aligned.rate_hz, aligned.start);
    let of_channel = |channel: &Channel| {
        let unit = channel.unit.as_ref().map_or("", |unit| &unit.text);
        let found = Clipping::of(&channel.samples)?;
        Some(clipped_ends(&channel.name, unit, &found, &axis))
    };
    let channels = aligned.channels.iter();
    channels.filter_map(of_channel).flatten().collect()
}

/// Warnings about isolated outliers in channels sampled together.
pub(crate) fn spiked(aligned: &AlignedChannels) -> Vec<Warning> {
    let axis = TimeAxis::uniform(aligned.rate_hz, aligned.start);
    let of_channel = |channel: &Channel| {
        let found = Spikes::of(&spikes(&channel.samples))?;
        Some(samples::spiked(
            &channel.name,
            unit_of(channel),
            &found,
            &axis,
        ))
    };
    aligned.channels.iter().filter_map(of_channel).collect()
}

/// Warnings about values that are held, of channels sampled together.
pub(crate) fn repeated(aligned: &AlignedChannels) -> Vec<Warning> {
    let axis = TimeAxis::uniform(aligned.rate_hz, aligned.start);
    let of_channel =
        |channel: &Channel| repeats_of(&channel.name, &repeats(&channel.samples)?, &axis);
    aligned.channels.iter().filter_map(of_channel).collect()
}

/// Number of levels below which the steps of a converter show in a fit to many samples.
const SEEN_IN_A_FIT: f64 = 100.0;

/// Warning about channels too coarse for a fit, if there are any.
pub(crate) fn coarse_of(channels: &[Channel]) -> Vec<Warning> {
    let named = channels.iter().filter_map(|channel| {
        let found = quantisation(&channel.samples)?;
        if !samples::is_coarse(&found, SEEN_IN_A_FIT) {
            return None;
        }
        Some((channel.name.as_str(), unit_of(channel), found))
    });
    let named: Vec<_> = named.collect();
    match named.is_empty() {
        true => Vec::new(),
        false => vec![coarse(&named)],
    }
}

/// Warning about constant channels.
pub fn constant(channels: &[(&str, f64)]) -> Warning {
    let named = channels
        .iter()
        .map(|(name, value)| format!("\"{name}\" is always {}", crate::print::short(*value)));
    WarningCode::ConstantChannel.warning(format!(
        "{}: not connected, not selected, or no signal",
        join(named)
    ))
}

/// Warning about coarsely resolved channels.
pub fn coarse(channels: &[(&str, &str, Quantisation)]) -> Warning {
    let named = channels.iter().map(|(name, unit, q)| {
        format!(
            "\"{name}\" has {} steps of {} in its range ({} bits)",
            crate::print::short(q.levels - 1.0),
            with_unit(q.step, unit, 4),
            crate::print::rounded(q.bits, 2)
        )
    });
    WarningCode::CoarseQuantisation.warning(format!(
        "{}: rounding alone adds noise of 0.29 steps rms; use a smaller input range",
        join(named)
    ))
}

/// `a; b; c`, truncated if there are very many.
fn join(items: impl Iterator<Item = String>) -> String {
    const MOST: usize = 12;
    let items: Vec<String> = items.collect();
    if items.len() <= MOST {
        return items.join("; ");
    }
    format!(
        "{}; and {} more",
        items[..MOST].join("; "),
        items.len() - MOST
    )
}

/// A number with its unit, if known.
pub(crate) fn with_unit(value: f64, unit: &str, digits: u32) -> String {
    let value = crate::print::rounded(value, digits);
    if unit.is_empty() {
        value
    } else {
        format!("{value} {unit}")
    }
}

/// Position of a sample for a message: its time if known, or its number from 1.
fn place(axis: &TimeAxis, index: usize) -> String {
    let stamp = axis.stamps_s.as_ref().and_then(|t| t.get(index).copied());
    let counted = || {
        axis.rate_hz
            .map(|rate| axis.start.unwrap_or_default().later(index as f64 / rate))
    };
    let stamp = stamp
        .filter(|t| t.is_finite())
        .map(|after_s| axis.moment(after_s));
    match stamp.or_else(counted) {
        Some(moment) => moment.short(),
        None => format!("sample {}", index + 1),
    }
}

/// Unit of a channel as written in the file; empty if none.
pub fn unit_of(channel: &Channel) -> &str {
    let known = channel.unit.as_ref().map(|unit| unit.text.as_str());
    channel.unit_text.as_deref().or(known).unwrap_or("")
}

/// Unambiguous names of channels: with the segment, or the number of the channel where several of one
/// segment have the same name.
pub fn labels(channels: &[Channel]) -> Vec<String> {
    let key = |channel: &Channel| (channel.name.clone(), channel.segment);
    let mut counts: HashMap<(String, Option<usize>), usize> = HashMap::new();
    for channel in channels {
        *counts.entry(key(channel)).or_default() += 1;
    }
    let label = |(i, channel): (usize, &Channel)| {
        let mut label = channel.name.clone();
        if let Some(segment) = channel.segment {
            label.push_str(&format!(" (segment {})", segment + 1));
        }
        if counts[&key(channel)] > 1 {
            label.push_str(&format!(" (channel {})", i + 1));
        }
        label
    };
    channels.iter().enumerate().map(label).collect()
}
