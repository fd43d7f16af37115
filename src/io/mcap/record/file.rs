//! Sequential top-level records of a file, with chunks as stored.

use std::sync::atomic::{AtomicU64, Ordering};

use mcap::MAGIC;
use mcap::records::op;
use thiserror::Error;

use super::chunk::{self, ChunkError};
use super::input::CountedInput;
use super::{RECORD_HEAD, record_head};
use crate::failure::{ErrorCode, Failure};
use crate::io::Input;
use crate::warning::WarningCode;

/// Longest record read into memory; attachments may be longer, as they are skipped.
const LONGEST: u64 = chunk::LARGEST;
/// The same for metadata, schemas and channels, of which whole lists are kept.
static LONGEST_METADATA: AtomicU64 = AtomicU64::new(64 << 20);
/// Number of bytes of an attachment that are read, for its names.
const ATTACHMENT_FRONT: u64 = 1 << 16;
/// Size of an end record.
pub(crate) const FOOTER: usize = RECORD_HEAD + 20;
/// First reserved opcode without meaning in any version of the format, below the private ones.
const FIRST_RESERVED: u8 = 0x10;
const FIRST_PRIVATE: u8 = 0x80;
/// Number of losses kept individually.
const LOSSES_KEPT: usize = 20;
/// End of a file truncated within an attachment.
pub(crate) const IN_ATTACHMENT: &str = "within an attachment";

/// Sets the limit for metadata, schemas and channels, for all files from now on.
pub(crate) fn limit_metadata(bytes: u64) {
    LONGEST_METADATA.store(bytes.min(LONGEST), Ordering::Relaxed);
}

/// Longest record of a kind that is read into memory.
pub(crate) fn longest(op: u8) -> u64 {
    match op {
        op::METADATA | op::SCHEMA | op::CHANNEL => LONGEST_METADATA.load(Ordering::Relaxed),
        _ => LONGEST,
    }
}

/// Lost data.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum Loss {
    /// The file ends before its end record.
    #[error(
        "the file ends {what}, without its end record; everything complete up to byte {at} was read"
    )]
    Truncated {
        /// Offset after the last complete record.
        at: u64,
        /// Where it ends.
        what: &'static str,
    },
    /// A damaged chunk that was dropped.
    #[error("the chunk at byte {at} was skipped: {why}{}", log_times(*.span_ns))]
    Chunk {
        /// Its offset.
        at: u64,
        why: ChunkError,
        /// Range of log times that it claims, in ns.
        span_ns: Option<(u64, u64)>,
    },
    /// A record within a chunk that runs past its end.
    #[error(
        "a record in the chunk at byte {at} runs past the end of the chunk; the rest of the chunk was skipped"
    )]
    Overrun {
        /// Offset of the chunk.
        at: u64,
    },
    /// A record of a kind that does not exist, or not in this place.
    #[error("{}", unknown(*.at, *.op, *.is_nested))]
    Unknown {
        /// Offset of the record, or of the chunk that contains it.
        at: u64,
        op: u8,
        /// Whether it is in a chunk.
        is_nested: bool,
    },
    /// An unreadable schema, channel or summary entry.
    #[error("a record at byte {at} (opcode 0x{op:02x}) cannot be read: what it declares is lost")]
    Unreadable {
        /// Offset of the record, or of the chunk that contains it.
        at: u64,
        op: u8,
    },
    /// A message index that does not follow a chunk.
    #[error("the index of messages at byte {at} follows no chunk: the chunk before it is lost")]
    LoneIndex {
        /// Its offset.
        at: u64,
    },
    /// An end record before the end of the file.
    #[error("the end record at byte {at} does not end the file: it was ignored")]
    EarlyEnd {
        /// Its offset.
        at: u64,
    },
    /// Checksum mismatch for a part of the file.
    #[error(
        "the CRC of the data section is {found:08x} instead of {told:08x}: bytes of the file are damaged"
    )]
    Checksum { told: u32, found: u32 },
    /// Messages of channels not declared before them.
    #[error("messages of channels not declared before them, skipped: {messages}")]
    Undeclared { messages: u64 },
    /// Chunks listed in the index at the end of the file, but missing.
    #[error("chunks listed in the file's index but missing: {chunks}, the first at byte {at}")]
    MissingChunks {
        /// Expected offset of the first of them.
        at: u64,
        chunks: u64,
    },
    /// A count that differs from the statistics at the end of the file.
    #[error("the file declares {told} {what}, but contains {found}")]
    Count {
        what: &'static str,
        told: u64,
        found: u64,
    },
    /// A record that is implausibly long.
    #[error(
        "the record at byte {at} (opcode 0x{op:02x}) has a declared length of {length} bytes, {}",
        end_of_long(*.length)
    )]
    TooLong {
        /// Its offset.
        at: u64,
        op: u8,
        /// Its claimed length.
        length: u64,
    },
}

impl Loss {
    /// Stable code for warnings.
    pub fn code(&self) -> WarningCode {
        match self {
            Self::Truncated { .. } => WarningCode::McapTruncated,
            Self::Chunk { .. } | Self::Overrun { .. } => WarningCode::McapDamagedChunk,
            Self::TooLong { .. }
            | Self::Unknown { .. }
            | Self::Unreadable { .. }
            | Self::LoneIndex { .. }
            | Self::EarlyEnd { .. } => WarningCode::McapDamagedRecord,
            Self::Checksum { .. } => WarningCode::McapChecksum,
            Self::Undeclared { .. } => WarningCode::McapUnknownChannel,
            Self::MissingChunks { .. } | Self::Count { .. } => WarningCode::McapCount,
        }
    }
}

/// Log times that a chunk claims, after the text about it.
fn log_times(span_ns: Option<(u64, u64)>) -> String {
    span_ns.map_or_else(String::new, |(start, end)| {
        format!(" (log times {start} ns to {end} ns)")
    })
}

/// What became of a record of such a length.
fn end_of_long(length: u64) -> &'static str {
    match length > LONGEST {
        true => "more than any record; nothing after it could be read",
        false => "and was skipped; --longest-metadata reads longer ones",
    }
}

/// A record of unknown kind in a message.
fn unknown(at: u64, op: u8, is_nested: bool) -> String {
    match is_nested {
        false => format!(
            "the record at byte {at} has the opcode 0x{op:02x}, which is not defined: its content is lost"
        ),
        true => format!(
            "a record in the chunk at byte {at} has the opcode 0x{op:02x}, which is not allowed in a chunk: its \
             content is lost"
        ),
    }
}

/// Data lost so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Losses {
    /// The first ones.
    pub first: Vec<Loss>,
    pub count: usize,
}

impl Losses {
    pub fn add(&mut self, loss: Loss) {
        self.count += 1;
        if self.first.len() < LOSSES_KEPT {
            self.first.push(loss);
        }
    }
}

/// A record of the file; its bytes are kept until the next one is requested.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FileRecord {
    pub op: u8,
    /// Its offset in the file.
    pub offset: u64,
    /// Whether it is complete. Only chunks are returned otherwise.
    pub is_whole: bool,
}

/// Records of a file. Damage to its content is not an error, but reported in the losses.
pub(crate) struct FileReader {
    name: String,
    input: CountedInput,
    /// Number of bytes of the current record in the window.
    held: usize,
    /// Number of bytes of the current record after those, for attachments.
    behind: u64,
    pub is_ended: bool,
    /// Whether the end record was found.
    pub is_closed: bool,
    pub losses: Losses,
    /// CRC of all bytes before the current record.
    crc: crc32fast::Hasher,
}

impl FileReader {
    /// Opens a file and checks that it is MCAP.
    ///
    /// # Errors
    /// If it cannot be read, or does not begin like an MCAP file.
    pub fn open(input: &Input) -> Result<Self, Failure> {
        Self::new(input.name(), CountedInput::new(input.open()?))
    }

    /// Reads from a stream.
    ///
    /// # Errors
    /// If it does not begin like an MCAP file.
    pub fn new(name: String, input: CountedInput) -> Result<Self, Failure> {
        let mut file = Self {
            name,
            input,
            held: 0,
            behind: 0,
            is_ended: false,
            is_closed: false,
            losses: Losses::default(),
            crc: crc32fast::Hasher::new(),
        };
        file.held = file.want(MAGIC.len())?;
        if file.bytes() != MAGIC {
            return Err(ErrorCode::NotARecording
                .failed(
                    "not an MCAP file: it does not begin with the bytes 89 4d 43 41 50 30 0d 0a; \
                     record with a recorder that writes MCAP, or convert the file first",
                )
                .at(&file.name));
        }
        Ok(file)
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// The current record with opcode and length; for an attachment only its header.
    pub fn bytes(&self) -> &[u8] {
        &self.input.window()[..self.held]
    }

    /// The body of the current record; for an attachment only its header.
    pub fn body(&self) -> &[u8] {
        self.bytes().get(RECORD_HEAD..).unwrap_or(&[])
    }

    /// The next record, or `None` at the end.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn next(&mut self) -> Result<Option<FileRecord>, Failure> {
        self.skip()?;
        if self.is_ended {
            return Ok(None);
        }
        let offset = self.input.offset();
        let there = self.want(RECORD_HEAD)?;
        let Some((op, length)) = record_head(&self.input.window()[..there]) else {
            let what = match there {
                0 => "after a whole record",
                _ => "within a record",
            };
            return Ok(self.truncated(offset, what));
        };
        let is_attachment = op == op::ATTACHMENT;
        // A recorder that was stopped leaves its last chunk without a length.
        if length > longest(op) && !is_attachment && op != op::CHUNK {
            let at = offset;
            self.losses.add(Loss::TooLong { at, op, length });
            if length > LONGEST {
                self.is_ended = true;
                return Ok(None);
            }
            (self.held, self.behind) = (RECORD_HEAD, length);
            return self.next();
        }
        let most = if is_attachment {
            ATTACHMENT_FRONT
        } else {
            LONGEST
        };
        let whole = RECORD_HEAD + length.min(most) as usize;
        self.held = self.want(whole)?;
        let is_whole = self.held == whole && (is_attachment || length <= most);
        match op {
            op::ATTACHMENT if is_whole => self.behind = length - length.min(most),
            op::ATTACHMENT => return Ok(self.truncated(offset, IN_ATTACHMENT)),
            op::CHUNK if !is_whole => drop(self.truncated(offset, "within a chunk")),
            _ if !is_whole => return Ok(self.truncated(offset, "within a record")),
            op::FOOTER if self.is_at_end(whole)? => {
                self.is_closed = true;
                self.is_ended = true;
                return Ok(None);
            }
            op::FOOTER => self.losses.add(Loss::EarlyEnd { at: offset }),
            op::DATA_END => self.check_data(),
            0 | FIRST_RESERVED..FIRST_PRIVATE => self.losses.add(Loss::Unknown {
                at: offset,
                op,
                is_nested: false,
            }),
            _ => {}
        }
        Ok(Some(FileRecord {
            op,
            offset,
            is_whole,
        }))
    }

    /// Whether an end record of this size is the last of the file.
    fn is_at_end(&mut self, whole: usize) -> Result<bool, Failure> {
        let end = whole + MAGIC.len();
        let there = self.want(end + 1)?;
        let behind = &self.input.window()[whole.min(there)..there];
        // A file truncated within its last bytes has lost nothing.
        Ok(whole == FOOTER && MAGIC.starts_with(behind))
    }

    /// Compares the CRC of everything before the data-end record with the stored one.
    fn check_data(&mut self) {
        let Some(told) = self
            .body()
            .first_chunk()
            .map(|told| u32::from_le_bytes(*told))
        else {
            return;
        };
        let found = self.crc.clone().finalize();
        // Damage may be known already.
        if told != 0 && told != found && self.losses.count == 0 {
            self.losses.add(Loss::Checksum { told, found });
        }
    }

    /// Skips the current record; `false` if the file ends within it.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn skip(&mut self) -> Result<bool, Failure> {
        self.copy(|_| Ok(()))
    }

    /// Passes all bytes of the current record to `write`; `false` if the file ends within it.
    ///
    /// # Errors
    /// If the file cannot be read, or those of `write`.
    pub fn copy(
        &mut self,
        mut write: impl FnMut(&[u8]) -> Result<(), Failure>,
    ) -> Result<bool, Failure> {
        let at = self.input.offset();
        write(self.bytes())?;
        self.crc.update(&self.input.window()[..self.held]);
        self.input.used(std::mem::take(&mut self.held));
        while self.behind > 0 {
            let step = self.behind.min(ATTACHMENT_FRONT) as usize;
            let there = self.want(step)?;
            write(&self.input.window()[..there])?;
            self.crc.update(&self.input.window()[..there]);
            self.input.used(there);
            self.behind -= there as u64;
            if there < step {
                self.behind = 0;
                self.truncated(at, IN_ATTACHMENT);
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn truncated(&mut self, at: u64, what: &'static str) -> Option<FileRecord> {
        self.is_ended = true;
        self.losses.add(Loss::Truncated { at, what });
        None
    }

    fn want(&mut self, count: usize) -> Result<usize, Failure> {
        let there = self.input.want(count);
        there.map_err(|error| Failure::unreadable(&error).at(&self.name))
    }
}
