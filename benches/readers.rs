//! Reading one number from a ROS 2 recording in memory, named `mcap/compression/field`.
//!
//! `cargo bench --bench readers`. The comparison with the Python reader is `benches/peer/mcap_reader.py`.

use std::hint::black_box;
use std::io::Cursor;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use torqcomp::io::Input;
use torqcomp::io::mcap::{FieldChoice, Inventory, SignalReader, TimeOptions};

const MESSAGES: u64 = 100_000;
const JOINTS: u32 = 6;
const SCHEMA: &str = "\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
";

/// A `sensor_msgs/msg/JointState` with six joints in CDR.
fn joint_state(place: u64, time_ns: u64) -> Vec<u8> {
    let mut data = vec![0, 1, 0, 0];
    let pad = |data: &mut Vec<u8>, align: usize| {
        let length = (data.len() - 4).next_multiple_of(align);
        data.resize(length + 4, 0);
    };
    let text = |data: &mut Vec<u8>, text: &str| {
        pad(data, 4);
        data.extend_from_slice(&(text.len() as u32 + 1).to_le_bytes());
        data.extend_from_slice(text.as_bytes());
        data.push(0);
    };
    data.extend_from_slice(&((time_ns / 1_000_000_000) as u32).to_le_bytes());
    data.extend_from_slice(&((time_ns % 1_000_000_000) as u32).to_le_bytes());
    text(&mut data, "base_link");
    pad(&mut data, 4);
    data.extend_from_slice(&JOINTS.to_le_bytes());
    for joint in 0..JOINTS {
        text(&mut data, &format!("joint_{joint}_motor"));
    }
    for list in 0..3 {
        pad(&mut data, 4);
        data.extend_from_slice(&JOINTS.to_le_bytes());
        pad(&mut data, 8);
        for joint in 0..JOINTS {
            let value = place as f64 * 0.1 + f64::from(joint) + f64::from(list) * 0.01;
            data.extend_from_slice(&value.to_le_bytes());
        }
    }
    data
}

fn recording(compression: Option<Compression>) -> Vec<u8> {
    let options = WriteOptions::new()
        .compression(compression)
        .compression_threads(0)
        .profile("ros2");
    let mut writer = Writer::with_options(Cursor::new(Vec::new()), options).expect("in memory");
    let name = "sensor_msgs/msg/JointState";
    let schema = writer.add_schema(name, "ros2msg", SCHEMA.as_bytes());
    let channel =
        schema.and_then(|id| writer.add_channel(id, "/joint_states", "cdr", &Default::default()));
    let channel_id = channel.expect("the first channel");
    for place in 0..MESSAGES {
        let log_time = 1_700_000_000_000_000_000 + place * 1_000_000;
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time,
            publish_time: log_time,
        };
        let data = joint_state(place, log_time);
        writer
            .write_to_known_channel(&header, &data)
            .expect("in memory");
    }
    writer.finish().expect("in memory");
    writer.into_inner().into_inner()
}

fn stream(bytes: &[u8]) -> Box<Cursor<Vec<u8>>> {
    Box::new(Cursor::new(bytes.to_vec()))
}

fn read(bytes: &[u8], field: &str) -> u64 {
    let choice = FieldChoice {
        topic: Some("/joint_states".to_owned()),
        field: Some(field.to_owned()),
        signal: None,
    };
    let options = TimeOptions::default();
    let reader = SignalReader::with_stream(&Input::Stdin, stream(bytes), &choice, &options);
    let mut reader = reader.expect("it is there");
    let (mut times, mut values) = (Vec::new(), Vec::new());
    while reader.next(&mut times, &mut values).expect("in memory") {
        black_box((&times, &values));
    }
    reader.finish().samples
}

fn readers(criterion: &mut Criterion) {
    let compressions = [
        ("none", None),
        ("zstd", Some(Compression::Zstd)),
        ("lz4", Some(Compression::Lz4)),
    ];
    let mut group = criterion.benchmark_group("mcap");
    group.sample_size(10);
    group.throughput(Throughput::Elements(MESSAGES));
    for (name, compression) in compressions {
        let bytes = recording(compression);
        for field in ["effort[0]", "effort[name=joint_5_motor]"] {
            group.bench_function(format!("{name}/{field}"), |bencher| {
                bencher.iter(|| assert_eq!(read(&bytes, field), MESSAGES));
            });
        }
        group.bench_function(format!("{name}/inventory"), |bencher| {
            bencher.iter(|| {
                let inventory = Inventory::read("bench".to_owned(), stream(&bytes));
                inventory.expect("in memory").messages
            });
        });
    }
    group.finish();
}

criterion_group!(benches, readers);
criterion_main!(benches);
