//! Inventory of a file.

use std::collections::BTreeMap;
use std::io::Read;

use mcap::records::{Header, Record, op};
use schemars::JsonSchema;
use serde::Serialize;

use super::channels::{Channels, TopicChannel};
use super::decode::MessageType;
use super::index;
use super::mixed::two_publishers;
use super::path::{self, PathPart};
use super::record::input::CountedInput;
use super::record::reader::{ChunkReport, RecordReader};
use super::record::{self, RawMessage};
use super::route::Route;
use super::schema::Schema;
use super::schema::leaves::{self, Leaf};
use super::selection::FieldRequest;
use super::summary;
use super::time::Stamp;
use super::units;
use crate::failure::{ErrorCode, Failure};
use crate::io::Input;
use crate::print::plural;
use crate::warning::{Warning, WarningCode};

/// Maximum number of leaves of a channel with an example value.
const EXAMPLES: usize = 64;

/// What is in a file.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Inventory {
    /// Name of the file.
    pub file: String,
    /// Profile, as `ros2`.
    pub profile: String,
    /// Library that wrote it.
    pub library: String,
    /// Messages in all channels.
    pub messages: u64,
    /// Earliest log time, in ns.
    pub first_log_ns: Option<u64>,
    /// Latest log time, in ns.
    pub last_log_ns: Option<u64>,
    /// Channels in the order of their topics.
    pub channels: Vec<ChannelReport>,
    /// Attachments in the order of the file.
    pub attachments: Vec<AttachmentReport>,
    /// Metadata in the order of the file.
    pub metadata: Vec<MetadataReport>,
    /// Chunks by compression.
    pub chunks: Vec<ChunkReport>,
    /// Whether the file ends with an end record.
    pub is_closed: bool,
    /// Whether data were lost: exit code 3.
    pub is_lossy: bool,
    /// What is wrong.
    pub warnings: Vec<Warning>,
}

/// A channel.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ChannelReport {
    /// Number in the file.
    pub id: u16,
    /// Topic.
    pub topic: String,
    /// Encoding of the messages.
    pub message_encoding: String,
    /// Name of the schema; `null` without one.
    pub schema: Option<String>,
    /// Language of the schema.
    pub schema_encoding: Option<String>,
    /// Messages.
    pub messages: u64,
    /// Log time of the first and the last message, in ns.
    pub log_ns: Option<(u64, u64)>,
    /// Publish time of the first and the last message, in ns.
    pub publish_ns: Option<(u64, u64)>,
    /// Messages per second by log time; none with fewer than two messages or no time between.
    pub rate_hz: Option<f64>,
    /// Messages logged before the preceding one.
    pub out_of_order: u64,
    /// Why the messages cannot be read; `null` if they can.
    pub unreadable: Option<String>,
    /// Field of the messages' own time stamp.
    pub stamp: Option<String>,
    /// Numbers in the messages.
    pub leaves: Vec<LeafReport>,
    /// Whether there are more numbers than listed.
    pub has_more_leaves: bool,
}

/// A number in a channel's messages.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LeafReport {
    /// Path; lists with `[]`, arrays with `[3]`.
    pub path: String,
    /// Kind of number.
    pub kind: &'static str,
    /// Unit, if given in the file.
    pub unit: Option<String>,
    /// Value in the first message, of the first item in lists.
    pub example: Option<f64>,
    /// Names of the items in the first message, up to 256, of a number in a list whose items have names.
    pub names: Vec<String>,
    /// Whether the number is part of a time stamp.
    pub is_stamp: bool,
}

/// An attachment.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AttachmentReport {
    /// Name.
    pub name: String,
    /// Media type.
    pub media_type: String,
    /// Length in bytes.
    pub size: u64,
    /// Time of recording, in ns.
    pub log_ns: u64,
}

/// A metadata record.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MetadataReport {
    /// Name.
    pub name: String,
    /// Keys and values.
    pub pairs: BTreeMap<String, String>,
}

impl Inventory {
    /// Scans a whole file.
    ///
    /// # Errors
    /// If it cannot be read or is not MCAP. Damage is not an error, but reported in the warnings.
    pub fn scan(input: &Input) -> Result<Self, Failure> {
        Self::read(input.name(), input.open()?)
    }

    /// The same for a stream.
    ///
    /// # Errors
    /// If it cannot be read or is not MCAP.
    pub fn read(name: String, stream: Box<dyn Read + Send>) -> Result<Self, Failure> {
        let mut records = RecordReader::new(name, CountedInput::new(stream))?;
        let mut scan = Scan::default();
        while let Some((op, body)) = records.next()? {
            scan.note(op, body);
        }
        Ok(scan.finish(&records))
    }
}

/// The file's only topic with numbers.
///
/// # Errors
/// If there are several, or none, or the file can only be read once.
pub(super) fn only_topic(input: &Input) -> Result<FieldRequest, Failure> {
    if *input == Input::Stdin {
        return Err(ErrorCode::MissingArgument.usage(
            "choose what to read from standard input with --topic, as --topic /joint_states \
             --field effort[0]",
        ));
    }
    // The structure of JSON messages is only known from a message, so the whole file must be read.
    let channels = index::channels(input).filter(|channels| {
        let mut encodings = channels
            .iter()
            .map(|channel| &channel.record.message_encoding);
        encodings.all(|encoding| encoding != "json")
    });
    let topics = match channels {
        Some(channels) => channels.iter().map(|channel| numbers_of(channel)).collect(),
        None => {
            let channels = Inventory::scan(input)?.channels.into_iter();
            let topic = |channel: ChannelReport| match channel.unreadable {
                Some(why) => (channel.topic, Err(why)),
                None => (
                    channel.topic,
                    Ok(channel.leaves.iter().any(|l| !l.is_stamp)),
                ),
            };
            channels.map(topic).collect()
        }
    };
    choose_topic(&input.name(), topics)
}

/// A topic, and whether its messages contain numbers, or why they cannot be read.
type TopicNumbers = (String, Result<bool, String>);

fn numbers_of(channel: &TopicChannel) -> TopicNumbers {
    let of = channel.message_type(&[]);
    let has_numbers = |schema: &Schema| leaves::leaves(schema).0.iter().any(|leaf| !leaf.is_stamp);
    let numbers = of.map(|of| has_numbers(&of.schema));
    (channel.record.topic.clone(), numbers)
}

fn choose_topic(file: &str, mut topics: Vec<TopicNumbers>) -> Result<FieldRequest, Failure> {
    topics.sort();
    topics.dedup();
    let has_numbers = |(_, numbers): &&TopicNumbers| *numbers == Ok(true);
    let with_numbers = topics.iter().filter(has_numbers);
    let names: Vec<_> = with_numbers.map(|(topic, _)| topic.as_str()).collect();
    match names[..] {
        [topic] => Ok(FieldRequest::Topic(topic.to_owned(), Vec::new())),
        [] => Err(ErrorCode::NotARecording
            .failed(format_args!(
                "there is no topic whose numbers can be read{}",
                topics
                    .iter()
                    .filter_map(|(topic, numbers)| {
                        let why = numbers.as_ref().err()?;
                        Some(format!("; {topic}: {why}"))
                    })
                    .collect::<String>()
            ))
            .at(file)),
        _ => Err(ErrorCode::ChannelUnclear
            .usage(format_args!(
                "choose a topic with --topic; there are: {}",
                names.join(", ")
            ))
            .at(file)),
    }
}

#[derive(Default)]
struct Scan {
    header: Option<Header>,
    channels: Channels,
    seen: BTreeMap<u16, ChannelCount>,
    attachments: Vec<AttachmentReport>,
    metadata: Vec<MetadataReport>,
    /// Number of truncated message records.
    broken: u64,
}

/// Statistics of a channel's messages.
struct ChannelCount {
    messages: u64,
    log_ns: (u64, u64),
    publish_ns: (u64, u64),
    least_log_ns: u64,
    greatest_log_ns: u64,
    out_of_order: u64,
    first: Vec<u8>,
}

impl Scan {
    fn note(&mut self, op: u8, body: &[u8]) {
        match op {
            op::MESSAGE => match RawMessage::read(body) {
                Some(message) => self.message(&message),
                None => self.broken += 1,
            },
            op::HEADER | op::METADATA => match record::parse(op, body) {
                Some(Record::Header(header)) => self.header = Some(header),
                Some(Record::Metadata(found)) => self.metadata.push(MetadataReport {
                    name: found.name,
                    pairs: found.metadata,
                }),
                _ => {}
            },
            op::ATTACHMENT => {
                if let Some((header, size)) = record::attachment_front(body) {
                    self.attachments.push(AttachmentReport {
                        name: header.name,
                        media_type: header.media_type,
                        size,
                        log_ns: header.log_time,
                    });
                }
            }
            _ => self.channels.note(op, body),
        }
    }

    fn message(&mut self, message: &RawMessage) {
        let (log, publish) = (message.log_time_ns, message.publish_time_ns);
        match self.seen.get_mut(&message.channel_id) {
            Some(seen) => {
                seen.messages += 1;
                seen.out_of_order += u64::from(log < seen.log_ns.1);
                seen.log_ns.1 = log;
                seen.publish_ns.1 = publish;
                seen.least_log_ns = seen.least_log_ns.min(log);
                seen.greatest_log_ns = seen.greatest_log_ns.max(log);
            }
            None => {
                let seen = ChannelCount {
                    messages: 1,
                    log_ns: (log, log),
                    publish_ns: (publish, publish),
                    least_log_ns: log,
                    greatest_log_ns: log,
                    out_of_order: 0,
                    first: message.data.to_vec(),
                };
                self.seen.insert(message.channel_id, seen);
            }
        }
    }

    fn finish(self, records: &RecordReader) -> Inventory {
        let mut channels: Vec<_> = self
            .channels
            .iter()
            .map(|channel| report(channel, self.seen.get(&channel.record.id)))
            .collect();
        channels.sort_by(|a, b| (&a.topic, a.id).cmp(&(&b.topic, b.id)));
        tell_publishers(&mut channels);
        let first_log_ns = self.seen.values().map(|seen| seen.least_log_ns).min();
        let last_log_ns = self.seen.values().map(|seen| seen.greatest_log_ns).max();
        let last = last_log_ns.and_then(|last| i64::try_from(last).ok());
        let mut warnings = summary::losses(records, last);
        warnings.extend(self.warnings(&channels));
        let header = self.header.map(|header| (header.profile, header.library));
        let (profile, library) = header.unwrap_or_default();
        Inventory {
            file: records.name().to_owned(),
            profile,
            library,
            messages: self.seen.values().map(|seen| seen.messages).sum(),
            first_log_ns,
            last_log_ns,
            channels,
            attachments: self.attachments,
            metadata: self.metadata,
            chunks: records.chunk_counts().values().cloned().collect(),
            is_closed: records.is_closed(),
            is_lossy: records.losses().count > 0 || self.broken > 0,
            warnings,
        }
    }

    fn warnings(&self, channels: &[ChannelReport]) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let mut say = |code: WarningCode, message: String| warnings.push(code.warning(message));
        for channel in channels {
            if channel.out_of_order > 0 {
                let message = format!(
                    "{}: messages logged before the preceding one: {} of {}",
                    channel.topic, channel.out_of_order, channel.messages
                );
                say(WarningCode::McapOutOfOrder, message);
            }
            if let Some(why) = &channel.unreadable {
                say(
                    WarningCode::McapUnreadable,
                    format!("{}: {why}", channel.topic),
                );
            }
        }
        if self.broken > 0 {
            let records = plural(self.broken, "truncated message record");
            say(WarningCode::McapSkipped, format!("{records} skipped"));
        }
        warnings.extend(summary::conflict(self.channels.conflicts));
        warnings
    }
}

/// Notes that messages of neighbouring channels of a topic are interleaved.
fn tell_publishers(channels: &mut [ChannelReport]) {
    for place in 1..channels.len() {
        let [one, other] = [&channels[place - 1], &channels[place]];
        let is_mixed = match (one.log_ns, other.log_ns) {
            (Some(a), Some(b)) => one.topic == other.topic && a.0 < b.1 && b.0 < a.1,
            _ => false,
        };
        if is_mixed {
            let why = two_publishers([one.id, other.id]);
            for channel in &mut channels[place - 1..=place] {
                channel.unreadable.get_or_insert_with(|| why.clone());
            }
        }
    }
}

fn report(channel: &TopicChannel, seen: Option<&ChannelCount>) -> ChannelReport {
    let record = &channel.record;
    let schema = channel.schema.as_ref();
    let first = seen.map(|seen| seen.first.as_slice());
    let of = match (first, record.message_encoding.as_str()) {
        // The structure of JSON messages is only known from a message.
        (None, "json") => Err("its fields are unknown without a message".to_owned()),
        (first, _) => channel.message_type(first.unwrap_or(&[])),
    };
    let mut report = ChannelReport {
        id: record.id,
        topic: record.topic.clone(),
        message_encoding: record.message_encoding.clone(),
        schema: schema.map(|schema| schema.name.clone()),
        schema_encoding: schema.map(|schema| schema.encoding.clone()),
        messages: seen.map_or(0, |seen| seen.messages),
        log_ns: seen.map(|seen| seen.log_ns),
        publish_ns: seen.map(|seen| seen.publish_ns),
        rate_hz: seen.and_then(rate_hz),
        out_of_order: seen.map_or(0, |seen| seen.out_of_order),
        ..ChannelReport::default()
    };
    match of {
        Ok(of) => {
            let (found, more) = leaves::leaves(&of.schema);
            report.has_more_leaves = more;
            report.stamp = Stamp::find(&of.schema).map(|stamp| stamp.text);
            report.leaves = found
                .iter()
                .enumerate()
                .map(|(place, leaf)| {
                    let message = first.filter(|_| place < EXAMPLES);
                    leaf_report(leaf, &of, message, &record.metadata)
                })
                .collect();
        }
        Err(why) => report.unreadable = Some(why),
    }
    report
}

fn leaf_report(
    leaf: &Leaf,
    of: &MessageType,
    message: Option<&[u8]>,
    metadata: &BTreeMap<String, String>,
) -> LeafReport {
    let parts = path::parse(&leaf.first_item()).ok();
    let find = |parts: &Vec<PathPart>| Route::find(&of.schema, parts).ok();
    let route = parts.as_ref().and_then(find);
    let names = parts
        .zip(message)
        .and_then(|(parts, message)| of.item_names(&parts, message));
    LeafReport {
        path: leaf.path.clone(),
        kind: leaf.number.name(),
        unit: route
            .as_ref()
            .filter(|_| !leaf.is_stamp)
            .and_then(|route| units::find(route, metadata))
            .map(|found| found.unit),
        example: route
            .zip(message)
            .and_then(|(route, message)| of.values(&route, message).ok())
            .and_then(|values| values.first().copied()),
        names: names.unwrap_or_default(),
        is_stamp: leaf.is_stamp,
    }
}

fn rate_hz(seen: &ChannelCount) -> Option<f64> {
    let span_ns = seen.greatest_log_ns - seen.least_log_ns;
    (seen.messages > 1 && span_ns > 0).then(|| (seen.messages - 1) as f64 * 1e9 / span_ns as f64)
}

#[cfg(test)]
#[path = "inventory_tests.rs"]
mod tests;
