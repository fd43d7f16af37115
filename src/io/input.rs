//! Input of a recording.

use std::io::{self, BufRead, Cursor, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::packed::{self, Packing};
use super::storage::Stored;
use crate::failure::Failure;
use crate::file_name::{ShowPath, is_dash};

/// First bytes of an MCAP file, without the version.
pub(crate) const MCAP_START: &[u8] = b"\x89MCAP";
/// Number of bytes examined before a file is read.
pub(crate) const HEAD: usize = 512;

/// Content of standard input if compressed, with the bytes that were examined and not yet read.
static UNPACKED_STDIN: Mutex<Option<UnpackedStdin>> = Mutex::new(None);

struct UnpackedStdin {
    packing: Packing,
    ahead: Vec<u8>,
    rest: Box<dyn Read + Send>,
}

/// Source of bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Input {
    /// Standard input.
    Stdin,
    /// A file.
    File(PathBuf),
}

impl Input {
    /// `-` is standard input.
    pub fn of(path: &Path) -> Self {
        if is_dash(path) {
            Self::Stdin
        } else {
            Self::File(path.to_owned())
        }
    }

    /// Name for messages.
    pub fn name(&self) -> String {
        match self {
            Self::Stdin => "standard input".to_owned(),
            Self::File(path) => path.shown().to_string(),
        }
    }

    /// Whether it begins like an MCAP file; nothing is consumed from standard input.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn is_mcap(&self) -> Result<bool, Failure> {
        Ok(self.head()?.starts_with(MCAP_START))
    }

    /// Its compression, if any; `None` for a pipe, which can be read only once.
    pub(crate) fn packing(&self) -> Option<Packing> {
        let Self::File(path) = self else {
            let stdin = UNPACKED_STDIN
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            return stdin.as_ref().map(|stdin| stdin.packing);
        };
        let file = Stored::open(path).ok().filter(|_| is_regular(path))?;
        let mut first = Vec::new();
        let mut start = file.take(packed::MAGIC as u64);
        start.read_to_end(&mut first).ok()?;
        Packing::of(&first)
    }

    /// Description of its encoding, for messages: the name of the compression, then that of the
    /// content.
    pub(crate) fn dialect(&self, of_content: &str) -> String {
        match self.packing() {
            Some(packing) => format!("{}, {of_content}", packing.name()),
            None => of_content.to_owned(),
        }
    }

    /// The seekable file whose bytes `open` returns; `None` for standard input and compressed files.
    pub(crate) fn plain_file(&self) -> Option<&Path> {
        match self {
            Self::File(path) if self.packing().is_none() => Some(path),
            _ => None,
        }
    }

    /// The first bytes of the content; nothing is consumed from standard input.
    ///
    /// # Errors
    /// If it cannot be opened or read.
    pub(crate) fn head(&self) -> Result<Vec<u8>, Failure> {
        let mut first = Vec::new();
        match self {
            Self::Stdin if self.is_unpacked_stdin()? => {
                let mut stdin = UNPACKED_STDIN
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner);
                if let Some(stdin) = stdin.as_mut() {
                    let missing = HEAD.saturating_sub(stdin.ahead.len()) as u64;
                    let read = (&mut stdin.rest)
                        .take(missing)
                        .read_to_end(&mut stdin.ahead);
                    read.map_err(|error| self.unreadable(&error))?;
                    first.clone_from(&stdin.ahead);
                }
            }
            Self::Stdin => {
                let mut stdin = std::io::stdin().lock();
                first.extend_from_slice(stdin.fill_buf().unwrap_or_default());
            }
            // Bytes taken from a pipe would be lost.
            Self::File(path) if !is_regular(path) && path.exists() => {}
            Self::File(_) => {
                let mut start = self.open()?.take(HEAD as u64);
                let read = start.read_to_end(&mut first);
                read.map_err(|error| self.unreadable(&error))?;
            }
        }
        first.truncate(HEAD);
        Ok(first)
    }

    /// Whether standard input is compressed; it is decompressed from here on.
    fn is_unpacked_stdin(&self) -> Result<bool, Failure> {
        let mut stdin = UNPACKED_STDIN
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if stdin.is_some() {
            return Ok(true);
        }
        // The lock of standard input must be released before anything reads from it.
        let packing = Packing::of(std::io::stdin().lock().fill_buf().unwrap_or_default());
        if let Some(packing) = packing {
            let rest = packing.unpack(Stored::stdin());
            *stdin = Some(UnpackedStdin {
                packing,
                ahead: Vec::new(),
                rest: rest.map_err(|error| self.unreadable(&error))?,
            });
        }
        Ok(stdin.is_some())
    }

    /// Failure to read it.
    pub fn unreadable(&self, error: &io::Error) -> Failure {
        match error.kind() {
            ErrorKind::InvalidData => Failure::unreadable(error).at(self.name()),
            _ => match self {
                Self::Stdin => Failure::reading(Path::new(&self.name()), error),
                Self::File(path) => Failure::reading(path, error),
            },
        }
    }

    /// Opens its content for reading, decompressed if necessary.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(&self) -> Result<Box<dyn Read + Send>, Failure> {
        let path = match self {
            Self::Stdin if self.is_unpacked_stdin()? => return Ok(Box::new(StdinContent)),
            Self::Stdin => return Ok(Box::new(Stored::stdin())),
            Self::File(path) => path,
        };
        let unreadable = |error: io::Error| self.unreadable(&error);
        let mut file = Stored::open(path).map_err(unreadable)?;
        if file.metadata().is_ok_and(|meta| meta.is_dir()) {
            return Err(self.unreadable(&ErrorKind::IsADirectory.into()));
        }
        let mut first = Vec::new();
        let mut start = (&mut file).take(packed::MAGIC as u64);
        start.read_to_end(&mut first).map_err(unreadable)?;
        let packing = Packing::of(&first);
        let bytes = Cursor::new(first).chain(file);
        match packing {
            Some(packing) => packing.unpack(bytes).map_err(unreadable),
            None => Ok(Box::new(bytes)),
        }
    }
}

fn is_regular(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|meta| meta.is_file())
}

/// Content of compressed standard input.
struct StdinContent;

impl Read for StdinContent {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut stdin = UNPACKED_STDIN
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let Some(stdin) = stdin.as_mut() else {
            return Ok(0);
        };
        if stdin.ahead.is_empty() {
            return stdin.rest.read(bytes);
        }
        let count = bytes.len().min(stdin.ahead.len());
        bytes[..count].copy_from_slice(&stdin.ahead[..count]);
        stdin.ahead.drain(..count);
        Ok(count)
    }
}
