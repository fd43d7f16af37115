//! The lines of a universal file and the numbers in them.

use super::super::bytes::Bytes;
use super::super::damaged;
use crate::failure::Failure;

/// Maximum line length.
const LONGEST_LINE: usize = 4096;
/// Number of bytes read ahead at a time.
const PIECE: u64 = 1 << 16;

/// Lines of a file, and bytes between them.
pub(super) struct Lines<'a> {
    pub(super) bytes: &'a mut Bytes,
    pub(super) ahead: Vec<u8>,
    /// Number of bytes of `ahead` consumed.
    pub(super) used: usize,
    /// Number of lines read so far.
    pub(super) number: usize,
}

impl Lines<'_> {
    /// Reads ahead, so that at least one more byte is available if the file has one.
    pub(super) fn fill(&mut self) -> Result<bool, Failure> {
        if self.used > self.ahead.len() / 2 {
            self.ahead.drain(..self.used);
            self.used = 0;
        }
        let more = self.bytes.take(PIECE)?;
        self.ahead.extend_from_slice(&more);
        Ok(!more.is_empty())
    }

    /// The next line without its end; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<String>, Failure> {
        loop {
            let rest = &self.ahead[self.used..];
            let end = memchr::memchr(b'\n', rest);
            if let Some(end) = end.filter(|end| *end <= LONGEST_LINE) {
                let line = String::from_utf8_lossy(&rest[..end]);
                let line = line.trim_end_matches('\r').to_owned();
                self.used += end + 1;
                self.number += 1;
                return Ok(Some(line));
            }
            if rest.len() > LONGEST_LINE {
                return Err(self.wrong("the line is too long for a universal file"));
            }
            if !self.fill()? {
                let rest = &self.ahead[self.used..];
                let line = String::from_utf8_lossy(rest).into_owned();
                self.used = self.ahead.len();
                self.number += 1;
                return Ok(Some(line).filter(|line| !line.trim().is_empty()));
            }
        }
    }

    /// The next bytes, fewer at the end of the file.
    pub(super) fn bytes(&mut self, count: usize) -> Result<Vec<u8>, Failure> {
        let there = (self.ahead.len() - self.used).min(count);
        let mut bytes = self.ahead[self.used..self.used + there].to_vec();
        self.used += there;
        bytes.extend(self.bytes.take((count - there) as u64)?);
        Ok(bytes)
    }

    pub(super) fn wrong(&self, what: &str) -> Failure {
        damaged(what, self.bytes.at).line(self.number)
    }
}

/// Numbers in a line of fixed fields, or separated by spaces if the fields deviate from the standard.
pub(super) fn numbers_of(line: &str, widths: &[usize], values: &mut Vec<f64>) -> bool {
    let number = |text: &str| -> Option<f64> {
        // FORTRAN writes double precision with a D.
        text.trim().replace(['D', 'd'], "E").parse().ok()
    };
    let words: Option<Vec<f64>> = line.split_whitespace().map(number).collect();
    if let Some(words) = words {
        values.extend(words);
        return true;
    }
    let mut rest = line;
    for width in widths.iter().cycle() {
        if rest.trim().is_empty() {
            return true;
        }
        let Some((cell, behind)) = rest.split_at_checked((*width).min(rest.len())) else {
            return false;
        };
        match number(cell) {
            Some(value) => values.push(value),
            None => return false,
        }
        rest = behind;
    }
    true
}
