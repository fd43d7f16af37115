//! Buffered bytes of a file or stream, as many as a record needs.

use std::io::{self, Read};

/// Number of bytes requested at a time: a claimed huge record takes no more memory than its actual
/// bytes.
const PIECE: usize = 1 << 18;

/// A stream with a window of bytes that have been read but not yet consumed.
pub(crate) struct CountedInput {
    stream: Box<dyn Read + Send>,
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    /// Offset of `start` in the file.
    offset: u64,
}

impl CountedInput {
    /// Starts at the beginning of a stream.
    pub fn new(stream: Box<dyn Read + Send>) -> Self {
        Self {
            stream,
            buffer: Vec::new(),
            start: 0,
            end: 0,
            offset: 0,
        }
    }

    /// Offset of the next byte in the file.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Reads until `count` bytes are in the window, or the file ends; returns how many there are,
    /// at most `count`.
    ///
    /// # Errors
    /// If the stream cannot be read.
    pub fn want(&mut self, count: usize) -> io::Result<usize> {
        while self.end - self.start < count {
            let missing = (count - (self.end - self.start)).min(PIECE);
            if self.start == self.end || self.buffer.len() - self.end < missing {
                self.buffer.copy_within(self.start..self.end, 0);
                self.end -= self.start;
                self.start = 0;
            }
            if self.buffer.len() - self.end < missing {
                // Doubling keeps the work proportional to the actual bytes.
                self.buffer.resize((2 * self.end).max(PIECE), 0);
            }
            // Bytes read beyond the request must be moved to the front later on.
            let until = self.buffer.len().min(self.end + PIECE);
            match self.stream.read(&mut self.buffer[self.end..until])? {
                0 => return Ok(self.end - self.start),
                read => self.end += read,
            }
        }
        Ok(count)
    }

    /// The bytes in the window.
    pub fn window(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    /// Consumes bytes of the window.
    pub fn used(&mut self, count: usize) {
        let count = count.min(self.end - self.start);
        self.start += count;
        self.offset += count as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_in_order_whatever_the_steps() {
        let bytes: Vec<u8> = (0..2_000_000_u32).map(|i| (i % 251) as u8).collect();
        let mut input = CountedInput::new(Box::new(io::Cursor::new(bytes.clone())));
        let mut at = 0;
        for step in [1, 9, 300_000, 17, 600_000, 5] {
            assert_eq!(input.want(step).unwrap(), step);
            assert!(input.window()[..step] == bytes[at..at + step]);
            input.used(step);
            at += step;
            assert_eq!(input.offset(), at as u64);
        }
        assert_eq!(input.want(usize::MAX).unwrap(), bytes.len() - at);
        assert!(*input.window() == bytes[at..]);
    }

    #[test]
    fn a_huge_wish_takes_no_more_memory_than_there_are_bytes() {
        let mut input = CountedInput::new(Box::new(io::Cursor::new(vec![1_u8; 10])));
        assert_eq!(input.want(1 << 40).unwrap(), 10);
        assert!(input.buffer.len() <= 2 * PIECE);
    }
}
