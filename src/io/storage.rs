//! All file system calls: opening, reading, writing, syncing and renaming, in one place so that tests can intercept
//! every one of them.

use std::fs::{File, Metadata};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use tempfile::{NamedTempFile, TempPath};

use super::fault::{Call, check, limit};

/// A file or stream being read; an interrupted call is repeated.
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

/// The bytes of a file.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    Stored::open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// A file as text.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    Stored::open(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// Opens an existing file for writing.
pub(super) fn open_for_writing(path: &Path) -> io::Result<File> {
    check(Call::Open)?;
    File::options().write(true).open(path)
}

/// Opens a file for appending and reading, creating it if necessary.
pub(crate) fn open_at_end(path: &Path) -> io::Result<File> {
    check(Call::Open)?;
    File::options()
        .read(true)
        .append(true)
        .create(true)
        .open(path)
}

/// The first bytes of a file, at most `most`; empty for a pipe or device.
pub(crate) fn first_bytes(file: &File, most: usize) -> io::Result<Vec<u8>> {
    let mut first = Vec::new();
    if has_bytes(file)? {
        from_start(file)?
            .take(most as u64)
            .read_to_end(&mut first)?;
    }
    Ok(first)
}

/// Reads an open file from its start.
pub(super) fn from_start(mut file: &File) -> io::Result<Stored<&File>> {
    file.seek(SeekFrom::Start(0))?;
    Ok(Stored(file))
}

/// Whether the last line of a file has no line end; false for an empty file, a pipe or a device.
pub(crate) fn ends_without_line(mut file: &File) -> io::Result<bool> {
    if !has_bytes(file)? {
        return Ok(false);
    }
    file.seek(SeekFrom::End(-1))?;
    let mut last = [0];
    Stored(file).read_exact(&mut last)?;
    Ok(last != *b"\n")
}

fn has_bytes(file: &File) -> io::Result<bool> {
    let meta = file.metadata()?;
    Ok(meta.is_file() && meta.len() > 0)
}

/// Appends all bytes to a file.
pub(crate) fn write_all(mut file: &File, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        match write(&mut file, bytes) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Creates a file with a temporary name.
pub(super) fn create(
    builder: &tempfile::Builder<'_, '_>,
    folder: &Path,
) -> io::Result<NamedTempFile> {
    check(Call::Create)?;
    builder.tempfile_in(folder)
}

/// Creates a file without a name, which disappears with the process; `None` where the system has none, or no way to name
/// it later.
#[cfg(target_os = "linux")]
pub(super) fn create_unnamed(folder: &Path) -> Option<File> {
    use rustix::fs::{Mode, OFlags};
    check(Call::Unnamed).ok()?;
    let options = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
    let file = rustix::fs::open(folder, options, Mode::from_raw_mode(0o666)).ok()?;
    Some(File::from(file)).filter(|file| opened(file).exists())
}

#[cfg(not(target_os = "linux"))]
pub(super) fn create_unnamed(_: &Path) -> Option<File> {
    None
}

/// The link to an open file of this process.
#[cfg(target_os = "linux")]
fn opened(file: &File) -> std::path::PathBuf {
    use std::os::fd::AsRawFd;
    format!("/proc/self/fd/{}", file.as_raw_fd()).into()
}

/// Gives an unnamed file a temporary name.
#[cfg(target_os = "linux")]
pub(super) fn name(
    file: &File,
    builder: &tempfile::Builder<'_, '_>,
    folder: &Path,
) -> io::Result<TempPath> {
    use rustix::fs::{AtFlags, CWD, linkat};
    check(Call::Link)?;
    let opened = opened(file);
    let named = builder.make_in(folder, |path| {
        Ok(linkat(CWD, &opened, CWD, path, AtFlags::SYMLINK_FOLLOW)?)
    });
    named.map(NamedTempFile::into_temp_path)
}

#[cfg(not(target_os = "linux"))]
pub(super) fn name(_: &File, _: &tempfile::Builder<'_, '_>, _: &Path) -> io::Result<TempPath> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Writes as many of the bytes as one call accepts.
pub(super) fn write(to: &mut impl Write, bytes: &[u8]) -> io::Result<usize> {
    let most = limit(Call::Write, bytes.len())?;
    to.write(&bytes[..most])
}

/// Syncs the names in a folder, if supported by the system.
pub(crate) fn sync_folder(folder: &Path) -> io::Result<()> {
    use io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
    match open_folder(folder).and_then(|folder| sync(&folder)) {
        Err(error) if matches!(error.kind(), InvalidInput | PermissionDenied | Unsupported) => {
            Ok(())
        }
        synced => synced,
    }
}

#[cfg(not(windows))]
fn open_folder(folder: &Path) -> io::Result<File> {
    Stored::open(folder).map(|folder| folder.0)
}

/// Windows opens a folder only with this flag, and syncs only writable handles.
#[cfg(windows)]
fn open_folder(folder: &Path) -> io::Result<File> {
    use std::os::windows::fs::OpenOptionsExt;
    const FILE_FLAG_BACKUP_SEMANTICS: u32 = 0x0200_0000;
    check(Call::Open)?;
    let mut options = File::options();
    options
        .write(true)
        .custom_flags(FILE_FLAG_BACKUP_SEMANTICS)
        .open(folder)
}

/// Syncs a file.
pub(crate) fn sync(file: &File) -> io::Result<()> {
    check(Call::Sync)?;
    file.sync_all()
}

/// Renames a temporary file, replacing an existing file or only if there is none.
pub(super) fn rename(part: TempPath, path: &Path, replace: bool) -> io::Result<()> {
    check(Call::Rename)?;
    let renamed = match replace {
        true => part.persist(path),
        false => part.persist_noclobber(path),
    };
    renamed.map_err(|error| error.error)
}

/// Gives an existing file a second, temporary name.
pub(super) fn link(
    path: &Path,
    builder: &tempfile::Builder<'_, '_>,
    folder: &Path,
) -> io::Result<TempPath> {
    check(Call::Link)?;
    let named = builder.make_in(folder, |second| std::fs::hard_link(path, second));
    named.map(NamedTempFile::into_temp_path)
}

/// An anonymous file in the folder for temporary files, removed with the process.
#[derive(Debug)]
pub struct Scratch(Stored<File>);

impl Scratch {
    /// Creates it.
    ///
    /// # Errors
    /// Those of the system.
    pub fn new() -> io::Result<Self> {
        check(Call::Create)?;
        tempfile::tempfile().map(|file| Self(Stored(file)))
    }

    /// Reads the bytes at an offset.
    ///
    /// # Errors
    /// Those of the system, and if there are fewer bytes.
    pub fn read_at(&mut self, offset: u64, bytes: &mut [u8]) -> io::Result<()> {
        self.0.seek(SeekFrom::Start(offset))?;
        self.0.read_exact(bytes)
    }
}

impl Write for Scratch {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        write(&mut self.0.0, bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
