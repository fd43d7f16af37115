//! Report of a recording: description and faults of each channel.

use std::sync::Arc;

use torqcomp_dsp::quality::clipping::Clipping;
use torqcomp_dsp::quality::steps::Event;

use super::content::Content;
use super::report::{ChannelWarning, Detail, InspectedChannel, InspectedFile};
use super::whole;
use crate::parallel::{parallel, threads};
use crate::print::some_of;
use crate::quality::{self, Findings, TimeFindings, copies, labels, unit_of};
use crate::recording::moment::Moment;
use crate::recording::text::Clock;
use crate::recording::{Channel, Recording, TimeAxis};
use crate::warning::Warning;

/// Describes the content of a file.
pub fn file(content: &Content) -> InspectedFile {
    let recording = &content.recording;
    let channels = &recording.channels;
    let axes = distinct_axes(channels);
    let times: Vec<TimeFindings> = axes
        .iter()
        .map(|(axis, _)| TimeFindings::of(axis))
        .collect();
    let findings = examine(channels);
    let labels = labels(channels);

    let mut warnings = of_file(recording);
    for ((axis, members), found) in axes.iter().zip(&times) {
        let names: Vec<String> = members.iter().map(|i| labels[*i].clone()).collect();
        let all = members.len() == channels.len();
        let mut found = found.warnings(&whose(&names, all), axis);
        // The reader may have reported it already.
        found.retain(|w| recording.warnings.iter().all(|said| said.code != w.code));
        warnings.extend(found.into_iter().map(|w| said(w, names.clone())));
    }
    warnings.extend(of_channels(channels, &labels, &findings));
    let copies = copies::within(recording);
    warnings.extend(copies.into_iter().map(|(w, names)| said(w, names)));

    let time_of = |i: usize| axes.iter().position(|(_, members)| members.contains(&i));
    let described = channels.iter().zip(&findings).enumerate();
    InspectedFile {
        file: recording.source.clone(),
        format: recording.format,
        dialect: recording.dialect.clone(),
        details: details(recording),
        segments: recording.segments.clone(),
        channels: described
            .map(|(i, (channel, found))| {
                let time = time_of(i).map(|place| &times[place]);
                let described = describe(channel, found, time);
                match content.wholes.get(i).copied().flatten() {
                    Some(all) => whole::describe(&all, described),
                    None => described,
                }
            })
            .chain(content.listed.iter().cloned())
            .collect(),
        warnings,
        data_lost: recording.lost.is_some()
            || content.inventory.as_ref().is_some_and(|i| i.is_lossy),
        mcap: content.inventory.clone(),
    }
}

/// Faults of the file as a whole.
fn of_file(recording: &Recording) -> Vec<ChannelWarning> {
    recording
        .lost
        .iter()
        .chain(&recording.warnings)
        // Warnings about each channel need not be repeated for the file.
        .filter(|warning| warning.code != "non-finite")
        .map(|warning| said(warning.clone(), Vec::new()))
        .collect()
}

/// A warning with the names of the channels concerned.
pub fn said(warning: Warning, channels: Vec<String>) -> ChannelWarning {
    ChannelWarning { warning, channels }
}

fn details(recording: &Recording) -> Vec<Detail> {
    let pair = |(key, value): &(String, String)| Detail {
        key: key.clone(),
        value: value.clone(),
    };
    recording.details.iter().map(pair).collect()
}

/// The time axes of the channels, each with the numbers of its channels.
fn distinct_axes(channels: &[Channel]) -> Vec<(&TimeAxis, Vec<usize>)> {
    let mut axes: Vec<(&TimeAxis, Vec<usize>)> = Vec::new();
    for (i, channel) in channels.iter().enumerate() {
        match axes
            .iter_mut()
            .find(|(axis, _)| is_same(axis, &channel.axis))
        {
            Some((_, members)) => members.push(i),
            None => axes.push((&channel.axis, vec![i])),
        }
    }
    axes
}

fn is_same(a: &TimeAxis, b: &TimeAxis) -> bool {
    let stamps = match (&a.stamps_s, &b.stamps_s) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b) || a == b,
        (None, None) => true,
        _ => false,
    };
    let head = |axis: &TimeAxis| (axis.rate_hz, axis.rate_from.clone(), axis.assumed.clone());
    stamps && head(a) == head(b)
}

/// The channels of an axis, for people.
fn whose(names: &[String], all: bool) -> String {
    match names {
        [one] => format!("\"{one}\""),
        _ if all => "all channels".to_owned(),
        [first, second] => format!("\"{first}\" and \"{second}\""),
        [first, others @ ..] => format!("\"{first}\" and {} others", others.len()),
        [] => "no channel".to_owned(),
    }
}

/// Examines all channels, several at a time.
fn examine(channels: &[Channel]) -> Vec<Findings> {
    parallel(channels.len(), threads(), |i| {
        Findings::of(&channels[i].samples, channels[i].axis.rate_hz)
    })
}

/// Number of channels with the same fault from which it is reported once for all of them.
const MANY: usize = 4;

/// Faults of the samples; those common to many channels are reported once.
fn of_channels(
    channels: &[Channel],
    labels: &[String],
    findings: &[Findings],
) -> Vec<ChannelWarning> {
    let mut all = Vec::new();
    let mut constant = Vec::new();
    let mut coarse = Vec::new();
    for ((channel, name), found) in channels.iter().zip(labels).zip(findings) {
        let unit = unit_of(channel);
        let warnings = found.warnings(name, unit, &channel.axis, &channel.holes);
        let of_time = quality::time::stamps_in_channel(name, channel);
        let warnings = of_time.into_iter().chain(warnings);
        all.extend(warnings.map(|w| said(w, vec![name.clone()])));
        constant.extend(found.dead().map(|value| (name.as_str(), value)));
        coarse.extend(found.coarse().map(|q| (name.as_str(), unit, q)));
    }
    let mut all = gathered(all);
    if !constant.is_empty() {
        let names = constant.iter().map(|(name, _)| (*name).to_owned());
        all.push(said(quality::constant(&constant), names.collect()));
    }
    if !coarse.is_empty() {
        let names = coarse.iter().map(|(name, ..)| (*name).to_owned());
        all.push(said(quality::coarse(&coarse), names.collect()));
    }
    all
}

/// Combines warnings of one code about many channels.
fn gathered(warnings: Vec<ChannelWarning>) -> Vec<ChannelWarning> {
    let mut out: Vec<ChannelWarning> = Vec::new();
    for warning in &warnings {
        let code = warning.warning.code;
        let alike = warnings.iter().filter(|w| w.warning.code == code);
        let alike: Vec<&ChannelWarning> = alike.collect();
        if alike.len() < MANY {
            out.push(warning.clone());
        } else if out.iter().all(|said| said.warning.code != code) {
            let mut channels: Vec<String> = alike.iter().flat_map(|w| w.channels.clone()).collect();
            channels.dedup();
            let message = format!(
                "{} channels, {}; the first: {}",
                channels.len(),
                listed(&channels),
                warning.warning.message
            );
            out.push(said(Warning { code, message }, channels));
        }
    }
    out
}

/// Some names, for people.
fn listed(names: &[String]) -> String {
    let quoted = names.iter().map(|n| format!("\"{n}\""));
    some_of(quoted, names.len(), 6)
}

fn describe(channel: &Channel, found: &Findings, time: Option<&TimeFindings>) -> InspectedChannel {
    let axis = &channel.axis;
    let unit = unit_of(channel);
    let of_axis = InspectedChannel {
        name: channel.name.clone(),
        heading: channel.heading.clone(),
        segment: channel.segment.map(|segment| segment + 1),
        unit: (!unit.is_empty()).then(|| unit.to_owned()),
        unit_known: channel.unit.is_some(),
        samples: channel.samples.len(),
        rate_hz: axis.rate_hz,
        rate_std_hz: axis.rate_std_hz,
        rate_from: axis.rate_from.describe(),
        header_rate_hz: axis.header_rate_hz,
        start: axis.start.map(Moment::seconds),
        start_ns: axis
            .start
            .filter(|start| start.origin_ns != 0)
            .map(Moment::nanoseconds),
        start_unit: "s",
        start_time: axis.start_text.as_deref().map(Clock::iso_or_as_written),
        duration_s: duration_s(channel),
        assumed: axis.assumed.clone(),
        ..InspectedChannel::default()
    };
    with_samples(with_steps(of_axis, axis.origin_ns, time), found)
}

fn duration_s(channel: &Channel) -> Option<f64> {
    let axis = &channel.axis;
    if let Some(stamps) = &axis.stamps_s {
        let mut finite = stamps.iter().filter(|t| t.is_finite());
        let first = finite.next()?;
        return Some(finite.next_back().unwrap_or(first) - first);
    }
    let steps = channel.samples.len().checked_sub(1)?;
    axis.rate_hz.map(|rate_hz| steps as f64 / rate_hz)
}

/// An irregular step on the file's own axis.
fn absolute(event: Event, origin_s: f64) -> Event {
    Event {
        from_s: event.from_s + origin_s,
        ..event
    }
}

/// Adds findings from the time stamps.
fn with_steps(
    channel: InspectedChannel,
    origin_ns: i64,
    time: Option<&TimeFindings>,
) -> InspectedChannel {
    let origin_s = origin_ns as f64 * 1e-9;
    let Some((time, steps)) = time.and_then(|time| time.steps.as_ref().map(|s| (time, s))) else {
        return channel;
    };
    InspectedChannel {
        jitter: steps.jitter.map(|jitter| jitter.std),
        jitter_peak: steps.jitter.map(|jitter| jitter.peak),
        stamps_rounded_to_s: time.rounded.map(|rounded| rounded.quantum_s),
        gaps: Some(steps.gaps.count),
        missing_samples: Some(steps.missing),
        gap_list: steps
            .gaps
            .listed
            .iter()
            .map(|gap| absolute(*gap, origin_s))
            .collect(),
        repeated_stamps: Some(steps.repeated.count),
        backwards: Some(steps.backwards.count),
        clock_jumps: Some(steps.jumps.count),
        ..channel
    }
}

/// Adds findings from the samples.
fn with_samples(channel: InspectedChannel, found: &Findings) -> InspectedChannel {
    let rail = |of: fn(&Clipping) -> Option<f64>| found.clipping.as_ref().and_then(of);
    let lines = found.mains.iter().flat_map(|mains| &mains.lines);
    InspectedChannel {
        smallest: found.range.map(|(low, _)| low),
        largest: found.range.map(|(_, high)| high),
        mean: found.mean,
        rms: found.std,
        repeated: match found.constant {
            Some(_) => Some(1.0),
            None => found.repeats.map(|r| r.fraction),
        },
        repeated_unexplained: found.repeats.and_then(|r| r.unexplained),
        hold: found.repeats.and_then(|r| r.hold),
        clipped: Some(found.clipping.map_or(0, |c| c.samples())),
        clipped_low: rail(|c| c.low.map(|r| r.value)),
        clipped_high: rail(|c| c.high.map(|r| r.value)),
        stuck: Some(found.standstills.map_or(0, |found| found.samples)),
        constant: Some(found.constant.is_some()),
        non_finite: Some(found.non_finite.map_or(0, |f| f.count)),
        resolution: found.quantisation.map(|q| q.step),
        resolution_bits: found.quantisation.map(|q| q.bits),
        mains: lines.cloned().collect(),
        ..channel
    }
}
