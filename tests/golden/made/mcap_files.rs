//! MCAP files of every encoding, written by the crate `mcap`: one signal at 1 kHz, with typical other content.

use std::f64::consts::TAU;

use mcap::Compression;
use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

use crate::mcap_file::{Cdr, McapFile};

/// Time of the first message: 14 November 2023.
const BEGIN_NS: u64 = 1_700_000_000_000_000_000;
const COUNT: usize = 1200;

pub fn files() -> Vec<(&'static str, Vec<u8>)> {
    let whole = ros2(None);
    // In the middle of a chunk, and one byte of a chunk changed.
    let cut = whole[..whole.len() / 2].to_vec();
    let mut damaged = whole.clone();
    let place = whole.len() / 3;
    damaged[place] ^= 0x55;
    vec![
        ("ros2.mcap", ros2(Some(Compression::Zstd))),
        ("cut.mcap", cut),
        ("damaged.mcap", damaged),
        ("json.mcap", json()),
        ("protobuf.mcap", protobuf()),
        ("blocks.mcap", blocks()),
    ]
}

/// Bridge volts.
fn volts(i: usize) -> f64 {
    let t = i as f64 / 1000.0;
    1e-3 * (TAU * 30.0 * t).cos() + 2e-4 * (TAU * 90.0 * t + 1.0).sin()
}

fn time_ns(i: usize) -> u64 {
    BEGIN_NS + i as u64 * 1_000_000
}

const JOINT_STATE: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
    ================================================================================\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\nMSG: builtin_interfaces/Time\n\
    int32 sec\nuint32 nanosec\n";

/// Joint states and a slower temperature.
fn ros2(compression: Option<Compression>) -> Vec<u8> {
    let mut file = McapFile::new(compression, "", "golden");
    let schema = (
        "sensor_msgs/msg/JointState",
        "ros2msg",
        JOINT_STATE.as_bytes(),
    );
    let joints = file.channel("/joint_states", "cdr", Some(schema));
    let schema = (
        "example/msg/Temperature",
        "ros2msg",
        b"float64 celsius".as_slice(),
    );
    let slow = file.channel("/temperature", "cdr", Some(schema));
    for i in 0..COUNT {
        let mut cdr = Cdr::new();
        cdr.stamp(time_ns(i));
        cdr.text("stand");
        cdr.u32(2);
        cdr.text("motor");
        cdr.text("brake");
        cdr.numbers(&[i as f64 * 0.01, 0.0]);
        cdr.numbers(&[10.0, -10.0]);
        cdr.numbers(&[2e3 * volts(i), -1.5]);
        file.message(joints, i, time_ns(i), &cdr.0);
        if i % 100 == 0 {
            let mut cdr = Cdr::new();
            cdr.f64(20.0 + i as f64 * 1e-3);
            file.message(slow, i, time_ns(i), &cdr.0);
        }
    }
    file.finish()
}

/// Objects without a schema.
fn json() -> Vec<u8> {
    let mut file = McapFile::new(None, "", "golden");
    let stand = file.channel("/stand", "json", None);
    for i in 0..COUNT {
        let text = format!(
            "{{\"bridge\":{{\"volts\":{:.9},\"range\":\"10 mV\"}},\"speed\":[{},0]}}",
            volts(i),
            1100 + i % 7
        );
        file.message(stand, i, time_ns(i), text.as_bytes());
    }
    file.finish()
}

fn field(name: &str, number: i32, of: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(of.into()),
        type_name: type_name.map(str::to_owned),
        ..Default::default()
    }
}

#[derive(Clone, PartialEq, prost::Message)]
struct Bridge {
    #[prost(double, tag = "1")]
    volts: f64,
    #[prost(float, tag = "2")]
    celsius: f32,
}

#[derive(Clone, PartialEq, prost::Message)]
struct Stand {
    #[prost(message, optional, tag = "1")]
    stamp: Option<prost_types::Timestamp>,
    #[prost(message, optional, tag = "2")]
    bridge: Option<Bridge>,
    #[prost(sint32, tag = "3")]
    count: i32,
}

fn protobuf() -> Vec<u8> {
    let message = |name: &str, field: Vec<FieldDescriptorProto>| DescriptorProto {
        name: Some(name.to_owned()),
        field,
        ..Default::default()
    };
    let part = |name: &str, package: &str, dependency: &[&str], message_type| FileDescriptorProto {
        name: Some(name.to_owned()),
        package: Some(package.to_owned()),
        dependency: dependency.iter().map(|&d| d.to_owned()).collect(),
        message_type,
        syntax: Some("proto3".to_owned()),
        ..Default::default()
    };
    let time = vec![
        field("seconds", 1, Type::Int64, None),
        field("nanos", 2, Type::Int32, None),
    ];
    let bridge = vec![
        field("volts", 1, Type::Double, None),
        field("celsius", 2, Type::Float, None),
    ];
    let stand = vec![
        field(
            "stamp",
            1,
            Type::Message,
            Some(".google.protobuf.Timestamp"),
        ),
        field("bridge", 2, Type::Message, Some(".example.Bridge")),
        field("count", 3, Type::Sint32, None),
    ];
    let own = vec![message("Bridge", bridge), message("Stand", stand)];
    let known = "google/protobuf/timestamp.proto";
    let set = FileDescriptorSet {
        file: vec![
            part(
                known,
                "google.protobuf",
                &[],
                vec![message("Timestamp", time)],
            ),
            part("stand.proto", "example", &[known], own),
        ],
    };
    let mut file = McapFile::new(Some(Compression::Lz4), "", "golden");
    let schema = ("example.Stand", "protobuf", set.encode_to_vec());
    let stand = file.channel("/stand", "protobuf", Some((schema.0, schema.1, &schema.2)));
    for i in 0..COUNT {
        let message = Stand {
            stamp: Some(prost_types::Timestamp {
                seconds: (time_ns(i) / 1_000_000_000) as i64,
                nanos: (time_ns(i) % 1_000_000_000) as i32,
            }),
            bridge: Some(Bridge {
                volts: volts(i),
                celsius: 20.5,
            }),
            count: i as i32 - 600,
        };
        file.message(stand, i, time_ns(i), &message.encode_to_vec());
    }
    file.finish()
}

/// A hundred samples per message, with their spacing.
fn blocks() -> Vec<u8> {
    let mut file = McapFile::new(Some(Compression::Zstd), "", "golden");
    let text = b"float64 dt\nfloat64[] data".as_slice();
    let bridge = file.channel(
        "/bridge",
        "cdr",
        Some(("example/msg/Block", "ros2msg", text)),
    );
    for block in 0..COUNT / 100 {
        let mut cdr = Cdr::new();
        cdr.0.extend(1e-3_f64.to_le_bytes());
        let samples: Vec<f64> = (0..100).map(|k| volts(block * 100 + k)).collect();
        cdr.numbers(&samples);
        file.message(bridge, block * 100, time_ns(block * 100), &cdr.0);
    }
    file.finish()
}
