//! A chunk: records put together, mostly compressed.
//!
//! The crate `mcap` has readers of its own. They allocate what a chunk or record claims to need,
//! give nothing of a chunk that is cut off, and cannot go on behind a damaged one; so the bytes
//! are unpacked here, into a buffer that grows by what really comes out.

use std::fmt;
use std::io::Read;

use super::fields::Fields;

/// Most bytes a chunk may unpack to.
pub const LARGEST: u64 = 1 << 30;

/// Bytes that the buffer grows by while unpacking.
const STEP: usize = 1 << 18;

/// The front of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkHead {
    /// Earliest log time in it, in ns.
    pub start_ns: u64,
    /// Latest log time in it, in ns.
    pub end_ns: u64,
    /// Bytes of its records, unpacked.
    pub size: u64,
    /// CRC-32 of its records, unpacked; 0 if the writer left it out.
    pub crc: u32,
    /// Name of the compression, empty for none.
    pub compression: String,
    /// Bytes of its records as they are in the file.
    pub packed_size: u64,
}

impl ChunkHead {
    /// Reads the front of a chunk record; what follows are the records.
    #[must_use]
    pub fn read(body: &[u8]) -> Option<(Self, &[u8])> {
        let mut fields = Fields::new(body);
        let head = Self {
            start_ns: fields.u64()?,
            end_ns: fields.u64()?,
            size: fields.u64()?,
            crc: fields.u32()?,
            compression: fields.text()?,
            packed_size: fields.u64()?,
        };
        Some((head, fields.rest()))
    }
}

/// What is wrong with a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChunkError {
    /// The front cannot be read.
    Head,
    /// A compression that is not known.
    Compression(String),
    /// It unpacks to more than [`LARGEST`], or says so.
    TooLarge(u64),
    /// The compressed bytes are damaged.
    Damaged(String),
    /// It unpacks to another length than it says.
    Length {
        /// What it says.
        told: u64,
        /// What came out.
        found: u64,
    },
    /// The checksum does not fit.
    Crc {
        /// What it says.
        told: u32,
        /// What it is.
        found: u32,
    },
}

impl fmt::Display for ChunkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Head => f.write_str("its front cannot be read"),
            Self::Compression(name) => write!(
                f,
                "its compression \"{name}\" is not known; expected \"zstd\", \"lz4\" or none"
            ),
            Self::TooLarge(size) => {
                write!(f, "it unpacks to {size} bytes, {LARGEST} are read at most")
            }
            Self::Damaged(why) => write!(f, "it cannot be unpacked ({why})"),
            Self::Length { told, found } => {
                write!(f, "it unpacks to {found} bytes instead of {told}")
            }
            Self::Crc { told, found } => write!(
                f,
                "its CRC is {found:08x} instead of {told:08x}: the bytes are damaged"
            ),
        }
    }
}

/// Unpacks a whole chunk into `records` and checks its length and its CRC.
///
/// # Errors
/// [`ChunkError`] if any of them is wrong; `records` then holds what came out until there.
pub fn unpack(head: &ChunkHead, packed: &[u8], records: &mut Vec<u8>) -> Result<(), ChunkError> {
    if head.size > LARGEST {
        return Err(ChunkError::TooLarge(head.size));
    }
    unpack_bytes(head, packed, records)?;
    check(head, records)
}

/// Checks length and CRC of the records of a chunk.
///
/// # Errors
/// [`ChunkError`] if one of them is wrong.
pub fn check(head: &ChunkHead, records: &[u8]) -> Result<(), ChunkError> {
    let found = records.len() as u64;
    if found != head.size {
        let told = head.size;
        return Err(ChunkError::Length { told, found });
    }
    let found = crc32fast::hash(records);
    if head.crc != 0 && head.crc != found {
        let told = head.crc;
        return Err(ChunkError::Crc { told, found });
    }
    Ok(())
}

/// Unpacks as much as there is of a chunk that is cut off: the records that came out whole.
pub fn unpack_part(head: &ChunkHead, packed: &[u8], records: &mut Vec<u8>) -> Option<ChunkError> {
    unpack_bytes(head, packed, records).err()
}

fn unpack_bytes(head: &ChunkHead, packed: &[u8], records: &mut Vec<u8>) -> Result<(), ChunkError> {
    records.clear();
    let limit = head.size.min(LARGEST);
    let damaged = |error: std::io::Error| ChunkError::Damaged(error.to_string());
    match head.compression.as_str() {
        "" => {
            records.extend_from_slice(packed);
            Ok(())
        }
        "zstd" => {
            let input = zstd::stream::read::Decoder::with_buffer(packed).map_err(damaged)?;
            drain(input, limit, records)
        }
        "lz4" => drain(lz4::Decoder::new(packed).map_err(damaged)?, limit, records),
        name => Err(ChunkError::Compression(name.to_owned())),
    }
}

/// Reads to the end, but no further than one byte past the limit.
fn drain(mut input: impl Read, limit: u64, records: &mut Vec<u8>) -> Result<(), ChunkError> {
    let limit = usize::try_from(limit).unwrap_or(usize::MAX);
    let mut filled = 0;
    loop {
        if filled == records.len() {
            // Doubling keeps the work proportional; the claim is only an upper bound.
            let more = (records.len() + STEP).max(2 * records.len()).min(limit);
            records.resize(more.max(filled + 1), 0);
        }
        match input.read(&mut records[filled..]) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) => {
                records.truncate(filled);
                return Err(ChunkError::Damaged(error.to_string()));
            }
        }
        if filled > limit {
            break;
        }
    }
    records.truncate(filled);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(compression: &str, size: u64, crc: u32) -> ChunkHead {
        ChunkHead {
            start_ns: 0,
            end_ns: 0,
            size,
            crc,
            compression: compression.to_owned(),
            packed_size: 0,
        }
    }

    fn text() -> Vec<u8> {
        (0..700_000_u32)
            .flat_map(|i| (i / 7).to_le_bytes())
            .collect()
    }

    fn packed(compression: &str, plain: &[u8]) -> Vec<u8> {
        match compression {
            "zstd" => zstd::stream::encode_all(plain, 3).unwrap(),
            "lz4" => {
                let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
                std::io::Write::write_all(&mut encoder, plain).unwrap();
                encoder.finish().0
            }
            _ => plain.to_vec(),
        }
    }

    #[test]
    fn every_compression_gives_the_bytes_back() {
        let plain = text();
        let crc = crc32fast::hash(&plain);
        for compression in ["", "zstd", "lz4"] {
            let mut records = vec![1, 2, 3];
            let bytes = packed(compression, &plain);
            unpack(
                &head(compression, plain.len() as u64, crc),
                &bytes,
                &mut records,
            )
            .unwrap();
            assert!(records == plain, "{compression}");
        }
    }

    #[test]
    fn a_wrong_checksum_or_length_is_said() {
        let plain = text();
        let size = plain.len() as u64;
        let mut records = Vec::new();
        let wrong = unpack(&head("", size, 1), &plain, &mut records);
        assert!(matches!(wrong, Err(ChunkError::Crc { told: 1, .. })));
        for compression in ["zstd", "lz4"] {
            let bytes = packed(compression, &plain);
            let short = unpack(&head(compression, size + 1, 0), &bytes, &mut records);
            assert!(matches!(short, Err(ChunkError::Length { .. })), "{short:?}");
            let long = unpack(&head(compression, 1000, 0), &bytes, &mut records);
            assert!(matches!(long, Err(ChunkError::Length { told: 1000, .. })));
            assert!(records.len() <= 1001, "no more is unpacked than was said");
        }
    }

    #[test]
    fn a_huge_claim_allocates_nothing() {
        let mut records = Vec::new();
        let bytes = packed("zstd", b"few bytes");
        let said = unpack(&head("zstd", LARGEST, 0), &bytes, &mut records);
        assert!(matches!(said, Err(ChunkError::Length { found: 9, .. })));
        assert!(records.capacity() <= 2 * STEP);
        let said = unpack(&head("zstd", u64::MAX, 0), &bytes, &mut records);
        assert_eq!(said, Err(ChunkError::TooLarge(u64::MAX)));
    }

    #[test]
    fn a_cut_chunk_gives_what_is_whole() {
        let plain = text();
        for compression in ["zstd", "lz4"] {
            let bytes = packed(compression, &plain);
            let mut records = Vec::new();
            let cut = &bytes[..bytes.len() / 2];
            let error = unpack_part(&head(compression, plain.len() as u64, 0), cut, &mut records);
            assert!(error.is_some() || records.len() < plain.len());
            assert!(records.len() > 200_000, "{compression}: {}", records.len());
            assert!(records == plain[..records.len()], "{compression}");
        }
    }
}
