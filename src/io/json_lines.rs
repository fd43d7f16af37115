//! JSON-lines files with durable appending, also by several processes.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::storage;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;

/// Number of leading bytes in which a line of the file's kind is searched for.
const LOOKED_AT: usize = 1 << 16;

/// A file of JSON lines.
pub(crate) struct JsonLines {
    path: PathBuf,
    file: File,
    sync: bool,
}

impl JsonLines {
    /// Opens a file whose lines begin like this, or creates it.
    ///
    /// # Errors
    /// If it cannot be written, or is another kind of file.
    pub(crate) fn open(path: &Path, beginning: &str, sync: bool) -> Result<Self, Failure> {
        let unwritable = |error| Failure::writing(&path.shown().to_string(), &error);
        let file = storage::open_at_end(path).map_err(unwritable)?;
        let first = storage::first_bytes(&file, LOOKED_AT).map_err(unwritable)?;
        let mut lines = first.split(|byte| *byte == b'\n');
        // The first line may be truncated.
        let is_of_kind = beginning.as_bytes().starts_with(&first)
            || lines.any(|line| line.starts_with(beginning.as_bytes()));
        if !is_of_kind {
            return Err(ErrorCode::ConflictingArguments.usage(format_args!(
                "this file has no lines that begin with {beginning}, so nothing is appended to it; name another file"
            ))
            .at(path.shown()));
        }
        if sync {
            let folder = path
                .parent()
                .filter(|folder| !folder.as_os_str().is_empty());
            storage::sync_folder(folder.unwrap_or(Path::new("."))).map_err(unwritable)?;
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            sync,
        })
    }

    /// Appends lines durably. Those of several processes are not interleaved, and a line that was cut short remains a
    /// separate line.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(crate) fn append(&self, lines: String) -> Result<(), Failure> {
        self.add(lines)?;
        self.settle()
    }

    /// Appends lines as [`JsonLines::append`] does; they are durable only once settled. Threads append one at a time.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(crate) fn add(&self, lines: String) -> Result<(), Failure> {
        self.write(lines).map_err(|error| self.unwritable(&error))
    }

    /// Makes all lines appended so far durable; several threads may share one sync.
    ///
    /// # Errors
    /// If the system call fails.
    pub(crate) fn settle(&self) -> Result<(), Failure> {
        let synced = match self.sync {
            true => storage::sync(&self.file),
            false => Ok(()),
        };
        synced.map_err(|error| self.unwritable(&error))
    }

    fn unwritable(&self, error: &io::Error) -> Failure {
        Failure::writing(&self.path.shown().to_string(), error)
    }

    fn write(&self, mut lines: String) -> io::Result<()> {
        // Without locks, a single write call at the end must suffice.
        let is_locked = self.file.lock().is_ok();
        let written = storage::ends_without_line(&self.file).and_then(|is_cut| {
            if is_cut {
                lines.insert(0, '\n');
            }
            storage::write_all(&self.file, lines.as_bytes())
        });
        if is_locked {
            // Closing the file unlocks it, too.
            let _ = self.file.unlock();
        }
        written
    }
}
