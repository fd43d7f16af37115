//! Teledyne LeCroy text export: `LECROY` with the model, `Segments,2,SegmentSize,1252`, a line for each
//! segment's trigger, then time and amplitude of all segments in sequence.

use super::{Maker, Rule};
use crate::failure::Failure;
use crate::io::Reading;
use crate::recording::text::chunks::Chunks;
use crate::recording::text::head::Head;
use crate::recording::text::table::Layout;
use crate::recording::text::{FOR_MAKER, recording_of};
use crate::recording::{Channel, Recording, Segment};
use crate::warning::{Warning, WarningCode};

const MAKER: Maker = Maker::of_seconds("LeCroy").with_reader(read);

/// The rule.
pub const ALL: &[Rule] = &[(MAKER, |head| head.starts(0, "LECROY"))];

/// Segments listed in the header.
struct Segments {
    size: usize,
    list: Vec<Segment>,
}

fn read(chunks: &mut Chunks, reading: &Reading) -> Result<Recording, Failure> {
    let (text, complete) = chunks.peek(FOR_MAKER)?;
    let segments = segments(&Head::of(text, complete, 1));
    let mut layout = Layout::find(chunks, 1, MAKER.hints, reading)?;
    let is_cut = |segments: &&Segments| segments.list.len() > 1;
    layout.block_rows = segments
        .as_ref()
        .filter(is_cut)
        .map(|segments| segments.size);
    let (mut recording, _) = recording_of(vec![layout.read(chunks, usize::MAX)?]);
    let Some(Segments { size, list }) = segments else {
        return Ok(recording);
    };
    recording
        .warnings
        .retain(|warning| warning.code != "sample-count");
    let said = size * list.len();
    let there = samples_of_a_channel(&recording);
    if there < said {
        recording.lost = Some(WarningCode::SamplesMissing.warning(format!(
            "the header gives {said} samples, but there are {there}"
        )));
    } else {
        // These files end without a line end, and everything announced is there.
        let ended = |lost: &mut Warning| lost.code == "unended-last-line";
        recording.lost.take_if(ended);
    }
    let is_listed = |channel: &Channel| channel.segment.is_none_or(|place| place < list.len());
    recording.channels.retain(is_listed);
    for channel in &mut recording.channels {
        let place = channel.segment.unwrap_or(0);
        let start = list[place].start_text.clone();
        channel.axis.start_text = start.or(channel.axis.start_text.take());
        channel.segment = (list.len() > 1).then_some(place);
    }
    recording.segments = if list.len() > 1 { list } else { Vec::new() };
    Ok(recording)
}

/// Number of samples of the first channel over all segments.
fn samples_of_a_channel(recording: &Recording) -> usize {
    let heading = recording.channels.first().map(|channel| &channel.heading);
    let same = recording
        .channels
        .iter()
        .filter(|channel| Some(&channel.heading) == heading);
    same.map(|channel| channel.samples.len()).sum()
}

/// Cells of a line above the table, separated by commas, semicolons, tabs or spaces, with date and
/// time of a trigger as one cell.
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
