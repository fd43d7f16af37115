//! Grouping of messages into chunks with their indexes.

use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::{ChunkHeader, ChunkIndex, MessageIndex, MessageIndexEntry, op};

use super::index::FileIndex;
use super::sink::{RecordSink, body, push_record};
use crate::io::mcap::record::chunk::pack;

/// Size of records at which a chunk is closed, in bytes.
const FULL: usize = 1 << 20;

/// A chunk under construction.
pub(super) struct ChunkBuilder {
    /// `None` for records outside of chunks.
    compression: Option<String>,
    records: Vec<u8>,
    /// Log time and offset of the messages of each channel.
    places: BTreeMap<u16, Vec<MessageIndexEntry>>,
}

impl ChunkBuilder {
    /// An empty chunk: `zstd`, `lz4` or empty for no compression; `None` for no chunks at all. An
    /// index of chunks would hide messages outside of chunks, so a file has either.
    pub fn new(compression: Option<&str>) -> Self {
        Self {
            compression: compression.map(str::to_owned),
            records: Vec::new(),
            places: BTreeMap::new(),
        }
    }

    /// Appends a record other than a message.
    pub fn record(&mut self, op: u8, body: &[u8]) {
        push_record(&mut self.records, op, body);
    }

    /// Appends the body of a message record.
    pub fn message(&mut self, channel_id: u16, log_time: u64, body: &[u8]) {
        let offset = self.records.len() as u64;
        let places = self.places.entry(channel_id).or_default();
        places.push(MessageIndexEntry { log_time, offset });
        self.record(op::MESSAGE, body);
    }

    /// Whether it should be written.
    pub fn is_full(&self) -> bool {
        self.records.len() >= FULL
    }

    /// Writes it, if not empty, and starts a new one.
    pub fn write<W: Write>(
        &mut self,
        sink: &mut RecordSink<W>,
        index: &mut FileIndex,
    ) -> io::Result<()> {
        let records = std::mem::take(&mut self.records);
        let places = std::mem::take(&mut self.places);
        if records.is_empty() {
            return Ok(());
        }
        let Some(compression) = &self.compression else {
            return sink.write(&records);
        };
        let packed = pack(compression, &records)?;
        let logs = || places.values().flatten().map(|entry| entry.log_time);
        let header = ChunkHeader {
            message_start_time: logs().min().unwrap_or(0),
            message_end_time: logs().max().unwrap_or(0),
            uncompressed_size: records.len() as u64,
            uncompressed_crc: crc32fast::hash(&records),
            compression: compression.clone(),
            compressed_size: packed.len() as u64,
        };
        let mut chunk = body(&header)?;
        chunk.extend_from_slice(&packed);
        let mut entry = chunk_index(header, sink.offset());
        sink.record(op::CHUNK, &chunk)?;
        entry.chunk_length = sink.offset() - entry.chunk_start_offset;
        for (channel_id, records) in places {
            let offset = sink.offset();
            let list = MessageIndex {
                channel_id,
                records,
            };
            sink.record(op::MESSAGE_INDEX, &body(&list)?)?;
            entry.message_index_offsets.insert(channel_id, offset);
            entry.message_index_length += sink.offset() - offset;
        }
        index.chunks.push(entry);
        Ok(())
    }
}

/// Summary entry of a chunk at an offset, without lengths and indexes.
pub(super) fn chunk_index(header: ChunkHeader, chunk_start_offset: u64) -> ChunkIndex {
    ChunkIndex {
        message_start_time: header.message_start_time,
        message_end_time: header.message_end_time,
        chunk_start_offset,
        chunk_length: 0,
        message_index_offsets: BTreeMap::new(),
        message_index_length: 0,
        compression: header.compression,
        compressed_size: header.compressed_size,
        uncompressed_size: header.uncompressed_size,
    }
}
