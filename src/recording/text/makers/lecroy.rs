//! Teledyne LeCroy text export: `LECROY` with the model, `Segments,2,SegmentSize,1252`, a line for each
//! segment's trigger, then time and amplitude of all segments below each other.

use std::sync::Arc;

use super::Maker;
use crate::failure::Failure;
use crate::io::csv::Options;
use crate::recording::text::decode::Text;
use crate::recording::text::head::Head;
use crate::recording::text::table::{self, Hints};
use crate::recording::text::{FOR_MAKER, recording_of};
use crate::recording::{Axis, Channel, Hole, RateFrom, Recording, Segment};
use crate::warning::Warning;

const HINTS: Hints = Hints {
    time_unit: Some("s"),
    unit: None,
};

/// The rule.
pub const ALL: &[Maker] = &[Maker {
    name: "LeCroy",
    is: |head| head.starts(0, "LECROY"),
    hints: HINTS,
    read: Some(read),
}];

/// Segments as the head lists them.
struct Segments {
    size: usize,
    list: Vec<Segment>,
}

fn read(text: &Text, options: &Options) -> Result<Recording, Failure> {
    let part = table::read(&text.bytes, 0, 1, HINTS, options, &|_| false)?;
    let mut recording = recording_of(vec![part]);
    let Some(segments) = segments(&Head::of(&text.bytes, 0, 1, FOR_MAKER)) else {
        return Ok(recording);
    };
    let said = segments.size * segments.list.len();
    recording
        .warnings
        .retain(|warning| warning.code != "sample-count");
    let there = recording
        .channels
        .iter()
        .map(|channel| channel.samples.len())
        .max();
    if there.is_some_and(|there| there < said) {
        recording.lost = Some(Warning::new(
            "samples-missing",
            format!(
                "the head announces {said} samples, but there are {}",
                there.unwrap_or(0)
            ),
        ));
    }
    if segments.list.len() > 1 {
        let channels = std::mem::take(&mut recording.channels);
        for place in 0..segments.list.len() {
            let parts = channels
                .iter()
                .filter_map(|channel| part_of(channel, place, &segments));
            recording.channels.extend(parts);
        }
        recording.segments = segments.list;
    } else if let Some(start) = segments
        .list
        .first()
        .and_then(|one| one.start_text.as_ref())
    {
        for channel in &mut recording.channels {
            channel.axis.start_text = Some(start.clone());
        }
    }
    Ok(recording)
}

/// The cells of a line above the table: between commas, semicolons, tabs or spaces, the date and the
/// time of a trigger being one cell.
fn cells(text: &str) -> Vec<String> {
    let text = text.trim();
    if let Some(mark) = [',', ';', '\t']
        .into_iter()
        .find(|mark| text.contains(*mark))
    {
        return text
            .split(mark)
            .map(|cell| cell.trim().to_owned())
            .collect();
    }
    let words: Vec<&str> = text.split_whitespace().collect();
    match words.as_slice() {
        [number, date @ .., seconds] if number.starts_with('#') && !date.is_empty() => {
            vec![(*number).to_owned(), date.join(" "), (*seconds).to_owned()]
        }
        [] => vec![String::new()],
        words => words.iter().map(|word| (*word).to_owned()).collect(),
    }
}

/// `Segments,N,SegmentSize,M` and the lines `#1,date time,seconds` below it.
fn segments(head: &Head) -> Option<Segments> {
    let place = head
        .lines
        .iter()
        .position(|line| cells(&line.text)[0] == "Segments")?;
    let first = cells(&head.lines[place].text);
    let (count, size): (usize, usize) = (first.get(1)?.parse().ok()?, first.get(3)?.parse().ok()?);
    if count == 0 || size == 0 || count.checked_mul(size).is_none() {
        return None;
    }
    let list: Vec<Segment> = head.lines[place..]
        .iter()
        .filter(|line| line.text.starts_with('#'))
        .take(count)
        .enumerate()
        .map(|(place, line)| {
            let cells = cells(&line.text);
            Segment {
                name: format!("segment {}", place + 1),
                start_s: cells.get(2).and_then(|seconds| seconds.parse().ok()),
                start_text: cells.get(1).filter(|text| !text.is_empty()).cloned(),
            }
        })
        .collect();
    (!list.is_empty()).then_some(Segments { size, list })
}

/// The samples of one segment.
fn part_of(channel: &Channel, place: usize, segments: &Segments) -> Option<Channel> {
    let from = (place * segments.size).min(channel.samples.len());
    let to = (from + segments.size).min(channel.samples.len());
    if from == to {
        return None;
    }
    let axis = match &channel.axis.stamps_s {
        Some(stamps) => {
            let heading = match &channel.axis.rate_from {
                RateFrom::Stamps(heading) => heading.clone(),
                _ => "Time".to_owned(),
            };
            let to = to.min(stamps.len());
            let mut axis = Axis::of_stamps(&heading, Arc::new(stamps[from.min(to)..to].to_vec()));
            if channel.axis.rate_from == RateFrom::Given {
                axis.rate_hz = channel.axis.rate_hz;
                axis.rate_from = RateFrom::Given;
            }
            axis
        }
        None => channel.axis.clone(),
    };
    Some(Channel {
        samples: channel.samples[from..to].to_vec(),
        holes: channel
            .holes
            .iter()
            .filter(|hole| (from..to).contains(&hole.index))
            .map(|hole| Hole {
                index: hole.index - from,
                ..*hole
            })
            .collect(),
        axis: Axis {
            start_text: segments.list[place].start_text.clone(),
            header_rate_hz: channel.axis.header_rate_hz,
            assumed: channel.axis.assumed.clone(),
            ..axis
        },
        segment: Some(place),
        name: channel.name.clone(),
        heading: channel.heading.clone(),
        unit: channel.unit.clone(),
        unit_text: channel.unit_text.clone(),
    })
}
