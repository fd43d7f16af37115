//! Record fields that `mcap` cannot read: of truncated records, and texts that are not UTF-8.

/// A sequential reader of a record's body. Every length is checked against the available bytes.
#[derive(Clone, Copy)]
pub(super) struct RecordFields<'a> {
    pub rest: &'a [u8],
}

impl<'a> RecordFields<'a> {
    pub fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*taken)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// Bytes after a 32-bit length.
    pub fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(usize::try_from(length).ok()?)
    }

    /// Text after a length; invalid UTF-8 is replaced.
    pub fn text(&mut self) -> Option<String> {
        let bytes = self.bytes()?;
        Some(String::from_utf8_lossy(bytes).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_beyond_the_end_is_refused() {
        let fields = |rest| RecordFields { rest };
        assert_eq!(fields(b"\xff\xff\xff\xff abc").bytes(), None);
        assert_eq!(fields(b"\x01").u16(), None);
        assert_eq!(fields(b"\x02\0\0\0\xe4x").text().unwrap(), "\u{fffd}x");
    }
}
