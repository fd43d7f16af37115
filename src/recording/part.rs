//! The first part of a text that is too long to be read as a whole.

use std::io::Read;

use super::progress;
use super::text::{self, LONGEST_LINE};
use crate::failure::Failure;
use crate::io::Input;
use crate::warning::Warning;

/// Bytes that are gone through at a time.
const PIECE: usize = 1 << 16;

/// The first bytes of a text, no more than so many, up to the end of a line; and a warning about what was
/// left out, if anything. A shorter text that is all one line is read as a whole.
///
/// # Errors
/// If the input cannot be read, its first bytes are no text, or its first line is too long for a table: all before more of
/// it is read.
pub(super) fn first(place: &Input, most: u64) -> Result<(Vec<u8>, Option<Warning>), Failure> {
    let failed = |error| Failure::failed(format_args!("{}: cannot be read: {error}", place.name()));
    let refused = |failure: Failure| failure.at(place.name());
    let mut input = progress::open(place)?;
    let mut bytes = Vec::new();
    let mut read_to = |bytes: &mut Vec<u8>, most: u64| {
        let more = most.saturating_sub(bytes.len() as u64);
        input.by_ref().take(more).read_to_end(bytes).map_err(failed)
    };
    read_to(&mut bytes, (PIECE as u64).min(most))?;
    text::refuse_binary(&bytes).map_err(refused)?;
    read_to(&mut bytes, (LONGEST_LINE as u64).min(most))?;
    if bytes.len() == LONGEST_LINE && end_of_lines(&bytes).is_none() {
        return Err(refused(text::too_long_a_line()));
    }
    read_to(&mut bytes, most)?;
    if (bytes.len() as u64) < most {
        return Ok((bytes, None));
    }
    let mut piece = vec![0; PIECE];
    let count = input.read(&mut piece).map_err(failed)?;
    let Some(end) = end_of_lines(&bytes).filter(|_| count > 0) else {
        bytes.extend_from_slice(&piece[..count]);
        input.read_to_end(&mut bytes).map_err(failed)?;
        return Ok((bytes, None));
    };
    let newlines = |bytes: &[u8]| memchr::memchr_iter(b'\n', bytes).count();
    let mut lines = newlines(&piece[..count]);
    loop {
        let count = input.read(&mut piece).map_err(failed)?;
        if count == 0 {
            break;
        }
        lines += newlines(&piece[..count]);
    }
    bytes.truncate(end);
    let warning = Warning::new(
        "first-samples-only",
        format!(
            "only the first {end} bytes of the file were looked at; about {lines} lines follow them, \
             whose samples are in no figure here"
        ),
    );
    Ok((bytes, Some(warning)))
}

/// Where the last whole line ends.
fn end_of_lines(bytes: &[u8]) -> Option<usize> {
    let pairs = || (0..bytes.len() / 2).rev().map(|i| 2 * i);
    let is_newline = |at: &usize, pair: [u8; 2]| bytes[*at..*at + 2] == pair;
    match bytes {
        [0xff, 0xfe, ..] => pairs().find(|at| is_newline(at, *b"\n\0")).map(|at| at + 2),
        [0xfe, 0xff, ..] => pairs().find(|at| is_newline(at, *b"\0\n")).map(|at| at + 2),
        _ => memchr::memrchr(b'\n', bytes)
            .or_else(|| memchr::memrchr(b'\r', bytes))
            .map(|at| at + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8], most: u64) -> (Vec<u8>, Option<Warning>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        std::fs::write(&path, bytes).unwrap();
        first(&Input::File(path), most).unwrap()
    }

    #[test]
    fn whole_lines_up_to_the_limit() {
        let text = b"time,a\n0,1\n1,2\n2,3\n";
        let (part, warning) = read(text, 14);
        assert_eq!(part, b"time,a\n0,1\n");
        assert!(warning.unwrap().message.contains("first 11 bytes"));
        assert_eq!(read(text, 19), (text.to_vec(), None), "exactly as long");
        assert_eq!(read(text, 100), (text.to_vec(), None));
        assert_eq!(read(b"1,2,3,4", 3), (b"1,2,3,4".to_vec(), None));
        assert_eq!(read(b"a\r0\r1\r2", 5).0, b"a\r0\r");
    }

    #[test]
    fn what_is_no_text_is_refused_by_its_first_bytes() {
        let mut state = 1_u64;
        let mut noise = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 56) as u8
        };
        let random: Vec<u8> = (0..100_000).map(|_| noise()).collect();
        let long = vec![b'1'; LONGEST_LINE + 1];
        for (bytes, why) in [
            (vec![0; 100_000], "binary"),
            (random, "binary"),
            (long, "longer than 16 MiB"),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("file");
            std::fs::write(&path, &bytes).unwrap();
            let refused = first(&Input::File(path), u64::MAX).unwrap_err();
            assert!(refused.to_string().contains(why), "{refused}");
        }
    }

    #[test]
    fn two_bytes_a_character() {
        let little: Vec<u8> = "\u{feff}ab\ncd\nef"
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect();
        assert_eq!(read(&little, 15).0, little[..14]);
        let big: Vec<u8> = "\u{feff}ab\ncd\nef"
            .encode_utf16()
            .flat_map(u16::to_be_bytes)
            .collect();
        assert_eq!(read(&big, 15).0, big[..14]);
    }
}
