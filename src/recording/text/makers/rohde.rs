//! Pairs of values in Rohde & Schwarz exports: each time occurs twice, with the minimum and the maximum sampled there
//! (RTM user manual 1317.4726, "CSV format"; RTC1000 user manual 1335.7352, 8.3.1.1). Single values are a plain table.

use std::sync::Arc;

use super::{Maker, Rule};
use crate::failure::Failure;
use crate::io::Reading;
use crate::recording::text::chunks::Chunks;
use crate::recording::text::head::Head;
use crate::recording::text::table::Layout;
use crate::recording::{Channel, Recording, TimeAxis};

const MAKER: Maker =
    Maker::of_seconds("Rohde & Schwarz, pairs of minimum and maximum").with_reader(read);

/// Number of pairs examined by the rule.
const LOOKED_AT: usize = 2;

/// The rule.
pub const ALL: &[Rule] = &[(MAKER, has_pairs)];

fn has_pairs(head: &Head) -> bool {
    let is_theirs = ["in s,", "in s;", "[s],", "[s];"]
        .iter()
        .any(|first| head.starts(0, first));
    let time = |line: usize| head.lines.get(line)?.text.split([',', ';']).next();
    let is_pair = |k: usize| time(2 * k + 1).is_some() && time(2 * k + 1) == time(2 * k + 2);
    is_theirs && (0..LOOKED_AT).all(is_pair) && time(1) != time(3)
}

fn read(chunks: &mut Chunks, reading: &Reading) -> Result<Recording, Failure> {
    let layout = Layout::find(chunks, 1, MAKER.hints, reading)?;
    let mut recording = crate::recording::text::general(chunks, layout, MAKER.hints, reading)?;
    let channels = std::mem::take(&mut recording.channels);
    recording.channels = channels.iter().flat_map(halves).collect();
    Ok(recording)
}

/// The first and the second value of each pair, as separate channels; the channel itself if some are not pairs.
fn halves(channel: &Channel) -> Vec<Channel> {
    let stamps = channel
        .axis
        .stamps_s
        .as_ref()
        .map_or(&[][..], |stamps| stamps);
    let (pairs, rest) = stamps.as_chunks::<2>();
    let are_pairs =
        rest.is_empty() && pairs.iter().all(|[a, b]| a == b) && channel.holes.is_empty();
    if pairs.is_empty() || !are_pairs {
        return vec![channel.clone()];
    }
    let once = Arc::new(pairs.iter().map(|pair| pair[0]).collect());
    let heading = channel.axis.stamps_in.as_deref().unwrap_or("time");
    let axis = TimeAxis::of_stamps_after(channel.axis.origin_ns, heading, once);
    let half = |(of, name): (usize, &str)| Channel {
        name: format!("{} {name}", channel.name),
        heading: format!("{} {name}", channel.heading),
        samples: channel
            .samples
            .iter()
            .skip(of)
            .step_by(2)
            .copied()
            .collect(),
        axis: axis.clone(),
        ..channel.clone()
    };
    ["minimum", "maximum"]
        .into_iter()
        .enumerate()
        .map(half)
        .collect()
}
