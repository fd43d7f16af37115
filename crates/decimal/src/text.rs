//! Text assembled from many short pieces.

use crate::Span;
use crate::digits::{self, Decimal, Digits};

/// Longest piece copied with a fixed length.
const SHORT: usize = 32;
/// Free space kept at the end.
const ROOM: usize = digits::ROOM;
/// Numbers decomposed before they are written: the steps for one depend on each other, those for several do not.
const TOGETHER: usize = 8;

/// The copy for a short piece, unless the source ends before.
#[inline(always)]
fn short_piece(source: &[u8], span: Span) -> Option<&[u8; SHORT]> {
    source.get(span.offset()..)?.first_chunk()
}

/// A growing text. Pieces are copied with a fixed length, which is faster than the exact one; the
/// surplus is overwritten by the next piece.
///
/// ```
/// use torqcomp_decimal::{Digits, Span, Text};
/// let mut text = Text::default();
/// let source = b"0.00 0.01";
/// text.rows((source, &[Span::new(0, 4), Span::new(5, 4)]), (&[1.0, -0.25], 2.0), 12);
/// text.seconds(1_500_000_000);
/// text.byte(b',');
/// text.number(2.0 / 3.0, Digits::Significant(3));
/// assert_eq!(text.as_bytes(), b"0.00,2\n0.01,-0.5\n1.500000000,0.667");
/// ```
#[derive(Debug, Default)]
pub struct Text {
    bytes: Vec<u8>,
    length: usize,
}

impl Text {
    /// Clears the text, keeping its memory.
    pub fn clear(&mut self) {
        self.length = 0;
    }

    /// The text.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// Appends a byte.
    pub fn byte(&mut self, byte: u8) {
        self.room()[0] = byte;
        self.length += 1;
    }

    /// Appends a finite number.
    pub fn number(&mut self, value: f64, digits: Digits) {
        self.length += digits::put(self.room(), value, digits);
    }

    /// Appends nanoseconds as seconds with all digits.
    pub fn seconds(&mut self, nanoseconds: i64) {
        const PER_SECOND: u64 = 1_000_000_000;
        let magnitude = nanoseconds.unsigned_abs();
        let (mut whole, mut part) = (magnitude / PER_SECOND, magnitude % PER_SECOND);
        // From the last digit to the first: nine after the point, at least one before it.
        let mut text = [b'0'; SHORT];
        let mut first = SHORT;
        let mut put = |byte: u8| {
            first -= 1;
            text[first] = byte;
        };
        for _ in 0..9 {
            put(b'0' + (part % 10) as u8);
            part /= 10;
        }
        put(b'.');
        loop {
            put(b'0' + (whole % 10) as u8);
            whole /= 10;
            if whole == 0 {
                break;
            }
        }
        if nanoseconds < 0 {
            put(b'-');
        }
        let length = SHORT - first;
        text.copy_within(first.., 0);
        self.copy(&text, Span::new(0, length));
    }

    /// Appends a row for each value: the text of `source` there, a comma, the value times `scale`, and a line feed.
    ///
    /// # Panics
    /// If a piece is outside the source, or there are fewer than values.
    pub fn rows(
        &mut self,
        (source, spans): (&[u8], &[Span]),
        (values, scale): (&[f64], f64),
        count: u32,
    ) {
        if count == digits::DEFAULT_COUNT {
            // The same code, with the number of digits known at compile time.
            self.rows_of((source, spans), (values, scale), digits::DEFAULT_COUNT);
        } else {
            self.rows_of((source, spans), (values, scale), count);
        }
    }

    #[inline(always)]
    fn rows_of(
        &mut self,
        (source, spans): (&[u8], &[Span]),
        (values, scale): (&[f64], f64),
        count: u32,
    ) {
        let spans = spans[..values.len()].chunks(TOGETHER);
        for (values, spans) in values.chunks(TOGETHER).zip(spans) {
            let mut decimals = [Decimal::of(0.0, count); TOGETHER];
            for (decimal, value) in decimals.iter_mut().zip(values) {
                *decimal = Decimal::of(value * scale, count);
            }
            for (decimal, span) in decimals.iter().zip(spans) {
                self.row(source, *span, decimal);
            }
        }
    }

    #[inline(always)]
    fn row(&mut self, source: &[u8], span: Span, decimal: &Decimal) {
        let length = span.length();
        let Some(piece) = short_piece(source, span).filter(|_| length < SHORT) else {
            self.long_row(source, span, decimal);
            return;
        };
        if self.bytes.len() < self.length + SHORT + ROOM {
            self.grow();
        }
        let row = &mut self.bytes[self.length..self.length + SHORT + ROOM];
        *digits::chunk_at(row, 0) = *piece;
        row[length] = b',';
        let number = &mut row[length + 1..length + 1 + ROOM];
        let end = length + 1 + decimal.put(number.try_into().expect("a slice of that length"));
        row[end] = b'\n';
        self.length += end + 1;
    }

    #[cold]
    fn long_row(&mut self, source: &[u8], span: Span, decimal: &Decimal) {
        self.copy(source, span);
        self.byte(b',');
        self.length += decimal.put(self.room());
        self.byte(b'\n');
    }

    /// Appends a piece of a text.
    ///
    /// # Panics
    /// If the text is shorter.
    pub fn copy(&mut self, source: &[u8], span: Span) {
        let (offset, length) = (span.offset(), span.length());
        match short_piece(source, span) {
            Some(piece) if length <= SHORT => *digits::chunk_at(self.room(), 0) = *piece,
            _ => self.copy_long(&source[offset..offset + length]),
        }
        self.length += length;
    }

    #[cold]
    fn copy_long(&mut self, piece: &[u8]) {
        let end = self.length + piece.len();
        if self.bytes.len() < end {
            self.bytes.resize(end, 0);
        }
        self.bytes[self.length..end].copy_from_slice(piece);
    }

    #[inline]
    fn room(&mut self) -> &mut [u8; ROOM] {
        if self.bytes.len() < self.length + ROOM {
            self.grow();
        }
        (&mut self.bytes[self.length..self.length + ROOM])
            .try_into()
            .expect("a slice of that length")
    }

    #[cold]
    fn grow(&mut self) {
        let more = (self.bytes.len() / 2).max(4 * ROOM);
        self.bytes.resize(self.length + more, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn nanoseconds_keep_every_digit() {
        let mut text = Text::default();
        for nanoseconds in [0, 1_700_000_000_123_456_789, -1_500_000_000] {
            text.seconds(nanoseconds);
            text.byte(b' ');
        }
        let expected = "0.000000000 1700000000.123456789 -1.500000000 ";
        assert_eq!(text.as_bytes(), expected.as_bytes());
    }

    proptest! {
        #[test]
        fn pieces_stand_one_after_the_other(
            pieces in prop::collection::vec((0_usize..200, 0_usize..60, any::<u8>(), -1e6..1e6_f64), 0..60),
        ) {
            let source: Vec<u8> = (0..260_u32).map(|i| b'a' + (i % 26) as u8).collect();
            let (mut text, mut plain) = (Text::default(), Vec::new());
            for round in 0..2 {
                text.clear();
                plain.clear();
                for (offset, length, byte, value) in &pieces {
                    text.copy(&source, Span::new(*offset, *length));
                    plain.extend_from_slice(&source[*offset..offset + length]);
                    text.byte(*byte);
                    plain.push(*byte);
                    text.number(value * f64::from(round), Digits::Significant(9));
                    digits::write(&mut plain, value * f64::from(round), Digits::Significant(9));
                }
                prop_assert_eq!(text.as_bytes(), plain.as_slice());
            }
        }
    }
}
