//! Files: opened, read, written, synced and named here and nowhere else, so that tests reach every one of these calls.

use std::fs::{File, Metadata};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use tempfile::{NamedTempFile, TempPath};

use super::fault::{Call, check, limit};

/// A file or stream that is read; a call that a signal interrupts is repeated.
#[derive(Debug)]
pub struct Stored<R>(R);

impl Stored<File> {
    /// Opens a file for reading.
    pub fn open(path: &Path) -> io::Result<Self> {
        check(Call::Open)?;
        File::open(path).map(Self)
    }

    /// Its kind and length.
    pub fn metadata(&self) -> io::Result<Metadata> {
        self.0.metadata()
    }
}

impl Stored<io::Stdin> {
    /// Standard input.
    pub fn stdin() -> Self {
        Self(io::stdin())
    }
}

impl<R: Read> Read for Stored<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        loop {
            let read =
                limit(Call::Read, bytes.len()).and_then(|most| self.0.read(&mut bytes[..most]));
            match read {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                read => return read,
            }
        }
    }
}

impl Seek for Stored<File> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

/// A file as text.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    Stored::open(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// Opens what is there for writing.
pub(super) fn open_for_writing(path: &Path) -> io::Result<File> {
    check(Call::Open)?;
    File::options().write(true).open(path)
}

/// Creates a temporary file.
pub(super) fn create(
    builder: &tempfile::Builder<'_, '_>,
    folder: &Path,
) -> io::Result<NamedTempFile> {
    check(Call::Create)?;
    builder.tempfile_in(folder)
}

/// Writes as many of the bytes as one call does.
pub(super) fn write(to: &mut impl Write, bytes: &[u8]) -> io::Result<usize> {
    let most = limit(Call::Write, bytes.len())?;
    to.write(&bytes[..most])
}

/// Has the names in a folder on the disk, where the system can do that.
pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    use io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
    match Stored::open(folder).and_then(|folder| sync(&folder.0)) {
        Err(error) if matches!(error.kind(), InvalidInput | PermissionDenied | Unsupported) => {
            Ok(())
        }
        synced => synced,
    }
}

/// Has a file on the disk.
pub(super) fn sync(file: &File) -> io::Result<()> {
    check(Call::Sync)?;
    file.sync_all()
}

/// Gives a temporary file its name, in place of what has that name or only if nothing has.
pub(super) fn rename(part: TempPath, path: &Path, replace: bool) -> io::Result<()> {
    check(Call::Rename)?;
    let renamed = match replace {
        true => part.persist(path),
        false => part.persist_noclobber(path),
    };
    renamed.map_err(|error| error.error)
}

/// Gives a file that exists the name of a temporary file, too.
pub(super) fn link(path: &Path, part: &TempPath) -> io::Result<()> {
    check(Call::Link)?;
    std::fs::remove_file(part)?;
    std::fs::hard_link(path, part)
}
