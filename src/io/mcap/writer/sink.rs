//! Bytes on their way out, counted and with their checksum.

use std::io::{self, Write};

/// A record's body under construction: little-endian numbers, texts with a length.
#[derive(Debug, Clone, Default)]
pub struct Body(pub Vec<u8>);

impl Body {
    /// A number of 16 bits.
    pub fn u16(&mut self, number: u16) -> &mut Self {
        self.raw(&number.to_le_bytes())
    }

    /// A number of 32 bits.
    pub fn u32(&mut self, number: u32) -> &mut Self {
        self.raw(&number.to_le_bytes())
    }

    /// A number of 64 bits.
    pub fn u64(&mut self, number: u64) -> &mut Self {
        self.raw(&number.to_le_bytes())
    }

    /// Bytes as they are.
    pub fn raw(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.extend_from_slice(bytes);
        self
    }

    /// Bytes behind their length.
    pub fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(length(bytes)).raw(bytes)
    }

    /// Pairs of texts behind the length of all of them.
    pub fn map<'a>(&mut self, pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> &mut Self {
        let mut inside = Self::default();
        for (key, value) in pairs {
            inside.bytes(key.as_bytes()).bytes(value.as_bytes());
        }
        self.bytes(&inside.0)
    }

    /// Appends a record: opcode, length and body.
    pub fn record(&mut self, op: u8, body: &[u8]) -> &mut Self {
        self.raw(&[op]).u64(body.len() as u64).raw(body)
    }
}

/// Length as MCAP writes it; what is longer than 4 GiB has been refused before.
fn length(bytes: &[u8]) -> u32 {
    u32::try_from(bytes.len()).unwrap_or(u32::MAX)
}

/// An output that knows how far it is.
pub struct Sink<W> {
    out: W,
    offset: u64,
    crc: crc32fast::Hasher,
}

impl<W: Write> Sink<W> {
    /// Starts at the front.
    pub fn new(out: W) -> Self {
        Self {
            out,
            offset: 0,
            crc: crc32fast::Hasher::new(),
        }
    }

    /// Bytes written so far.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Checksum of what was written since the last call.
    pub fn take_crc(&mut self) -> u32 {
        std::mem::take(&mut self.crc).finalize()
    }

    /// Writes bytes.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.out.write_all(bytes)?;
        self.crc.update(bytes);
        self.offset += bytes.len() as u64;
        Ok(())
    }

    /// Writes a record.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn record(&mut self, op: u8, body: &[u8]) -> io::Result<()> {
        self.write(&[op])?;
        self.write(&(body.len() as u64).to_le_bytes())?;
        self.write(body)
    }

    /// Gives the output back, flushed.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}
