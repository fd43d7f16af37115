//! Sequential records of an MCAP file, including those in chunks.

use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;

use mcap::records::op;
use schemars::JsonSchema;
use serde::Serialize;

use super::census::Census;
use super::chunk::{
    ChunkError, STEP, UnpackedChunk, chunk_front, is_long, records_of_long, unpack, unpack_part,
};
use super::file::{FileReader, FileRecord, Loss, Losses, longest};
use super::input::CountedInput;
use super::{RECORD_HEAD, record_head, split_record};
use crate::failure::Failure;
use crate::io::Input;

/// Chunks with the same compression.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ChunkReport {
    /// Compression, empty for none.
    pub compression: String,
    /// Chunks.
    pub chunks: u64,
    /// Bytes in the file.
    pub packed_bytes: u64,
    /// Bytes unpacked.
    pub unpacked_bytes: u64,
}

/// Records of a file.
pub(crate) struct RecordReader {
    file: FileReader,
    /// Decompressed records of the current chunk, or the header of an attachment.
    buffer: Vec<u8>,
    /// Their location in the file's record instead, for an uncompressed chunk.
    in_place: Option<Range<usize>>,
    /// Source of further records of a long chunk.
    more: Option<Box<dyn Read + Send>>,
    /// Position up to which they have been delivered.
    at: usize,
    /// Offset in the file of the current record, or of the chunk that contains it.
    record_offset: u64,
    chunk_counts: BTreeMap<String, ChunkReport>,
    census: Census,
    is_counted: bool,
}

/// Longest record in a chunk that is read piece by piece.
const LONGEST_NESTED: u64 = 1 << 28;

/// Location of the body of a record.
enum Holder {
    File,
    Records(Range<usize>),
}

impl RecordReader {
    /// Opens a file and checks that it is MCAP.
    ///
    /// # Errors
    /// If it cannot be read, or does not begin like an MCAP file.
    pub fn open(input: &Input) -> Result<Self, Failure> {
        FileReader::open(input).map(Self::of_file)
    }

    /// Reads from a stream.
    ///
    /// # Errors
    /// If it does not begin like an MCAP file.
    pub fn new(name: String, input: CountedInput) -> Result<Self, Failure> {
        FileReader::new(name, input).map(Self::of_file)
    }

    fn of_file(file: FileReader) -> Self {
        Self {
            file,
            buffer: Vec::new(),
            in_place: None,
            more: None,
            at: 0,
            record_offset: 0,
            chunk_counts: BTreeMap::new(),
            census: Census::default(),
            is_counted: false,
        }
    }

    pub fn name(&self) -> &str {
        self.file.name()
    }

    /// Data lost so far.
    pub fn losses(&self) -> &Losses {
        &self.file.losses
    }

    /// Chunks so far, by the name of their compression.
    pub fn chunk_counts(&self) -> &BTreeMap<String, ChunkReport> {
        &self.chunk_counts
    }

    /// Whether the end record was found.
    pub fn is_closed(&self) -> bool {
        self.file.is_closed
    }

    /// Opcode and body of the next record, or `None` at the end. For an attachment it is the
    /// header.
    ///
    /// # Errors
    /// If the file cannot be read. Damage to its content is not an error: see [`Self::losses`].
    pub fn next(&mut self) -> Result<Option<(u8, &[u8])>, Failure> {
        let Some((op, holder)) = self.advance()? else {
            if !std::mem::replace(&mut self.is_counted, true) {
                self.census.finish(&mut self.file.losses);
            }
            return Ok(None);
        };
        let (mut losses, at) = (std::mem::take(&mut self.file.losses), self.record_offset);
        let body = match &holder {
            Holder::File => self.file.body(),
            Holder::Records(range) => match &self.in_place {
                Some(place) => &self.file.body()[place.clone()][range.clone()],
                None => &self.buffer[range.clone()],
            },
        };
        self.census.note(op, body, at, &mut losses);
        self.file.losses = losses;
        Ok(Some(match holder {
            Holder::File => (op, self.file.body()),
            Holder::Records(range) => (op, &self.records()[range]),
        }))
    }

    fn records(&self) -> &[u8] {
        match &self.in_place {
            Some(range) => &self.file.body()[range.clone()],
            None => &self.buffer,
        }
    }

    fn advance(&mut self) -> Result<Option<(u8, Holder)>, Failure> {
        loop {
            let rest = &self.records()[self.at..];
            if let Some((op, body)) = split_record(rest) {
                let start = self.at + RECORD_HEAD;
                let end = start + body.len();
                self.at = end;
                if !matches!(op, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
                    self.file.losses.add(Loss::Unknown {
                        at: self.record_offset,
                        op,
                        is_nested: true,
                    });
                    continue;
                }
                return Ok(Some((op, Holder::Records(start..end))));
            }
            if self.unpack_more() {
                continue;
            }
            let rest = &self.records()[self.at..];
            // The rest of a truncated chunk has been reported already.
            if !rest.is_empty() && !self.file.is_ended {
                let at = self.record_offset;
                self.file.losses.add(Loss::Overrun { at });
            }
            (self.at, self.in_place) = (0, None);
            self.buffer.clear();
            let Some(record) = self.file.next()? else {
                return Ok(None);
            };
            self.record_offset = record.offset;
            self.census.note_outer(record.op, record.offset);
            match record.op {
                op::CHUNK => self.unpack(record),
                op::ATTACHMENT => {
                    self.buffer.extend_from_slice(self.file.body());
                    self.at = self.buffer.len();
                    return Ok(match self.file.skip()? {
                        true => Some((record.op, Holder::Records(0..self.at))),
                        false => None,
                    });
                }
                op => return Ok(Some((op, Holder::File))),
            }
        }
    }

    /// Decompresses the current chunk of the file; its records are delivered next.
    fn unpack(&mut self, record: FileRecord) {
        let body = self.file.body();
        let front = chunk_front(body);
        if let Some((header, _)) = &front {
            let count = self.chunk_counts.entry(header.compression.clone());
            let count = count.or_insert_with_key(|compression| ChunkReport {
                compression: compression.clone(),
                ..ChunkReport::default()
            });
            count.chunks += 1;
            count.packed_bytes = count.packed_bytes.saturating_add(header.compressed_size);
            count.unpacked_bytes = count
                .unpacked_bytes
                .saturating_add(header.uncompressed_size);
        }
        let is_long = front.as_ref().is_some_and(|(header, _)| is_long(header));
        if is_long {
            match records_of_long(front.as_ref(), record.is_whole) {
                Ok(more) => self.more = Some(more),
                Err(why) if record.is_whole => self.lose_chunk(record.offset, why),
                Err(_) => {}
            }
            return;
        }
        if !record.is_whole {
            if let Some((header, packed)) = front {
                // Whatever is complete is used; the truncation is reported anyway.
                let _ = unpack_part(&header, packed, &mut self.buffer);
            }
            return;
        }
        match unpack(front.as_ref(), &mut self.buffer) {
            Ok(UnpackedChunk::Buffer) => {}
            Ok(UnpackedChunk::InPlace(length)) => {
                let start = body.len() - front.map_or(0, |(_, rest)| rest.len());
                self.in_place = Some(start..start + length);
            }
            Err(why) => self.lose_chunk(record.offset, why),
        }
    }

    /// Records that the current chunk of the file was dropped.
    fn lose_chunk(&mut self, at: u64, why: ChunkError) {
        self.buffer.clear();
        let front = chunk_front(self.file.body());
        let span_ns = front.map(|(header, _)| (header.message_start_time, header.message_end_time));
        self.file.losses.add(Loss::Chunk { at, why, span_ns });
    }

    /// Decompresses more of a long chunk after the undelivered records; `false` at its end.
    fn unpack_more(&mut self) -> bool {
        let Some(more) = &mut self.more else {
            return false;
        };
        self.buffer.drain(..self.at);
        self.at = 0;
        if let Some((op, length)) = record_head(&self.buffer)
            && length > longest(op).min(LONGEST_NESTED)
        {
            let at = self.record_offset;
            self.file.losses.add(Loss::TooLong { at, op, length });
            self.buffer.clear();
            self.more = None;
            return false;
        }
        // Doubling keeps the work proportional.
        let step = STEP.max(self.buffer.len()) as u64;
        let read = more.take(step).read_to_end(&mut self.buffer);
        let is_more = read.is_ok_and(|count| count > 0);
        if !is_more {
            self.more = None;
        }
        is_more
    }
}

#[cfg(test)]
#[path = "reader_tests.rs"]
mod tests;
