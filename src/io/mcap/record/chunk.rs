//! Chunks: grouped records, usually compressed.
//!
//! The bytes are decompressed into a buffer that grows with the actual output; a long chunk is read piece by
//! piece.

use std::io::{self, BufRead, Read, Write};

use lz4_flex::frame::{BlockMode, BlockSize, FrameDecoder, FrameEncoder, FrameInfo};
use mcap::records::ChunkHeader;
use thiserror::Error;

use super::fields::RecordFields;

/// Maximum decompressed size of a chunk.
pub(crate) const LARGEST: u64 = 1 << 30;

/// Decompressed size above which a chunk is read piece by piece.
const LONG: u64 = 1 << 25;

/// Growth of the buffer during decompression, in bytes.
pub(super) const STEP: usize = 1 << 18;

/// Parses the header of a chunk record; the remainder are its records as stored in the file.
/// `mcap::parse_record` rejects a truncated chunk entirely.
pub(crate) fn chunk_front(body: &[u8]) -> Option<(ChunkHeader, &[u8])> {
    let mut fields = RecordFields { rest: body };
    let header = ChunkHeader {
        message_start_time: fields.u64()?,
        message_end_time: fields.u64()?,
        uncompressed_size: fields.u64()?,
        uncompressed_crc: fields.u32()?,
        compression: fields.text()?,
        compressed_size: fields.u64()?,
    };
    Some((header, fields.rest))
}

/// A fault of a chunk.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum ChunkError {
    /// Unreadable header.
    #[error("its header cannot be read")]
    Head,
    /// Unknown compression.
    #[error("unknown compression \"{0}\"; expected \"zstd\", \"lz4\" or none")]
    Compression(String),
    /// Decompressed size above [`LARGEST`], actual or claimed.
    #[error("it decompresses to {0} bytes, the maximum is {LARGEST}")]
    TooLarge(u64),
    /// Damaged compressed data.
    #[error("it cannot be decompressed ({0})")]
    Damaged(String),
    /// Decompressed length differs from the claimed one.
    #[error("it decompresses to {found} bytes instead of {told}")]
    Length {
        /// Claimed length.
        told: u64,
        /// Actual length.
        found: u64,
    },
    /// Checksum mismatch.
    #[error("its CRC is {found:08x} instead of {told:08x}: the bytes are damaged")]
    Crc {
        /// Stored checksum.
        told: u32,
        /// Computed checksum.
        found: u32,
    },
}

/// Location of a chunk's records after decompression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum UnpackedChunk {
    /// In the buffer.
    Buffer,
    /// In the file as stored: this many bytes after the header.
    InPlace(usize),
}

impl UnpackedChunk {
    /// The records, from the remainder or the buffer.
    pub fn records<'a>(self, rest: &'a [u8], buffer: &'a [u8]) -> &'a [u8] {
        match self {
            Self::Buffer => buffer,
            Self::InPlace(length) => &rest[..length],
        }
    }
}

/// Decompresses a whole chunk after its header, into `records` if it is compressed, and checks its
/// length and its CRC.
///
/// # Errors
/// [`ChunkError`] if any of them is wrong; `records` must then be ignored.
pub(crate) fn unpack(
    front: Option<&(ChunkHeader, &[u8])>,
    records: &mut Vec<u8>,
) -> Result<UnpackedChunk, ChunkError> {
    let (header, packed) = packed(front)?;
    if header.compression.is_empty() {
        check(header, packed)?;
        return Ok(UnpackedChunk::InPlace(packed.len()));
    }
    if header.uncompressed_size > LARGEST {
        return Err(ChunkError::TooLarge(header.uncompressed_size));
    }
    unpack_part(header, packed, records)?;
    check(header, records)?;
    Ok(UnpackedChunk::Buffer)
}

/// The header of a chunk and its bytes as stored in the file.
fn packed<'a>(
    front: Option<&'a (ChunkHeader, &'a [u8])>,
) -> Result<(&'a ChunkHeader, &'a [u8]), ChunkError> {
    let (header, rest) = front.ok_or(ChunkError::Head)?;
    let size = usize::try_from(header.compressed_size).ok();
    match size.and_then(|size| rest.get(..size)) {
        Some(packed) => Ok((header, packed)),
        None => Err(ChunkError::Length {
            told: header.compressed_size,
            found: rest.len() as u64,
        }),
    }
}

/// Whether a chunk's decompressed size requires [`records_of_long`].
pub(crate) fn is_long(header: &ChunkHeader) -> bool {
    !header.compression.is_empty() && (LONG + 1..=LARGEST).contains(&header.uncompressed_size)
}

/// The records of a long chunk, decompressed on the fly. Length and CRC of a complete chunk are checked first.
///
/// # Errors
/// As for [`unpack`].
pub(crate) fn records_of_long(
    front: Option<&(ChunkHeader, &[u8])>,
    is_whole: bool,
) -> Result<Box<dyn Read + Send>, ChunkError> {
    let (header, bytes) = match (is_whole, front) {
        (false, Some((header, cut))) => (header, *cut),
        _ => packed(front)?,
    };
    if is_whole {
        let mut input = decoder(&header.compression, bytes)?.take(header.uncompressed_size + 1);
        let (mut piece, mut found) = (vec![0; STEP], 0);
        let mut crc = crc32fast::Hasher::new();
        loop {
            let read = input.read(&mut piece);
            match read.map_err(|error| ChunkError::Damaged(error.to_string()))? {
                0 => break,
                count => {
                    crc.update(&piece[..count]);
                    found += count as u64;
                }
            }
        }
        compare(header, found, || crc.finalize())?;
    }
    decoder(&header.compression, io::Cursor::new(bytes.to_vec()))
}

fn check(header: &ChunkHeader, records: &[u8]) -> Result<(), ChunkError> {
    compare(header, records.len() as u64, || crc32fast::hash(records))
}

/// Compares the output with the header's claims.
fn compare(header: &ChunkHeader, found: u64, crc: impl FnOnce() -> u32) -> Result<(), ChunkError> {
    let told = header.uncompressed_size;
    if found != told {
        return Err(ChunkError::Length { told, found });
    }
    let (told, found) = (header.uncompressed_crc, crc());
    if told != 0 && told != found {
        return Err(ChunkError::Crc { told, found });
    }
    Ok(())
}

/// Decompresses as much as there is, also of a truncated chunk.
///
/// # Errors
/// [`ChunkError`] if the rest cannot be decompressed; `records` contains the output up to there.
pub(crate) fn unpack_part(
    head: &ChunkHeader,
    packed: &[u8],
    records: &mut Vec<u8>,
) -> Result<(), ChunkError> {
    records.clear();
    let limit = head.uncompressed_size.min(LARGEST);
    if head.compression.is_empty() {
        records.extend_from_slice(packed);
        return Ok(());
    }
    drain(decoder(&head.compression, packed)?, limit, records)
}

/// A decompressor.
fn decoder<'a>(
    compression: &str,
    packed: impl BufRead + Send + 'a,
) -> Result<Box<dyn Read + Send + 'a>, ChunkError> {
    match compression {
        "zstd" => match zstd::stream::read::Decoder::with_buffer(packed) {
            Ok(decoder) => Ok(Box::new(decoder)),
            Err(error) => Err(ChunkError::Damaged(error.to_string())),
        },
        "lz4" => Ok(Box::new(FrameDecoder::new(packed))),
        name => Err(ChunkError::Compression(name.to_owned())),
    }
}

/// Reads to the end, but at most one byte beyond the limit.
fn drain(mut input: impl Read, limit: u64, records: &mut Vec<u8>) -> Result<(), ChunkError> {
    let limit = usize::try_from(limit).unwrap_or(usize::MAX);
    let mut filled = 0;
    loop {
        if filled == records.len() {
            // Doubling keeps the work proportional to the data; the claimed size is only an upper
            // bound.
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

/// Compresses records with `zstd`, `lz4` or not at all.
pub(crate) fn pack(compression: &str, records: &[u8]) -> io::Result<Vec<u8>> {
    match compression {
        "zstd" => zstd::stream::encode_all(records, zstd::DEFAULT_COMPRESSION_LEVEL),
        "lz4" => {
            // Whole blocks of a truncated chunk can be decompressed, as they are small.
            let frame = FrameInfo::new()
                .block_size(BlockSize::Max64KB)
                .block_mode(BlockMode::Linked)
                .content_checksum(true);
            let mut encoder = FrameEncoder::with_frame_info(frame, Vec::new());
            encoder.write_all(records)?;
            encoder.finish().map_err(io::Error::other)
        }
        _ => Ok(records.to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(compression: &str, size: u64, crc: u32) -> ChunkHeader {
        ChunkHeader {
            message_start_time: 0,
            message_end_time: 0,
            uncompressed_size: size,
            uncompressed_crc: crc,
            compression: compression.to_owned(),
            compressed_size: 0,
        }
    }

    fn unpack(
        mut header: ChunkHeader,
        packed: &[u8],
        records: &mut Vec<u8>,
    ) -> Result<UnpackedChunk, ChunkError> {
        header.compressed_size = packed.len() as u64;
        super::unpack(Some(&(header, packed)), records)
    }

    fn text() -> Vec<u8> {
        (0..700_000_u32)
            .flat_map(|i| (i / 7).to_le_bytes())
            .collect()
    }

    #[test]
    fn every_compression_gives_the_bytes_back() {
        let plain = text();
        let crc = crc32fast::hash(&plain);
        for compression in ["", "zstd", "lz4"] {
            let mut records = vec![1, 2, 3];
            let bytes = pack(compression, &plain).unwrap();
            let unpacked = unpack(
                head(compression, plain.len() as u64, crc),
                &bytes,
                &mut records,
            )
            .unwrap();
            let records = unpacked.records(&bytes, &records);
            assert!(records == plain, "{compression}");
        }
    }

    #[test]
    fn a_wrong_checksum_or_length_is_said() {
        let plain = text();
        let size = plain.len() as u64;
        let mut records = Vec::new();
        let wrong = unpack(head("", size, 1), &plain, &mut records);
        assert!(matches!(wrong, Err(ChunkError::Crc { told: 1, .. })));
        for compression in ["zstd", "lz4"] {
            let bytes = pack(compression, &plain).unwrap();
            let short = unpack(head(compression, size + 1, 0), &bytes, &mut records);
            assert!(matches!(short, Err(ChunkError::Length { .. })), "{short:?}");
            let long = unpack(head(compression, 1000, 0), &bytes, &mut records);
            assert!(matches!(long, Err(ChunkError::Length { told: 1000, .. })));
            assert!(records.len() <= 1001, "no more is unpacked than was said");
        }
    }

    #[test]
    fn a_huge_claim_allocates_nothing() {
        let mut records = Vec::new();
        let bytes = pack("zstd", b"few bytes").unwrap();
        let said = unpack(head("zstd", LARGEST, 0), &bytes, &mut records);
        assert!(matches!(said, Err(ChunkError::Length { found: 9, .. })));
        assert!(records.capacity() <= 2 * STEP);
        let said = unpack(head("zstd", u64::MAX, 0), &bytes, &mut records);
        assert_eq!(said, Err(ChunkError::TooLarge(u64::MAX)));
    }

    #[test]
    fn a_cut_chunk_gives_what_is_whole() {
        let plain = text();
        for compression in ["zstd", "lz4"] {
            let bytes = pack(compression, &plain).unwrap();
            let mut records = Vec::new();
            let cut = &bytes[..bytes.len() / 2];
            let error = unpack_part(&head(compression, plain.len() as u64, 0), cut, &mut records);
            assert!(error.is_err() || records.len() < plain.len());
            assert!(records.len() > 200_000, "{compression}: {}", records.len());
            assert!(records == plain[..records.len()], "{compression}");
        }
    }
}
