use mcap::Compression;

use super::super::super::testing::{File, float64, frames, options};
use super::*;

fn ops(bytes: &[u8]) -> (Vec<u8>, Frames) {
    let mut frames = frames(bytes);
    let mut ops = Vec::new();
    while let Some(frame) = frames.advance().unwrap() {
        ops.push(frame.op);
    }
    (ops, frames)
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
        let (ops, frames) = ops(&file(compression));
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
        assert!(frames.is_closed() && frames.losses().is_empty());
        let name = compression.map_or("", |c| match c {
            Compression::Zstd => "zstd",
            Compression::Lz4 => "lz4",
        });
        assert_eq!(frames.compressions()[name].chunks, 2);
    }
}

#[test]
fn an_attachment_is_told_by_its_front() {
    let bytes = file(None);
    let mut frames = frames(&bytes);
    let mut seen = None;
    while let Some(frame) = frames.advance().unwrap() {
        if frame.op == op::ATTACHMENT {
            assert!(frame.is_front && !frame.is_in_chunk);
            let (head, _) = super::super::AttachmentHead::read(frames.body(&frame)).unwrap();
            seen = Some((head.name, head.size));
        }
    }
    assert_eq!(seen, Some(("notes".to_owned(), 300_000)));
}

#[test]
fn hostile_lengths_end_the_reading() {
    let mut bytes = MAGIC.to_vec();
    bytes.push(op::MESSAGE);
    bytes.extend_from_slice(&u64::MAX.to_le_bytes());
    let (_, frames) = ops(&bytes);
    assert!(matches!(frames.losses()[0], Loss::TooLong { at: 8, .. }));
    bytes.truncate(9);
    bytes.extend_from_slice(&(1_u64 << 29).to_le_bytes());
    let (_, frames) = ops(&bytes);
    assert!(matches!(frames.losses()[0], Loss::Truncated { at: 8, .. }));
    bytes[8] = op::ATTACHMENT;
    bytes[9..].copy_from_slice(&u64::MAX.to_le_bytes());
    let (_, frames) = ops(&bytes);
    assert!(matches!(frames.losses()[0], Loss::Truncated { at: 8, .. }));
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
    let (seen, frames) = ops(&bytes);
    assert!(seen.is_empty());
    let said: Vec<_> = frames.losses().iter().map(Loss::code).collect();
    assert_eq!(said, ["mcap-damaged-chunk", "mcap-truncated"]);
}
