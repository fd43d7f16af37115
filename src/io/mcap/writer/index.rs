//! Content of the written file, for its summary.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use mcap::MAGIC;
use mcap::records::{
    AttachmentIndex, ChunkIndex, DataEnd, MetadataIndex, Statistics, SummaryOffset, op,
};

use super::sink::{RecordSink, body, push_record};

/// Content of the summary.
#[derive(Default)]
pub(super) struct FileIndex {
    /// Bodies of the schemas by number, as declared in the file.
    pub schemas: BTreeMap<u16, Vec<u8>>,
    /// Bodies of the channels by number.
    pub channels: BTreeMap<u16, Vec<u8>>,
    pub topics: BTreeSet<String>,
    /// Messages and times; the other counts follow from the lists.
    pub statistics: Statistics,
    pub chunks: Vec<ChunkIndex>,
    pub attachments: Vec<AttachmentIndex>,
    pub metadata: Vec<MetadataIndex>,
}

impl FileIndex {
    /// Counts a message.
    pub fn message(&mut self, channel_id: u16, log_ns: u64) {
        let counts = &mut self.statistics;
        let is_first = counts.message_count == 0;
        if is_first || log_ns < counts.message_start_time {
            counts.message_start_time = log_ns;
        }
        counts.message_end_time = counts.message_end_time.max(log_ns);
        counts.message_count += 1;
        *counts.channel_message_counts.entry(channel_id).or_default() += 1;
    }

    /// Ends the data, and writes the summary and the footer.
    pub fn write<W: Write>(mut self, sink: &mut RecordSink<W>) -> io::Result<()> {
        let data_section_crc = sink.take_crc();
        sink.record(op::DATA_END, &body(&DataEnd { data_section_crc })?)?;
        sink.take_crc();
        self.count();
        let start = sink.offset();
        let groups = [
            (op::SCHEMA, self.schemas.into_values().collect()),
            (op::CHANNEL, self.channels.into_values().collect()),
            (op::STATISTICS, vec![body(&self.statistics)?]),
            (op::CHUNK_INDEX, bodies(&self.chunks)?),
            (op::ATTACHMENT_INDEX, bodies(&self.attachments)?),
            (op::METADATA_INDEX, bodies(&self.metadata)?),
        ];
        let mut offsets = Vec::new();
        for (group_opcode, bodies) in groups {
            let group_start = sink.offset();
            for body in &bodies {
                sink.record(group_opcode, body)?;
            }
            if !bodies.is_empty() {
                offsets.push(SummaryOffset {
                    group_opcode,
                    group_start,
                    group_length: sink.offset() - group_start,
                });
            }
        }
        let offsets_start = sink.offset();
        for body in bodies(&offsets)? {
            sink.record(op::SUMMARY_OFFSET, &body)?;
        }
        footer(sink, start, offsets_start)
    }

    fn count(&mut self) {
        let count = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
        let counts = &mut self.statistics;
        counts.schema_count = u16::try_from(self.schemas.len()).unwrap_or(u16::MAX);
        counts.channel_count = count(self.channels.len());
        counts.attachment_count = count(self.attachments.len());
        counts.metadata_count = count(self.metadata.len());
        counts.chunk_count = count(self.chunks.len());
    }
}

fn bodies<T>(records: &[T]) -> io::Result<Vec<Vec<u8>>>
where
    T: for<'a> binrw::BinWrite<Args<'a> = ()>,
{
    records.iter().map(body).collect()
}

/// Writes the footer, with the checksum of the summary and of the footer's own start.
fn footer<W: Write>(sink: &mut RecordSink<W>, start: u64, offsets_start: u64) -> io::Result<()> {
    let places = [start.to_le_bytes(), offsets_start.to_le_bytes()].concat();
    let mut front = Vec::new();
    push_record(&mut front, op::FOOTER, &places);
    // Its length includes the checksum.
    front[1] += 4;
    sink.write(&front)?;
    let crc = sink.take_crc();
    sink.write(&crc.to_le_bytes())?;
    sink.write(MAGIC)
}
