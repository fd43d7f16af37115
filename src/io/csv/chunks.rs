//! Reading a stream in pieces that end with whole lines.

use std::io::{self, Read};

/// Longest line that is accepted.
const LONGEST_LINE: usize = 1 << 24;

/// Cuts a stream into pieces of whole lines.
pub struct Chunks {
    input: Box<dyn Read + Send>,
    /// The start of the line that the last piece ended in.
    carry: Vec<u8>,
    size: usize,
    at_end: bool,
}

/// What a piece is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece {
    /// Whole lines, each ended.
    Lines,
    /// The last piece, whose last line has no line feed.
    Unended,
    /// There is nothing left.
    End,
}

impl Chunks {
    /// Pieces of about `size` bytes; `head` has been read from the input already.
    #[must_use]
    pub fn new(head: Vec<u8>, input: Box<dyn Read + Send>, size: usize) -> Self {
        Self {
            input,
            carry: head,
            size,
            at_end: false,
        }
    }

    /// Makes the pieces about so many bytes long.
    pub fn set_size(&mut self, bytes: usize) {
        self.size = bytes;
    }

    /// Fills `piece` with the next whole lines.
    ///
    /// # Errors
    /// Those of the input, and [`io::ErrorKind::InvalidData`] for a line beyond 16 MiB.
    pub fn next(&mut self, piece: &mut Vec<u8>) -> io::Result<Piece> {
        // What is carried may be more than one piece: the head of the file.
        let carried = self.carry.len().min(self.size);
        if piece.len() < carried {
            piece.resize(carried, 0);
        }
        piece[..carried].copy_from_slice(&self.carry[..carried]);
        self.carry.drain(..carried);
        // Old bytes behind it are kept for now: they need not be cleared to be read over.
        let mut filled = carried;
        loop {
            if self.carry.is_empty() {
                self.fill(piece, filled)?;
            } else {
                piece.truncate(filled);
            }
            if let Some(last) = memchr::memrchr(b'\n', piece) {
                let rest = piece[last + 1..].to_vec();
                if self.at_end && self.carry.is_empty() && !rest.is_empty() {
                    return Ok(Piece::Unended);
                }
                self.carry.splice(0..0, rest);
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
                return Err(io::Error::new(
                    io::ErrorKind::InvalidData,
                    "a line is longer than 16 MiB: this is no table of numbers",
                ));
            }
            self.size = self.size.max(2 * piece.len());
            let more = self.carry.len().min(self.size - piece.len());
            piece.extend(self.carry.drain(..more));
            filled = piece.len();
        }
    }

    /// Reads behind the first `filled` bytes until the piece is full or the input ends.
    fn fill(&mut self, piece: &mut Vec<u8>, mut filled: usize) -> io::Result<()> {
        piece.resize(self.size.max(filled), 0);
        while !self.at_end && filled < piece.len() {
            match self.input.read(&mut piece[filled..]) {
                Ok(0) => self.at_end = true,
                Ok(count) => filled += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        piece.truncate(filled);
        Ok(())
    }
}

/// Reads the first bytes of an input, as many as there are up to `size`.
///
/// # Errors
/// Those of the input.
pub fn head(input: &mut dyn Read, size: usize) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    input.take(size as u64).read_to_end(&mut head)?;
    Ok(head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pieces(head: &[u8], rest: &[u8], size: usize) -> (Vec<Vec<u8>>, Piece) {
        let input = Box::new(io::Cursor::new(rest.to_vec()));
        let mut chunks = Chunks::new(head.to_vec(), input, size);
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
