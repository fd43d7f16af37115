//! A copy of an MCAP file with one channel more.
//!
//! The data of the input are copied byte for byte: every schema, channel, message, attachment,
//! metadata record and record of unknown kind, chunks as they are compressed. Behind them come
//! chunks with the added channel, in the compression that most chunks of the input have (or its
//! messages by themselves, if those of the input are), and a metadata record `torqcomp`; then the summary of everything. So the added messages are behind
//! the others in the file, and readers put them in order of time by the index. A chunk that is
//! damaged is left out; what is whole of a chunk that is cut off becomes a chunk of its own.

mod chunks;
mod copy;
mod index;
mod sink;
mod torque;

use std::collections::BTreeMap;
use std::io::Write;

use mcap::records::op;

use super::decode::Encoding;
use super::record::frames::Loss;
use crate::failure::Failure;
use crate::io::Input;
use chunks::Chunk;
use index::{Entry, Index};
use sink::{Body, Sink};
use torque::Torque;

/// Name of the metadata record with the provenance.
pub const METADATA: &str = "torqcomp";

/// The channel that is added.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Added {
    /// Its topic.
    pub topic: String,
    /// Name of the joint or channel that the torque is of.
    pub name: String,
    /// Encoding of its messages.
    pub encoding: Encoding,
}

/// A copy under construction.
pub struct Writer<W: Write> {
    sink: Sink<W>,
    place: String,
    index: Index,
    chunk: Chunk,
    torque: Torque,
    channel_id: u16,
    sequence: u32,
    losses: Vec<Loss>,
    body: Vec<u8>,
}

impl<W: Write> Writer<W> {
    /// Copies a file and declares the channel that is added. `output_name` is for messages.
    ///
    /// # Errors
    /// If the input cannot be read or the output not be written, or the topic is taken.
    pub fn copying(
        input: &Input,
        output: W,
        output_name: &str,
        added: &Added,
    ) -> Result<Self, Failure> {
        let mut sink = Sink::new(output);
        let copied = copy::copy(input, &mut sink, output_name)?;
        let mut index = copied.index;
        if index.topics.contains(&added.topic) {
            return Err(Failure::failed(format_args!(
                "{}: there is a topic \"{}\" in it already; name another one for the result",
                input.name(),
                added.topic
            )));
        }
        let torque = Torque::new(added.encoding, &added.name);
        let mut chunk = Chunk::new(copied.compression);
        let channel_id = declare(&mut index, &mut chunk, &torque, &added.topic)
            .ok_or_else(|| Failure::failed("the file has no number left for another channel"))?;
        Ok(Self {
            sink,
            place: output_name.to_owned(),
            index,
            chunk,
            torque,
            channel_id,
            sequence: 0,
            losses: copied.losses,
            body: Vec::new(),
        })
    }

    /// What could not be copied.
    #[must_use]
    pub fn losses(&self) -> &[Loss] {
        &self.losses
    }

    /// Path of the torque in the added messages, as `effort[0]`.
    #[must_use]
    pub fn field(&self) -> &'static str {
        self.torque.field()
    }

    /// Adds a torque in N m: its time for the message's own stamp and its log time, both in ns.
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
            written.map_err(|e| Failure::writing(&self.place, &e))?;
        }
        Ok(())
    }

    /// Writes the provenance and the summary, and gives the output back.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn finish(mut self, provenance: &BTreeMap<String, String>) -> Result<W, Failure> {
        let place = std::mem::take(&mut self.place);
        self.end(provenance)
            .map_err(|error| Failure::writing(&place, &error))
    }

    fn end(mut self, provenance: &BTreeMap<String, String>) -> std::io::Result<W> {
        self.chunk.write(&mut self.sink, &mut self.index)?;
        let mut body = Body::default();
        let pairs = provenance.iter().map(|(k, v)| (k.as_str(), v.as_str()));
        body.bytes(METADATA.as_bytes()).map(pairs);
        let offset = self.sink.offset();
        self.sink.record(op::METADATA, &body.0)?;
        let length = self.sink.offset() - offset;
        self.index
            .metadata
            .push(Entry::metadata(offset, length, METADATA));
        self.index.write(&mut self.sink)?;
        self.sink.finish()
    }
}

/// Declares schema and channel in the first chunk; gives the channel's number.
fn declare(index: &mut Index, chunk: &mut Chunk, torque: &Torque, topic: &str) -> Option<u16> {
    let (name, language, text) = torque.schema();
    let front = |id: u16| {
        let mut body = Body::default();
        body.u16(id)
            .bytes(name.as_bytes())
            .bytes(language.as_bytes())
            .bytes(&text);
        body.0
    };
    // The same schema need not be declared twice.
    let known = index
        .schemas
        .iter()
        .find(|(id, body)| **body == front(**id));
    let schema_id = match known {
        Some((id, _)) => *id,
        None => (1..=u16::MAX).find(|id| !index.schemas.contains_key(id))?,
    };
    let schema = front(schema_id);
    chunk.record(op::SCHEMA, &schema);
    index.schemas.insert(schema_id, schema);
    let free = |id: &u16| !index.channels.contains_key(id) && !index.messages.contains_key(id);
    let channel_id = (1..=u16::MAX).find(free)?;
    let mut body = Body::default();
    body.u16(channel_id)
        .u16(schema_id)
        .bytes(topic.as_bytes())
        .bytes(torque.message_encoding().as_bytes())
        .map([("unit", "N m")]);
    chunk.record(op::CHANNEL, &body.0);
    index.channels.insert(channel_id, body.0);
    Some(channel_id)
}

#[cfg(test)]
mod tests;
