//! Selection among the times of a message.

use super::route::{self, Hop};
use super::schema::leaves::{is_nanoseconds, is_seconds, is_stamp};
use super::schema::{FieldKind, Schema};

/// Time assigned to samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeChoice {
    /// Log time.
    Log,
    /// Publish time.
    Publish,
    /// The stamp within the message.
    Header,
}

impl TimeChoice {
    /// Parses `log`, `publish` or `header`.
    pub fn parse(text: &str) -> Option<Self> {
        match text {
            "log" => Some(Self::Log),
            "publish" => Some(Self::Publish),
            "header" => Some(Self::Header),
            _ => None,
        }
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Log => "log",
            Self::Publish => "publish",
            Self::Header => "header",
        }
    }
}

/// The choice, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeUsed {
    /// The time.
    pub choice: TimeChoice,
    /// Field of the stamp, for `Header`.
    pub field: Option<String>,
    /// The reason, for messages.
    pub why: String,
}

/// A time stamp within messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stamp {
    /// Path of the field.
    pub text: String,
    /// Path to its seconds.
    pub seconds: Vec<Hop>,
    /// Path to its nanoseconds.
    pub nanoseconds: Vec<Hop>,
}

impl Stamp {
    /// Finds it: `header.stamp`, then `stamp` or `timestamp` in the message itself or in its
    /// header, then the only field of type `google.protobuf.Timestamp`.
    pub fn find(schema: &Schema) -> Option<Self> {
        let named = [
            &["header", "stamp"][..],
            &["stamp"],
            &["timestamp"],
            &["header", "timestamp"],
        ];
        let found = named.iter().find_map(|names| Self::at(schema, names));
        found.or_else(|| {
            let root = schema.root();
            let mut stamps = root.fields.iter().filter(|field| match field.kind {
                FieldKind::Struct(inner) => {
                    schema.structs[inner].name == "google.protobuf.Timestamp"
                }
                _ => false,
            });
            match (stamps.next(), stamps.next()) {
                (Some(field), None) => Self::at(schema, &[&field.name]),
                _ => None,
            }
        })
    }

    fn at(schema: &Schema, names: &[&str]) -> Option<Self> {
        let (hops, FieldKind::Struct(index)) = route::way(schema, names)? else {
            return None;
        };
        let fields = &schema.structs[*index].fields;
        // JSON has no order, so the fields are identified by name.
        let place = |is: fn(&str) -> bool| fields.iter().position(|field| is(&field.name));
        let (seconds, nanoseconds) = (place(is_seconds)?, place(is_nanoseconds)?);
        let is_numbers = [seconds, nanoseconds]
            .iter()
            .all(|place| matches!(fields[*place].kind, FieldKind::Number(_)));
        let way = |place| {
            let mut way = hops.clone();
            way.push(Hop::Field(place));
            way
        };
        (is_numbers && (fields.len() == 2 || is_stamp(schema, *index))).then(|| Self {
            text: names.join("."),
            seconds: way(seconds),
            nanoseconds: way(nanoseconds),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::schema::ros2msg::{Generation, read};
    use super::*;

    fn found(text: &str) -> Option<String> {
        let text = text.replace("---", &"=".repeat(80));
        let schema = read("p/M", &text, Generation::Ros2).unwrap();
        Stamp::find(&schema).map(|stamp| stamp.text)
    }

    #[test]
    fn the_header_comes_before_a_bare_stamp() {
        let header = "---\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id";
        let both = format!("builtin_interfaces/Time stamp\nstd_msgs/Header header\n{header}");
        assert_eq!(found(&both).as_deref(), Some("header.stamp"));
        let bare = "float64 x\nbuiltin_interfaces/Time stamp";
        assert_eq!(found(bare).as_deref(), Some("stamp"));
        assert_eq!(found("float64 stamp"), None);
        assert_eq!(found("float64 x"), None);
    }
}
