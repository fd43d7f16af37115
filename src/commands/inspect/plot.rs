//! Chart of the channels.

use torqcomp_dsp::quality::range;

use super::report::{InspectReport, Inspected, InspectedChannel};
use crate::chart::{Chart, Series, picture};
use crate::print::rounded;
use crate::quality::{labels, unit_of};
use crate::recording::{Channel, Recording};

/// Label of x where the sampling rate is unknown.
const SAMPLES: &str = "sample number, no unit";

/// Height of a channel's panel, in user units.
const HEIGHT: f64 = 120.0;
/// Times farther from zero than this many record lengths are given relative to the start of the record.
const FAR: f64 = 1e4;

/// Draws every channel of every file read.
pub fn svg(recordings: &[&Recording], report: &InspectReport) -> String {
    let found = report.files.iter().filter_map(|entry| match entry {
        Inspected::Read(file) => Some(file.as_ref()),
        Inspected::Failed { .. } => None,
    });
    let several = recordings.len() > 1;
    let mut charts = Vec::new();
    for (recording, found) in recordings.iter().zip(found) {
        let channels = recording.channels.iter().zip(&found.channels);
        for ((channel, found), label) in channels.zip(labels(&recording.channels)) {
            let name = match several {
                true => format!("{}: {label}", recording.source),
                false => label,
            };
            charts.push(chart(channel, found, name));
        }
    }
    let title = match recordings {
        [one] => one.source.clone(),
        several => format!("{} files", several.len()),
    };
    picture(&title, HEIGHT, &charts)
}

fn chart(channel: &Channel, found: &InspectedChannel, name: String) -> Chart {
    let drawn = channel.samples.len();
    let name = match found.samples > drawn {
        true => format!("{name} (the first {drawn} of {} samples)", found.samples),
        false => name,
    };
    let (axis, last) = (&channel.axis, drawn.saturating_sub(1));
    let uniform =
        |i: usize, rate_hz: f64| axis.start.unwrap_or_default().after_s + i as f64 / rate_hz;
    let (ends, x_label) = match (&axis.stamps_s, axis.rate_hz) {
        (Some(stamps), _) => (range(stamps), "time, s"),
        (None, Some(rate_hz)) => (
            Some((uniform(0, rate_hz), uniform(last, rate_hz))),
            "time, s",
        ),
        (None, None) => (Some((1.0, drawn as f64)), SAMPLES),
    };
    let (from, to) = ends.unwrap_or((0.0, 0.0));
    let is_far = from.abs() > FAR * (to - from) && x_label != SAMPLES;
    let zero = if is_far { from } else { 0.0 };
    let x = |i: usize| match (&axis.stamps_s, axis.rate_hz) {
        (Some(stamps), _) => stamps.get(i).copied().unwrap_or(f64::NAN) - zero,
        (None, Some(rate_hz)) => uniform(i, rate_hz) - zero,
        (None, None) => (i + 1) as f64,
    };
    let points = channel.samples.iter().enumerate().map(|(i, y)| (x(i), *y));
    let series = Series::recorded(points, (from - zero, to - zero));
    let x_label = match is_far {
        true => format!("time after {} s, s", rounded(zero, 12)),
        false => x_label.to_owned(),
    };
    let unit = match unit_of(channel) {
        "" => "unit not given",
        unit => unit,
    };
    Chart {
        rails: [found.clipped_low, found.clipped_high]
            .into_iter()
            .flatten()
            .collect(),
        first_colour: 1,
        ..Chart::new(&name, &x_label, unit, vec![series])
    }
}
