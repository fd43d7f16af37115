//! Temporary files of incomplete outputs, and their removal when a run ends early.

use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use tempfile::TempPath;

use super::storage;

/// Files to be removed if the run is interrupted.
static OPEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
/// Folders in which this run has looked for orphaned files.
static TIDIED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
/// Number of open files from which on removed ones are purged from the list.
const MOST_OPEN: usize = 256;
/// Prefix and suffix of the names of all of them.
const PREFIX: &str = ".torqcomp-";
const SUFFIX: &str = ".part";

fn open() -> MutexGuard<'static, Vec<PathBuf>> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether a folder has not been examined before.
fn is_first_in(folder: &Path) -> bool {
    let mut tidied = TIDIED.lock().unwrap_or_else(PoisonError::into_inner);
    tidied.insert(folder.to_owned())
}

/// Removes incomplete files, and exits before any other file is created.
fn remove_open_and_exit(code: i32) -> ! {
    let mut open = open();
    for part in open.drain(..) {
        // It may have been renamed or removed already.
        let _ = std::fs::remove_file(part);
    }
    std::process::exit(code)
}

/// Removes incomplete outputs when the run is terminated by a signal; the exit code is 128 plus the number of the
/// signal, as in shells. A signal ignored at the start, as under `nohup`, stays ignored.
///
/// # Errors
/// If signals cannot be handled.
#[cfg(unix)]
pub fn remove_when_interrupted() -> io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXCPU, SIGXFSZ};
    let ends = [SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU];
    let ends = ends.into_iter().filter(|signal| !is_ignored(*signal));
    let mut signals = signal_hook::iterator::Signals::new(ends)?;
    // A write beyond the limit then fails like any other.
    signal_hook::flag::register(SIGXFSZ, std::sync::Arc::default())?;
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || {
            if let Some(signal) = signals.forever().next() {
                remove_open_and_exit(128 + signal);
            }
        })?;
    Ok(())
}

/// Removes incomplete outputs when the run is interrupted; the exit code is 130.
///
/// # Errors
/// If interruptions cannot be handled.
#[cfg(not(unix))]
pub fn remove_when_interrupted() -> io::Result<()> {
    ctrlc::set_handler(|| remove_open_and_exit(130)).map_err(io::Error::other)
}

/// Whether this process ignores a signal, as far as the system reports it.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// A file in a folder that gets its name when it is complete. Until then it has none, so that nothing is left of it however
/// the process ends; where the system has no such files, a temporary one, and it is removed unless it is completed.
pub struct Unfinished {
    file: File,
    name: Option<TempPath>,
    folder: PathBuf,
}

impl Unfinished {
    /// Creates it.
    pub fn create_in(folder: &Path) -> io::Result<Self> {
        if is_first_in(folder) {
            remove_orphans(folder, &Owner::of_this_process());
        }
        let (file, name) = match storage::create_unnamed(folder) {
            Some(file) => (file, None),
            None => {
                let named = with_name(|builder| storage::create(builder, folder))?;
                let (file, name) = named.into_parts();
                (file, Some(name))
            }
        };
        Ok(Self {
            file,
            name,
            folder: folder.to_owned(),
        })
    }

    /// The open file.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Its temporary name, given now if it has none.
    pub fn named(self) -> io::Result<TempPath> {
        let Self { file, name, folder } = self;
        match name {
            Some(name) => Ok(name),
            None => with_name(|builder| storage::name(&file, builder, &folder))
                .or_else(|_| copied(&file, &folder)),
        }
    }
}

/// A synced copy with a temporary name, for a file system that cannot name an unnamed file.
fn copied(file: &File, folder: &Path) -> io::Result<TempPath> {
    let copy = with_name(|builder| storage::create(builder, folder))?;
    copy.as_file()
        .set_permissions(file.metadata()?.permissions())?;
    io::copy(&mut storage::from_start(file)?, &mut copy.as_file())?;
    storage::sync(copy.as_file())?;
    Ok(copy.into_temp_path())
}

/// A second name for an existing file, removed on drop.
pub fn second_name(path: &Path, folder: &Path) -> io::Result<TempPath> {
    with_name(|builder| storage::link(path, builder, folder))
}

/// Creates a file, or a name for one, that identifies the process and the time of its creation.
fn with_name<N: AsRef<Path>>(
    create: impl FnOnce(&tempfile::Builder<'_, '_>) -> io::Result<N>,
) -> io::Result<N> {
    let owner = Owner::of_this_process();
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH);
    let seconds = since_epoch.map_or(0, |since| since.as_secs());
    let prefix = format!("{PREFIX}{}-{}-{seconds}-", owner.place, owner.process);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX);
    set_permissions(&mut builder);
    // Held during creation, so that an interruption sees all files or prevents them.
    let mut open = open();
    let named = create(&builder)?;
    if open.len() >= MOST_OPEN {
        open.retain(|path| path.exists());
    }
    open.push(named.as_ref().to_owned());
    Ok(named)
}

/// Gives the finished file the permissions of any other new file.
#[cfg(unix)]
fn set_permissions(builder: &mut tempfile::Builder<'_, '_>) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(std::fs::Permissions::from_mode(0o666));
}

#[cfg(not(unix))]
fn set_permissions(_: &mut tempfile::Builder<'_, '_>) {}

/// Creator of a temporary file.
struct Owner {
    /// The machine and, if it has several, its PID namespace; without hyphens.
    place: String,
    process: u32,
}

impl Owner {
    fn of_this_process() -> Self {
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
        let host = host.or_else(|| std::env::var("COMPUTERNAME").ok());
        let space = std::fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        let mut place = host.unwrap_or_else(|| "host".to_owned());
        place.push_str(
            &space
                .to_string_lossy()
                .replace(|c: char| !c.is_ascii_digit(), ""),
        );
        place.retain(|c| c.is_ascii_alphanumeric());
        Self {
            place,
            process: std::process::id(),
        }
    }
}

/// Removes the temporary files of processes that have certainly ended: of this machine and user, with a PID that no
/// process has. Failure to do so does not fail the run.
#[cfg(target_os = "linux")]
fn remove_orphans(folder: &Path, owner: &Owner) {
    use std::os::unix::fs::MetadataExt;
    let Ok(this) = std::fs::metadata("/proc/self") else {
        return;
    };
    let own = format!("{PREFIX}{}-", owner.place);
    let Ok(files) = std::fs::read_dir(folder) else {
        return;
    };
    for file in files.flatten() {
        let name = file.file_name();
        let name = name.to_string_lossy();
        let rest = name.strip_prefix(&own).filter(|_| name.ends_with(SUFFIX));
        let Some((process, _)) = rest.and_then(|rest| rest.split_once('-')) else {
            continue;
        };
        let is_number = !process.is_empty() && process.bytes().all(|b| b.is_ascii_digit());
        let is_gone = is_number && !Path::new("/proc").join(process).exists();
        // Processes of other users may be hidden.
        let is_ours = file.metadata().is_ok_and(|meta| meta.uid() == this.uid());
        if is_gone && is_ours {
            let _ = std::fs::remove_file(file.path());
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn remove_orphans(_: &Path, _: &Owner) {}
