//! Sequential bytes of a file, with their position.

use std::io::{Cursor, Read};

use crate::failure::Failure;

/// Number of bytes skipped at a time.
const PIECE: u64 = 1 << 16;

/// Byte order of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

/// A sequential reader.
pub(super) struct Bytes {
    input: Box<dyn Read + Send>,
    /// Bytes read so far.
    pub(super) at: u64,
}

impl Bytes {
    pub(super) fn new(input: Box<dyn Read + Send>) -> Self {
        Self { input, at: 0 }
    }

    /// For bytes in memory that begin at a position of the file.
    pub(super) fn of(bytes: Vec<u8>, at: u64) -> Self {
        Self {
            input: Box::new(Cursor::new(bytes)),
            at,
        }
    }

    /// The next bytes, fewer at the end of the file. Nothing is reserved for a count claimed by the
    /// file.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(super) fn take(&mut self, count: u64) -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        let read = (&mut self.input).take(count).read_to_end(&mut bytes);
        self.at += read.map_err(|error| Failure::unreadable(&error))? as u64;
        Ok(bytes)
    }

    /// `N` bytes; `None` if the file ends before.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(super) fn array<const N: usize>(&mut self) -> Result<Option<[u8; N]>, Failure> {
        Ok(self.take(N as u64)?.try_into().ok())
    }

    /// Skips bytes; returns whether all were there.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(super) fn skip(&mut self, count: u64) -> Result<bool, Failure> {
        let mut left = count;
        while left > 0 {
            match self.take(left.min(PIECE))?.len() as u64 {
                0 => return Ok(false),
                read => left -= read,
            }
        }
        Ok(true)
    }
}

/// A number of fixed width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    Signed(usize),
    Unsigned(usize),
    Float32,
    Float64,
}

impl Number {
    /// Size in bytes.
    pub(super) fn width(self) -> usize {
        match self {
            Self::Signed(width) | Self::Unsigned(width) => width,
            Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }

    /// Decodes a number from bytes of its size.
    pub(super) fn read(self, bytes: &[u8], order: Order) -> f64 {
        let mut wide = [0; 8];
        let width = self.width().min(bytes.len());
        for (i, byte) in bytes[..width].iter().enumerate() {
            let place = match order {
                Order::Little => i,
                Order::Big => width - 1 - i,
            };
            wide[place] = *byte;
        }
        let bits = u64::from_le_bytes(wide);
        match self {
            Self::Unsigned(_) => bits as f64,
            Self::Signed(width) => {
                let above = 64 - 8 * width as u32;
                ((bits << above) as i64 >> above) as f64
            }
            Self::Float32 => f64::from(f32::from_bits(bits as u32)),
            Self::Float64 => f64::from_bits(bits),
        }
    }

    /// Decodes all numbers in bytes; an incomplete one at the end is ignored.
    pub(super) fn all(self, bytes: &[u8], order: Order) -> Vec<f64> {
        let each = bytes.chunks_exact(self.width());
        each.map(|bytes| self.read(bytes, order)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_their_sign_and_order() {
        let of = |number: Number, bytes: &[u8]| number.read(bytes, Order::Little);
        assert_eq!(of(Number::Signed(3), &[0xff, 0xff, 0xff]), -1.0);
        assert_eq!(of(Number::Signed(3), &[0, 0, 0x80]), -8_388_608.0);
        assert_eq!(of(Number::Unsigned(2), &[0xff, 0xff]), 65_535.0);
        assert_eq!(of(Number::Signed(8), &(-5_i64).to_le_bytes()), -5.0);
        assert_eq!(of(Number::Float32, &1.5_f32.to_le_bytes()), 1.5);
        assert_eq!(
            Number::Float64.read(&(-0.1_f64).to_be_bytes(), Order::Big),
            -0.1
        );
        assert_eq!(Number::Signed(2).read(&[0xff, 0xfe], Order::Big), -2.0);
        assert_eq!(
            Number::Signed(2).all(&[1, 0, 2, 0, 3], Order::Little),
            [1.0, 2.0]
        );
    }
}
