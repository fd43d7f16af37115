//! Outputs that appear whole or not at all.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use tempfile::NamedTempFile;

use crate::failure::Failure;

/// Files that are not complete, to be removed if the run is interrupted.
static PARTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
/// Exit code of an interrupted run: 128 and the number of the signal, as shells have it.
const INTERRUPTED: i32 = 130;

/// Has incomplete outputs removed when the run is interrupted or told to end.
///
/// # Errors
/// If the system does not let signals be handled.
pub fn clean_up_when_interrupted() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(|| {
        for part in PARTS.lock().unwrap_or_else(|e| e.into_inner()).drain(..) {
            // It may have got its name already, or be gone.
            let _ = std::fs::remove_file(part);
        }
        std::process::exit(INTERRUPTED);
    })
}

/// An output: standard output, a device, or a file that takes its name when it is complete.
pub struct Output {
    name: String,
    kind: Kind,
}

enum Kind {
    Stdout(io::Stdout),
    /// A pipe or device that exists: nothing to rename.
    Device(File),
    File {
        part: NamedTempFile,
        path: PathBuf,
        /// Whether a file that came in the meantime may be replaced.
        force: bool,
    },
}

impl Output {
    /// Opens an output. `taken` are the files that it must not replace: the inputs and the other
    /// outputs.
    ///
    /// # Errors
    /// If the output is one of them, exists without `force`, or its folder cannot be written.
    pub fn open(place: Option<&str>, force: bool, taken: &[&Path]) -> Result<Self, Failure> {
        let Some(text) = place.filter(|text| *text != "-") else {
            return Ok(Self {
                name: "standard output".to_owned(),
                kind: Kind::Stdout(io::stdout()),
            });
        };
        let name = text.to_owned();
        let path = Path::new(text);
        if let Some(other) = taken.iter().find(|other| same_file(other, path)) {
            return Err(Failure::usage(format_args!(
                "the output {name} is {} as well; write to another file",
                other.display()
            )));
        }
        // A link is followed, so that it stays one; also one that leads nowhere counts as existing.
        let exists = std::fs::symlink_metadata(path).is_ok();
        let kind = match std::fs::metadata(path) {
            Ok(meta) if meta.is_dir() => {
                return Err(Failure::usage(format_args!(
                    "the output {name} is a folder; name a file in it"
                )));
            }
            Ok(meta) if !meta.is_file() => {
                let file = File::options().write(true).open(path);
                Kind::Device(file.map_err(|e| Failure::writing(&name, &e))?)
            }
            _ if exists && !force => {
                return Err(Failure::failed(format_args!(
                    "the output {name} exists; give --force to replace it, or another name"
                )));
            }
            found => {
                let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
                let part = part_beside(&path).map_err(|e| folder_failure(&path, &e))?;
                if let Ok(meta) = found {
                    // What is replaced hands on its permissions.
                    let kept = part.as_file().set_permissions(meta.permissions());
                    kept.map_err(|e| Failure::writing(&name, &e))?;
                }
                Kind::File { part, path, force }
            }
        };
        Ok(Self { name, kind })
    }

    /// Writes bytes.
    ///
    /// # Errors
    /// [`Failure::ClosedPipe`] if nobody reads any more, or a failure that names the output.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        let result = match &mut self.kind {
            Kind::Stdout(out) => out.write_all(bytes),
            Kind::Device(file) => file.write_all(bytes),
            Kind::File { part, .. } => part.as_file_mut().write_all(bytes),
        };
        result.map_err(|error| Failure::writing(&self.name, &error))
    }

    /// Completes the output: a file gets its name now.
    ///
    /// # Errors
    /// As [`Output::write`].
    pub fn finish(self) -> Result<(), Failure> {
        let result = match self.kind {
            Kind::Stdout(mut out) => out.flush(),
            Kind::Device(mut file) => file.flush(),
            Kind::File { part, path, force } => {
                let done = if force {
                    part.persist(path)
                } else {
                    part.persist_noclobber(path)
                };
                done.map(drop).map_err(|e| e.error)
            }
        };
        result.map_err(|error| Failure::writing(&self.name, &error))
    }

    /// Name for people.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.kind {
            Kind::Stdout(out) => out.write(bytes),
            Kind::Device(file) => file.write(bytes),
            Kind::File { part, .. } => part.as_file_mut().write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.kind {
            Kind::Stdout(out) => out.flush(),
            Kind::Device(file) => file.flush(),
            Kind::File { part, .. } => part.as_file_mut().flush(),
        }
    }
}

/// A nameless-to-be file in the folder of the output, removed if it is not completed.
fn part_beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".torqcomp-").suffix(".part");
    set_permissions(&mut builder);
    let part = builder.tempfile_in(folder_of(path))?;
    let mut parts = PARTS.lock().unwrap_or_else(|e| e.into_inner());
    parts.push(part.path().to_owned());
    Ok(part)
}

/// The finished file gets the permissions of any other new file.
#[cfg(unix)]
fn set_permissions(builder: &mut tempfile::Builder<'_, '_>) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(std::fs::Permissions::from_mode(0o666));
}

#[cfg(not(unix))]
fn set_permissions(_: &mut tempfile::Builder<'_, '_>) {}

fn folder_failure(path: &Path, error: &io::Error) -> Failure {
    let folder = folder_of(path);
    if folder.is_dir() {
        Failure::failed(format_args!(
            "{}: cannot be created: {}; check the permissions of its folder",
            path.display(),
            error.kind()
        ))
    } else {
        Failure::failed(format_args!(
            "{}: the folder {} does not exist; make it first",
            path.display(),
            folder.display()
        ))
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Whether two paths lead to the same file.
fn same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        // Outputs that are not there yet.
        (Err(_), Err(_)) => {
            a == b || folder_of(a) == folder_of(b) && a.file_name() == b.file_name()
        }
        _ => false,
    }
}

/// Writes a small result in one go.
///
/// # Errors
/// As [`Output::open`] and [`Output::write`].
pub fn write_all(
    place: Option<&str>,
    force: bool,
    taken: &[&Path],
    text: &str,
) -> Result<(), Failure> {
    let mut output = Output::open(place, force, taken)?;
    output.write(text.as_bytes())?;
    output.finish()
}
