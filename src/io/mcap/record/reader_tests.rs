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
fn long_metadata_are_left_out_and_named() {
    let mut file = File::new(options(None));
    let schema = ("std_msgs/msg/Float64", &b"float64 data"[..]);
    file.channel(1, "/x", "cdr+ros2msg", schema);
    let text = "a".repeat((64 << 20) + 1);
    let metadata = mcap::records::Metadata {
        name: "log".to_owned(),
        metadata: [("text".to_owned(), text)].into(),
    };
    file.writer().write_metadata(&metadata).unwrap();
    file.message(1, 5, &float64(1.0));
    let (ops, reader) = ops(&file.finish());
    assert!(ops.contains(&op::MESSAGE) && !ops.contains(&op::METADATA));
    let losses = reader.losses();
    assert_eq!(losses.count, 1, "{:?}", losses.first);
    let said = losses.first[0].to_string();
    assert!(
        said.contains("(opcode 0x0c) has a declared length of 671088")
            && said.contains("--longest-metadata"),
        "{said}"
    );
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
    let said: Vec<_> = reader
        .losses()
        .first
        .iter()
        .map(|loss| loss.code().name())
        .collect();
    assert_eq!(said, ["mcap-damaged-chunk", "mcap-truncated"]);
}

/// Ninety-six messages of 1 MB in one chunk of a few kB: all are read, in the memory of a few.
#[test]
fn a_long_chunk_is_unpacked_piece_by_piece() {
    for compression in [Compression::Zstd, Compression::Lz4] {
        let mut file = File::new(options(Some(compression)).chunk_size(None));
        let schema = ("std_msgs/msg/Float64", &b"float64 data"[..]);
        file.channel(1, "/x", "cdr+ros2msg", schema);
        for i in 0..96 {
            file.message(1, 5 + i, &vec![0; 1 << 20]);
        }
        let bytes = file.finish();
        assert!(bytes.len() < 1 << 20, "{}", bytes.len());
        let mut reader = reader(&bytes);
        let mut messages = 0;
        while let Some((op, body)) = reader.next().unwrap() {
            messages += usize::from(op == op::MESSAGE && body.len() == 22 + (1 << 20));
            assert!(reader.buffer.capacity() < 1 << 23);
        }
        assert_eq!((messages, reader.losses().count), (96, 0));
        // With a changed checksum, the chunk is dropped entirely.
        let mut damaged = bytes.clone();
        let chunk = super::super::super::testing::chunks(&bytes)[0];
        damaged[chunk + RECORD_HEAD + 24] ^= 1;
        let (ops, reader) = ops(&damaged);
        assert!(!ops.contains(&op::MESSAGE));
        assert!(matches!(
            reader.losses().first[0],
            Loss::Chunk {
                why: ChunkError::Crc { .. },
                ..
            }
        ));
        // Of a truncated chunk, the complete part is read.
        let (ops, reader) = ops_of_cut(&bytes, chunk);
        assert!(ops.contains(&op::MESSAGE) && reader.losses().count == 1);
    }
}

/// Records of a file truncated in the middle of its chunk.
fn ops_of_cut(bytes: &[u8], chunk: usize) -> (Vec<u8>, RecordReader) {
    let length = bytes[chunk + 1..]
        .first_chunk()
        .map(|b| u64::from_le_bytes(*b));
    ops(&bytes[..chunk + RECORD_HEAD + length.unwrap() as usize / 2])
}
