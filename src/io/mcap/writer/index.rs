//! What is in the file that is written, for the summary at its end.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use mcap::MAGIC;
use mcap::records::op;

use super::sink::{Body, Sink};

/// A chunk and the indexes behind it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChunkEntry {
    /// Earliest and latest log time, in ns.
    pub span_ns: (u64, u64),
    /// Where the chunk begins.
    pub offset: u64,
    /// Bytes of its record.
    pub length: u64,
    /// Where the index of each channel begins.
    pub index_offsets: BTreeMap<u16, u64>,
    /// Bytes of all its indexes.
    pub index_length: u64,
    /// Compression.
    pub compression: String,
    /// Bytes of its records in the file.
    pub packed: u64,
    /// Bytes of its records unpacked.
    pub unpacked: u64,
}

/// An attachment or a metadata record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The body of its index record.
    pub index: Vec<u8>,
}

impl Entry {
    /// Of a metadata record.
    #[must_use]
    pub fn metadata(offset: u64, length: u64, name: &str) -> Self {
        let mut body = Body::default();
        body.u64(offset).u64(length).bytes(name.as_bytes());
        Self { index: body.0 }
    }
}

/// Everything the summary says.
#[derive(Debug, Default)]
pub struct Index {
    /// Bodies of the schemas by number, as the file declares them.
    pub schemas: BTreeMap<u16, Vec<u8>>,
    /// Bodies of the channels by number.
    pub channels: BTreeMap<u16, Vec<u8>>,
    /// Topics.
    pub topics: BTreeSet<String>,
    /// Messages by channel.
    pub messages: BTreeMap<u16, u64>,
    /// Earliest and latest log time, in ns.
    pub span_ns: Option<(u64, u64)>,
    /// Chunks.
    pub chunks: Vec<ChunkEntry>,
    /// Attachments.
    pub attachments: Vec<Entry>,
    /// Metadata.
    pub metadata: Vec<Entry>,
}

impl Index {
    /// Counts a message.
    pub fn message(&mut self, channel_id: u16, log_ns: u64) {
        *self.messages.entry(channel_id).or_default() += 1;
        self.span_ns = Some(match self.span_ns {
            None => (log_ns, log_ns),
            Some((first, last)) => (first.min(log_ns), last.max(log_ns)),
        });
    }

    /// Ends the data, and writes the summary and the footer.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn write<W: Write>(&self, sink: &mut Sink<W>) -> io::Result<()> {
        let crc = sink.take_crc();
        sink.record(op::DATA_END, &crc.to_le_bytes())?;
        sink.take_crc();
        let start = sink.offset();
        let groups = [
            (op::SCHEMA, self.schemas.values().cloned().collect()),
            (op::CHANNEL, self.channels.values().cloned().collect()),
            (op::STATISTICS, vec![self.statistics()]),
            (op::CHUNK_INDEX, self.chunks.iter().map(chunk).collect()),
            (op::ATTACHMENT_INDEX, bodies(&self.attachments)),
            (op::METADATA_INDEX, bodies(&self.metadata)),
        ];
        let mut offsets = Vec::new();
        for (op, bodies) in &groups {
            let from = sink.offset();
            for body in bodies {
                sink.record(*op, body)?;
            }
            if !bodies.is_empty() {
                let mut body = Body::default();
                body.raw(&[*op]).u64(from).u64(sink.offset() - from);
                offsets.push(body.0);
            }
        }
        let offsets_start = sink.offset();
        for body in &offsets {
            sink.record(op::SUMMARY_OFFSET, body)?;
        }
        footer(sink, start, offsets_start)
    }

    fn statistics(&self) -> Vec<u8> {
        let count = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
        let (first, last) = self.span_ns.unwrap_or((0, 0));
        let mut counts = Body::default();
        for (channel, messages) in &self.messages {
            counts.u16(*channel).u64(*messages);
        }
        let mut body = Body::default();
        body.u64(self.messages.values().sum())
            .u16(u16::try_from(self.schemas.len()).unwrap_or(u16::MAX))
            .u32(count(self.channels.len()))
            .u32(count(self.attachments.len()))
            .u32(count(self.metadata.len()))
            .u32(count(self.chunks.len()))
            .u64(first)
            .u64(last)
            .bytes(&counts.0);
        body.0
    }
}

fn bodies(entries: &[Entry]) -> Vec<Vec<u8>> {
    entries.iter().map(|entry| entry.index.clone()).collect()
}

fn chunk(entry: &ChunkEntry) -> Vec<u8> {
    let mut offsets = Body::default();
    for (channel, offset) in &entry.index_offsets {
        offsets.u16(*channel).u64(*offset);
    }
    let mut body = Body::default();
    body.u64(entry.span_ns.0)
        .u64(entry.span_ns.1)
        .u64(entry.offset)
        .u64(entry.length)
        .bytes(&offsets.0)
        .u64(entry.index_length)
        .bytes(entry.compression.as_bytes())
        .u64(entry.packed)
        .u64(entry.unpacked);
    body.0
}

/// The footer holds the checksum of the summary and of its own front.
fn footer<W: Write>(sink: &mut Sink<W>, start: u64, offsets_start: u64) -> io::Result<()> {
    let mut front = Body::default();
    front
        .raw(&[op::FOOTER])
        .u64(20)
        .u64(start)
        .u64(offsets_start);
    sink.write(&front.0)?;
    let crc = sink.take_crc();
    sink.write(&crc.to_le_bytes())?;
    sink.write(MAGIC)
}
