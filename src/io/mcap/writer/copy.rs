//! The data of a file, copied as they are.

use std::io::Write;

use mcap::MAGIC;
use mcap::records::op;

use super::chunks::Chunk;
use super::index::{ChunkEntry, Entry, Index};
use super::sink::{Body, Sink};
use crate::failure::Failure;
use crate::io::Input;
use crate::io::mcap::record::chunk::{self, ChunkError, ChunkHead};
use crate::io::mcap::record::fields::Fields;
use crate::io::mcap::record::frames::{Loss, not_mcap};
use crate::io::mcap::record::input::CountedInput;
use crate::io::mcap::record::{
    AttachmentHead, ChannelRecord, Message, MetadataRecord, SchemaRecord,
};

/// Bytes of a record's opcode and length.
const RECORD_HEAD: usize = 9;
/// Bytes of an attachment that its names are read from.
const ATTACHMENT_FRONT: u64 = 1 << 16;
/// Bytes copied at a time.
const PIECE: usize = 1 << 18;

/// What was copied.
pub struct Copied {
    /// What is in it.
    pub index: Index,
    /// Compression of most of its chunks, by their number; none if it has messages, but no chunks.
    pub compression: Option<&'static str>,
    /// What could not be copied.
    pub losses: Vec<Loss>,
}

/// Copies everything up to the end of the data.
///
/// # Errors
/// If the input cannot be read or is not MCAP, or the output cannot be written.
pub fn copy<W: Write>(
    place: &Input,
    sink: &mut Sink<W>,
    output_name: &str,
) -> Result<Copied, Failure> {
    let mut copier = Copier {
        input: CountedInput::new(place.open()?),
        input_name: place.name(),
        sink,
        output_name,
        index: Index::default(),
        losses: Vec::new(),
        records: Vec::new(),
        is_chunk_copied: false,
    };
    copier.start()?;
    while copier.record()? {}
    Ok(Copied {
        compression: usual_compression(&copier.index),
        index: copier.index,
        losses: copier.losses,
    })
}

fn usual_compression(index: &Index) -> Option<&'static str> {
    if index.chunks.is_empty() && !index.messages.is_empty() {
        return None;
    }
    ["zstd", "lz4", ""].into_iter().rev().max_by_key(|name| {
        let same = index
            .chunks
            .iter()
            .filter(|chunk| chunk.compression == *name);
        same.count()
    })
}

struct Copier<'a, W: Write> {
    input: CountedInput,
    input_name: String,
    sink: &'a mut Sink<W>,
    output_name: &'a str,
    index: Index,
    losses: Vec<Loss>,
    /// Unpacked records of a chunk.
    records: Vec<u8>,
    /// Whether the indexes that follow belong to a chunk that was copied.
    is_chunk_copied: bool,
}

impl<W: Write> Copier<'_, W> {
    fn start(&mut self) -> Result<(), Failure> {
        let there = self.want(MAGIC.len())?;
        if self.input.window()[..there] != *MAGIC {
            return Err(not_mcap(&self.input_name));
        }
        self.pass(MAGIC.len() as u64).map(drop)
    }

    /// Copies one record; false at the end of the data.
    fn record(&mut self) -> Result<bool, Failure> {
        let at = self.input.offset();
        let there = self.want(RECORD_HEAD)?;
        let Some(length) = self.input.window().get(1..RECORD_HEAD) else {
            let what = if there == 0 {
                "after a whole record"
            } else {
                "within a record"
            };
            return Ok(self.truncated(at, what));
        };
        let op = self.input.window()[0];
        let length = length.try_into().map_or(0, u64::from_le_bytes);
        match op {
            op::DATA_END | op::FOOTER => Ok(false),
            op::ATTACHMENT => self.attachment(at, length),
            _ if length > chunk::LARGEST && op != op::CHUNK => {
                self.losses.push(Loss::TooLong { at, op, length });
                Ok(false)
            }
            _ => self.whole(at, op, length),
        }
    }

    fn whole(&mut self, at: u64, op: u8, length: u64) -> Result<bool, Failure> {
        let whole = RECORD_HEAD + length.min(chunk::LARGEST) as usize;
        let there = self.want(whole)?;
        if op == op::CHUNK {
            // A recorder that was stopped leaves its last chunk without a length.
            let is_whole = there == whole && length <= chunk::LARGEST;
            return self.chunk(at, there, is_whole);
        }
        if there < whole {
            return Ok(self.truncated(at, "within a record"));
        }
        let offset = self.sink.offset();
        let body = &self.input.window()[RECORD_HEAD..whole];
        match op {
            op::MESSAGE_INDEX if !self.is_chunk_copied => {
                self.input.used(whole);
                return Ok(true);
            }
            op::MESSAGE_INDEX => {
                let channel = Fields::new(body).u16();
                if let (Some(entry), Some(channel)) = (self.index.chunks.last_mut(), channel) {
                    entry.index_offsets.insert(channel, offset);
                    entry.index_length += whole as u64;
                }
            }
            op::METADATA => {
                let name = MetadataRecord::read(body).map(|record| record.name);
                let name = name.unwrap_or_default();
                let entry = Entry::metadata(offset, whole as u64, &name);
                self.index.metadata.push(entry);
            }
            _ => note(&mut self.index, op, body),
        }
        self.pass(whole as u64).map(|_| true)
    }

    fn chunk(&mut self, at: u64, there: usize, is_whole: bool) -> Result<bool, Failure> {
        let body = &self.input.window()[RECORD_HEAD.min(there)..there];
        let Some((head, packed)) = ChunkHead::read(body) else {
            if !is_whole {
                return Ok(self.truncated(at, "within a chunk"));
            }
            return Ok(self.leave_out(at, there, ChunkError::Head, None));
        };
        let span_ns = Some((head.start_ns, head.end_ns));
        if !is_whole {
            let _ = chunk::unpack_part(&head, packed, &mut self.records);
            self.salvage(&head.compression)?;
            return Ok(self.truncated(at, "within a chunk"));
        }
        let size = usize::try_from(head.packed_size).unwrap_or(usize::MAX);
        let unpacked = match packed.get(..size) {
            Some(packed) => chunk::unpack(&head, packed, &mut self.records),
            None => Err(ChunkError::Length {
                told: head.packed_size,
                found: packed.len() as u64,
            }),
        };
        if let Err(why) = unpacked {
            return Ok(self.leave_out(at, there, why, span_ns));
        }
        self.is_chunk_copied = true;
        let index = &mut self.index;
        each(&self.records, |op, body| note(index, op, body));
        self.index.chunks.push(ChunkEntry {
            span_ns: (head.start_ns, head.end_ns),
            offset: self.sink.offset(),
            length: there as u64,
            compression: head.compression,
            packed: head.packed_size,
            unpacked: head.size,
            ..ChunkEntry::default()
        });
        self.pass(there as u64).map(|_| true)
    }

    fn leave_out(
        &mut self,
        at: u64,
        whole: usize,
        why: ChunkError,
        span_ns: Option<(u64, u64)>,
    ) -> bool {
        self.is_chunk_copied = false;
        self.losses.push(Loss::Chunk { at, why, span_ns });
        self.input.used(whole);
        true
    }

    /// Writes the whole records of a chunk that is cut off as a chunk.
    fn salvage(&mut self, compression: &str) -> Result<(), Failure> {
        let mut chunk = Chunk::new(Some(compression));
        let index = &mut self.index;
        each(&self.records, |op, body| {
            note(index, op, body);
            match Message::read(body) {
                Some(message) if op == op::MESSAGE => {
                    chunk.message(message.channel_id, message.log_time_ns, body);
                }
                _ => chunk.record(op, body),
            }
        });
        let written = chunk.write(self.sink, &mut self.index);
        written.map_err(|error| Failure::writing(self.output_name, &error))
    }

    fn attachment(&mut self, at: u64, length: u64) -> Result<bool, Failure> {
        let front = length.min(ATTACHMENT_FRONT) as usize;
        let there = self.want(RECORD_HEAD + front)?;
        let body = &self.input.window()[RECORD_HEAD.min(there)..there];
        let head = AttachmentHead::read(body);
        let offset = self.sink.offset();
        let whole = length.saturating_add(RECORD_HEAD as u64);
        // It may be too long to be held, so that it ends too early is found only in copying it.
        let copied = self.pass(whole)?;
        if copied < whole {
            return Err(Failure::failed(format_args!(
                "{}: the file ends within the attachment at byte {at}; such a file cannot be \
                 copied. Make it whole first with \"mcap recover\"",
                self.input_name
            )));
        }
        if let Some((head, _)) = head {
            let mut body = Body::default();
            body.u64(offset)
                .u64(whole)
                .u64(head.log_time_ns)
                .u64(head.create_time_ns)
                .u64(head.size)
                .bytes(head.name.as_bytes())
                .bytes(head.media_type.as_bytes());
            self.index.attachments.push(Entry { index: body.0 });
        }
        Ok(true)
    }

    fn truncated(&mut self, at: u64, what: &str) -> bool {
        let what = what.to_owned();
        self.losses.push(Loss::Truncated { at, what });
        false
    }

    fn want(&mut self, count: usize) -> Result<usize, Failure> {
        let there = self.input.want(count);
        there.map_err(|error| {
            Failure::failed(format_args!("{}: cannot be read: {error}", self.input_name))
        })
    }

    /// Copies that many bytes; gives how many there were.
    fn pass(&mut self, count: u64) -> Result<u64, Failure> {
        let mut left = count;
        while left > 0 {
            let step = usize::try_from(left).unwrap_or(usize::MAX).min(PIECE);
            let there = self.want(step)?;
            if there == 0 {
                break;
            }
            let written = self.sink.write(&self.input.window()[..there]);
            written.map_err(|error| Failure::writing(self.output_name, &error))?;
            self.input.used(there);
            left -= there as u64;
        }
        Ok(count - left)
    }
}

/// Takes note of a record.
fn note(index: &mut Index, op: u8, body: &[u8]) {
    match op {
        op::SCHEMA => {
            if let Some(schema) = SchemaRecord::read(body) {
                index.schemas.entry(schema.id).or_insert(body.to_vec());
            }
        }
        op::CHANNEL => {
            if let Some(channel) = ChannelRecord::read(body) {
                index.topics.insert(channel.topic);
                index.channels.entry(channel.id).or_insert(body.to_vec());
            }
        }
        op::MESSAGE => {
            if let Some(message) = Message::read(body) {
                index.message(message.channel_id, message.log_time_ns);
            }
        }
        _ => {}
    }
}

/// Calls with each whole record.
fn each(records: &[u8], mut call: impl FnMut(u8, &[u8])) {
    let mut rest = Fields::new(records);
    while let Some(op) = rest.take(1) {
        let length = rest.u64().and_then(|length| usize::try_from(length).ok());
        let Some(body) = length.and_then(|length| rest.take(length)) else {
            return;
        };
        call(op[0], body);
    }
}
