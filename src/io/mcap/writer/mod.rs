//! Copying of an MCAP file with an additional channel.
//!
//! The data of the input are copied verbatim: every schema, channel, message, attachment, metadata record and record of
//! unknown kind, with chunks in their compressed form. They are followed by chunks with the added channel, in the
//! compression of most chunks of the input (or by messages without chunks, as in the input), and a metadata record
//! `torqcomp`; then the summary of everything. So the added messages come after the others in the file, and readers
//! sort them by time using the index. A damaged chunk is dropped; the complete part of a truncated chunk becomes a
//! separate chunk.

mod chunks;
mod copy;
mod index;
mod sink;
mod torque;

use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::{Channel, Metadata, MetadataIndex, SchemaHeader, op};

use super::decode::Encoding;
use crate::failure::{ErrorCode, Failure};
use crate::io::Input;
use chunks::ChunkBuilder;
use index::FileIndex;
use sink::{RecordSink, body};
use torque::TorqueMessage;

/// Name of the metadata record with the provenance.
pub const METADATA: &str = "torqcomp";

/// Default topic of the added channel.
pub const TOPIC: &str = "/torqcomp/compensated_torque";

/// Key in the metadata of the added channel that marks it, with the value `true`.
pub const COMPENSATED_KEY: &str = "compensated";

/// The channel that is added.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Added {
    /// Its topic.
    pub topic: String,
    /// Name of the joint or channel of the torque.
    pub name: String,
    /// Encoding of its messages.
    pub encoding: Encoding,
}

/// A copy under construction.
pub struct Writer<W: Write> {
    sink: RecordSink<W>,
    /// Name of the output, for messages.
    name: String,
    index: FileIndex,
    chunk: ChunkBuilder,
    torque: TorqueMessage,
    channel_id: u16,
    sequence: u32,
    body: Vec<u8>,
}

impl<W: Write> Writer<W> {
    /// Copies a file and declares the added channel. `output_name` is for messages.
    ///
    /// # Errors
    /// If the input cannot be read or the output cannot be written, or the topic exists already.
    pub fn copying(
        input: &Input,
        output: W,
        output_name: &str,
        added: &Added,
    ) -> Result<Self, Failure> {
        let mut sink = RecordSink::new(output);
        let copied = copy::copy(input, &mut sink, output_name)?;
        let mut index = copied.index;
        if index.topics.contains(&added.topic) {
            return Err(ErrorCode::OutputExists
                .failed(format_args!(
                    "the topic \"{}\" already exists; choose another one for the result",
                    added.topic
                ))
                .at(input.name()));
        }
        let torque = TorqueMessage::new(added.encoding, &added.name);
        let mut chunk = ChunkBuilder::new(copied.compression);
        let channel_id = declare(&mut index, &mut chunk, &torque, &added.topic)
            .map_err(|error| Failure::writing(output_name, &error))?
            .ok_or_else(|| {
                ErrorCode::CannotWrite.failed("no channel number is left in the file")
            })?;
        Ok(Self {
            sink,
            name: output_name.to_owned(),
            index,
            chunk,
            torque,
            channel_id,
            sequence: 0,
            body: Vec::new(),
        })
    }

    /// Path of the torque in the added messages, such as `effort[0]`.
    pub fn field(&self) -> &'static str {
        self.torque.field()
    }

    /// Adds a torque in N m, with the message's own stamp and its log time, both in ns.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn add(&mut self, time_ns: i64, log_ns: i64, torque_n_m: f64) -> Result<(), Failure> {
        let log_ns = u64::try_from(log_ns).unwrap_or(0);
        self.body.clear();
        self.body.extend_from_slice(&self.channel_id.to_le_bytes());
        self.body.extend_from_slice(&self.sequence.to_le_bytes());
        self.body.extend_from_slice(&log_ns.to_le_bytes());
        self.body.extend_from_slice(&log_ns.to_le_bytes());
        self.torque.write(time_ns, torque_n_m, &mut self.body);
        self.sequence = self.sequence.wrapping_add(1);
        self.chunk.message(self.channel_id, log_ns, &self.body);
        self.index.message(self.channel_id, log_ns);
        if self.chunk.is_full() {
            let written = self.chunk.write(&mut self.sink, &mut self.index);
            written.map_err(|e| Failure::writing(&self.name, &e))?;
        }
        Ok(())
    }

    /// Writes the provenance and the summary, and returns the output.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn finish(mut self, provenance: &BTreeMap<String, String>) -> Result<W, Failure> {
        let name = std::mem::take(&mut self.name);
        self.end(provenance)
            .map_err(|error| Failure::writing(&name, &error))
    }

    fn end(mut self, provenance: &BTreeMap<String, String>) -> io::Result<W> {
        self.chunk.write(&mut self.sink, &mut self.index)?;
        let metadata = Metadata {
            name: METADATA.to_owned(),
            metadata: provenance.clone(),
        };
        let offset = self.sink.offset();
        self.sink.record(op::METADATA, &body(&metadata)?)?;
        self.index.metadata.push(MetadataIndex {
            offset,
            length: self.sink.offset() - offset,
            name: metadata.name,
        });
        self.index.write(&mut self.sink)?;
        self.sink.finish()
    }
}

/// Declares schema and channel in the first chunk; returns the channel's number, or `None` if all are
/// taken.
fn declare(
    index: &mut FileIndex,
    chunk: &mut ChunkBuilder,
    torque: &TorqueMessage,
    topic: &str,
) -> io::Result<Option<u16>> {
    let (name, encoding, text) = torque.schema();
    let schema = |id: u16| -> io::Result<Vec<u8>> {
        let (name, encoding) = (name.to_owned(), encoding.to_owned());
        let mut record = body(&SchemaHeader { id, name, encoding })?;
        record.extend_from_slice(&(text.len() as u32).to_le_bytes());
        record.extend_from_slice(&text);
        Ok(record)
    };
    // The same schema keeps its number.
    let is_same = |(id, body): &(&u16, &Vec<u8>)| schema(**id).is_ok_and(|same| same == **body);
    let known = index.schemas.iter().find(is_same).map(|(id, _)| *id);
    let unused = |id: &u16| !index.schemas.contains_key(id);
    let Some(schema_id) = known.or_else(|| (1..=u16::MAX).find(unused)) else {
        return Ok(None);
    };
    // Declared in the chunk in any case, which is then self-contained.
    let schema = schema(schema_id)?;
    chunk.record(op::SCHEMA, &schema);
    index.schemas.insert(schema_id, schema);
    let counts = &index.statistics.channel_message_counts;
    let unused = |id: &u16| !index.channels.contains_key(id) && !counts.contains_key(id);
    let Some(id) = (1..=u16::MAX).find(unused) else {
        return Ok(None);
    };
    // For this field only: a joint state also has positions and velocities.
    let unit_key = format!("unit.{}", torque.field().trim_end_matches("[0]"));
    let channel = body(&Channel {
        id,
        schema_id,
        topic: topic.to_owned(),
        message_encoding: torque.message_encoding().to_owned(),
        metadata: [(unit_key.as_str(), "N m"), (COMPENSATED_KEY, "true")]
            .map(|(key, value)| (key.to_owned(), value.to_owned()))
            .into(),
    })?;
    chunk.record(op::CHANNEL, &channel);
    index.channels.insert(id, channel);
    Ok(Some(id))
}

#[cfg(test)]
mod tests;
