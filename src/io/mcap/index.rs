//! What the summary at the end of a file says of it, without reading the rest.

use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};

use mcap::records::op;
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use mcap::{MAGIC, Summary};

use super::channels::Channels;
use super::record::RawMessage;
use super::record::file::longest;
use super::record::input::CountedInput;
use super::record::reader::RecordReader;
use super::selection::FieldRequest;
use super::signal::{SelectedSignal, TimeOptions, TopicSignal};
use crate::io::Input;
use crate::io::storage::Stored;

/// The end of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignalEnd {
    /// Time of its last sample, in ns since the clock's zero.
    pub last_ns: i64,
    /// Messages of its topic.
    pub messages: u64,
}

/// A file and its summary; `None` if it cannot be sought, or has no summary that is whole.
pub(super) fn summary(input: &Input) -> Option<(Stored<File>, Summary)> {
    let Input::File(path) = input else {
        return None;
    };
    let mut file = Stored::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    let options = SummaryReaderOptions::default()
        .with_file_size(length)
        .with_record_length_limit(longest(op::CHANNEL) as usize);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            // A damaged length: no memory is taken for what the file cannot hold.
            SummaryReadEvent::ReadRequest(count) if count as u64 > length => return None,
            SummaryReadEvent::ReadRequest(count) => {
                let read = file.read(reader.insert(count)).ok()?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to).ok()?),
        }
    }
    Some((file, reader.finish()?))
}

/// The channels of a file, if its summary repeats all of them.
pub(super) fn channels(input: &Input) -> Option<Channels> {
    let (_, summary) = summary(input)?;
    let count = summary.stats.as_ref()?.channel_count as usize;
    (count > 0 && count == summary.channels.len()).then(|| Channels::of_summary(&summary))
}

/// The end of a signal, told from the summary and the chunk with its latest messages.
pub(super) fn signal_end(
    input: &Input,
    request: &FieldRequest,
    selected: &SelectedSignal,
    options: &TimeOptions,
) -> Option<SignalEnd> {
    let (mut file, summary) = summary(input)?;
    let is_ours = |id: &u16| {
        let channel = summary.channels.get(id);
        channel.is_some_and(|channel| channel.topic == selected.topic)
    };
    let counts = &summary.stats.as_ref()?.channel_message_counts;
    let messages = counts.iter().filter(|(id, _)| is_ours(id));
    let messages = messages.map(|(_, count)| count).sum();
    let ours = summary
        .chunk_indexes
        .iter()
        .filter(|chunk| chunk.message_index_offsets.keys().any(is_ours));
    let last = ours.max_by_key(|chunk| chunk.message_end_time)?;
    file.seek(SeekFrom::Start(last.chunk_start_offset)).ok()?;
    let stream = Cursor::new(MAGIC).chain(file.take(last.chunk_length));
    let mut records = RecordReader::new(input.name(), CountedInput::new(Box::new(stream))).ok()?;
    let mut channels = Channels::of_summary(&summary);
    let options = TimeOptions {
        time: Some(selected.time.choice),
        ..options.clone()
    };
    let mut signal = None;
    while let Some((op, body)) = records.next().ok()? {
        if op != op::MESSAGE {
            channels.note(op, body);
            continue;
        }
        let message = RawMessage::read(body)?;
        if signal.is_none() {
            let found = TopicSignal::find(request, &message, &channels, &options, "");
            signal = found.transpose().ok()?;
        }
        if let Some(signal) = &mut signal {
            signal.take(&message, &channels).ok()?;
        }
    }
    let mut signal = signal?;
    signal.end().ok()?;
    let (mut times_ns, mut values) = (Vec::new(), Vec::new());
    signal.give(true, &mut times_ns, &mut values);
    let last_ns = *times_ns.last()?;
    Some(SignalEnd { last_ns, messages })
}
