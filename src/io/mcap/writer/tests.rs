use std::collections::BTreeSet;

use mcap::{Compression, MessageStream, Summary, WriteOptions};

use super::super::TimeOptions;
use super::super::testing::{File, drain, float64, inventory, open, options};
use super::*;

fn original(options: WriteOptions) -> Vec<u8> {
    let mut file = File::new(options);
    file.channel(
        3,
        "/x",
        "cdr+ros2msg",
        ("std_msgs/msg/Float64", b"float64 data"),
    );
    for place in 0..2000 {
        file.message(3, 1000 + place, &float64(place as f64));
    }
    let metadata = mcap::records::Metadata {
        name: "about".to_owned(),
        metadata: BTreeMap::from([("stand".to_owned(), "A".to_owned())]),
    };
    file.writer().write_metadata(&metadata).unwrap();
    file.writer()
        .attach(&mcap::Attachment {
            log_time: 1,
            create_time: 2,
            name: "photo".to_owned(),
            media_type: "image/png".to_owned(),
            data: vec![9; 500_000].into(),
        })
        .unwrap();
    let private = file.writer();
    let set = Default::default();
    private.write_private_record(0x80, b"mine", set).unwrap();
    file.finish()
}

fn added(encoding: Encoding) -> Added {
    Added {
        topic: "/torque".to_owned(),
        name: "shaft".to_owned(),
        encoding,
    }
}

fn copy(bytes: &[u8], encoding: Encoding) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.mcap");
    std::fs::write(&path, bytes).unwrap();
    let place = Input::File(path);
    let mut writer = Writer::copying(&place, Vec::new(), "out", &added(encoding)).unwrap();
    for place in 0..20_000_i64 {
        writer
            .add(1000 + place, 1000 + place, torque(place))
            .unwrap();
    }
    let provenance = BTreeMap::from([("input".to_owned(), "in.mcap".to_owned())]);
    writer.finish(&provenance).unwrap()
}

fn torque(place: i64) -> f64 {
    place as f64 / 7.0 - 100.0
}

fn read(bytes: &[u8], field: &str) -> (Vec<i64>, Vec<f64>) {
    drain(&mut open(bytes, ("/torque", field), &TimeOptions::default()).unwrap())
}

#[test]
fn the_data_are_copied_byte_for_byte_and_the_torque_is_added() {
    let all = [
        options(Some(Compression::Zstd)),
        options(Some(Compression::Lz4)),
        options(None),
        options(None).use_chunks(false),
    ];
    for options in all {
        let before = original(options);
        let after = copy(&before, Encoding::Cdr);
        // Everything up to the end of the data is unchanged.
        let same = before
            .iter()
            .zip(&after)
            .take_while(|(a, b)| a == b)
            .count();
        let end = Summary::read(&before).unwrap().unwrap();
        let first_index = end
            .metadata_indexes
            .iter()
            .map(|i| i.offset + i.length)
            .max();
        assert!(same as u64 > first_index.unwrap());
        let (times, values) = read(&after, "effort[name=shaft]");
        assert_eq!(times, (1000..21_000).collect::<Vec<_>>());
        let is_right = |(place, value): (usize, &f64)| *value == torque(place as i64);
        assert!(values.iter().enumerate().all(is_right));
    }
}

#[test]
fn the_official_reader_finds_everything_by_the_summary() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let before = original(options(compression));
        let after = copy(&before, Encoding::Cdr);
        let summary = Summary::read(&after).unwrap().unwrap();
        let statistics = summary.stats.as_ref().unwrap();
        assert_eq!(statistics.message_count, 22_000);
        assert_eq!(statistics.metadata_count, 2);
        assert_eq!(statistics.attachment_count, 1);
        assert_eq!(
            (statistics.message_start_time, statistics.message_end_time),
            (1000, 20_999)
        );
        let topics: BTreeSet<_> = summary
            .channels
            .values()
            .map(|c| c.topic.as_str())
            .collect();
        assert_eq!(topics, BTreeSet::from(["/torque", "/x"]));
        let mut counted = 0;
        for chunk in &summary.chunk_indexes {
            counted += summary.stream_chunk(&after, chunk).unwrap().count();
            for (channel, places) in summary.read_message_indexes(&after, chunk).unwrap() {
                assert!(summary.channels.values().any(|c| **c == *channel));
                assert!(!places.is_empty());
            }
        }
        assert_eq!(counted, 22_000);
        assert_eq!(summary.attachment_indexes.len(), 1);
        let attachment = mcap::read::attachment(&after, &summary.attachment_indexes[0]).unwrap();
        assert_eq!(attachment.data.len(), 500_000);
        let index = summary
            .metadata_indexes
            .iter()
            .find(|i| i.name == METADATA)
            .unwrap();
        let metadata = mcap::read::metadata(&after, index).unwrap();
        assert_eq!(metadata.metadata["input"], "in.mcap");
        let messages = MessageStream::new(&after).unwrap();
        assert_eq!(messages.filter(Result::is_ok).count(), 22_000);
    }
}

#[test]
fn checksums_of_data_and_summary_are_right() {
    use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
    let after = copy(&original(options(Some(Compression::Zstd))), Encoding::Cdr);
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_check_finishes_after_end_magic(true),
    );
    let mut rest = &after[..];
    let mut data_end = 0;
    while let Some(event) = reader.next_event() {
        match event.unwrap() {
            LinearReadEvent::ReadRequest(need) => {
                let length = need.min(rest.len());
                reader.insert(length).copy_from_slice(&rest[..length]);
                reader.notify_read(length);
                rest = &rest[length..];
            }
            LinearReadEvent::Record { opcode, data } => {
                data_end += u32::from(opcode == op::DATA_END && data != [0; 4]);
            }
        }
    }
    assert_eq!(data_end, 1);
}

#[test]
fn a_file_without_chunks_stays_without() {
    let after = copy(&original(options(None).use_chunks(false)), Encoding::Cdr);
    let summary = Summary::read(&after).unwrap().unwrap();
    assert!(summary.chunk_indexes.is_empty());
    assert_eq!(summary.stats.unwrap().message_count, 22_000);
    assert_eq!(MessageStream::new(&after).unwrap().count(), 22_000);
}

#[test]
fn every_encoding_can_be_read_back() {
    let before = original(options(None));
    for (encoding, field) in [
        (Encoding::Cdr, "effort[0]"),
        (Encoding::Ros1, "effort[0]"),
        (Encoding::Protobuf, "compensated_torque_n_m"),
        (Encoding::Json, "compensated_torque_n_m"),
    ] {
        let after = copy(&before, encoding);
        let (times, values) = read(&after, field);
        assert_eq!(times.len(), 20_000, "{encoding:?}");
        let is_right = |(place, value): (usize, &f64)| *value == torque(place as i64);
        assert!(values.iter().enumerate().all(is_right), "{encoding:?}");
    }
}

#[test]
fn damage_is_left_out_and_said_and_the_copy_is_whole() {
    let before = original(options(Some(Compression::Zstd)));
    let cut = &before[..before.len() / 30];
    let after = copy(cut, Encoding::Cdr);
    let copied = inventory(&after);
    assert!(copied.is_closed && !copied.is_lossy);
    let there = inventory(cut);
    assert_eq!(there.warnings[0].code, "mcap-truncated");
    assert_eq!(copied.messages, there.messages + 20_000);

    let mut damaged = before.clone();
    let summary = Summary::read(&before).unwrap().unwrap();
    let chunk = &summary.chunk_indexes[3];
    damaged[chunk.chunk_start_offset as usize + 150] ^= 0x55;
    let after = copy(&damaged, Encoding::Cdr);
    let copied = inventory(&after);
    let there = inventory(&damaged);
    assert_eq!(there.warnings[0].code, "mcap-damaged-chunk");
    assert!(!copied.is_lossy && copied.messages < 22_000);
    assert_eq!(copied.messages, there.messages + 20_000);
}

#[test]
fn a_topic_that_is_taken_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.mcap");
    std::fs::write(&path, original(options(None))).unwrap();
    let added = Added {
        topic: "/x".to_owned(),
        ..added(Encoding::Cdr)
    };
    let said = Writer::copying(&Input::File(path), Vec::new(), "out", &added);
    assert!(said.err().unwrap().to_string().contains("choose another"));
}
