//! The torque message, in the encoding of the file.
//!
//! For ROS it is `sensor_msgs/JointState`: it has a header with a stamp, its `effort` is defined as
//! the torque of a revolute joint in N m, and position and velocity may be empty, so nothing
//! unknown is claimed. A `WrenchStamped` would have to claim five other components.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

use crate::io::mcap::decode::Encoding;

const ROS2_DEFINITION: &str = include_str!("definitions/joint_state.ros2msg");
const ROS1_DEFINITION: &str = include_str!("definitions/joint_state.ros1msg");
const JSON_DEFINITION: &str = include_str!("definitions/torque.schema.json");

/// Writes torques as messages.
#[derive(Debug)]
pub(super) struct TorqueMessage {
    encoding: Encoding,
    name: String,
    sequence: u32,
}

impl TorqueMessage {
    /// For a joint or channel of that name.
    pub fn new(encoding: Encoding, name: &str) -> Self {
        Self {
            encoding,
            name: name.to_owned(),
            sequence: 0,
        }
    }

    /// Encoding of the messages, as named in the channel.
    pub fn message_encoding(&self) -> &'static str {
        match self.encoding {
            Encoding::Cdr => "cdr",
            Encoding::Ros1 => "ros1",
            Encoding::Protobuf => "protobuf",
            Encoding::Json => "json",
        }
    }

    /// Name, language and text of the schema.
    pub fn schema(&self) -> (&'static str, &'static str, Vec<u8>) {
        match self.encoding {
            Encoding::Cdr => (
                "sensor_msgs/msg/JointState",
                "ros2msg",
                ROS2_DEFINITION.as_bytes().to_vec(),
            ),
            Encoding::Ros1 => (
                "sensor_msgs/JointState",
                "ros1msg",
                ROS1_DEFINITION.as_bytes().to_vec(),
            ),
            Encoding::Protobuf => ("torqcomp.Torque", "protobuf", descriptor()),
            Encoding::Json => (
                "torqcomp.Torque",
                "jsonschema",
                JSON_DEFINITION.as_bytes().to_vec(),
            ),
        }
    }

    /// Path of the torque in the message.
    pub fn field(&self) -> &'static str {
        match self.encoding {
            Encoding::Cdr | Encoding::Ros1 => "effort[0]",
            Encoding::Protobuf | Encoding::Json => "compensated_torque_n_m",
        }
    }

    /// Appends the message with a torque in N m at a time in ns. JSON cannot represent non-finite
    /// values, which are written as null.
    pub fn write(&mut self, time_ns: i64, torque_n_m: f64, out: &mut Vec<u8>) {
        let seconds = time_ns.div_euclid(1_000_000_000);
        let nanoseconds = time_ns.rem_euclid(1_000_000_000) as u32;
        match self.encoding {
            Encoding::Cdr => self.cdr(seconds, nanoseconds, torque_n_m, out),
            Encoding::Ros1 => self.ros1(seconds, nanoseconds, torque_n_m, out),
            Encoding::Protobuf => self.protobuf(seconds, nanoseconds, torque_n_m, out),
            Encoding::Json => {
                let value = serde_json::json!({
                    "timestamp": {"sec": seconds, "nsec": nanoseconds},
                    "name": self.name,
                    "compensated_torque_n_m": torque_n_m,
                });
                out.extend_from_slice(value.to_string().as_bytes());
            }
        }
        self.sequence = self.sequence.wrapping_add(1);
    }

    fn cdr(&self, seconds: i64, nanoseconds: u32, torque_n_m: f64, out: &mut Vec<u8>) {
        out.extend_from_slice(&[0, 1, 0, 0]);
        let start = out.len();
        let pad = |out: &mut Vec<u8>, align: usize| {
            let length = (out.len() - start).next_multiple_of(align);
            out.resize(start + length, 0);
        };
        out.extend_from_slice(&(seconds as i32).to_le_bytes());
        out.extend_from_slice(&nanoseconds.to_le_bytes());
        // frame_id, empty: only the terminator.
        out.extend_from_slice(&[1, 0, 0, 0, 0]);
        pad(out, 4);
        out.extend_from_slice(&1_u32.to_le_bytes());
        out.extend_from_slice(&(self.name.len() as u32 + 1).to_le_bytes());
        out.extend_from_slice(self.name.as_bytes());
        out.push(0);
        pad(out, 4);
        // No positions, no velocities, one effort.
        out.extend_from_slice(&[0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
        pad(out, 8);
        out.extend_from_slice(&torque_n_m.to_le_bytes());
    }

    fn ros1(&self, seconds: i64, nanoseconds: u32, torque_n_m: f64, out: &mut Vec<u8>) {
        for word in [self.sequence, seconds as u32, nanoseconds, 0, 1] {
            out.extend_from_slice(&word.to_le_bytes());
        }
        out.extend_from_slice(&(self.name.len() as u32).to_le_bytes());
        out.extend_from_slice(self.name.as_bytes());
        out.extend_from_slice(&[0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
        out.extend_from_slice(&torque_n_m.to_le_bytes());
    }

    fn protobuf(&self, seconds: i64, nanoseconds: u32, torque_n_m: f64, out: &mut Vec<u8>) {
        let message = ProtobufTorque {
            timestamp: Some(prost_types::Timestamp {
                seconds,
                nanos: nanoseconds as i32,
            }),
            name: self.name.clone(),
            torque_n_m,
        };
        out.extend_from_slice(&message.encode_to_vec());
    }
}

#[derive(Clone, PartialEq, prost::Message)]
struct ProtobufTorque {
    #[prost(message, tag = "1")]
    timestamp: Option<prost_types::Timestamp>,
    #[prost(string, tag = "2")]
    name: String,
    #[prost(double, tag = "3")]
    torque_n_m: f64,
}

/// `message Torque { google.protobuf.Timestamp timestamp = 1; string name = 2; double
/// compensated_torque_n_m = 3; }`, with its dependencies.
fn descriptor() -> Vec<u8> {
    let stamp_file = "google/protobuf/timestamp.proto";
    let stamp_type = Some(".google.protobuf.Timestamp");
    let stamp = vec![
        field("seconds", 1, Type::Int64, None),
        field("nanos", 2, Type::Int32, None),
    ];
    let torque = vec![
        field("timestamp", 1, Type::Message, stamp_type),
        field("name", 2, Type::String, None),
        field("compensated_torque_n_m", 3, Type::Double, None),
    ];
    let mut files = vec![
        file(stamp_file, "google.protobuf", "Timestamp", stamp),
        file("torqcomp/torque.proto", "torqcomp", "Torque", torque),
    ];
    files[1].dependency.push(stamp_file.to_owned());
    FileDescriptorSet { file: files }.encode_to_vec()
}

fn field(name: &str, number: i32, kind: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        r#type: Some(kind as i32),
        label: Some(Label::Optional as i32),
        type_name: type_name.map(str::to_owned),
        ..Default::default()
    }
}

/// A file with one message.
fn file(
    name: &str,
    package: &str,
    message: &str,
    fields: Vec<FieldDescriptorProto>,
) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(name.to_owned()),
        package: Some(package.to_owned()),
        message_type: vec![DescriptorProto {
            name: Some(message.to_owned()),
            field: fields,
            ..Default::default()
        }],
        syntax: Some("proto3".to_owned()),
        ..Default::default()
    }
}
