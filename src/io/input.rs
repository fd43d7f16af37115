//! Where a recording is read from.

use std::io::{self, BufRead, ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::storage::Stored;
use crate::failure::Failure;

/// The first bytes of an MCAP file that do not tell its version.
pub(crate) const MCAP_START: &[u8] = b"\x89MCAP";

/// Where bytes come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Input {
    /// Standard input.
    Stdin,
    /// A file.
    File(PathBuf),
}

impl Input {
    /// `-` is standard input.
    #[must_use]
    pub fn of(text: &str) -> Self {
        if text == "-" {
            Self::Stdin
        } else {
            Self::File(PathBuf::from(text))
        }
    }

    /// Name for people.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Stdin => "standard input".to_owned(),
            Self::File(path) => path.display().to_string(),
        }
    }

    /// Whether it begins as an MCAP file does; of standard input nothing is taken.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn is_mcap(&self) -> Result<bool, Failure> {
        if *self == Self::Stdin {
            let mut stdin = std::io::stdin().lock();
            return Ok(stdin.fill_buf().unwrap_or_default().starts_with(MCAP_START));
        }
        let mut first = Vec::new();
        let mut start = self.open()?.take(MCAP_START.len() as u64);
        start
            .read_to_end(&mut first)
            .map_err(|error| self.unreadable(&error))?;
        Ok(first == MCAP_START)
    }

    /// The failure to read it.
    pub fn unreadable(&self, error: &io::Error) -> Failure {
        let path = match self {
            Self::Stdin => Path::new("standard input"),
            Self::File(path) => path,
        };
        Failure::reading(path, error)
    }

    /// Opens it for reading.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(&self) -> Result<Box<dyn Read + Send>, Failure> {
        match self {
            Self::Stdin => Ok(Box::new(Stored::stdin())),
            Self::File(path) => {
                let file = Stored::open(path).map_err(|e| self.unreadable(&e))?;
                match file.metadata().is_ok_and(|m| m.is_dir()) {
                    true => Err(self.unreadable(&ErrorKind::IsADirectory.into())),
                    false => Ok(Box::new(file)),
                }
            }
        }
    }
}
