//! One number of one topic as a signal, read as a stream.

use std::collections::VecDeque;

use mcap::records::op;

use super::blocks::{Blocks, Spacing};
use super::channels::{Channel, Channels};
use super::clock::Clock;
use super::decode::{Damage, Decoder, Reading, Targets};
use super::order::Sorter;
use super::record::Message;
use super::record::frames::Frames;
use super::route::Route;
use super::selection::{Selection, Wanted};
use super::summary::{Summary, Tally};
use super::time::{Stamp, TimeChoice, TimeUsed};
use super::units::{self, UnitFound};
use crate::failure::Failure;
use crate::io::Input;

/// Samples given at a time.
const BATCH: usize = 1 << 13;
/// Messages looked at before the choice of the time.
const FIRST: usize = 16;

/// What the command line says beyond the choice of a number.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Options {
    /// The time that counts; told from the messages if not given.
    pub time: Option<TimeChoice>,
    /// Field that holds the spacing of samples, for messages with many of them.
    pub spacing: Option<String>,
}

/// What was chosen, for people.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// Topic.
    pub topic: String,
    /// Name of the schema.
    pub schema: String,
    /// Encoding of its messages.
    pub encoding: String,
    /// Field.
    pub field: String,
    /// Kind of number.
    pub number: &'static str,
    /// Unit, if the file tells it.
    pub unit: Option<UnitFound>,
    /// Which time counts, and why.
    pub time: TimeUsed,
    /// How samples within a message lie.
    pub spacing: Spacing,
}

impl Chosen {
    /// A number of a topic, before the time is chosen; `stamp` is the field of the time stamp.
    fn of(channel: &Channel, route: &Route, stamp: Option<String>, spacing: Spacing) -> Self {
        Self {
            topic: channel.record.topic.clone(),
            schema: channel.schema_name().to_owned(),
            encoding: channel.record.message_encoding.clone(),
            field: route.text.clone(),
            number: route.number.name(),
            unit: units::find(route, &channel.record.metadata),
            time: TimeUsed {
                choice: TimeChoice::Log,
                field: stamp,
                why: String::new(),
            },
            spacing,
        }
    }
}

/// The time that counts, and why: as told, or what the messages carry in a field.
fn choice_of_time(
    told: Option<TimeChoice>,
    field: Option<&str>,
    is_set: bool,
) -> (TimeChoice, String) {
    match (told, field) {
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

/// A signal that is open for reading.
pub struct Source {
    frames: Frames,
    channels: Channels,
    /// The first channel of the topic; others must be like it.
    channel: std::sync::Arc<Channel>,
    /// For each channel whether it is of the topic.
    is_ours: Vec<Option<bool>>,
    chosen: Chosen,
    decoder: Decoder,
    reading: Reading,
    /// Messages that were looked at before, with log and publish time.
    first: VecDeque<Copied>,
    blocks: Blocks,
    sorter: Sorter,
    clock: Clock,
    tally: Tally,
    is_at_end: bool,
    log_offset_ns: i64,
}

/// A message kept for later.
struct Copied {
    log_time_ns: u64,
    publish_time_ns: u64,
    data: Vec<u8>,
}

impl Source {
    /// Opens a file and finds the number in it.
    ///
    /// # Errors
    /// If the file cannot be read, or the number is not in it: then with what is there.
    pub fn open(place: &Input, selection: &Selection, options: &Options) -> Result<Self, Failure> {
        let wanted = match selection.check()? {
            Wanted::Only => super::inventory::only_topic(place)?,
            wanted => wanted,
        };
        Self::read(place, Frames::open(place)?, &wanted, options)
    }

    /// Finds a number in a place that is open.
    ///
    /// # Errors
    /// If the number is not in it: then with what is there.
    pub fn read(
        place: &Input,
        mut frames: Frames,
        wanted: &Wanted,
        options: &Options,
    ) -> Result<Self, Failure> {
        let mut channels = Channels::default();
        if let Some(found) = first_message(&mut frames, &mut channels, wanted)? {
            return Self::after(frames, channels, found, wanted, options);
        }
        // Where the chunk that declares a channel is damaged, the end of the file may declare it again.
        if frames.loss_count() > 0 && *place != Input::Stdin {
            let mut again = Frames::open(place)?;
            if let Some(found) = first_message(&mut again, &mut channels, wanted)? {
                return Self::after(again, channels, found, wanted, options);
            }
        }
        Err(missed(&frames, &channels, wanted))
    }

    /// Goes on behind the first message of the wanted topic.
    fn after(
        frames: Frames,
        channels: Channels,
        (channel, first): (std::sync::Arc<Channel>, Copied),
        wanted: &Wanted,
        options: &Options,
    ) -> Result<Self, Failure> {
        let topic = &channel.record.topic;
        let name = frames.name().to_owned();
        let at_topic = |why: String| Failure::failed(format_args!("{name}: topic {topic}: {why}"));
        let (encoding, schema) = channel.layout(&first.data).map_err(at_topic)?;
        let field = wanted.field_in(&channel, &channels);
        let parts = field.map_or(Ok(Vec::new()), super::selection::FieldText::parts);
        let route = parts.and_then(|parts| Route::find(&schema, &parts));
        let route = route.map_err(at_topic)?;
        let spacing = Spacing::find(&schema, &route, options.spacing.as_deref());
        let spacing = spacing.map_err(at_topic)?;
        let stamp = Stamp::find(&schema);
        let field = stamp.as_ref().map(|stamp| stamp.text.clone());
        let targets = Targets {
            value: route.clone(),
            stamp,
            spacing: spacing.hops().cloned(),
        };
        let chosen = Chosen::of(&channel, &route, field, spacing.clone());
        let mut source = Self {
            decoder: Decoder::new(encoding, &schema, targets),
            frames,
            channels,
            channel,
            is_ours: vec![None; 1 << 16],
            chosen,
            reading: Reading::default(),
            first: VecDeque::from([first]),
            blocks: Blocks::new(spacing),
            sorter: Sorter::default(),
            clock: Clock::default(),
            tally: Tally::default(),
            is_at_end: false,
            log_offset_ns: 0,
        };
        source.look_ahead()?;
        source.choose_time(options.time)?;
        Ok(source)
    }

    /// Name of the file, for people.
    #[must_use]
    pub fn name(&self) -> &str {
        self.frames.name()
    }

    /// What was chosen.
    #[must_use]
    pub fn chosen(&self) -> &Chosen {
        &self.chosen
    }

    /// The chosen time of the first message minus its log time, in ns: what a time must be
    /// lessened by to lie among the log times of the file.
    #[must_use]
    pub fn log_offset_ns(&self) -> i64 {
        self.log_offset_ns
    }

    /// Gives the next samples in the order of their times, in ns since the clock's zero; false
    /// when there are none left. What is in the two lists is replaced.
    ///
    /// # Errors
    /// If the file cannot be read, or channels of the topic are of different types.
    pub fn next(
        &mut self,
        times_ns: &mut Vec<i64>,
        values: &mut Vec<f64>,
    ) -> Result<bool, Failure> {
        times_ns.clear();
        values.clear();
        while values.len() < BATCH && !self.is_at_end {
            for _ in 0..BATCH {
                if !self.message()? {
                    self.is_at_end = true;
                    break;
                }
            }
            if self.is_at_end {
                let sorter = &mut self.sorter;
                self.blocks.finish(|time, value| sorter.push(time, value));
            }
            self.sorter.give(self.is_at_end, times_ns, values);
        }
        self.tally.samples(times_ns);
        Ok(!values.is_empty())
    }

    /// Says what was read and what was not; to be called at the end.
    #[must_use]
    pub fn finish(self) -> Summary {
        self.tally.summary(
            &self.chosen,
            &self.frames,
            &self.sorter,
            &self.blocks,
            &self.clock,
            self.channels.conflicts,
        )
    }

    /// Reads one message of the topic; false at the end of the file.
    fn message(&mut self) -> Result<bool, Failure> {
        if let Some(copied) = self.first.pop_front() {
            self.take(copied.log_time_ns, copied.publish_time_ns, &copied.data);
            return Ok(true);
        }
        while let Some(frame) = self.frames.advance()? {
            if frame.op != op::MESSAGE {
                self.channels.note(frame.op, self.frames.body(&frame));
                continue;
            }
            let body = self.frames.body(&frame);
            let Some(message) = Message::read(body) else {
                self.tally.broken += 1;
                continue;
            };
            if self.is_ours[usize::from(message.channel_id)].is_none() {
                let is_ours = is_ours(
                    &self.channel,
                    &self.channels,
                    message.channel_id,
                    self.frames.name(),
                )?;
                self.is_ours[usize::from(message.channel_id)] = is_ours;
            }
            if self.is_ours[usize::from(message.channel_id)] != Some(true) {
                continue;
            }
            // Taken apart so that the message can stay where it is while the rest is filled.
            let (log, publish) = (message.log_time_ns, message.publish_time_ns);
            let result = self.decoder.read(message.data, &mut self.reading);
            self.keep(log, publish, result);
            return Ok(true);
        }
        Ok(false)
    }

    fn take(&mut self, log_time_ns: u64, publish_time_ns: u64, data: &[u8]) {
        let result = self.decoder.read(data, &mut self.reading);
        self.keep(log_time_ns, publish_time_ns, result);
    }

    fn keep(&mut self, log_time_ns: u64, publish_time_ns: u64, result: Result<(), Damage>) {
        self.tally.messages += 1;
        if let Err(damage) = result {
            self.tally.skip(damage, log_time_ns);
            return;
        }
        let time_ns = match self.chosen.time.choice {
            TimeChoice::Log => i64::try_from(log_time_ns).ok(),
            TimeChoice::Publish => i64::try_from(publish_time_ns).ok(),
            TimeChoice::Header => {
                let stamp_ns = self.reading.stamp_ns();
                self.clock.note(stamp_ns, log_time_ns);
                stamp_ns
            }
        };
        let Some(time_ns) = time_ns else {
            self.tally.without_time += 1;
            return;
        };
        let sorter = &mut self.sorter;
        let reading = &self.reading;
        self.blocks
            .push(time_ns, &reading.values, reading.spacing, |time, value| {
                sorter.push(time, value);
            });
    }

    /// Copies the first messages, to choose the time by them.
    fn look_ahead(&mut self) -> Result<(), Failure> {
        while self.first.len() < FIRST {
            let Some(frame) = self.frames.advance()? else {
                break;
            };
            let body = self.frames.body(&frame);
            if frame.op != op::MESSAGE {
                self.channels.note(frame.op, body);
                continue;
            }
            let Some(message) = Message::read(body) else {
                self.tally.broken += 1;
                continue;
            };
            let name = self.frames.name();
            if is_ours(&self.channel, &self.channels, message.channel_id, name)? == Some(true) {
                self.first.push_back(Copied::of(&message));
            }
        }
        Ok(())
    }

    /// Takes the time that the user names, or the message's own stamp if it has one that counts.
    fn choose_time(&mut self, told: Option<TimeChoice>) -> Result<(), Failure> {
        let field = self.chosen.time.field.take();
        let stamps: Vec<Option<i64>> = self
            .first
            .iter()
            .map(|message| {
                let read = self.decoder.read(&message.data, &mut self.reading);
                read.ok().and_then(|()| self.reading.stamp_ns())
            })
            .collect();
        if told == Some(TimeChoice::Header) && field.is_none() {
            return Err(Failure::failed(format_args!(
                "{}: topic {}: its messages have no time stamp (header.stamp, stamp or timestamp); \
                 use --time log or --time publish",
                self.frames.name(),
                self.chosen.topic
            )));
        }
        let is_set = stamps.iter().flatten().any(|stamp| *stamp != 0);
        let (choice, why) = choice_of_time(told, field.as_deref(), is_set);
        self.log_offset_ns = self.first.front().map_or(0, |message| {
            let log_ns = i64::try_from(message.log_time_ns).ok();
            let time_ns = match choice {
                TimeChoice::Log => log_ns,
                TimeChoice::Publish => i64::try_from(message.publish_time_ns).ok(),
                TimeChoice::Header => stamps.first().copied().flatten(),
            };
            time_ns
                .zip(log_ns)
                .map_or(0, |(time, log)| time.saturating_sub(log))
        });
        self.chosen.time = TimeUsed {
            choice,
            field: field.filter(|_| choice == TimeChoice::Header),
            why,
        };
        Ok(())
    }
}

impl Copied {
    fn of(message: &Message) -> Self {
        Self {
            log_time_ns: message.log_time_ns,
            publish_time_ns: message.publish_time_ns,
            data: message.data.to_vec(),
        }
    }
}

/// The first message of the wanted topic; none if there is none.
fn first_message(
    frames: &mut Frames,
    channels: &mut Channels,
    wanted: &Wanted,
) -> Result<Option<(std::sync::Arc<Channel>, Copied)>, Failure> {
    while let Some(frame) = frames.advance()? {
        let body = frames.body(&frame);
        if frame.op != op::MESSAGE {
            channels.note(frame.op, body);
            continue;
        }
        let Some(message) = Message::read(body) else {
            continue;
        };
        let Some(channel) = channels.get(message.channel_id) else {
            continue;
        };
        if wanted.field_in(channel, channels).is_some() {
            return Ok(Some((channel.clone(), Copied::of(&message))));
        }
    }
    Ok(None)
}

/// The failure of a file without the wanted topic: what is there, and what was lost.
fn missed(frames: &Frames, channels: &Channels, wanted: &Wanted) -> Failure {
    let mut said = format!("{}: {}", frames.name(), wanted.miss(channels));
    for loss in frames.losses() {
        said.push_str(&format!("; {loss}"));
    }
    Failure::failed(said)
}

/// Whether a channel is of the topic; none if it is not declared.
fn is_ours(
    ours: &Channel,
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
    let what = |channel: &Channel| {
        let schema = channel.schema.as_ref();
        let schema = schema.map(|s| (s.name.clone(), s.encoding.clone(), s.data.clone()));
        (channel.record.message_encoding.clone(), schema)
    };
    if what(channel) == what(ours) {
        return Ok(Some(true));
    }
    Err(Failure::failed(format_args!(
        "{name}: the topic {} has channels of different types: channel {} is {} in {}, channel {} \
         is {} in {}; split the file by channel first",
        ours.record.topic,
        ours.record.id,
        ours.schema_name(),
        ours.record.message_encoding,
        channel.record.id,
        channel.schema_name(),
        channel.record.message_encoding,
    )))
}

#[cfg(test)]
#[path = "source_tests.rs"]
mod tests;
