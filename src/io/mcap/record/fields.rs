//! Fields of an MCAP record: little-endian numbers, texts with a length, maps with a length.

use std::collections::BTreeMap;

/// A record's body, read from front to back. Every length is checked against what is there.
#[derive(Debug, Clone, Copy)]
pub struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    /// Starts at the front of a record's body.
    #[must_use]
    pub fn new(body: &'a [u8]) -> Self {
        Self { rest: body }
    }

    /// What has not been read yet.
    #[must_use]
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// The next bytes.
    pub fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*taken)
    }

    /// A number of 16 bits.
    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    /// A number of 32 bits.
    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    /// A number of 64 bits.
    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// Bytes behind a length of 32 bits.
    pub fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(usize::try_from(length).ok()?)
    }

    /// Text behind a length of 32 bits. Bytes that are not UTF-8 are replaced.
    pub fn text(&mut self) -> Option<String> {
        self.bytes()
            .map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }

    /// Pairs of texts behind the length of all of them in bytes.
    pub fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let mut inside = Self::new(self.bytes()?);
        let mut pairs = BTreeMap::new();
        while !inside.rest.is_empty() {
            let key = inside.text()?;
            pairs.insert(key, inside.text()?);
        }
        Some(pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_texts_and_maps_are_read_in_order() {
        let body = b"\x02\x01\x03\0\0\0abc\x0a\0\0\0\x01\0\0\0k\x01\0\0\0v!";
        let mut fields = Fields::new(body);
        assert_eq!(fields.u16(), Some(0x0102));
        assert_eq!(fields.text().as_deref(), Some("abc"));
        let map = fields.map().unwrap();
        assert_eq!(map.get("k").map(String::as_str), Some("v"));
        assert_eq!(fields.rest(), b"!");
    }

    #[test]
    fn a_length_beyond_the_end_is_refused() {
        assert_eq!(Fields::new(b"\xff\xff\xff\xff abc").bytes(), None);
        assert_eq!(Fields::new(b"\x09\0\0\0\x01\0\0\0k").map(), None);
        assert_eq!(Fields::new(b"\x01").u16(), None);
    }
}
