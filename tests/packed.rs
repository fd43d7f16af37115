//! Compressed recordings: their content is read as if uncompressed, by every command and from a pipe, and damage is
//! reported.

use std::fs;

use serde_json::Value;

use crate::golden::workplace;
use crate::util::{COMPENSATE, Folder, record, steady};

/// A gzip file of stored blocks (RFC 1951, 3.2.4; RFC 1952), written independently of the reader.
fn stored(content: &[u8]) -> Vec<u8> {
    let mut file = vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255];
    let mut blocks = content.chunks(60_000).peekable();
    while let Some(block) = blocks.next() {
        let length = block.len() as u16;
        file.push(u8::from(blocks.peek().is_none()));
        file.extend(length.to_le_bytes());
        file.extend((!length).to_le_bytes());
        file.extend(block);
    }
    file.extend(crc(content).to_le_bytes());
    file.extend((content.len() as u32).to_le_bytes());
    file
}

/// CRC-32 of a text, bit by bit.
fn crc(content: &[u8]) -> u32 {
    !content.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
        })
    })
}

/// A Zstandard frame of raw blocks without a checksum (RFC 8878, 3.1.1).
fn raw(content: &[u8]) -> Vec<u8> {
    // A window of 128 KiB, as long as the longest block.
    let mut file = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 7 << 3];
    let mut blocks = content.chunks(100_000).peekable();
    while let Some(block) = blocks.next() {
        let is_last = u32::from(blocks.peek().is_none());
        let head = is_last | (block.len() as u32) << 3;
        file.extend(&head.to_le_bytes()[..3]);
        file.extend(block);
    }
    file
}

fn text() -> String {
    let (shown, _) = steady(&[(1.0, 60.0, 0.0), (0.2, 700.0, 1.0)], 20_000.0, 30_000);
    record(&shown, 20_000.0)
}

#[test]
fn a_packed_text_gives_the_bytes_of_the_text() {
    let folder = Folder::new();
    folder.write("in.csv", text());
    let plain = folder.run(&COMPENSATE);
    assert_eq!(plain.code, 0, "{}", plain.stderr);
    let wanted = folder.read("out.csv");
    for (packed, name) in [
        (stored(text().as_bytes()), "gzip"),
        (raw(text().as_bytes()), "zstd"),
    ] {
        // The name is irrelevant.
        folder.write("in.csv", &packed);
        let ran = folder.run(&[&COMPENSATE[..], &["--force"]].concat());
        ran.says(
            0,
            &[&format!("in.csv ({name}, comma-separated, decimal point)")],
        );
        assert!(folder.read("out.csv") == wanted, "{name} differs");
        let words = ["compensate", "-", "--stand", "stand.toml"];
        let piped = folder.pipe(&words, &packed);
        assert!(piped.stdout == wanted, "{name}: {}", piped.stderr);
        // Two consecutive members are one file.
        let text = text();
        let half = text.len() / 2;
        let parts = [&text.as_bytes()[..half], &text.as_bytes()[half..]];
        let parts = parts.map(|part| {
            if name == "gzip" {
                stored(part)
            } else {
                raw(part)
            }
        });
        let joined = folder.pipe(&words, &parts.concat());
        assert!(joined.stdout == wanted, "{name}: {}", joined.stderr);
    }
}

#[test]
fn packed_messages_are_read_by_every_way_to_them() {
    let folder = Folder::new();
    let mcap = fs::read(workplace().join("made/ros2.mcap")).expect("a recording");
    folder.write("a.mcap", &mcap);
    let signal = ["--signal", "/joint_states.effort[0]"];
    let rows = folder.run(&[&["extract", "a.mcap"], &signal[..]].concat());
    assert_eq!(rows.code, 0, "{}", rows.stderr);
    let listed = |name: &str| -> Value {
        let report = folder.json(&["inspect", name, "--json"]);
        report
            .get("channels")
            .cloned()
            .unwrap_or_else(|| report["files"][0]["channels"].clone())
    };
    for packed in [stored(&mcap), raw(&mcap)] {
        folder.write("packed", &packed);
        let found = folder.run(&[&["extract", "packed"], &signal[..]].concat());
        assert_eq!(found.stdout, rows.stdout, "{}", found.stderr);
        let piped = folder.pipe(&[&["extract", "-"], &signal[..]].concat(), &packed);
        assert_eq!(piped.stdout, rows.stdout, "{}", piped.stderr);
        // In another case, which requires a first pass over the file.
        let other = ["--signal", "/JOINT_STATES.EFFORT[0]"];
        let [of_plain, of_packed] =
            ["a.mcap", "packed"].map(|name| folder.run(&[&["extract", name], &other[..]].concat()));
        assert_eq!(of_packed.code, of_plain.code, "{}", of_packed.stderr);
        assert_eq!(of_packed.stdout, of_plain.stdout);
        assert_eq!(listed("packed"), listed("a.mcap"));
    }
}

#[test]
fn damage_is_told_and_leaves_nothing() {
    let folder = Folder::new();
    let text = text();
    for (packed, program) in [
        (stored(text.as_bytes()), "gzip"),
        (raw(text.as_bytes()), "zstd"),
    ] {
        for cut in [packed.len() - 3, packed.len() / 2, 8] {
            folder.write("in.csv", &packed[..cut]);
            let ran = folder.run(&[&COMPENSATE[..], &["--json"]].concat());
            let hint = format!("{program} -dc FILE > NEW");
            ran.says(
                1,
                &["in.csv", &format!("its {program} data are damaged"), &hint],
            );
            let failure: Value = serde_json::from_str(&ran.stdout).expect("a document");
            assert_eq!(failure["error"]["code"], "damaged-file");
            assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
        }
    }
    // A wrong bit of the content is detected by the checksum at the end.
    let mut packed = stored(text.as_bytes());
    let at = packed.len() / 2;
    let digit = packed[at..]
        .iter()
        .position(u8::is_ascii_digit)
        .expect("a digit");
    packed[at + digit] ^= 1;
    folder.write("in.csv", &packed);
    folder
        .run(&COMPENSATE)
        .says(1, &["its gzip data are damaged"]);
}

#[test]
fn packed_recordings_are_found_in_folders() {
    let folder = Folder::new();
    fs::create_dir(folder.path("logs")).expect("a folder");
    folder.write("logs/a.csv.gz", stored(text().as_bytes()));
    folder.write("logs/notes.bin", stored(b"no rows here\n"));
    folder.write("logs/b", raw(text().as_bytes()));
    let words = ["extract", "logs", "-o", "out/"];
    folder.run(&words).says(0, &["2 done", "logs/notes.bin"]);
    assert_eq!(
        folder.read("out/a.csv.rows.csv"),
        folder.read("out/b.rows.csv")
    );
}
