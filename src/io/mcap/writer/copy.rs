//! Verbatim copy of the data of a file.

use std::io::Write;

use mcap::records::{AttachmentIndex, MetadataIndex, Record, op};

use super::chunks::{ChunkBuilder, chunk_index};
use super::index::FileIndex;
use super::sink::RecordSink;
use crate::failure::{ErrorCode, Failure};
use crate::io::Input;
use crate::io::mcap::record::chunk::{chunk_front, unpack, unpack_part};
use crate::io::mcap::record::file::{FileReader, FileRecord, IN_ATTACHMENT, Loss};
use crate::io::mcap::record::{RawMessage, attachment_front, each_record, parse};

/// Result of copying.
pub(super) struct CopiedFile {
    pub index: FileIndex,
    /// Compression of most of its chunks, by number; `None` if it has messages, but no chunks.
    pub compression: Option<&'static str>,
}

/// Copies everything up to the end of the data.
///
/// # Errors
/// If the input cannot be read or is not MCAP, or the output cannot be written.
pub(super) fn copy<W: Write>(
    input: &Input,
    sink: &mut RecordSink<W>,
    output_name: &str,
) -> Result<CopiedFile, Failure> {
    let mut copier = Copier {
        file: FileReader::open(input)?,
        sink,
        output_name,
        index: FileIndex::default(),
        records: Vec::new(),
        is_chunk_copied: false,
    };
    // The magic bytes.
    copier.pass()?;
    while let Some(record) = copier.file.next()? {
        if record.op == op::DATA_END {
            break;
        }
        copier.record(record)?;
    }
    // It may be too long to be held, so truncation is only detected during copying.
    for loss in &copier.file.losses.first {
        if let Loss::Truncated { at, what } = loss
            && *what == IN_ATTACHMENT
        {
            return Err(ErrorCode::DamagedFile.failed(format_args!(
                "the file ends within the attachment at byte {at}; repair it first with \"mcap recover\""
            ))
            .at(input.name()));
        }
    }
    Ok(CopiedFile {
        compression: usual_compression(&copier.index),
        index: copier.index,
    })
}

fn usual_compression(index: &FileIndex) -> Option<&'static str> {
    if index.chunks.is_empty() && index.statistics.message_count > 0 {
        return None;
    }
    ["zstd", "lz4", ""].into_iter().rev().max_by_key(|name| {
        let compressions = index.chunks.iter().map(|chunk| &chunk.compression);
        compressions.filter(|other| other == name).count()
    })
}

struct Copier<'a, W: Write> {
    file: FileReader,
    sink: &'a mut RecordSink<W>,
    output_name: &'a str,
    index: FileIndex,
    /// Decompressed records of a chunk.
    records: Vec<u8>,
    /// Whether the indexes that follow belong to a copied chunk.
    is_chunk_copied: bool,
}

impl<W: Write> Copier<'_, W> {
    /// Copies one record, or drops it.
    fn record(&mut self, record: FileRecord) -> Result<(), Failure> {
        let offset = self.sink.offset();
        let body = self.file.body();
        match record.op {
            op::CHUNK => return self.chunk(record),
            op::MESSAGE_INDEX if !self.is_chunk_copied => return Ok(()),
            op::MESSAGE_INDEX => {
                if let (Some(chunk), Some(Record::MessageIndex(list))) = (
                    self.index.chunks.last_mut(),
                    mcap::parse_record(record.op, body).ok(),
                ) {
                    chunk.message_index_offsets.insert(list.channel_id, offset);
                    chunk.message_index_length += self.file.bytes().len() as u64;
                }
            }
            op::ATTACHMENT => return self.attachment(offset),
            op::METADATA => {
                if let Some(Record::Metadata(metadata)) = parse(record.op, body) {
                    self.index.metadata.push(MetadataIndex {
                        offset,
                        length: self.file.bytes().len() as u64,
                        name: metadata.name,
                    });
                }
            }
            op => note(&mut self.index, op, body),
        }
        self.pass().map(drop)
    }

    fn chunk(&mut self, record: FileRecord) -> Result<(), Failure> {
        let front = chunk_front(self.file.body());
        self.records.clear();
        if !record.is_whole {
            let Some((header, packed)) = front else {
                return Ok(());
            };
            // The complete part is used; the truncation is reported in the losses.
            let _ = unpack_part(&header, packed, &mut self.records);
            return self.salvage(&header.compression);
        }
        let unpacked = unpack(front.as_ref(), &mut self.records);
        self.is_chunk_copied = unpacked.is_ok();
        let at = record.offset;
        let span_ns = front
            .as_ref()
            .map(|(header, _)| (header.message_start_time, header.message_end_time));
        match (unpacked, front) {
            (Err(why), _) => self.file.losses.add(Loss::Chunk { at, why, span_ns }),
            (Ok(unpacked), Some((header, rest))) => {
                let index = &mut self.index;
                let records = unpacked.records(rest, &self.records);
                each_record(records, |op, body| note(index, op, body));
                let mut entry = chunk_index(header, self.sink.offset());
                entry.chunk_length = self.file.bytes().len() as u64;
                index.chunks.push(entry);
                self.pass()?;
            }
            (Ok(_), None) => {}
        }
        Ok(())
    }

    /// Writes the complete records of a truncated chunk as a chunk.
    fn salvage(&mut self, compression: &str) -> Result<(), Failure> {
        let mut chunk = ChunkBuilder::new(Some(compression));
        let index = &mut self.index;
        each_record(&self.records, |op, body| {
            note(index, op, body);
            match RawMessage::read(body) {
                Some(message) if op == op::MESSAGE => {
                    chunk.message(message.channel_id, message.log_time_ns, body);
                }
                _ => chunk.record(op, body),
            }
        });
        let written = chunk.write(self.sink, &mut self.index);
        written.map_err(|error| Failure::writing(self.output_name, &error))
    }

    fn attachment(&mut self, offset: u64) -> Result<(), Failure> {
        let front = attachment_front(self.file.body());
        self.pass()?;
        if let Some((header, data_size)) = front {
            self.index.attachments.push(AttachmentIndex {
                offset,
                length: self.sink.offset() - offset,
                log_time: header.log_time,
                create_time: header.create_time,
                data_size,
                name: header.name,
                media_type: header.media_type,
            });
        }
        Ok(())
    }

    /// Copies the current record.
    fn pass(&mut self) -> Result<bool, Failure> {
        let (sink, output_name) = (&mut *self.sink, self.output_name);
        self.file.copy(|bytes| {
            let written = sink.write(bytes);
            written.map_err(|error| Failure::writing(output_name, &error))
        })
    }
}

/// Records a copied record in the index.
fn note(index: &mut FileIndex, op: u8, body: &[u8]) {
    match op {
        op::MESSAGE => {
            if let Some(message) = RawMessage::read(body) {
                index.message(message.channel_id, message.log_time_ns);
            }
        }
        op::SCHEMA | op::CHANNEL => match parse(op, body) {
            Some(Record::Schema { header, .. }) => {
                index.schemas.entry(header.id).or_insert(body.to_vec());
            }
            Some(Record::Channel(channel)) => {
                index.topics.insert(channel.topic);
                index.channels.entry(channel.id).or_insert(body.to_vec());
            }
            _ => {}
        },
        _ => {}
    }
}
