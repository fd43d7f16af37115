//! Files with a progress report of reading.

use std::io::{self, Read};

use crate::failure::Failure;
use crate::io::Input;
use crate::progress::{Amount, Progress, Task};

/// A file being read, of known length or not.
struct Followed {
    file: Box<dyn Read + Send>,
    length: Option<Amount>,
    read: u64,
    progress: Progress,
}

/// Opens an input with progress reporting.
///
/// # Errors
/// If it cannot be opened.
pub(super) fn open(input: &Input) -> Result<Box<dyn Read + Send>, Failure> {
    let file = input.open()?;
    let length = input.plain_file().and_then(|path| path.metadata().ok());
    let length = length.map_or(0, |meta| meta.len());
    Ok(Box::new(Followed {
        file,
        length: (length > 0).then(|| Amount::of_bytes(length)),
        read: 0,
        progress: Progress::new(Task::Read(input.name())),
    }))
}

impl Read for Followed {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(bytes)?;
        self.read += count as u64;
        self.progress
            .report(Amount::of_bytes(self.read), self.length);
        Ok(count)
    }
}
