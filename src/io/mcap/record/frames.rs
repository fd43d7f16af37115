//! The records of an MCAP file one after the other, those in chunks included.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

use mcap::MAGIC;
use mcap::records::op;

use super::chunk::{self, ChunkError, ChunkHead};
use super::input::CountedInput;
use crate::failure::Failure;
use crate::io::Input;

/// Bytes of a record's opcode and length.
const RECORD_HEAD: usize = 9;
/// Longest record that is taken into memory; attachments may be longer, they are passed over.
const LONGEST: u64 = chunk::LARGEST;
/// Bytes of an attachment that are looked at: its names.
const ATTACHMENT_FRONT: u64 = 1 << 16;
/// Losses that are kept one by one.
const LOSSES_KEPT: usize = 20;

/// Where the bytes of a record are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Holder {
    /// In the window of the file.
    Window,
    /// In the buffer of unpacked chunks.
    Chunk,
}

/// A record: what it is and where its body lies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Opcode.
    pub op: u8,
    /// Byte in the file at which it begins, or at which the chunk begins that it is in.
    pub offset: u64,
    /// Whether the body is only its front, as of attachments.
    pub is_front: bool,
    /// Whether it came out of a chunk.
    pub is_in_chunk: bool,
    holder: Holder,
    body: Range<usize>,
}

/// Data that are lost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Loss {
    /// The file ends before its end record.
    Truncated {
        /// Byte behind the last whole record.
        at: u64,
        /// What was being read.
        what: String,
    },
    /// A chunk is damaged and was left out.
    Chunk {
        /// Byte at which it begins.
        at: u64,
        /// What is wrong.
        why: ChunkError,
        /// Log times in it as it says, in ns.
        span_ns: Option<(u64, u64)>,
    },
    /// A record within a chunk runs past its end.
    Overrun {
        /// Byte at which the chunk begins.
        at: u64,
    },
    /// A record that is too long to be one.
    TooLong {
        /// Byte at which it begins.
        at: u64,
        /// Its opcode.
        op: u8,
        /// Its length as it says.
        length: u64,
    },
}

impl Loss {
    /// Stable code for warnings.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::Truncated { .. } => "mcap-truncated",
            Self::Chunk { .. } | Self::Overrun { .. } => "mcap-damaged-chunk",
            Self::TooLong { .. } => "mcap-damaged-record",
        }
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated { at, what } => write!(
                f,
                "the file ends {what}, without its end record; what is whole up to byte {at} was \
                 read"
            ),
            Self::Chunk { at, why, span_ns } => {
                write!(f, "the chunk at byte {at} was left out: {why}")?;
                match span_ns {
                    Some((start, end)) => {
                        write!(f, " (log times {start} ns to {end} ns)")
                    }
                    None => Ok(()),
                }
            }
            Self::Overrun { at } => write!(
                f,
                "a record in the chunk at byte {at} runs past the end of the chunk; the rest of \
                 the chunk was left out"
            ),
            Self::TooLong { at, op, length } => write!(
                f,
                "the record at byte {at} (opcode 0x{op:02x}) says it is {length} bytes long, more \
                 than any record; nothing behind it could be read"
            ),
        }
    }
}

/// How many chunks of a compression there are, and their bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ChunkCount {
    /// Chunks.
    pub chunks: u64,
    /// Bytes in the file.
    pub packed: u64,
    /// Bytes unpacked, as the chunks say.
    pub unpacked: u64,
}

/// The records of a file.
pub struct Frames {
    name: String,
    input: CountedInput,
    /// Unpacked records of the current chunk.
    chunk: Vec<u8>,
    /// Where they lie in the window instead, of a chunk that is not compressed.
    plain: Option<Range<usize>>,
    /// How far they have been delivered.
    chunk_at: usize,
    chunk_offset: u64,
    /// Bytes of the last frame in the file, passed over when the next is asked for.
    held: usize,
    ended: bool,
    closed: bool,
    losses: Vec<Loss>,
    lost: usize,
    compressions: BTreeMap<String, ChunkCount>,
}

impl Frames {
    /// Opens a file and checks that it is MCAP.
    ///
    /// # Errors
    /// If it cannot be read, or does not begin as an MCAP file does.
    pub fn open(place: &Input) -> Result<Self, Failure> {
        Self::new(place.name(), CountedInput::new(place.open()?))
    }

    /// Reads from bytes that come from elsewhere.
    ///
    /// # Errors
    /// If they do not begin as an MCAP file does.
    pub fn new(name: String, mut input: CountedInput) -> Result<Self, Failure> {
        let there = input.want(MAGIC.len()).map_err(|e| failed(&name, &e))?;
        if input.window()[..there] != *MAGIC {
            return Err(not_mcap(&name));
        }
        input.used(MAGIC.len());
        Ok(Self {
            name,
            input,
            chunk: Vec::new(),
            plain: None,
            chunk_at: 0,
            chunk_offset: 0,
            held: 0,
            ended: false,
            closed: false,
            losses: Vec::new(),
            lost: 0,
            compressions: BTreeMap::new(),
        })
    }

    /// Name of the file, for people.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Data that were lost so far, the first ones.
    #[must_use]
    pub fn losses(&self) -> &[Loss] {
        &self.losses
    }

    /// How often data were lost so far.
    #[must_use]
    pub fn loss_count(&self) -> usize {
        self.lost
    }

    /// Chunks so far, by the name of their compression.
    #[must_use]
    pub fn compressions(&self) -> &BTreeMap<String, ChunkCount> {
        &self.compressions
    }

    /// Whether the end record was found.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// The body of a record, until the next one is asked for.
    #[must_use]
    pub fn body(&self, frame: &Frame) -> &[u8] {
        match frame.holder {
            Holder::Window => self.input.at(frame.body.clone()),
            Holder::Chunk => &self.chunk[frame.body.clone()],
        }
    }

    /// The next record, or none at the end.
    ///
    /// # Errors
    /// If the file cannot be read. Damage to its content is no error: see [`Self::losses`].
    pub fn advance(&mut self) -> Result<Option<Frame>, Failure> {
        loop {
            if let Some(frame) = self.next_in_chunk() {
                return Ok(Some(frame));
            }
            if self.ended {
                return Ok(None);
            }
            if let Some(frame) = self.next_in_file()? {
                return Ok(Some(frame));
            }
        }
    }

    fn next_in_chunk(&mut self) -> Option<Frame> {
        let (holder, bytes, first) = match &self.plain {
            Some(place) => (Holder::Window, self.input.at(place.clone()), place.start),
            None => (Holder::Chunk, self.chunk.as_slice(), 0),
        };
        let all = bytes.len();
        let rest = &bytes[self.chunk_at..];
        if rest.is_empty() {
            return None;
        }
        let whole = record_head(rest)
            .and_then(|(op, length)| Some((op, usize::try_from(length).ok()?)))
            .filter(|(_, length)| *length <= rest.len() - RECORD_HEAD);
        let Some((op, length)) = whole else {
            // The rest of a chunk that was cut off has been reported already.
            if !self.ended {
                let at = self.chunk_offset;
                self.lose(Loss::Overrun { at });
            }
            self.chunk_at = all;
            return None;
        };
        let start = self.chunk_at + RECORD_HEAD;
        self.chunk_at = start + length;
        Some(Frame {
            op,
            offset: self.chunk_offset,
            is_front: false,
            is_in_chunk: true,
            holder,
            body: first + start..first + self.chunk_at,
        })
    }

    fn next_in_file(&mut self) -> Result<Option<Frame>, Failure> {
        self.input.used(std::mem::take(&mut self.held));
        let offset = self.input.offset();
        let there = self.want(RECORD_HEAD)?;
        let Some((op, length)) = record_head(&self.input.window()[..there]) else {
            let what = if there == 0 {
                "after a whole record"
            } else {
                "within a record"
            };
            return Ok(self.truncated(offset, what));
        };
        if op == op::ATTACHMENT {
            return self.attachment(offset, length);
        }
        // A recorder that was stopped leaves its last chunk without a length.
        if length > LONGEST && op != op::CHUNK {
            self.ended = true;
            self.lose(Loss::TooLong {
                at: offset,
                op,
                length,
            });
            return Ok(None);
        }
        self.record(offset, op, length)
    }

    fn record(&mut self, offset: u64, op: u8, told: u64) -> Result<Option<Frame>, Failure> {
        let length = told.min(LONGEST) as usize;
        let there = self.want(RECORD_HEAD + length)?;
        let is_whole = there == RECORD_HEAD + length && told <= LONGEST;
        self.held = there;
        match op {
            op::CHUNK => self.unpack(offset, is_whole),
            _ if !is_whole => {
                self.truncated(offset, "within a record");
            }
            op::FOOTER => {
                self.closed = true;
                self.ended = true;
            }
            _ => {
                return Ok(Some(Frame {
                    op,
                    offset,
                    is_front: false,
                    is_in_chunk: false,
                    holder: Holder::Window,
                    body: self.input.place(RECORD_HEAD, length),
                }));
            }
        }
        Ok(None)
    }

    /// Unpacks the chunk in the window; what it holds is delivered next.
    fn unpack(&mut self, offset: u64, is_whole: bool) {
        let mut records = std::mem::take(&mut self.chunk);
        records.clear();
        self.plain = None;
        let body = &self.input.window()[RECORD_HEAD..self.held.max(RECORD_HEAD)];
        let head = ChunkHead::read(body);
        let front = self.held - head.as_ref().map_or(0, |(_, rest)| rest.len());
        let span_ns = head.as_ref().map(|(head, _)| (head.start_ns, head.end_ns));
        if let Some((head, _)) = &head {
            let count = self.compressions.entry(head.compression.clone());
            let count = count.or_default();
            count.chunks += 1;
            count.packed = count.packed.saturating_add(head.packed_size);
            count.unpacked = count.unpacked.saturating_add(head.size);
        }
        if is_whole {
            match unpack_whole(head, &mut records) {
                Ok(None) => {}
                Ok(Some(length)) => self.plain = Some(self.input.place(front, length)),
                Err(why) => {
                    records.clear();
                    self.lose(Loss::Chunk {
                        at: offset,
                        why,
                        span_ns,
                    });
                }
            }
        } else {
            if let Some((head, packed)) = head {
                // Whatever comes out whole is used; that the chunk is cut off is said anyway.
                let _ = chunk::unpack_part(&head, packed, &mut records);
            }
            self.truncated(offset, "within a chunk");
        }
        self.chunk = records;
        self.chunk_at = 0;
        self.chunk_offset = offset;
    }

    /// Gives the front of an attachment and passes over the rest.
    fn attachment(&mut self, offset: u64, length: u64) -> Result<Option<Frame>, Failure> {
        let front = length.min(ATTACHMENT_FRONT) as usize;
        let there = self.want(RECORD_HEAD + front)?;
        if there < RECORD_HEAD + front {
            return Ok(self.truncated(offset, "within an attachment"));
        }
        // The front is kept beside the window, as the rest is passed over.
        self.plain = None;
        self.chunk.clear();
        self.chunk
            .extend_from_slice(&self.input.window()[RECORD_HEAD..there]);
        self.chunk_at = self.chunk.len();
        self.input.used(there);
        let rest = length - front as u64;
        let skipped = self.input.skip(rest).map_err(|e| failed(&self.name, &e))?;
        if skipped < rest {
            return Ok(self.truncated(offset, "within an attachment"));
        }
        Ok(Some(Frame {
            op: op::ATTACHMENT,
            offset,
            is_front: rest > 0,
            is_in_chunk: false,
            holder: Holder::Chunk,
            body: 0..front,
        }))
    }

    fn truncated(&mut self, at: u64, what: &str) -> Option<Frame> {
        self.ended = true;
        self.lose(Loss::Truncated {
            at,
            what: what.to_owned(),
        });
        None
    }

    fn lose(&mut self, loss: Loss) {
        self.lost += 1;
        if self.losses.len() < LOSSES_KEPT {
            self.losses.push(loss);
        }
    }

    fn want(&mut self, count: usize) -> Result<usize, Failure> {
        self.input.want(count).map_err(|e| failed(&self.name, &e))
    }
}

/// Unpacks a chunk and checks it. Of one that is not compressed nothing is copied: the length of its
/// records is given.
fn unpack_whole(
    head: Option<(ChunkHead, &[u8])>,
    records: &mut Vec<u8>,
) -> Result<Option<usize>, ChunkError> {
    let (head, rest) = head.ok_or(ChunkError::Head)?;
    let packed = usize::try_from(head.packed_size)
        .ok()
        .and_then(|size| rest.get(..size))
        .ok_or(ChunkError::Length {
            told: head.packed_size,
            found: rest.len() as u64,
        })?;
    if head.compression.is_empty() {
        chunk::check(&head, packed)?;
        return Ok(Some(packed.len()));
    }
    chunk::unpack(&head, packed, records)?;
    Ok(None)
}

fn record_head(bytes: &[u8]) -> Option<(u8, u64)> {
    let (head, _) = bytes.split_first_chunk::<RECORD_HEAD>()?;
    let [op, length @ ..] = head;
    Some((*op, u64::from_le_bytes(*length)))
}

/// The failure of a file that is something else.
#[must_use]
pub fn not_mcap(name: &str) -> Failure {
    Failure::failed(format_args!(
        "{name}: not an MCAP file: it does not begin with the bytes 89 4d 43 41 50 30 0d 0a; \
         record with a recorder that writes MCAP, or convert the file first"
    ))
}

fn failed(name: &str, error: &std::io::Error) -> Failure {
    Failure::failed(format_args!("{name}: cannot be read: {error}"))
}

#[cfg(test)]
#[path = "frames_tests.rs"]
mod tests;
