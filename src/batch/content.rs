//! Detection of recordings in a folder, by their first bytes.

use std::io::Read;
use std::path::Path;

use super::{manifest, summary};
use crate::io::{Input, MCAP_START};
use crate::log;
use crate::recording::formats;

/// Number of bytes examined.
const HEAD: u64 = 1 << 16;
/// Byte order marks of UTF-16.
const WIDE_TEXT: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];
/// Start of a stand file's first key.
const STAND: &str = "schema = \"torqcomp.";

/// Whether it begins like an MCAP file, or like a text with rows of numbers that is not a stand file, manifest, log or
/// summary written by torqcomp. An unreadable file counts as a recording; the reason is reported when it is read.
pub(super) fn is_recording(path: &Path) -> bool {
    let mut head = Vec::new();
    // A compressed file is judged by its content.
    let read = Input::File(path.to_owned())
        .open()
        .map(|file| file.take(HEAD).read_to_end(&mut head));
    if !matches!(read, Ok(Ok(_)))
        || head.starts_with(MCAP_START)
        || formats::is_recording(&head)
        || WIDE_TEXT.iter().any(|mark| head.starts_with(mark))
    {
        return true;
    }
    if head.contains(&0) {
        return false;
    }
    let text = String::from_utf8_lossy(&head);
    let is_ours = text.starts_with(manifest::BEGINNING)
        || text.starts_with(log::BEGINNING)
        || text.starts_with(&summary::beginning())
        || text.lines().any(|line| line.starts_with(STAND));
    !is_ours && text.lines().any(is_row)
}

/// Whether a line begins with a number and has more digits and separators than letters.
fn is_row(line: &str) -> bool {
    let cell = line.trim_start_matches(|c: char| c.is_whitespace() || c == '"');
    let number = cell.trim_start_matches(['+', '-', '.', ',']);
    let letters = cell.chars().filter(|c| c.is_alphabetic()).count();
    number.starts_with(|c: char| c.is_ascii_digit()) && 2 * letters < cell.chars().count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_begin_with_numbers() {
        for row in [
            "0,1.5",
            "  -.5;2",
            "\"1,5\";\"2\"",
            "12:00:01.5\t3",
            "2024-05-01T10:00,4,OK",
        ] {
            assert!(is_row(row), "{row}");
        }
        for text in [
            "# 5",
            "1. Switch the bridge on",
            "time_s,V",
            "",
            "- 5 things to do",
        ] {
            assert!(!is_row(text), "{text}");
        }
    }
}
