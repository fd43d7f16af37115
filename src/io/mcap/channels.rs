//! Channels of a file and the decoding of their messages.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use mcap::records::{self, Record, op};

use super::decode::{Encoding, MessageType};
use super::record;
use super::schema::ros2msg::Generation;
use super::schema::{Schema, json, protobuf, ros2idl, ros2msg};

/// Schemas and channels as declared in the file.
#[derive(Debug, Default)]
pub struct Channels {
    schemas: BTreeMap<u16, Arc<DeclaredSchema>>,
    channels: BTreeMap<u16, Arc<TopicChannel>>,
    /// Number of declarations that contradict an earlier one.
    pub conflicts: u64,
}

/// Message definition of a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeclaredSchema {
    id: u16,
    /// Name of the type, such as `sensor_msgs/msg/JointState`.
    pub name: String,
    /// Language of the definition, such as `ros2msg`.
    pub encoding: String,
    data: Vec<u8>,
    parsed: Parsed,
}

/// The parsed definition, shared by all selected numbers: one of a million fields takes 100 MB.
#[derive(Debug, Clone, Default)]
struct Parsed(OnceLock<Result<Arc<Schema>, String>>);

impl PartialEq for Parsed {
    /// It follows from the definition.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Eq for Parsed {}

/// A channel and its schema.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicChannel {
    /// The channel as declared in the file.
    pub record: records::Channel,
    /// Its schema, if any.
    pub schema: Option<Arc<DeclaredSchema>>,
}

impl Channels {
    /// Records a schema or a channel; other records are ignored.
    pub fn note(&mut self, op: u8, body: &[u8]) {
        // Message indexes need not be parsed.
        let is_declaration = matches!(op, op::SCHEMA | op::CHANNEL);
        match is_declaration.then(|| record::parse(op, body)).flatten() {
            Some(Record::Schema { header, data }) if header.id != 0 => {
                self.add_schema(DeclaredSchema {
                    id: header.id,
                    name: header.name,
                    encoding: header.encoding,
                    data: data.into_owned(),
                    parsed: Parsed::default(),
                });
            }
            Some(Record::Channel(channel)) => self.add_channel(channel),
            _ => {}
        }
    }

    fn add_schema(&mut self, schema: DeclaredSchema) {
        match self.schemas.get(&schema.id) {
            Some(known) if **known != schema => self.conflicts += 1,
            Some(_) => {}
            None => drop(self.schemas.insert(schema.id, Arc::new(schema))),
        }
    }

    fn add_channel(&mut self, record: records::Channel) {
        match self.channels.get(&record.id) {
            Some(known) if known.record != record => self.conflicts += 1,
            // Its schema may have been declared in the meantime.
            Some(known) if known.schema.is_some() || record.schema_id == 0 => {}
            _ => {
                let schema = self.schemas.get(&record.schema_id).cloned();
                let channel = TopicChannel { record, schema };
                self.channels.insert(channel.record.id, Arc::new(channel));
            }
        }
    }

    /// A channel by its number.
    pub fn get(&self, id: u16) -> Option<&Arc<TopicChannel>> {
        self.channels.get(&id)
    }

    /// All channels, by number.
    pub fn iter(&self) -> impl Iterator<Item = &Arc<TopicChannel>> {
        self.channels.values()
    }
}

impl DeclaredSchema {
    /// Parses a definition in a known language.
    fn read(&self) -> Result<Arc<Schema>, String> {
        let text = || String::from_utf8_lossy(&self.data);
        let read = match &*self.encoding {
            "ros2msg" => ros2msg::read(&self.name, &text(), Generation::Ros2),
            "ros1msg" => ros2msg::read(&self.name, &text(), Generation::Ros1),
            "protobuf" => protobuf::read(&self.name, &self.data),
            _ => ros2idl::read(&self.name, &text()),
        };
        read.map(Arc::new)
            .map_err(|error| format!("schema \"{}\", {error}", self.name))
    }
}

impl TopicChannel {
    /// What its messages are. For JSON, that is derived from a message.
    ///
    /// # Errors
    /// A sentence with the reason if they cannot be read.
    pub fn message_type(&self, message: &[u8]) -> Result<MessageType, String> {
        let record = &self.record;
        if record.message_encoding == "json" {
            let value = serde_json::from_slice(message)
                .map_err(|error| format!("its first message is not JSON: {error}"))?;
            let schema = json::read(&value).map_err(|error| error.to_string())?;
            return Ok(MessageType {
                encoding: Encoding::Json,
                schema: Arc::new(schema),
            });
        }
        let Some(schema) = &self.schema else {
            return Err(match record.schema_id {
                0 => format!(
                    "it has no schema, and messages in \"{}\" cannot be read without one",
                    record.message_encoding
                ),
                id => format!("its schema {id} is not in the file"),
            });
        };
        let pair = (&*record.message_encoding, &*schema.encoding);
        let encoding = match pair {
            ("cdr", "ros2msg" | "ros2idl" | "omgidl") => Encoding::Cdr,
            ("ros1", "ros1msg") => Encoding::Ros1,
            ("protobuf", "protobuf") => Encoding::Protobuf,
            (message, schema) => {
                return Err(format!(
                    "message encoding \"{message}\" with schema encoding \"{schema}\" is not \
                     supported; expected cdr with ros2msg or ros2idl, ros1 with ros1msg, protobuf \
                     or json"
                ));
            }
        };
        let parsed = schema.parsed.0.get_or_init(|| schema.read());
        let schema = parsed.clone()?;
        Ok(MessageType { encoding, schema })
    }

    /// Whether its messages have the same type as those of another channel.
    pub(super) fn has_type_of(&self, other: &Self) -> bool {
        let what = |channel: &Self| {
            let schema = channel.schema.as_ref();
            schema.map(|s| (s.name.clone(), s.encoding.clone(), s.data.clone()))
        };
        self.record.message_encoding == other.record.message_encoding && what(self) == what(other)
    }

    /// Name of its schema, for messages.
    pub fn schema_name(&self) -> &str {
        self.schema.as_ref().map_or("", |schema| &schema.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(message_encoding: &str, schema_encoding: &str) -> TopicChannel {
        TopicChannel {
            record: records::Channel {
                id: 1,
                schema_id: 1,
                topic: "/t".to_owned(),
                message_encoding: message_encoding.to_owned(),
                metadata: BTreeMap::new(),
            },
            schema: Some(Arc::new(DeclaredSchema {
                id: 1,
                name: "p/msg/M".to_owned(),
                encoding: schema_encoding.to_owned(),
                data: b"float64 x".to_vec(),
                parsed: Parsed::default(),
            })),
        }
    }

    #[test]
    fn encodings_are_told_or_refused_by_name() {
        let refused = |message: &str, schema: &str| -> String {
            let found = channel(message, schema).message_type(b"");
            found.err().unwrap()
        };
        let of = channel("cdr", "ros2msg").message_type(b"").unwrap();
        assert_eq!(of.encoding, Encoding::Cdr);
        let of = channel("json", "jsonschema").message_type(b"{}").unwrap();
        assert_eq!(of.encoding, Encoding::Json);
        let said = refused("flatbuffer", "flatbuffer");
        assert!(said.contains("message encoding \"flatbuffer\""), "{said}");
        let said = refused("cdr", "ros2idl");
        assert!(said.contains("schema \"p/msg/M\", line 1"), "{said}");
    }

    #[test]
    fn a_contradicting_declaration_is_counted_and_left_out() {
        let mut channels = Channels::default();
        let body = |name: &[u8]| [b"\x01\0\x01\0\0\0", name, &[0; 8]].concat();
        for name in [b"a", b"a", b"b"] {
            channels.note(op::SCHEMA, &body(name));
        }
        assert_eq!(channels.conflicts, 1);
        assert_eq!(channels.schemas[&1].name, "a");
    }
}
