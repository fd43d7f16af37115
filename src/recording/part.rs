//! The first part of a text that is too long to be read as a whole.

use std::io::Read;

use crate::failure::Failure;
use crate::io::Input;
use crate::warning::Warning;

/// Bytes that are gone through at a time.
const PIECE: usize = 1 << 16;

/// The first bytes of a text, no more than so many, up to the end of a line; and a warning about what was
/// left out, if anything. A text that is all one line is read as a whole.
pub(super) fn first(place: &Input, most: u64) -> Result<(Vec<u8>, Option<Warning>), Failure> {
    let failed = |error| Failure::failed(format_args!("{}: cannot be read: {error}", place.name()));
    let mut input = place.open()?;
    let mut bytes = Vec::new();
    input
        .by_ref()
        .take(most)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
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
        _ => memchr::memrchr(b'\n', bytes).map(|at| at + 1),
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
