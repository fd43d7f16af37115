//! The numbers in the messages of an MCAP file as channels.

use std::sync::Arc;

use super::content::Content;
use super::report::InspectedChannel;
use super::whole::{self, Kept, Stamps};
use crate::failure::{ErrorCode, Failure};
use crate::io::mcap::inventory::{ChannelReport, LeafReport};
use crate::io::mcap::{self, FieldChoice, Inventory, SelectedSignal};
use crate::io::{Input, Reading};
use crate::print::plural;
use crate::recording::moment::{Moment, date_and_time};
use crate::recording::{AllSamples, Channel, Recording, TimeAxis, message_times};
use crate::unit::NamedUnit;
use crate::warning::{Warning, WarningCode};

/// Maximum number of samples kept of all numbers together: eight bytes each, and as many for time stamps.
const MOST_SAMPLES: u64 = 1 << 22;
/// Maximum length of a file whose samples are read, in bytes.
const MOST_BYTES: u64 = 4_000_000_000;
/// Maximum number of numeric fields read.
const MOST_NUMBERS: u64 = 64;

/// Lists a file and reads its numbers, up to a maximum.
pub fn read(place: &Input, reading: &Reading) -> Result<Content, Failure> {
    read_most(place, reading, MOST_SAMPLES)
}

/// The same, keeping the given number of samples of all numbers together.
fn read_most(place: &Input, reading: &Reading, most: u64) -> Result<Content, Failure> {
    let mut inventory = Inventory::scan(place)?;
    if let Some(wanted) = &reading.topic {
        keep_topic(&mut inventory, wanted)?;
    }
    let mut content = of_file(&inventory);
    let Numbers {
        listed: numbers,
        choices,
        mut kept,
        left_out,
    } = Numbers::of(&inventory, Budget::of(place, &inventory, most));
    let mut results = Vec::new();
    if !choices.is_empty() {
        let options = message_times(reading);
        results = mcap::read_fields(place, &choices, &options, |number, times_ns, values| {
            kept[number].add(times_ns, values);
        })?;
    }
    let mut is_lossy = inventory.is_lossy;
    let mut results = results.into_iter().zip(kept);
    for (topic, number, is_read) in numbers {
        let read = is_read.then(|| results.next()).flatten();
        if let Some((Err(failure), _)) = &read {
            let said = mixed(topic, failure).into_iter().collect();
            add_warnings(&mut content.recording.warnings, said, &[]);
        }
        if let (Some((Ok((selected, summary)), kept)), Some(number)) = (read, number) {
            let (channel, whole) = channel(topic, number, &selected, kept);
            content.recording.channels.push(channel);
            content.wholes.push(whole);
            let warnings = &mut content.recording.warnings;
            // A list that is empty in all messages has no number in this file.
            let mut said = summary.warnings;
            said.retain(|warning| summary.samples > 0 || warning.code != "mcap-without-item");
            is_lossy |= summary.is_lossy;
            add_warnings(warnings, said, &inventory.warnings);
        } else {
            // Initially empty lists and similar; the warnings report damage.
            content.listed.push(entry(topic, number));
        }
    }
    let said = &mut content.recording.warnings;
    said.extend((left_out > 0).then(|| not_read(left_out)));
    said.extend(whole::warning(&content.recording.channels, &content.wholes));
    content.inventory = Some(Inventory {
        is_lossy,
        ..inventory
    });
    if let Some(range) = &reading.range {
        content.recording.keep(range)?;
    }
    Ok(content)
}

/// Known properties of a file before reading its samples.
fn of_file(inventory: &Inventory) -> Content {
    Content {
        recording: Recording {
            dialect: dialect(inventory),
            details: details(inventory),
            warnings: inventory.warnings.clone(),
            ..Recording::empty("mcap", inventory.file.clone())
        },
        wholes: Vec::new(),
        listed: Vec::new(),
        inventory: None,
    }
}

/// A warning about a topic whose messages are not one signal, unless already given.
fn mixed(topic: &ChannelReport, failure: &Failure) -> Option<Warning> {
    let is_new = topic.unreadable.is_none() && failure.code() == Some(ErrorCode::RecordsDiffer);
    is_new.then(|| WarningCode::McapUnreadable.warning(failure.to_string()))
}

/// The numbers of a file and those selected for reading.
struct Numbers<'a> {
    /// Each with its topic and whether it is read; one entry for a topic without numbers.
    listed: Vec<(&'a ChannelReport, Option<&'a LeafReport>, bool)>,
    /// Those read, and the samples kept of them.
    choices: Vec<FieldChoice>,
    kept: Vec<Kept>,
    /// Those with messages that exceed the limits.
    left_out: usize,
}

impl<'a> Numbers<'a> {
    fn of(inventory: &'a Inventory, mut budget: Budget) -> Self {
        let mut all = Self {
            listed: Vec::new(),
            choices: Vec::new(),
            kept: Vec::new(),
            left_out: 0,
        };
        for topic in &inventory.channels {
            let before = all.listed.len();
            for number in topic.leaves.iter().filter(|leaf| !leaf.is_stamp) {
                let share = budget.share(topic.messages);
                all.left_out += usize::from(share.is_none() && topic.messages > 0);
                all.listed.push((topic, Some(number), share.is_some()));
                if let Some(most) = share {
                    all.choices.push(choice(topic, number));
                    all.kept.push(Kept::new(most));
                }
            }
            if all.listed.len() == before {
                all.listed.push((topic, None, false));
            }
        }
        all
    }
}

/// Omits all other topics.
fn keep_topic(inventory: &mut Inventory, wanted: &str) -> Result<(), Failure> {
    inventory.channels.retain(|channel| channel.topic == wanted);
    if inventory.channels.is_empty() {
        return Err(ErrorCode::ChannelNotFound
            .failed(format_args!(
                "there is no topic {wanted}; omit --topic to see all"
            ))
            .at(&inventory.file));
    }
    Ok(())
}

fn choice(topic: &ChannelReport, number: &LeafReport) -> FieldChoice {
    FieldChoice {
        topic: Some(topic.topic.clone()),
        field: Some(number.first_item()),
        signal: None,
    }
}

fn not_read(left_out: usize) -> Warning {
    WarningCode::SamplesNotRead.warning(format!(
        "samples not examined: those of {}; there are too many of them, or the input can be read only once",
        plural(left_out, "number")
    ))
}

/// Remaining capacity for reading.
struct Budget {
    numbers: u64,
    samples: u64,
}

impl Budget {
    fn of(place: &Input, inventory: &Inventory, samples: u64) -> Self {
        let length = match place {
            Input::Stdin => None,
            Input::File(path) => std::fs::metadata(path).ok().map(|meta| meta.len()),
        };
        let topics = inventory.channels.iter().filter(|topic| topic.messages > 0);
        let numbers = topics.flat_map(|topic| topic.leaves.iter().filter(|leaf| !leaf.is_stamp));
        let is_readable = length.is_some_and(|length| length <= MOST_BYTES);
        let most = if is_readable { MOST_NUMBERS } else { 0 };
        Self {
            numbers: most.min(numbers.count() as u64),
            samples,
        }
    }

    /// Samples kept of a number with that many messages: all, or its equal part of what is
    /// left. `None` if it must not be read.
    fn share(&mut self, messages: u64) -> Option<usize> {
        let equal = self.samples.checked_div(self.numbers)?;
        if messages == 0 {
            return None;
        }
        self.numbers -= 1;
        self.samples -= equal.min(messages);
        usize::try_from(equal).ok()
    }
}

/// A number read, and statistics of all its samples if not all were kept.
fn channel(
    topic: &ChannelReport,
    number: &LeafReport,
    selected: &SelectedSignal,
    kept: Kept,
) -> (Channel, Option<AllSamples>) {
    let (stamps, samples, whole) = kept.finish();
    let unit = selected.unit.as_ref().map(|found| found.unit.clone());
    let time = &selected.time;
    let axis = axis(
        stamps,
        match &time.field {
            Some(field) => format!("{} time, {field}", time.choice.name()),
            None => format!("{} time", time.choice.name()),
        },
    );
    let channel = Channel {
        name: name(topic, Some(number)),
        heading: number.path.clone(),
        unit: unit.as_deref().and_then(NamedUnit::parse),
        unit_text: unit,
        samples,
        axis,
        is_compensated: selected.is_compensated,
        ..Channel::default()
    };
    (channel, whole)
}

/// An axis of time stamps relative to the first: as seconds since 1970 they would lose their last
/// digits.
fn axis(stamps: Stamps, words: String) -> TimeAxis {
    let origin_ns = stamps.first_ns.unwrap_or(0);
    let axis = TimeAxis::of_stamps_after(origin_ns, &words, Arc::new(stamps.from_first_s));
    TimeAxis {
        start_text: axis.start.and_then(Moment::date),
        ..axis
    }
}

/// Name of a number: topic and path, the first item of lists.
fn name(topic: &ChannelReport, number: Option<&LeafReport>) -> String {
    match number {
        Some(number) => format!("{}.{}", topic.topic, number.first_item()),
        None => topic.topic.clone(),
    }
}

/// A channel with unknown samples.
fn entry(topic: &ChannelReport, number: Option<&LeafReport>) -> InspectedChannel {
    let start_ns = topic.log_ns.map(|(first, _)| first);
    InspectedChannel {
        name: name(topic, number),
        heading: number.map_or_else(String::new, |number| number.path.clone()),
        unit: number.and_then(|number| number.unit.clone()),
        samples: usize::try_from(topic.messages).unwrap_or(usize::MAX),
        rate_hz: topic.rate_hz,
        rate_from: match topic.rate_hz {
            Some(_) => "mean of the log times".to_owned(),
            None => "none".to_owned(),
        },
        start: start_ns.map(|ns| ns as f64 * 1e-9),
        start_unit: "s",
        start_time: start_ns.and_then(|ns| date_and_time(i64::try_from(ns).ok()?)),
        ..InspectedChannel::default()
    }
}

/// Adds findings from reading one number that are not yet reported for the file.
fn add_warnings(all: &mut Vec<Warning>, more: Vec<Warning>, of_file: &[Warning]) {
    for warning in more {
        if !all.contains(&warning) && of_file.iter().all(|said| said.code != warning.code) {
            all.push(warning);
        }
    }
}

fn dialect(inventory: &Inventory) -> String {
    let profile = match inventory.profile.as_str() {
        "" => "no profile".to_owned(),
        profile => format!("profile {profile}"),
    };
    let chunks: Vec<String> = inventory
        .chunks
        .iter()
        .map(|chunk| match chunk.compression.as_str() {
            "" => plural(chunk.chunks, "uncompressed chunk"),
            name => plural(chunk.chunks, &format!("{name} chunk")),
        })
        .collect();
    let chunks = match chunks.as_slice() {
        [] => "no chunks".to_owned(),
        some => some.join(", "),
    };
    format!("MCAP, {profile}, {chunks}")
}

fn details(inventory: &Inventory) -> Vec<(String, String)> {
    let mut details = vec![("messages".to_owned(), inventory.messages.to_string())];
    if !inventory.library.is_empty() {
        details.push(("library".to_owned(), inventory.library.clone()));
    }
    for topic in &inventory.channels {
        let schema = topic.schema.as_deref().unwrap_or("no schema");
        let value = format!(
            "{schema}, {}, {}",
            topic.message_encoding,
            plural(topic.messages, "message")
        );
        details.push((topic.topic.clone(), value));
        let mut told: Vec<&[String]> = Vec::new();
        for leaf in topic.leaves.iter().filter(|leaf| !leaf.names.is_empty()) {
            // Position, velocity and effort of a joint state have the same names.
            if !told.contains(&leaf.names.as_slice()) {
                told.push(&leaf.names);
                let list = format!("names for {}.{}", topic.topic, leaf.path);
                details.push((list, leaf.names.join(", ")));
            }
        }
    }
    for file in &inventory.attachments {
        let value = format!("{}, {}, {} bytes", file.name, file.media_type, file.size);
        details.push(("attachment".to_owned(), value));
    }
    for record in &inventory.metadata {
        let keys: Vec<&str> = record.pairs.keys().map(String::as_str).collect();
        let value = format!("{}: {}", record.name, keys.join(", "));
        details.push(("metadata".to_owned(), value));
    }
    details
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::mcap::testing;

    /// Kept samples do not grow with the file: a short, a long and a longer topic.
    #[test]
    fn long_topics_share_what_may_be_kept() {
        let mut file = testing::File::new(testing::options(None));
        let topics = [(1, "/a", 10_u32), (2, "/b", 1000), (3, "/c", 5000)];
        for (id, topic, messages) in topics {
            file.channel(
                id,
                topic,
                "cdr+ros2msg",
                ("std_msgs/msg/Float64", b"float64 data"),
            );
            for i in 0..messages {
                let time_ns = 1_000_000_000 + 1_000_000 * u64::from(i);
                file.message(id, time_ns, &testing::float64(f64::from(i % 100)));
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.mcap");
        std::fs::write(&path, file.finish()).unwrap();
        let content = read_most(&Input::File(path), &Reading::default(), 610).unwrap();
        let kept = content.recording.channels.iter().map(|c| c.samples.len());
        assert_eq!(kept.collect::<Vec<_>>(), [10, 300, 300]);
        let all = content
            .wholes
            .iter()
            .map(|whole| whole.map(|w| w.sums.samples));
        assert_eq!(all.collect::<Vec<_>>(), [None, Some(1000), Some(5000)]);
        let longest = content.wholes[2].unwrap();
        assert_eq!(longest.sums.range(), Some((0.0, 99.0)));
        assert!((longest.sums.mean().unwrap() - 49.5).abs() < 1e-12);
        assert!((longest.duration_s.unwrap() - 4.999).abs() < 1e-9);
        assert_eq!(content.recording.warnings[0].code, "first-samples-only");
    }

    #[test]
    fn stamps_keep_their_nanoseconds() {
        let start = 1_700_000_000_000_000_001_i64;
        let stamps: Vec<i64> = (0..100).map(|i| start + 20_000 * i).collect();
        let mut kept = Kept::new(1000);
        kept.add(&stamps, &[0.0; 100]);
        let axis = axis(kept.finish().0, "log time".to_owned());
        assert!((axis.rate_hz.unwrap() - 50_000.0).abs() < 1e-6);
        assert_eq!(axis.start_text.unwrap(), "2023-11-14T22:13:20.000000001Z");
    }
}
