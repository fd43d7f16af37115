//! Common interface to the message encodings.

use std::sync::Arc;

use prost_reflect::MessageDescriptor;
use thiserror::Error;

use super::cdr;
use super::json;
use super::path::{self, PathPart};
use super::protobuf;
use super::route::{Hop, Lookup, Route};
use super::schema::Schema;
use super::time::Stamp;
use super::tree::TreeTargets;
use crate::failure::did_you_mean;

/// What to extract from every message.
#[derive(Debug, Clone, PartialEq)]
pub struct Targets {
    /// The value or values.
    pub value: Route,
    /// The time stamp within the message.
    pub stamp: Option<Stamp>,
    /// Path to the spacing of samples.
    pub spacing: Option<Vec<Hop>>,
}

/// Values extracted from a message.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reading {
    /// Values in order; one, unless all items of a list are wanted.
    pub values: Vec<f64>,
    /// Seconds of the stamp.
    pub seconds: Option<i64>,
    /// Nanoseconds of the stamp.
    pub nanoseconds: Option<i64>,
    /// Spacing of samples.
    pub spacing: Option<f64>,
    /// Index of an item requested by name.
    pub place: Option<usize>,
}

impl Reading {
    /// Clears the previous message.
    pub fn clear(&mut self) {
        self.values.clear();
        self.seconds = None;
        self.nanoseconds = None;
        self.spacing = None;
        self.place = None;
    }

    /// The stamp in ns.
    pub fn stamp_ns(&self) -> Option<i64> {
        self.seconds?
            .checked_mul(1_000_000_000)?
            .checked_add(self.nanoseconds?)
    }
}

/// Reason why a message gives no value.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Damage {
    /// It ends before the field.
    #[error("the message ends before the field")]
    Short,
    /// The list is shorter.
    #[error("there is no item [{index}], the list has {count}")]
    NoItem {
        /// Requested item.
        index: i64,
        /// Number of items.
        count: u64,
    },
    /// No item has that name.
    #[error("no item is called \"{name}\"{}", known(.name, .there))]
    NoName {
        /// Requested name.
        name: String,
        /// Existing names, up to [`NAMES`].
        there: Vec<String>,
    },
    /// Unknown encapsulation of the message.
    #[error(
        "its encapsulation 0x{0:02x} is not supported; expected plain CDR (0x00, 0x01) or plain XCDR2 (0x06, 0x07, \
         0x10, 0x11)"
    )]
    Encapsulation(u8),
    /// The field is not set.
    #[error("the field is not set")]
    Absent,
    /// The bytes are not a message in this encoding.
    #[error("the message cannot be read: {0}")]
    Malformed(String),
}

/// The names after the text that none of them is the requested one.
fn known(name: &str, there: &[String]) -> String {
    let meant = did_you_mean(name, there.iter().map(String::as_str));
    let shown = there[..there.len().min(SHOWN)].join(", ");
    match there.len() {
        0 => format!("{meant}; none has a name"),
        1..=SHOWN => format!("{meant}; there are: {shown}"),
        _ => format!("{meant}; there are: {shown} and more"),
    }
}

/// Maximum number of names kept from a message, and maximum in a sentence.
pub const NAMES: usize = 256;
const SHOWN: usize = 32;
/// Maximum length of a name in bytes; a longer one is ignored.
const NAME_BYTES: usize = 200;

/// A name searched for among those of the items of a list.
#[derive(Debug, Default)]
pub struct NameSearch<'a> {
    wanted: &'a [u8],
    /// Number of items seen so far.
    pub seen: usize,
    /// Index of the first item with the name.
    pub found: Option<usize>,
    /// Names seen, if they are to be listed.
    there: Option<Vec<String>>,
}

impl<'a> NameSearch<'a> {
    /// Searches a message with `run`; if the name is missing, a second pass lists the existing ones.
    ///
    /// # Errors
    /// If the message cannot be parsed, or does not contain the name.
    pub fn search(
        wanted: &'a [u8],
        mut run: impl FnMut(Self) -> Result<Self, Damage>,
    ) -> Result<Self, Damage> {
        let names = |there| Self {
            wanted,
            there,
            ..Self::default()
        };
        let searched = run(names(None))?;
        if searched.found.is_some() {
            return Ok(searched);
        }
        let listed = run(names(Some(Vec::new())))?;
        Err(Damage::NoName {
            name: String::from_utf8_lossy(wanted).into_owned(),
            there: listed.there.unwrap_or_default(),
        })
    }

    /// Compares the name of the next item.
    pub fn compare(&mut self, text: &[u8]) {
        if self.found.is_none() && text == self.wanted {
            self.found = Some(self.seen);
        }
        self.seen += 1;
        let there = self.there.as_mut().filter(|there| there.len() < NAMES);
        if let Some(there) = there.filter(|_| text.len() <= NAME_BYTES) {
            there.push(String::from_utf8_lossy(text).into_owned());
        }
    }
}

/// Supported encodings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// CDR, of ROS 2.
    Cdr,
    /// ROS 1.
    Ros1,
    /// Protobuf.
    Protobuf,
    /// JSON.
    Json,
}

impl Encoding {
    /// Parses the name used by channels.
    pub fn of(name: &str) -> Option<Self> {
        match name {
            "cdr" => Some(Self::Cdr),
            "ros1" => Some(Self::Ros1),
            "protobuf" => Some(Self::Protobuf),
            "json" => Some(Self::Json),
            _ => None,
        }
    }
}

/// Extracts wanted numbers from messages.
pub enum Decoder {
    /// CDR and ROS 1.
    Cdr(Box<cdr::CdrDecoder>),
    /// Protobuf.
    Protobuf(Option<MessageDescriptor>, TreeTargets),
    /// JSON.
    Json(TreeTargets),
}

impl Decoder {
    /// Prepares for messages of one type.
    pub fn new(encoding: Encoding, schema: &Arc<Schema>, targets: Targets) -> Self {
        match encoding {
            Encoding::Cdr => Self::cdr(schema, targets, false),
            Encoding::Ros1 => Self::cdr(schema, targets, true),
            Encoding::Protobuf => {
                let descriptor = schema.descriptor.clone();
                Self::Protobuf(descriptor, TreeTargets::new(schema, &targets))
            }
            Encoding::Json => Self::Json(TreeTargets::new(schema, &targets)),
        }
    }

    fn cdr(schema: &Arc<Schema>, targets: Targets, is_ros1: bool) -> Self {
        Self::Cdr(Box::new(cdr::CdrDecoder::new(schema, targets, is_ros1)))
    }

    /// Reads a message; `reading` is cleared first.
    ///
    /// # Errors
    /// [`Damage`] if the message does not contain the value.
    pub fn read(&mut self, data: &[u8], reading: &mut Reading) -> Result<(), Damage> {
        reading.clear();
        match self {
            Self::Cdr(decoder) => decoder.read(data, reading),
            Self::Protobuf(Some(descriptor), targets) => {
                protobuf::read(descriptor, targets, data, reading)
            }
            Self::Protobuf(None, _) => Err(Damage::Malformed("it has no definition".to_owned())),
            Self::Json(targets) => json::read(targets, data, reading),
        }
    }
}

/// A name that no item has, to obtain a list of all names.
const NOBODY: &str = "\0";

/// What the messages of a channel are.
pub struct MessageType {
    /// Their encoding.
    pub encoding: Encoding,
    /// Their definition.
    pub schema: Arc<Schema>,
}

impl MessageType {
    /// Names of the items of the list on a path, in a message; `None` if they have none.
    pub fn item_names(&self, parts: &[PathPart], message: &[u8]) -> Option<Vec<String>> {
        let by_name = path::by_name(parts.to_vec(), NOBODY)?;
        let route = Route::find(&self.schema, &by_name).ok()?;
        self.searched(&route, message)
    }

    /// Texts at the end of a path in a message that contains a number; `None` if it cannot be read.
    pub fn texts(&self, number: &Route, hops: &[Hop], message: &[u8]) -> Option<Vec<String>> {
        let route = Route {
            lookup: Some(Lookup {
                hops: hops.to_vec(),
                name: NOBODY.to_owned(),
            }),
            ..number.clone()
        };
        self.searched(&route, message)
    }

    /// All texts searched without finding a name.
    fn searched(&self, route: &Route, message: &[u8]) -> Option<Vec<String>> {
        match self.values(route, message) {
            Err(Damage::NoName { there, .. }) => Some(there),
            _ => None,
        }
    }

    /// Values of a number in a message.
    ///
    /// # Errors
    /// [`Damage`] if the message does not contain it.
    pub fn values(&self, route: &Route, message: &[u8]) -> Result<Vec<f64>, Damage> {
        let targets = Targets {
            value: route.clone(),
            stamp: None,
            spacing: None,
        };
        let mut reading = Reading::default();
        Decoder::new(self.encoding, &self.schema, targets).read(message, &mut reading)?;
        Ok(reading.values)
    }
}
