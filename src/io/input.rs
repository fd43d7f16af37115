//! Where a recording is read from.

use std::io::{BufRead, Read};
use std::path::PathBuf;

use crate::failure::Failure;

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
        /// The first bytes of such a file that do not tell its version.
        const START: &[u8] = b"\x89MCAP";
        if *self == Self::Stdin {
            let mut stdin = std::io::stdin().lock();
            return Ok(stdin.fill_buf().unwrap_or_default().starts_with(START));
        }
        let mut first = Vec::new();
        let read = self
            .open()?
            .take(START.len() as u64)
            .read_to_end(&mut first);
        Ok(read.is_ok() && first == START)
    }

    /// Opens it for reading.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(&self) -> Result<Box<dyn Read + Send>, Failure> {
        match self {
            Self::Stdin => Ok(Box::new(std::io::stdin())),
            Self::File(path) => {
                let file = std::fs::File::open(path).map_err(|e| Failure::reading(path, &e))?;
                if file.metadata().is_ok_and(|m| m.is_dir()) {
                    let error = std::io::ErrorKind::IsADirectory.into();
                    return Err(Failure::reading(path, &error));
                }
                Ok(Box::new(file))
            }
        }
    }
}
