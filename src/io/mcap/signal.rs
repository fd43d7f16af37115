//! One number of one topic, while a file is read.

use std::sync::Arc;

use super::blocks::{Blocks, Spacing};
use super::channels::{Channels, TopicChannel};
use super::clock::ClockCheck;
use super::decode::{Damage, Decoder, MessageType, Reading, Targets};
use super::mixed::{Publishers, one_frame, one_row, two_publishers};
use super::order::Sorter;
use super::path::{self, PathPart};
use super::record::RawMessage;
use super::route::Route;
use super::selection::{FieldRequest, FieldText};
use super::summary::Tally;
use super::time::{Stamp, TimeChoice, TimeUsed};
use super::units::{self, UnitFound};
use super::writer;
use crate::failure::{ErrorCode, Failure};
use crate::io::names_compensated;

/// Number of messages examined before the time is chosen.
const FIRST: usize = 16;

/// Options for the times of samples in messages.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TimeOptions {
    /// The clock; chosen from the messages if not given.
    pub time: Option<TimeChoice>,
    /// Field with the spacing of samples, for messages with several of them.
    pub spacing: Option<String>,
}

/// The selection, for messages.
#[derive(Debug, Clone, PartialEq)]
pub struct SelectedSignal {
    /// Topic.
    pub topic: String,
    /// Name of the schema.
    pub schema: String,
    /// Encoding of its messages.
    pub encoding: String,
    /// Field.
    pub field: String,
    /// Unit, if stated in the file.
    pub unit: Option<UnitFound>,
    /// Whether the channel is marked as a result of `compensate`.
    pub is_compensated: bool,
    /// The time used, and why.
    pub time: TimeUsed,
}

/// Whether a channel is marked as a result of `compensate`, by its metadata or, if a tool has dropped them, by its
/// topic or field.
fn is_compensated(channel: &::mcap::records::Channel, field: &str) -> bool {
    let marked = channel.metadata.get(writer::COMPENSATED_KEY);
    marked.is_some_and(|value| value == "true")
        || channel.topic == writer::TOPIC
        || field.rsplit('.').next().is_some_and(names_compensated)
}

/// A signal whose topic has been found.
pub(super) struct TopicSignal {
    /// Name of the file, for messages.
    name: String,
    /// The first channel of the topic; others must have the same type.
    channel: Arc<TopicChannel>,
    /// Whether each channel belongs to the topic.
    is_ours: Vec<Option<bool>>,
    publishers: Publishers,
    pub selected: SelectedSignal,
    pub options: TimeOptions,
    decoder: Decoder,
    /// The path to the number.
    route: Route,
    /// The field with the name of its item, if it was requested by index and has one.
    pub by_name: Option<String>,
    reading: Reading,
    /// Messages held back until the time is chosen.
    first: Vec<CopiedMessage>,
    pub is_time_chosen: bool,
    pub blocks: Blocks,
    pub sorter: Sorter,
    pub clock: ClockCheck,
    pub tally: Tally,
    /// The chosen time of the first message minus its log time, in ns.
    pub log_offset_ns: i64,
}

/// A copy of a message for later use.
struct CopiedMessage {
    log_time_ns: u64,
    publish_time_ns: u64,
    data: Vec<u8>,
}

impl TopicSignal {
    /// The requested signal, if a message is the first of its topic.
    pub fn find(
        request: &FieldRequest,
        message: &RawMessage,
        channels: &Channels,
        options: &TimeOptions,
        name: &str,
    ) -> Option<Result<Self, Failure>> {
        let channel = channels.get(message.channel_id)?;
        let field = request.field_in(channel, channels)?;
        let topic = &channel.record.topic;
        let signal = Self::new(name, channel, field, message, options);
        Some(signal.map_err(|why| {
            ErrorCode::ChannelNotFound
                .failed(format_args!("topic {topic}: {why}"))
                .at(name)
        }))
    }

    fn new(
        name: &str,
        channel: &Arc<TopicChannel>,
        field: FieldText,
        message: &RawMessage,
        options: &TimeOptions,
    ) -> Result<Self, String> {
        let of = channel.message_type(message.data)?;
        let schema = &of.schema;
        let parts = field.parts()?;
        let mut route = Route::find(schema, &parts)?;
        if parts.is_empty() && route.is_whole_list() {
            ask_for_item(&of, &route, message.data)?;
        }
        one_row(&of, &route, message.data)?;
        let by_name = by_name(&of, (&route, parts), message.data);
        let by_name = by_name.map(|named| {
            let text = std::mem::replace(&mut route, named).text;
            std::mem::replace(&mut route.text, text)
        });
        let spacing = Spacing::find(schema, &route, options.spacing.as_deref())?;
        let stamp = Stamp::find(schema);
        let selected = SelectedSignal {
            topic: channel.record.topic.clone(),
            schema: channel.schema_name().to_owned(),
            encoding: channel.record.message_encoding.clone(),
            field: route.text.clone(),
            unit: units::find(&route, &channel.record.metadata),
            is_compensated: is_compensated(&channel.record, &route.text),
            time: TimeUsed {
                choice: TimeChoice::Log,
                field: stamp.as_ref().map(|stamp| stamp.text.clone()),
                why: String::new(),
            },
        };
        let targets = Targets {
            value: route.clone(),
            stamp,
            spacing: spacing.hops().cloned(),
        };
        Ok(Self {
            name: name.to_owned(),
            channel: Arc::clone(channel),
            is_ours: vec![None; 1 << 16],
            publishers: Publishers::default(),
            selected,
            options: options.clone(),
            decoder: Decoder::new(of.encoding, schema, targets),
            route,
            by_name,
            reading: Reading::default(),
            first: Vec::new(),
            is_time_chosen: false,
            blocks: Blocks::new(spacing),
            sorter: Sorter::default(),
            clock: ClockCheck::default(),
            tally: Tally::default(),
            log_offset_ns: 0,
        })
    }

    /// Takes a message if it belongs to the topic.
    ///
    /// # Errors
    /// If channels of the topic have different types, or the messages lack the requested time.
    pub fn take(&mut self, message: &RawMessage, channels: &Channels) -> Result<bool, Failure> {
        let id = usize::from(message.channel_id);
        if self.is_ours[id].is_none() {
            self.is_ours[id] = is_ours(&self.channel, channels, message.channel_id, &self.name)?;
        }
        if self.is_ours[id] != Some(true) {
            return Ok(false);
        }
        self.publishers.note(message).map_err(|others| {
            let why = two_publishers(others);
            let topic = &self.selected.topic;
            ErrorCode::RecordsDiffer
                .failed(format_args!("topic {topic}: {why}"))
                .at(&self.name)
        })?;
        if self.is_time_chosen {
            self.decode(message);
            return Ok(true);
        }
        self.first.push(CopiedMessage {
            log_time_ns: message.log_time_ns,
            publish_time_ns: message.publish_time_ns,
            data: message.data.to_vec(),
        });
        if self.first.len() == FIRST {
            self.choose_time()?;
        }
        Ok(true)
    }

    /// Handles the end of the messages.
    ///
    /// # Errors
    /// If the messages lack the requested time, or their times start again.
    pub fn end(&mut self) -> Result<(), Failure> {
        if !self.is_time_chosen {
            self.choose_time()?;
        }
        let sorter = &mut self.sorter;
        self.blocks.finish(|time, value| sorter.push(time, value));
        let restart = self.sorter.restart;
        restart.map_or(Ok(()), |times_ns| Err(self.starts_again(times_ns)))
    }

    /// Failure for two runs in one file.
    fn starts_again(&self, [latest_ns, first_ns]: [i64; 2]) -> Failure {
        let used = &self.selected.time;
        let remedy = match used.choice {
            TimeChoice::Log => "",
            _ => ", or use --time log if the log times do not",
        };
        ErrorCode::RecordsDiffer.failed(format_args!(
            "topic {}: {} starts again, after {latest_ns} ns at {first_ns} ns, as where a simulation is reset or two \
             files were joined: the samples of both runs would be mixed; split the file there{remedy}",
            self.selected.topic,
            used.field.as_deref().unwrap_or("its time"),
        ))
        .at(&self.name)
    }

    /// Appends the samples that need not be held back any more, or all.
    pub fn give(&mut self, all: bool, times_ns: &mut Vec<i64>, values: &mut Vec<f64>) {
        let given = times_ns.len();
        self.sorter.give(all, times_ns, values);
        self.tally.samples(&times_ns[given..]);
    }

    fn decode(&mut self, message: &RawMessage) {
        self.tally.messages += 1;
        let log_time_ns = message.log_time_ns;
        if let Err(damage) = self.decoder.read(message.data, &mut self.reading) {
            self.tally.skip(damage, log_time_ns);
            return;
        }
        self.tally.place(self.reading.place);
        let (slice, count) = (self.route.slice, self.reading.values.len());
        slice.keep(&mut self.reading.values);
        if slice.start > 0 && count <= slice.start {
            let damage = Damage::NoItem {
                index: slice.start as i64,
                count: count as u64,
            };
            self.tally.skip(damage, log_time_ns);
            return;
        }
        let time_ns = self.time_ns(log_time_ns, message.publish_time_ns);
        if self.selected.time.choice == TimeChoice::Header {
            self.clock.note(time_ns, log_time_ns);
        }
        let Some(time_ns) = time_ns else {
            self.tally.without_time += 1;
            return;
        };
        let (sorter, reading) = (&mut self.sorter, &self.reading);
        self.blocks
            .push(time_ns, &reading.values, reading.spacing, |time, value| {
                sorter.push(time, value);
            });
    }

    /// The chosen time of the last decoded message.
    fn time_ns(&self, log_time_ns: u64, publish_time_ns: u64) -> Option<i64> {
        match self.selected.time.choice {
            TimeChoice::Log => i64::try_from(log_time_ns).ok(),
            TimeChoice::Publish => i64::try_from(publish_time_ns).ok(),
            TimeChoice::Header => self.reading.stamp_ns(),
        }
    }

    /// Rejects messages of two frames.
    fn check_frames(&self, first: &[CopiedMessage]) -> Result<(), Failure> {
        let data = first.iter().map(|message| &message.data[..]);
        let message = first.first().map_or(&[][..], |m| &m.data);
        let Ok(of) = self.channel.message_type(message) else {
            return Ok(());
        };
        one_frame(&of, &self.route, data).map_err(|why| {
            let topic = &self.selected.topic;
            ErrorCode::RecordsDiffer
                .failed(format_args!("topic {topic}: {why}"))
                .at(&self.name)
        })
    }

    /// Chooses the time named by the user, or the messages' own stamp if present and set, and decodes
    /// the messages held back.
    fn choose_time(&mut self) -> Result<(), Failure> {
        let field = self.selected.time.field.take();
        if self.options.time == Some(TimeChoice::Header) && field.is_none() {
            return Err(ErrorCode::TimeUnknown
                .failed(format_args!(
                    "topic {}: its messages have no time stamp (header.stamp, stamp or timestamp); \
                     use --time log or --time publish",
                    self.selected.topic
                ))
                .at(&self.name));
        }
        let first = std::mem::take(&mut self.first);
        self.check_frames(&first)?;
        let is_set = first.iter().any(|message| {
            let read = self.decoder.read(&message.data, &mut self.reading);
            read.is_ok() && self.reading.stamp_ns().is_some_and(|stamp| stamp != 0)
        });
        let (choice, why) = choice_of_time(self.options.time, field.as_deref(), is_set);
        self.selected.time = TimeUsed {
            choice,
            field: field.filter(|_| choice == TimeChoice::Header),
            why,
        };
        self.is_time_chosen = true;
        for (place, copied) in first.iter().enumerate() {
            self.decode(&RawMessage {
                channel_id: self.channel.record.id,
                log_time_ns: copied.log_time_ns,
                publish_time_ns: copied.publish_time_ns,
                data: &copied.data,
            });
            if place == 0 {
                let time_ns = self.time_ns(copied.log_time_ns, copied.publish_time_ns);
                let log_ns = i64::try_from(copied.log_time_ns).ok();
                let offset = time_ns.zip(log_ns);
                self.log_offset_ns = offset.map_or(0, |(time, log)| time.saturating_sub(log));
            }
        }
        Ok(())
    }
}

/// The path by name to an item requested by index, if the first message names it: joints change their index when
/// several nodes publish on a topic.
fn by_name(
    of: &MessageType,
    (route, parts): (&Route, Vec<PathPart>),
    message: &[u8],
) -> Option<Route> {
    let place = parts.iter().find_map(|part| match part {
        PathPart::Index(place) => usize::try_from(*place).ok(),
        _ => None,
    })?;
    let there = of.item_names(&parts, message)?;
    let name = there.get(place).filter(|name| !name.is_empty())?;
    let named = Route::find(&of.schema, &path::by_name(parts, name)?).ok()?;
    let is_only = there.iter().filter(|other| *other == name).count() == 1;
    let bits = |route: &Route| {
        let values = of.values(route, message).ok()?;
        Some(values.into_iter().map(f64::to_bits).collect::<Vec<_>>())
    };
    let is_same = bits(route)? == bits(&named)?;
    (is_only && is_same).then_some(named)
}

/// Asks for an item of a list, if the only number of a topic is a list with named items, which are not samples of one
/// signal.
fn ask_for_item(of: &MessageType, route: &Route, message: &[u8]) -> Result<(), String> {
    let parts = path::parse(&route.text).unwrap_or_default();
    let names = of.item_names(&parts, message).unwrap_or_default();
    let field = |name: &String| {
        let parts = path::by_name(parts.clone(), name);
        parts.map(|parts| format!("--field '{}'", path::text(&parts)))
    };
    let fields: Vec<String> = names.iter().filter_map(field).collect();
    match fields.len() {
        0 | 1 => Ok(()),
        count => Err(format!(
            "\"{}\" has {count} items, each with its own name; choose one: {}",
            route.text,
            fields.join(", ")
        )),
    }
}

/// The time to use, and why: the requested one, or a field of the messages.
fn choice_of_time(
    asked: Option<TimeChoice>,
    field: Option<&str>,
    is_set: bool,
) -> (TimeChoice, String) {
    match (asked, field) {
        (Some(choice), _) => (choice, "as asked".to_owned()),
        (None, Some(_)) if is_set => (
            TimeChoice::Header,
            "the messages carry their own time stamp".to_owned(),
        ),
        (None, Some(field)) => (
            TimeChoice::Log,
            format!("the field {field} is not set in the first messages"),
        ),
        (None, None) => (
            TimeChoice::Log,
            "the messages carry no time stamp of their own".to_owned(),
        ),
    }
}

/// Whether a channel belongs to the topic; `None` if it is not declared.
fn is_ours(
    ours: &TopicChannel,
    channels: &Channels,
    id: u16,
    name: &str,
) -> Result<Option<bool>, Failure> {
    let Some(channel) = channels.get(id) else {
        return Ok(None);
    };
    if channel.record.topic != ours.record.topic {
        return Ok(Some(false));
    }
    if channel.has_type_of(ours) {
        return Ok(Some(true));
    }
    Err(ErrorCode::RecordsDiffer
        .failed(format_args!(
            "the topic {} has channels of different types: channel {} is {} in {}, channel {} \
             is {} in {}; split the file by channel first",
            ours.record.topic,
            ours.record.id,
            ours.schema_name(),
            ours.record.message_encoding,
            channel.record.id,
            channel.schema_name(),
            channel.record.message_encoding
        ))
        .at(name))
}
