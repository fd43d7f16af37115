//! The summary at the end of a file, read without the rest.

use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::records::{ChunkIndex, Footer, Record, Statistics, op};

use super::channels::Channels;
use super::record::file::FOOTER;
use super::record::input::CountedInput;
use super::record::reader::RecordReader;
use super::record::{self, RawMessage, split_record};
use super::selection::FieldRequest;
use super::signal::{SelectedSignal, TimeOptions, TopicSignal};
use crate::io::Input;
use crate::io::storage::Stored;

/// The end of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignalEnd {
    /// Time of its last sample, in ns from the origin of the clock.
    pub last_ns: i64,
    /// Number of messages of its topic.
    pub messages: u64,
}

/// The summary of a file.
struct Summary {
    channels: Channels,
    chunks: Vec<ChunkIndex>,
    statistics: Option<Statistics>,
}

impl Summary {
    /// Reads it; `None` if there is none, the file is not seekable, or a record of it is unreadable. The summary reader
    /// of `mcap` is unsuitable: it reserves memory for any text length claimed by a chunk index.
    fn read(input: &Input) -> Option<Self> {
        let path = input.plain_file()?;
        let length = Stored::open(path).ok()?.metadata().ok()?.len();
        let end = length.checked_sub((FOOTER + MAGIC.len()) as u64)?;
        let mut footer = Vec::new();
        let mut file = open_at(input, end)?;
        file.read_to_end(&mut footer).ok()?;
        let Some((op::FOOTER, body)) = split_record(&footer) else {
            return None;
        };
        let Record::Footer(Footer {
            summary_start: start @ 1..,
            ..
        }) = mcap::parse_record(op::FOOTER, body).ok()?
        else {
            return None;
        };
        let mut records = records_at(input, start, length.checked_sub(start)?)?;
        let mut found = Self {
            channels: Channels::default(),
            chunks: Vec::new(),
            statistics: None,
        };
        while let Some((op, body)) = records.next().ok()? {
            match op {
                op::SCHEMA | op::CHANNEL => {
                    record::parse(op, body)?;
                    found.channels.note(op, body);
                }
                op::CHUNK_INDEX => found.chunks.push(record::read_chunk_index(body)?),
                op::STATISTICS => match mcap::parse_record(op, body).ok()? {
                    Record::Statistics(statistics) => found.statistics = Some(statistics),
                    _ => return None,
                },
                _ => {}
            }
        }
        records.is_closed().then_some(found)
    }
}

/// Opens a file at an offset.
fn open_at(input: &Input, at: u64) -> Option<Stored<File>> {
    let mut file = Stored::open(input.plain_file()?).ok()?;
    file.seek(SeekFrom::Start(at)).ok()?;
    Some(file)
}

/// The records of a part of a file.
fn records_at(input: &Input, at: u64, length: u64) -> Option<RecordReader> {
    let stream = Cursor::new(MAGIC).chain(open_at(input, at)?.take(length));
    RecordReader::new(input.name(), CountedInput::new(Box::new(stream))).ok()
}

/// The channels of a file, if its summary repeats all of them.
pub(super) fn channels(input: &Input) -> Option<Channels> {
    let summary = Summary::read(input)?;
    let count = summary.statistics?.channel_count as usize;
    (count > 0 && count == summary.channels.iter().count()).then_some(summary.channels)
}

/// The end of a signal, from the summary and the chunk with its latest messages.
pub(super) fn signal_end(
    input: &Input,
    request: &FieldRequest,
    selected: &SelectedSignal,
    options: &TimeOptions,
) -> Option<SignalEnd> {
    let mut summary = Summary::read(input)?;
    let is_ours = |id: &u16| {
        let channel = summary.channels.get(*id);
        channel.is_some_and(|channel| channel.record.topic == selected.topic)
    };
    let counts = &summary.statistics.as_ref()?.channel_message_counts;
    let messages = counts.iter().filter(|(id, _)| is_ours(id));
    let messages = messages.map(|(_, count)| count).sum();
    let ours = summary
        .chunks
        .iter()
        .filter(|chunk| chunk.message_index_offsets.keys().any(is_ours));
    let last = ours.max_by_key(|chunk| chunk.message_end_time)?;
    let mut records = records_at(input, last.chunk_start_offset, last.chunk_length)?;
    let options = TimeOptions {
        time: Some(selected.time.choice),
        ..options.clone()
    };
    let mut signal = None;
    while let Some((op, body)) = records.next().ok()? {
        if op != op::MESSAGE {
            summary.channels.note(op, body);
            continue;
        }
        let message = RawMessage::read(body)?;
        if signal.is_none() {
            let found = TopicSignal::find(request, &message, &summary.channels, &options, "");
            signal = found.transpose().ok()?;
        }
        if let Some(signal) = &mut signal {
            signal.take(&message, &summary.channels).ok()?;
        }
    }
    let mut signal = signal?;
    signal.end().ok()?;
    let (mut times_ns, mut values) = (Vec::new(), Vec::new());
    signal.give(true, &mut times_ns, &mut values);
    let last_ns = *times_ns.last()?;
    Some(SignalEnd { last_ns, messages })
}
