use mcap::{Compression, MAGIC};

use super::super::super::testing::{File, float64, options, reader};
use super::*;

fn ops(bytes: &[u8]) -> (Vec<u8>, RecordReader) {
    let mut reader = reader(bytes);
    let mut ops = Vec::new();
    while let Some((op, _)) = reader.next().unwrap() {
        ops.push(op);
    }
    (ops, reader)
}

fn file(compression: Option<Compression>) -> Vec<u8> {
    let mut file = File::new(options(compression));
    file.channel(
        1,
        "/x",
        "cdr+ros2msg",
        ("std_msgs/msg/Float64", b"float64 data"),
    );
    file.message(1, 5, &float64(1.0));
    file.writer()
        .attach(&mcap::Attachment {
            log_time: 1,
            create_time: 2,
            name: "notes".to_owned(),
            media_type: "text/plain".to_owned(),
            data: vec![7; 300_000].into(),
        })
        .unwrap();
    file.message(1, 6, &float64(2.0));
    file.finish()
}

#[test]
fn records_in_and_out_of_chunks_come_in_order() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let (ops, reader) = ops(&file(compression));
        let expected = [
            op::HEADER,
            op::SCHEMA,
            op::CHANNEL,
            op::MESSAGE,
            op::MESSAGE_INDEX,
            op::ATTACHMENT,
            op::MESSAGE,
            op::MESSAGE_INDEX,
            op::DATA_END,
        ];
        assert_eq!(ops[..expected.len()], expected);
        assert!(reader.is_closed() && reader.losses().count == 0);
        let name = compression.map_or("", |c| match c {
            Compression::Zstd => "zstd",
            Compression::Lz4 => "lz4",
        });
        assert_eq!(reader.chunk_counts()[name].chunks, 2);
    }
}

#[test]
fn an_attachment_is_told_by_its_front() {
    let bytes = file(None);
    let mut reader = reader(&bytes);
    let mut seen = None;
    while let Some((op, body)) = reader.next().unwrap() {
        if op == op::ATTACHMENT {
            assert!(body.len() < 100_000);
            let (header, size) = super::super::attachment_front(body).unwrap();
            seen = Some((header.name, size));
        }
    }
    assert_eq!(seen, Some(("notes".to_owned(), 300_000)));
}

#[test]
fn hostile_lengths_end_the_reading() {
    let mut bytes = MAGIC.to_vec();
    bytes.push(op::MESSAGE);
    bytes.extend_from_slice(&u64::MAX.to_le_bytes());
    let (_, reader) = ops(&bytes);
    assert!(matches!(
        reader.losses().first[0],
        Loss::TooLong { at: 8, .. }
    ));
    bytes.truncate(9);
    bytes.extend_from_slice(&(1_u64 << 29).to_le_bytes());
    let (_, reader) = ops(&bytes);
    assert!(matches!(
        reader.losses().first[0],
        Loss::Truncated { at: 8, .. }
    ));
    bytes[8] = op::ATTACHMENT;
    bytes[9..].copy_from_slice(&u64::MAX.to_le_bytes());
    let (_, reader) = ops(&bytes);
    assert!(matches!(
        reader.losses().first[0],
        Loss::Truncated { at: 8, .. }
    ));
}

#[test]
fn a_record_past_the_end_of_its_chunk_is_said() {
    let mut records = vec![op::METADATA];
    records.extend_from_slice(&100_u64.to_le_bytes());
    let mut body = vec![0; 16];
    body.extend_from_slice(&9_u64.to_le_bytes());
    body.extend_from_slice(&[0; 8]);
    body.extend_from_slice(&9_u64.to_le_bytes());
    body.extend_from_slice(&records);
    let mut bytes = MAGIC.to_vec();
    bytes.push(op::CHUNK);
    bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&body);
    let (seen, reader) = ops(&bytes);
    assert!(seen.is_empty());
    let said: Vec<_> = reader.losses().first.iter().map(Loss::code).collect();
    assert_eq!(said, ["mcap-damaged-chunk", "mcap-truncated"]);
}
