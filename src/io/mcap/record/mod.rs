//! The records of an MCAP file, <https://mcap.dev/spec>.

mod census;
pub mod chunk;
mod fields;
pub mod file;
pub mod input;
pub mod reader;

use std::collections::BTreeMap;

use mcap::records::{AttachmentHeader, ChunkIndex, Record, op};

use fields::RecordFields;

/// Parses a header, schema, channel or metadata record. Invalid UTF-8 is read with replacement characters; for pairs
/// with the same key, the last one counts. `mcap` rejects both, and reserves memory for any claimed text length, up to
/// 4 GiB.
pub(crate) fn parse(op: u8, body: &[u8]) -> Option<Record<'static>> {
    let mended = mended(op, body)?;
    mcap::parse_record(op, &mended).ok().map(Record::into_owned)
}

/// The same record with valid UTF-8 and unique keys.
fn mended(op: u8, body: &[u8]) -> Option<Vec<u8>> {
    let (front, texts, has_pairs) = match op {
        op::HEADER => (0, 2, false),
        op::SCHEMA => (2, 2, false),
        op::CHANNEL => (4, 2, true),
        op::METADATA => (0, 1, true),
        _ => return None,
    };
    let mut fields = RecordFields { rest: body };
    let mut mended = fields.take(front)?.to_vec();
    for _ in 0..texts {
        push(&mut mended, fields.text()?.as_bytes());
    }
    if has_pairs {
        let mut rest = RecordFields {
            rest: fields.bytes()?,
        };
        let mut pairs = BTreeMap::new();
        while !rest.rest.is_empty() {
            pairs.insert(rest.text()?, rest.text()?);
        }
        let mut bytes = Vec::new();
        for text in pairs.iter().flat_map(|(key, value)| [key, value]) {
            push(&mut bytes, text.as_bytes());
        }
        push(&mut mended, &bytes);
    }
    mended.extend_from_slice(fields.rest);
    Some(mended)
}

/// The index of a chunk, if complete.
pub(crate) fn read_chunk_index(body: &[u8]) -> Option<ChunkIndex> {
    let mut fields = RecordFields { rest: body };
    // First and last time, offset and length of the chunk; those of its indexes; compression,
    // sizes.
    fields.take(32)?;
    fields.bytes()?;
    fields.take(8)?;
    fields.bytes()?;
    match mcap::parse_record(op::CHUNK_INDEX, body).ok()? {
        Record::ChunkIndex(index) => Some(index),
        _ => None,
    }
}

fn push(record: &mut Vec<u8>, bytes: &[u8]) {
    // Longer texts than a record can have were rejected before.
    let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
    record.extend_from_slice(&length.to_le_bytes());
    record.extend_from_slice(bytes);
}

/// Size of a message's header.
const MESSAGE_HEAD: usize = 2 + 4 + 8 + 8;

/// One message. `mcap::parse_record` parses its header field by field through a cursor, but this is
/// executed for every message of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RawMessage<'a> {
    pub channel_id: u16,
    /// Log time, in ns.
    pub log_time_ns: u64,
    /// Publish time, in ns.
    pub publish_time_ns: u64,
    pub data: &'a [u8],
}

impl<'a> RawMessage<'a> {
    pub fn read(body: &'a [u8]) -> Option<Self> {
        let (head, data) = body.split_first_chunk::<MESSAGE_HEAD>()?;
        let mut fields = RecordFields { rest: head };
        let (channel_id, _sequence) = (fields.u16()?, fields.u32()?);
        Some(Self {
            channel_id,
            log_time_ns: fields.u64()?,
            publish_time_ns: fields.u64()?,
            data,
        })
    }
}

/// Parses the header of an attachment record and the length of its content.
pub(crate) fn attachment_front(body: &[u8]) -> Option<(AttachmentHeader, u64)> {
    let mut fields = RecordFields { rest: body };
    let header = AttachmentHeader {
        log_time: fields.u64()?,
        create_time: fields.u64()?,
        name: fields.text()?,
        media_type: fields.text()?,
    };
    Some((header, fields.u64()?))
}

/// Calls `each` with opcode and body of every complete record.
pub(crate) fn each_record(records: &[u8], mut each: impl FnMut(u8, &[u8])) {
    let mut rest = records;
    while let Some((op, body)) = split_record(rest) {
        each(op, body);
        rest = &rest[RECORD_HEAD + body.len()..];
    }
}

/// Size of a record's opcode and length.
const RECORD_HEAD: usize = 9;

/// Opcode and body of the first record, if complete.
pub(super) fn split_record(records: &[u8]) -> Option<(u8, &[u8])> {
    let (op, length) = record_head(records)?;
    let body = records[RECORD_HEAD..].get(..usize::try_from(length).ok()?)?;
    Some((op, body))
}

/// Opcode and claimed length of the body.
fn record_head(bytes: &[u8]) -> Option<(u8, u64)> {
    let ([op, length @ ..], _) = bytes.split_first_chunk::<RECORD_HEAD>()?;
    Some((*op, u64::from_le_bytes(*length)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_its_head_and_its_content() {
        let mut body = vec![7, 0, 9, 0, 0, 0];
        body.extend_from_slice(&5_u64.to_le_bytes());
        body.extend_from_slice(&6_u64.to_le_bytes());
        assert!(RawMessage::read(&body[..21]).is_none());
        body.extend_from_slice(b"xyz");
        let message = RawMessage::read(&body).unwrap();
        assert_eq!(message.channel_id, 7);
        assert_eq!((message.log_time_ns, message.publish_time_ns), (5, 6));
        assert_eq!(message.data, b"xyz");
    }

    #[test]
    fn texts_that_are_not_utf8_and_repeated_keys_are_read() {
        let mut body = vec![3, 0, 0, 0];
        push(&mut body, b"/t\xe4");
        push(&mut body, b"json");
        let pairs: Vec<u8> = [&b"k"[..], b"1", b"k", b"\xff"]
            .iter()
            .flat_map(|text| {
                let mut bytes = Vec::new();
                push(&mut bytes, text);
                bytes
            })
            .collect();
        push(&mut body, &pairs);
        assert!(mcap::parse_record(op::CHANNEL, &body).is_err());
        let Some(Record::Channel(channel)) = parse(op::CHANNEL, &body) else {
            panic!("no channel");
        };
        assert_eq!((channel.id, channel.topic.as_str()), (3, "/t\u{fffd}"));
        assert_eq!(channel.metadata["k"], "\u{fffd}");
    }

    #[test]
    fn a_text_that_claims_to_be_huge_is_refused() {
        let mut body = vec![3, 0, 0, 0];
        body.extend_from_slice(&u32::MAX.to_le_bytes());
        body.extend_from_slice(b"/topic");
        assert!(parse(op::CHANNEL, &body).is_none());
        assert!(parse(op::METADATA, b"\x01\0\0\0n\x09\0\0\0\x01\0\0\0k").is_none());
    }
}
