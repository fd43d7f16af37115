//! Corruption of files: no change may lose data silently.

use mcap::records::op;
use mcap::{Compression, WriteOptions};

use super::record::file::FileReader;
use super::record::input::CountedInput;
use super::testing::{File, drain, float64, inventory, open, options, stream};
use super::{Inventory, TimeOptions};

/// Number of messages of the tested topic.
const MESSAGES: u64 = 60;
/// Number of single-bit changes, over all files.
const FLIPS: usize = 5000;

/// Sixty messages of a topic among others, an attachment and metadata.
fn file(options: WriteOptions) -> Vec<u8> {
    let mut file = File::new(options.chunk_size(Some(600)));
    let schema = ("std_msgs/msg/Float64", &b"float64 data"[..]);
    for (id, topic) in [(1, "/torque"), (2, "/other")] {
        file.channel(id, topic, "cdr+ros2msg", schema);
    }
    for i in 0..MESSAGES {
        let time_ns = 1_000_000_000 + 1_000_000 * i;
        file.message(1, time_ns, &float64((i as f64).sin()));
        if i % 4 == 0 {
            file.message(2, time_ns, &float64(i as f64));
        }
    }
    file.finish()
}

/// With and without chunks, compression and checksums.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let without = |options: WriteOptions| {
        options
            .calculate_chunk_crcs(false)
            .calculate_data_section_crc(false)
            .calculate_summary_section_crc(false)
    };
    vec![
        ("zstd", file(options(Some(Compression::Zstd)))),
        ("lz4", file(options(Some(Compression::Lz4)))),
        ("plain chunks", file(options(None))),
        ("no chunks", file(options(None).use_chunks(false))),
        ("no checksums", file(without(options(None)))),
        (
            "no checksums, zstd",
            file(without(options(Some(Compression::Zstd)))),
        ),
    ]
}

/// Times and values, and whether a loss is reported.
type Found = ((Vec<i64>, Vec<f64>), bool);

/// Content read of the topic, or `None` if it is rejected.
fn read(bytes: &[u8]) -> Option<Found> {
    let mut reader = open(bytes, ("/torque", "data"), &TimeOptions::default()).ok()?;
    let read = drain(&mut reader);
    Some((read, reader.finish().is_lossy))
}

/// Fails if a changed file lacks data without a report.
fn attack(bytes: &[u8], whole: &(Vec<i64>, Vec<f64>), what: &str) {
    if let Some((found, is_lossy)) = read(bytes) {
        let same = found == *whole;
        assert!(
            same || is_lossy,
            "{what}: {} of {} samples, and nothing said",
            found.0.len(),
            whole.0.len()
        );
    }
    let Ok(listed) = Inventory::read("test.mcap".to_owned(), stream(bytes)) else {
        return;
    };
    let count = MESSAGES + MESSAGES / 4;
    assert!(
        listed.messages == count || listed.is_lossy,
        "{what}: {} of {count} messages are listed, and nothing is said",
        listed.messages
    );
}

#[test]
fn a_file_that_is_whole_is_lossless() {
    for (name, bytes) in files() {
        let (found, is_lossy) = read(&bytes).unwrap();
        assert!(!is_lossy && found.0.len() == MESSAGES as usize, "{name}");
        let listed = inventory(&bytes);
        assert!(
            !listed.is_lossy && listed.warnings.is_empty(),
            "{name}: {:?}",
            listed.warnings
        );
    }
}

/// Every record is changed to one of each other kind: existing ones, a nonexistent one, and a private one.
#[test]
fn a_changed_opcode_loses_nothing_in_silence() {
    for (name, bytes) in files() {
        let (whole, _) = read(&bytes).unwrap();
        let input = CountedInput::new(stream(&bytes));
        let mut file = FileReader::new("test.mcap".to_owned(), input).unwrap();
        let mut places = Vec::new();
        while let Some(record) = file.next().unwrap() {
            places.push(record.offset as usize);
        }
        for place in places {
            for op in (op::HEADER..=op::DATA_END).chain([0, 0x26, 0x7f, 0x80, 0x86, 0xff]) {
                let mut changed = bytes.clone();
                changed[place] = op;
                attack(
                    &changed,
                    &whole,
                    &format!("{name}, opcode 0x{op:02x} at byte {place}"),
                );
            }
        }
    }
}

/// Bits changed throughout the file, at reproducible places (linear congruential). Without checksums, a changed bit of
/// a value cannot be detected, so only the counts are compared.
#[test]
fn a_changed_bit_loses_nothing_in_silence() {
    let mut random = 1_u64;
    let mut next = |below: usize| {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as usize % below
    };
    let whole = |(name, bytes): (&'static str, Vec<u8>)| {
        let (read, _) = read(&bytes).unwrap();
        (name, bytes, read)
    };
    let files: Vec<_> = files().into_iter().map(whole).collect();
    for _ in 0..FLIPS {
        let (name, bytes, read_whole) = &files[next(files.len())];
        let (place, bit) = (next(bytes.len()), next(8));
        let mut changed = bytes.clone();
        changed[place] ^= 1 << bit;
        let mut whole = read_whole.clone();
        if name.starts_with("no checksums")
            && let Some((found, _)) = read(&changed)
            && found.0.len() == whole.0.len()
        {
            whole = found;
        }
        attack(
            &changed,
            &whole,
            &format!("{name}, bit {bit} of byte {place} of {}", bytes.len()),
        );
    }
}
