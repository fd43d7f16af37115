//! Reading of a stream in pieces of whole lines.

use std::io::{self, Read};

use super::last_line::{LastLine, last_line};
use crate::failure::{ErrorCode, Failure};
use crate::warning::Warning;

/// Longest line that is accepted.
pub const LONGEST_LINE: usize = 1 << 24;

/// Failure for a line longer than [`LONGEST_LINE`].
pub fn too_long_a_line() -> Failure {
    ErrorCode::NotARecording.failed("a line is longer than 16 MiB: this is not a table of numbers")
}
/// Bytes per piece: large enough to be fast, small enough to stay in cache.
const PIECE: usize = 1 << 17;

/// Splits a stream into pieces of whole lines.
pub struct Chunks {
    input: Box<dyn Read + Send>,
    /// Read but not yet output: the head of the file, the start of a line.
    carry: Vec<u8>,
    size: usize,
    at_end: bool,
    /// Number and text of a last line without a line end, if all was taken.
    unended: Option<(usize, String)>,
}

/// Kind of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece {
    /// Whole lines, each with a line end.
    Lines,
    /// The last piece, whose last line has no line feed.
    Unended,
    /// No more input.
    End,
}

impl Chunks {
    /// Pieces of an input.
    pub fn new(input: Box<dyn Read + Send>) -> Self {
        Self {
            input,
            carry: Vec::new(),
            size: PIECE,
            at_end: false,
            unended: None,
        }
    }

    /// Sets the minimum size of the pieces.
    pub fn set_size(&mut self, bytes: usize) {
        self.size = bytes.max(PIECE);
    }

    /// Peeks at the next bytes, up to `count`, and reports whether there are no more.
    ///
    /// # Errors
    /// Those of the input.
    pub fn peek(&mut self, count: usize) -> Result<(&[u8], bool), Failure> {
        let missing = count.saturating_sub(self.carry.len());
        if missing > 0 && !self.at_end {
            let mut more = (&mut self.input).take(missing as u64);
            let read = more.read_to_end(&mut self.carry).map_err(unreadable)?;
            self.at_end = read < missing;
        }
        let end = count.min(self.carry.len());
        let is_all = self.at_end && end == self.carry.len();
        Ok((&self.carry[..end], is_all))
    }

    /// All remaining bytes.
    ///
    /// # Errors
    /// Those of the input.
    pub fn take_all(&mut self) -> Result<Vec<u8>, Failure> {
        self.peek(usize::MAX)?;
        let text = std::mem::take(&mut self.carry);
        let last = last_line(&text);
        if last.len() < text.len() && !last.trim_ascii().is_empty() {
            let number = memchr::memchr_iter(b'\n', &text).count() + 1;
            let line = String::from_utf8_lossy(last).into_owned();
            self.unended = Some((number, line));
        }
        Ok(text)
    }

    /// A warning about a last line without a line end, if all was taken and the other lines have one.
    pub fn unended_line(&self) -> Option<Warning> {
        let (number, line) = self.unended.as_ref()?;
        LastLine::Suspect.warning(&format!("line {number}"), line)
    }

    /// Skips bytes that were peeked at.
    pub fn skip(&mut self, count: usize) {
        self.carry.drain(..count);
    }

    /// Puts bytes of the last piece back.
    pub fn put_back(&mut self, rest: &[u8]) {
        self.carry.splice(0..0, rest.iter().copied());
    }

    /// Fills `piece` with the next whole lines.
    ///
    /// # Errors
    /// Those of the input, and a line longer than 16 MiB.
    pub fn next(&mut self, piece: &mut Vec<u8>) -> Result<Piece, Failure> {
        // The carry may be more than one piece: the head of the file.
        let carried = self.carry.len().min(self.size);
        if piece.len() < carried {
            piece.resize(carried, 0);
        }
        piece[..carried].copy_from_slice(&self.carry[..carried]);
        self.carry.drain(..carried);
        // Old bytes after it are kept for now, as they need not be cleared before being
        // overwritten.
        let mut filled = carried;
        loop {
            if self.carry.is_empty() {
                self.fill(piece, filled).map_err(unreadable)?;
            } else {
                piece.truncate(filled);
            }
            if let Some(last) = memchr::memrchr(b'\n', piece) {
                let rest = piece[last + 1..].to_vec();
                if self.at_end && self.carry.is_empty() && !rest.is_empty() {
                    return Ok(Piece::Unended);
                }
                self.put_back(&rest);
                piece.truncate(last + 1);
                return Ok(Piece::Lines);
            }
            if self.at_end && self.carry.is_empty() {
                return Ok(if piece.is_empty() {
                    Piece::End
                } else {
                    Piece::Unended
                });
            }
            if piece.len() > LONGEST_LINE {
                return Err(too_long_a_line());
            }
            self.size = self.size.max(2 * piece.len());
            let more = self.carry.len().min(self.size - piece.len());
            piece.extend(self.carry.drain(..more));
            filled = piece.len();
        }
    }

    /// Appends to the first `filled` bytes until the piece is full or the input ends.
    fn fill(&mut self, piece: &mut Vec<u8>, mut filled: usize) -> io::Result<()> {
        piece.resize(self.size.max(filled), 0);
        while !self.at_end && filled < piece.len() {
            match self.input.read(&mut piece[filled..])? {
                0 => self.at_end = true,
                count => filled += count,
            }
        }
        piece.truncate(filled);
        Ok(())
    }
}

fn unreadable(error: io::Error) -> Failure {
    Failure::unreadable(&error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pieces(head: &[u8], rest: &[u8], size: usize) -> (Vec<Vec<u8>>, Piece) {
        let input = io::Cursor::new([head, rest].concat());
        let mut chunks = Chunks::new(Box::new(input));
        chunks.peek(head.len()).unwrap();
        chunks.size = size;
        let (mut all, mut piece) = (Vec::new(), Vec::new());
        loop {
            match chunks.next(&mut piece).unwrap() {
                Piece::End => return (all, Piece::End),
                Piece::Unended => {
                    all.push(piece.clone());
                    return (all, Piece::Unended);
                }
                Piece::Lines => all.push(piece.clone()),
            }
        }
    }

    proptest! {
        #[test]
        fn pieces_are_whole_lines_and_lose_nothing(
            text in "([0-9]{0,12}\n){0,40}[0-9]{0,5}", cut in 0_usize..400, size in 1_usize..64,
        ) {
            let bytes = text.as_bytes();
            let cut = cut.min(bytes.len());
            let (all, last) = pieces(&bytes[..cut], &bytes[cut..], size);
            prop_assert_eq!(all.concat(), bytes);
            let ended = bytes.is_empty() || bytes.ends_with(b"\n");
            prop_assert_eq!(last == Piece::End, ended);
            for piece in &all[..all.len() - usize::from(!ended)] {
                prop_assert!(piece.ends_with(b"\n"));
            }
        }
    }

    #[test]
    fn pieces_have_about_the_size_asked_for() {
        let text = "1,2\n".repeat(1000);
        let (all, _) = pieces(&text.as_bytes()[..100], &text.as_bytes()[100..], 64);
        assert!(all.iter().all(|piece| piece.len() <= 64));
        assert!(all.len() <= 64, "{}", all.len());
    }
}
