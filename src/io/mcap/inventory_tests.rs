use mcap::Compression;

use super::super::testing::{File, float64, inventory, options};
use super::*;

fn file(compression: Option<Compression>) -> Vec<u8> {
    let mut file = File::new(options(compression));
    let joints = b"string[] name\nfloat64[] effort";
    file.channel(
        1,
        "/joints",
        "cdr+ros2msg",
        ("sensor_msgs/msg/JointState", joints),
    );
    file.channel(
        2,
        "/x",
        "cdr+ros2msg",
        ("std_msgs/msg/Float64", b"float64 data"),
    );
    file.channel(3, "/flat", "flatbuffer+flatbuffer", ("F", b"?"));
    file.channel(4, "/empty", "json+", ("", b""));
    for time in [10, 30, 20, 40] {
        file.message(2, time * 1_000_000, &float64(time as f64));
    }
    // One name of six bytes, padding, one number.
    let mut joint = b"\0\x01\0\0\x01\0\0\0\x06\0\0\0motor\0\0\0\x01\0\0\0\0\0\0\0".to_vec();
    joint.extend_from_slice(&(-2.5_f64).to_le_bytes());
    file.message(1, 15_000_000, &joint);
    file.message(3, 15_000_000, b"?");
    let pairs = BTreeMap::from([("stand".to_owned(), "A".to_owned())]);
    let metadata = mcap::records::Metadata {
        name: "about".to_owned(),
        metadata: pairs,
    };
    file.writer().write_metadata(&metadata).unwrap();
    file.writer()
        .attach(&mcap::Attachment {
            log_time: 1,
            create_time: 2,
            name: "photo".to_owned(),
            media_type: "image/png".to_owned(),
            data: vec![1; 1000].into(),
        })
        .unwrap();
    file.finish()
}

#[test]
fn everything_in_a_file_is_listed() {
    let inventory = inventory(&file(Some(Compression::Zstd)));
    assert_eq!(
        (inventory.profile.as_str(), inventory.messages),
        ("ros2", 6)
    );
    assert_eq!(inventory.first_log_ns, Some(10_000_000));
    assert_eq!(inventory.last_log_ns, Some(40_000_000));
    let topics: Vec<_> = inventory
        .channels
        .iter()
        .map(|c| c.topic.as_str())
        .collect();
    assert_eq!(topics, ["/empty", "/flat", "/joints", "/x"]);
    let x = &inventory.channels[3];
    assert_eq!((x.messages, x.out_of_order), (4, 1));
    assert!((x.rate_hz.unwrap() - 100.0).abs() < 1e-9);
    assert_eq!(x.leaves[0].example, Some(10.0));
    let joints = &inventory.channels[2];
    assert_eq!(joints.leaves[0].path, "effort[]");
    assert_eq!(joints.leaves[0].unit.as_deref(), Some("N m"));
    assert_eq!(joints.leaves[0].example, Some(-2.5));
    assert_eq!(joints.leaves[0].names, ["motor"]);
    assert_eq!(joints.rate_hz, None);
    let flat = &inventory.channels[1];
    assert!(flat.unreadable.as_ref().unwrap().contains("\"flatbuffer\""));
    assert_eq!(inventory.attachments[0].size, 1000);
    assert_eq!(inventory.metadata[0].pairs["stand"], "A");
    assert_eq!(inventory.chunks[0].compression, "zstd");
    assert!(inventory.is_closed && !inventory.is_lossy);
    let codes: Vec<_> = inventory.warnings.iter().map(|w| w.code).collect();
    assert_eq!(
        codes,
        ["mcap-unreadable", "mcap-unreadable", "mcap-out-of-order"]
    );
}

#[test]
fn two_publishers_on_a_topic_are_said_once_each() {
    let mut file = File::new(options(None));
    let float = ("std_msgs/msg/Float64", &b"float64 data"[..]);
    for id in 1..4 {
        let topic = if id < 3 { "/x" } else { "/y" };
        file.channel(id, topic, "cdr+ros2msg", float);
    }
    for time in 0..9_u64 {
        file.message(1 + (time % 3) as u16, time, &float64(1.0));
    }
    let inventory = inventory(&file.finish());
    let is_readable = inventory.channels.iter().map(|c| c.unreadable.is_none());
    assert_eq!(is_readable.collect::<Vec<_>>(), [false, false, true]);
    let codes: Vec<_> = inventory.warnings.iter().map(|w| w.code).collect();
    assert_eq!(codes, ["mcap-unreadable", "mcap-unreadable"]);
}

#[test]
fn a_cut_file_is_lossy_and_says_where() {
    let bytes = file(None);
    let inventory = inventory(&bytes[..700]);
    assert!(inventory.is_lossy && !inventory.is_closed);
    let said = &inventory.warnings[0].message;
    assert!(said.contains("the file ends within a chunk"), "{said}");
}

#[test]
fn first_items() {
    let first = |path: &str| {
        let leaf = LeafReport {
            path: path.to_owned(),
            kind: "f64",
            unit: None,
            example: None,
            names: Vec::new(),
            is_stamp: false,
        };
        leaf.first_item()
    };
    assert_eq!(first("wrench.force.x"), "wrench.force.x");
    assert_eq!(first("poses[].c[9].x"), "poses[0].c[0].x");
}
