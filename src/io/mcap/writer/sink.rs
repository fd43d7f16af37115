//! Output of records with byte count and checksum.

use std::io::{self, Cursor, Write};

use binrw::{BinWrite, Endian};

/// The body of a record.
pub(super) fn body<T>(record: &T) -> io::Result<Vec<u8>>
where
    T: for<'a> BinWrite<Args<'a> = ()>,
{
    let mut bytes = Cursor::new(Vec::new());
    let written = record.write_options(&mut bytes, Endian::Little, ());
    written.map_err(io::Error::other)?;
    Ok(bytes.into_inner())
}

/// Appends a record: opcode, length and body.
pub(super) fn push_record(records: &mut Vec<u8>, op: u8, body: &[u8]) {
    records.push(op);
    records.extend_from_slice(&(body.len() as u64).to_le_bytes());
    records.extend_from_slice(body);
}

/// An output that keeps track of its offset.
pub(super) struct RecordSink<W> {
    out: W,
    offset: u64,
    crc: crc32fast::Hasher,
}

impl<W: Write> RecordSink<W> {
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

    /// Checksum of the bytes written since the last call.
    pub fn take_crc(&mut self) -> u32 {
        std::mem::take(&mut self.crc).finalize()
    }

    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.out.write_all(bytes)?;
        self.crc.update(bytes);
        self.offset += bytes.len() as u64;
        Ok(())
    }

    pub fn record(&mut self, op: u8, body: &[u8]) -> io::Result<()> {
        self.write(&[op])?;
        self.write(&(body.len() as u64).to_le_bytes())?;
        self.write(body)
    }

    /// Returns the output, flushed.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}
