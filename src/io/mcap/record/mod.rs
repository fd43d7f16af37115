//! The records of an MCAP file, <https://mcap.dev/spec>.

pub mod chunk;
pub mod fields;
pub mod frames;
pub mod input;

use std::collections::BTreeMap;

use fields::Fields;

/// What a channel's messages are made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SchemaRecord {
    /// Number within the file, from 1.
    pub id: u16,
    /// Name of the type, as `sensor_msgs/msg/JointState`.
    pub name: String,
    /// Language of the definition, as `ros2msg`.
    pub encoding: String,
    /// The definition.
    pub data: Vec<u8>,
}

impl SchemaRecord {
    /// Reads the body of a schema record.
    #[must_use]
    pub fn read(body: &[u8]) -> Option<Self> {
        let mut fields = Fields::new(body);
        Some(Self {
            id: fields.u16()?,
            name: fields.text()?,
            encoding: fields.text()?,
            data: fields.bytes()?.to_vec(),
        })
    }
}

/// A stream of messages of one type on one topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelRecord {
    /// Number within the file.
    pub id: u16,
    /// Number of its schema, 0 for none.
    pub schema_id: u16,
    /// Topic.
    pub topic: String,
    /// Encoding of the messages, as `cdr`.
    pub message_encoding: String,
    /// Anything else that the recorder noted.
    pub metadata: BTreeMap<String, String>,
}

impl ChannelRecord {
    /// Reads the body of a channel record.
    #[must_use]
    pub fn read(body: &[u8]) -> Option<Self> {
        let mut fields = Fields::new(body);
        Some(Self {
            id: fields.u16()?,
            schema_id: fields.u16()?,
            topic: fields.text()?,
            message_encoding: fields.text()?,
            metadata: fields.map()?,
        })
    }
}

/// Bytes in front of a message's own content.
const MESSAGE_HEAD: usize = 2 + 4 + 8 + 8;

/// One message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Message<'a> {
    /// Number of its channel.
    pub channel_id: u16,
    /// Sequence number given by the publisher.
    pub sequence: u32,
    /// Time at which it was recorded, in ns.
    pub log_time_ns: u64,
    /// Time at which it was published, in ns.
    pub publish_time_ns: u64,
    /// Its content.
    pub data: &'a [u8],
}

impl<'a> Message<'a> {
    /// Reads the body of a message record.
    #[must_use]
    pub fn read(body: &'a [u8]) -> Option<Self> {
        let (head, data) = body.split_at_checked(MESSAGE_HEAD)?;
        let mut fields = Fields::new(head);
        Some(Self {
            channel_id: fields.u16()?,
            sequence: fields.u32()?,
            log_time_ns: fields.u64()?,
            publish_time_ns: fields.u64()?,
            data,
        })
    }
}

/// A file within the file, without its bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttachmentHead {
    /// Time at which it was recorded, in ns.
    pub log_time_ns: u64,
    /// Time at which it was made, in ns; 0 if unknown.
    pub create_time_ns: u64,
    /// Name.
    pub name: String,
    /// Media type, as `text/plain`.
    pub media_type: String,
    /// Length of its content in bytes.
    pub size: u64,
}

impl AttachmentHead {
    /// Reads the front of an attachment record, and where its content begins.
    #[must_use]
    pub fn read(body: &[u8]) -> Option<(Self, usize)> {
        let mut fields = Fields::new(body);
        let head = Self {
            log_time_ns: fields.u64()?,
            create_time_ns: fields.u64()?,
            name: fields.text()?,
            media_type: fields.text()?,
            size: fields.u64()?,
        };
        Some((head, body.len() - fields.rest().len()))
    }
}

/// Named pairs of texts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MetadataRecord {
    /// Name.
    pub name: String,
    /// Keys and values.
    pub pairs: BTreeMap<String, String>,
}

impl MetadataRecord {
    /// Reads the body of a metadata record.
    #[must_use]
    pub fn read(body: &[u8]) -> Option<Self> {
        let mut fields = Fields::new(body);
        Some(Self {
            name: fields.text()?,
            pairs: fields.map()?,
        })
    }
}

/// The first record: who wrote the file, and by which rules.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct HeaderRecord {
    /// Profile, as `ros2`.
    pub profile: String,
    /// Library that wrote the file.
    pub library: String,
}

impl HeaderRecord {
    /// Reads the body of a header record.
    #[must_use]
    pub fn read(body: &[u8]) -> Option<Self> {
        let mut fields = Fields::new(body);
        Some(Self {
            profile: fields.text()?,
            library: fields.text()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_its_head_and_its_content() {
        let mut body = vec![7, 0, 9, 0, 0, 0];
        body.extend_from_slice(&5_u64.to_le_bytes());
        body.extend_from_slice(&6_u64.to_le_bytes());
        assert!(Message::read(&body[..21]).is_none());
        body.extend_from_slice(b"xyz");
        let message = Message::read(&body).unwrap();
        assert_eq!((message.channel_id, message.sequence), (7, 9));
        assert_eq!((message.log_time_ns, message.publish_time_ns), (5, 6));
        assert_eq!(message.data, b"xyz");
    }
}
