//! Atomic outputs: complete or absent.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use tempfile::TempPath;

use super::parts::{self, Unfinished};
use super::{standard_output, storage, sum};
use crate::failure::{ErrorCode, Failure};
use crate::file_name::{ShowPath, is_dash};

/// Whether anything was written to standard output.
static IS_STDOUT_USED: AtomicBool = AtomicBool::new(false);

/// A file that no output of this process may replace.
static KEPT_FREE: OnceLock<PathBuf> = OnceLock::new();

/// Maximum number of links followed.
const LINKS: usize = 40;

/// Policy for writing files.
#[derive(Debug, Clone, Copy)]
pub struct Policy {
    /// Whether an existing file is replaced.
    pub replace: bool,
    /// Whether a file is synced before it is renamed.
    pub sync: bool,
}

/// An output: standard output, a device, or a file that is renamed when it is complete.
pub struct Output {
    place: PathBuf,
    name: String,
    kind: Kind,
}

enum Kind {
    Stdout(io::Stdout),
    /// An existing pipe or device, without renaming.
    Device(File),
    File {
        part: Unfinished,
        path: PathBuf,
        policy: Policy,
    },
}

/// Protects a file from being replaced by any output of this process; only the first call counts.
pub(crate) fn keep_free(path: &Path) {
    let _ = KEPT_FREE.set(path.to_owned());
}

impl Output {
    /// Standard output.
    pub fn stdout() -> Self {
        Self {
            place: PathBuf::from("-"),
            name: "standard output".to_owned(),
            kind: Kind::Stdout(io::stdout()),
        }
    }

    /// Opens an output. `taken` are the files that it must not replace: the inputs, with `-` for standard input, and
    /// the other outputs.
    ///
    /// # Errors
    /// If the output is one of them, exists and may not be replaced, or its folder is not writable.
    pub fn open(place: Option<&Path>, policy: Policy, taken: &[&Path]) -> Result<Self, Failure> {
        let Some(path) = place.filter(|path| !is_dash(path)) else {
            return Ok(Self::stdout());
        };
        let (path_as_given, name) = (path.to_owned(), path.shown().to_string());
        let kept_free = KEPT_FREE.get().map(PathBuf::as_path);
        let mut taken = taken.iter().copied().chain(kept_free);
        if let Some(other) = taken.find(|other| is_same_file(other, path)) {
            let other = match other {
                input if is_dash(input) => "standard input".to_owned(),
                file => file.shown().to_string(),
            };
            return Err(ErrorCode::ConflictingArguments
                .usage(format_args!(
                    "the output is {other} as well; write to another file"
                ))
                .at(&name));
        }
        // A link is followed and preserved; a dangling one also counts as existing.
        let exists = std::fs::symlink_metadata(path).is_ok();
        let kind = match std::fs::metadata(path) {
            Ok(meta) if meta.is_dir() => {
                return Err(ErrorCode::InvalidValue
                    .usage("the output is a folder; name a file in it")
                    .at(&name));
            }
            Ok(meta) if !meta.is_file() => {
                let file = storage::open_for_writing(path);
                Kind::Device(file.map_err(|e| Failure::writing(&name, &e))?)
            }
            _ if exists && !policy.replace => {
                return Err(ErrorCode::OutputExists
                    .failed("the output exists; give --force to replace it, or another name")
                    .at(&name));
            }
            found => {
                let path = end_of_links(path);
                let part = Unfinished::create_in(folder_of(&path))
                    .map_err(|e| folder_failure(&path, &e))?;
                if let Ok(meta) = found {
                    // The permissions of a replaced file are preserved.
                    let kept = part.file().set_permissions(meta.permissions());
                    kept.map_err(|e| Failure::writing(&name, &e))?;
                }
                Kind::File { part, path, policy }
            }
        };
        Ok(Self {
            place: path_as_given,
            name,
            kind,
        })
    }

    /// Writes bytes.
    ///
    /// # Errors
    /// `Failure::ClosedPipe` if the reader has gone, or a failure that names the output.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        let written = self.write_all(bytes);
        written.map_err(|error| Failure::writing(&self.name, &error))
    }

    /// Completes the output: a file is renamed now.
    ///
    /// # Errors
    /// As for [`Output::write`].
    pub fn finish(self) -> Result<(), Failure> {
        finish_all([self])
    }

    /// Does everything that can fail before the file is renamed.
    fn seal(&mut self) -> io::Result<()> {
        match &mut self.kind {
            Kind::Stdout(out) => out.flush(),
            Kind::Device(file) => file.flush(),
            Kind::File { part, policy, .. } if policy.sync => storage::sync(part.file()),
            Kind::File { .. } => Ok(()),
        }
    }

    /// SHA-256 of the bytes written; `None` if it is not a file.
    pub(crate) fn sum(&self) -> io::Result<Option<String>> {
        match &self.kind {
            Kind::File { part, .. } => sum::of_open(part.file()).map(Some),
            Kind::Stdout(_) | Kind::Device(_) => Ok(None),
        }
    }

    /// Its path as given, `-` for standard output.
    pub(crate) fn place(&self) -> &Path {
        &self.place
    }

    /// Name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.kind {
            Kind::Stdout(out) => {
                standard_output::is_there()?;
                IS_STDOUT_USED.store(true, Ordering::Relaxed);
                storage::write(out, bytes)
            }
            Kind::Device(file) => storage::write(file, bytes),
            Kind::File { part, .. } => storage::write(&mut part.file(), bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.kind {
            Kind::Stdout(out) => out.flush(),
            Kind::Device(file) => file.flush(),
            Kind::File { part, .. } => part.file().flush(),
        }
    }
}

/// Creates a folder for outputs, including its parents.
///
/// # Errors
/// If the system call fails.
pub(crate) fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::writing(&folder.shown().to_string(), &error))
}

/// Completes the outputs of one run: all files are renamed, or none.
///
/// # Errors
/// As for [`Output::write`].
pub fn finish_all(outputs: impl IntoIterator<Item = Output>) -> Result<(), Failure> {
    let mut outputs: Vec<Output> = outputs.into_iter().collect();
    for output in &mut outputs {
        let sealed = output.seal();
        sealed.map_err(|error| Failure::writing(&output.name, &error))?;
    }
    let files = outputs.into_iter().filter_map(|output| match output.kind {
        Kind::File { part, path, policy } => Some((output.name, part, path, policy)),
        _ => None,
    });
    // Names are given before the first file is replaced: where that takes a copy, it may fail.
    let named = files.map(|(name, part, path, policy)| match part.named() {
        Ok(part) => Ok((name, part, path, policy)),
        Err(error) => Err(Failure::writing(&name, &error)),
    });
    let files: Vec<_> = named.collect::<Result<_, _>>()?;
    let several = files.len() > 1;
    let mut done: Vec<Renamed> = Vec::new();
    for (name, part, path, policy) in files {
        let renamed = Renamed::new(part, path, policy, several);
        match renamed {
            Ok(renamed) => done.push(renamed),
            Err(error) => {
                done.into_iter().for_each(Renamed::undo);
                return Err(Failure::writing(&name, &error));
            }
        }
    }
    done.iter().try_for_each(Renamed::settle)
}

/// A renamed file.
struct Renamed {
    path: PathBuf,
    /// Whether nothing of that name existed before.
    is_new: bool,
    /// The replaced file, kept under another name while it may have to be restored.
    replaced: Option<TempPath>,
    sync: bool,
}

impl Renamed {
    fn new(part: TempPath, path: PathBuf, policy: Policy, keep: bool) -> io::Result<Self> {
        let is_new = std::fs::symlink_metadata(&path).is_err();
        let replaced = match keep && !is_new {
            // `None` if the file system has no links.
            true => parts::second_name(&path, folder_of(&path)).ok(),
            false => None,
        };
        storage::rename(part, &path, policy.replace)?;
        Ok(Self {
            path,
            is_new,
            replaced,
            sync: policy.sync,
        })
    }

    /// Restores the previous state.
    fn undo(self) {
        // The original failure is the one to report.
        let _ = match self.replaced {
            Some(old) => storage::rename(old, &self.path, true),
            None if self.is_new => std::fs::remove_file(&self.path),
            // Without a copy of the old file, only the new one exists.
            None => Ok(()),
        };
    }

    /// Syncs the new name. Where folders cannot be opened or synced, this is left to the system.
    fn settle(&self) -> Result<(), Failure> {
        let synced = match self.sync {
            true => storage::sync_folder(folder_of(&self.path)),
            false => Ok(()),
        };
        synced.map_err(|error| {
            ErrorCode::CannotWrite.failed(format_args!(
                "written and in its place, but its folder cannot be synced: {error}; after a power cut the old \
                 content may be back"
            ))
            .at(self.path.shown())
        })
    }
}

fn folder_failure(path: &Path, error: &io::Error) -> Failure {
    let folder = folder_of(path);
    if folder.is_dir() {
        ErrorCode::CannotWrite
            .failed(format_args!(
                "cannot be created: {}; check the permissions of its folder",
                error.kind()
            ))
            .at(path.shown())
    } else {
        ErrorCode::CannotWrite
            .failed(format_args!(
                "the folder {} does not exist; create it first",
                folder.shown()
            ))
            .at(path.shown())
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The target of a path after following links, whether it exists or not.
pub(crate) fn end_of_links(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..LINKS {
        let Ok(next) = std::fs::read_link(&path) else {
            break;
        };
        path = folder_of(&path).join(next);
    }
    let folder = folder_of(&path).canonicalize();
    match (folder, path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path,
    }
}

/// Whether an input or another output is the same file as a path.
fn is_same_file(other: &Path, path: &Path) -> bool {
    match is_dash(other) {
        true => is_stdin(path),
        false => end_of_links(other) == end_of_links(path),
    }
}

/// Whether standard input is read from the file at a path. Only regular files are opened for that, as a pipe would
/// block.
fn is_stdin(path: &Path) -> bool {
    let is_file = std::fs::metadata(path).is_ok_and(|meta| meta.is_file());
    is_file
        && match (
            same_file::Handle::stdin(),
            same_file::Handle::from_path(path),
        ) {
            (Ok(stdin), Ok(file)) => stdin == file,
            _ => false,
        }
}

/// Whether anything was written to standard output: a second JSON document there would make it
/// unparsable.
pub(crate) fn is_stdout_used() -> bool {
    IS_STDOUT_USED.load(Ordering::Relaxed)
}

/// Writes a text to standard output.
///
/// # Errors
/// As for [`Output::write`].
pub fn print(text: &str) -> Result<(), Failure> {
    let mut output = Output::stdout();
    output.write(text.as_bytes())?;
    output.finish()
}
