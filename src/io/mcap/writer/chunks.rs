//! Messages put together into chunks with their indexes.

use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::op;

use super::index::{ChunkEntry, Index};
use super::sink::{Body, Sink};

/// Bytes of records that a chunk is closed at.
const FULL: usize = 1 << 20;

/// A chunk under construction.
#[derive(Debug)]
pub struct Chunk {
    /// None for records that stand in the file by themselves.
    compression: Option<String>,
    records: Body,
    /// For each channel the log time and the place of its messages.
    places: BTreeMap<u16, Vec<(u64, u64)>>,
}

impl Chunk {
    /// An empty chunk: `zstd`, `lz4` or empty for no compression; none for no chunk at all: an
    /// index of chunks would hide messages outside of chunks, so a file has either.
    #[must_use]
    pub fn new(compression: Option<&str>) -> Self {
        Self {
            compression: compression.map(str::to_owned),
            records: Body::default(),
            places: BTreeMap::new(),
        }
    }

    /// Appends a record other than a message.
    pub fn record(&mut self, op: u8, body: &[u8]) {
        self.records.record(op, body);
    }

    /// Appends the body of a message record.
    pub fn message(&mut self, channel_id: u16, log_ns: u64, body: &[u8]) {
        let place = self.records.0.len() as u64;
        let places = self.places.entry(channel_id).or_default();
        places.push((log_ns, place));
        self.records.record(op::MESSAGE, body);
    }

    /// Whether it should be written.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.records.0.len() >= FULL
    }

    /// Writes it, if there is anything in it, and begins anew.
    ///
    /// # Errors
    /// If it cannot be compressed or written.
    pub fn write<W: Write>(&mut self, sink: &mut Sink<W>, index: &mut Index) -> io::Result<()> {
        if self.records.0.is_empty() {
            return Ok(());
        }
        let Some(compression) = &self.compression else {
            sink.write(&self.records.0)?;
            self.records.0.clear();
            self.places.clear();
            return Ok(());
        };
        let packed = pack(compression, &self.records.0)?;
        let span_ns = self.span_ns();
        let front = self.front(span_ns, compression, packed.len());
        let offset = sink.offset();
        let length = (front.0.len() + packed.len()) as u64;
        sink.write(&[op::CHUNK])?;
        sink.write(&length.to_le_bytes())?;
        sink.write(&front.0)?;
        sink.write(&packed)?;
        let mut entry = ChunkEntry {
            span_ns,
            offset,
            length: sink.offset() - offset,
            compression: compression.clone(),
            packed: packed.len() as u64,
            unpacked: self.records.0.len() as u64,
            ..ChunkEntry::default()
        };
        self.write_places(sink, &mut entry)?;
        index.chunks.push(entry);
        self.records.0.clear();
        self.places.clear();
        Ok(())
    }

    /// Log times of the earliest and the latest message.
    fn span_ns(&self) -> (u64, u64) {
        let logs = || self.places.values().flatten().map(|(log, _)| *log);
        (logs().min().unwrap_or(0), logs().max().unwrap_or(0))
    }

    /// What stands before the packed records.
    fn front(&self, span_ns: (u64, u64), compression: &str, packed: usize) -> Body {
        let mut front = Body::default();
        front
            .u64(span_ns.0)
            .u64(span_ns.1)
            .u64(self.records.0.len() as u64)
            .u32(crc32fast::hash(&self.records.0))
            .bytes(compression.as_bytes())
            .u64(packed as u64);
        front
    }

    /// An index of the messages for each channel, and where it is.
    fn write_places<W: Write>(&self, sink: &mut Sink<W>, entry: &mut ChunkEntry) -> io::Result<()> {
        let indexes = sink.offset();
        for (channel, places) in &self.places {
            entry.index_offsets.insert(*channel, sink.offset());
            let mut list = Body::default();
            for (log, place) in places {
                list.u64(*log).u64(*place);
            }
            let mut body = Body::default();
            body.u16(*channel).bytes(&list.0);
            sink.record(op::MESSAGE_INDEX, &body.0)?;
        }
        entry.index_length = sink.offset() - indexes;
        Ok(())
    }
}

fn pack(compression: &str, records: &[u8]) -> io::Result<Vec<u8>> {
    match compression {
        "zstd" => zstd::stream::encode_all(records, 0),
        "lz4" => {
            let mut encoder = lz4::EncoderBuilder::new().build(Vec::new())?;
            encoder.write_all(records)?;
            let (packed, result) = encoder.finish();
            result.map(|()| packed)
        }
        _ => Ok(records.to_vec()),
    }
}
