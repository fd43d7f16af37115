//! How a command can end badly, and the exit code that goes with it.

use std::fmt;
use std::io;
use std::path::Path;

/// Why a command did not do its work.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// The command line asks for something that cannot be: exit code 2.
    Usage(String),
    /// The work failed: exit code 1.
    Failed(String),
    /// Nobody reads the output any more: exit code 0.
    ClosedPipe,
}

impl Failure {
    /// A failure of the work.
    pub fn failed(message: impl fmt::Display) -> Self {
        Self::Failed(message.to_string())
    }

    /// A wrong command line.
    pub fn usage(message: impl fmt::Display) -> Self {
        Self::Usage(message.to_string())
    }

    /// A failure to write to `place`.
    pub fn writing(place: &str, error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::ClosedPipe,
            io::ErrorKind::StorageFull => Self::failed(format_args!(
                "{place}: no space left on the disk; free some space or write elsewhere with -o"
            )),
            _ => Self::failed(format_args!("{place}: cannot be written: {error}")),
        }
    }

    /// A failure to read a file.
    pub fn reading(path: &Path, error: &io::Error) -> Self {
        let hint = match error.kind() {
            io::ErrorKind::NotFound => "; check the path",
            io::ErrorKind::PermissionDenied => "; check its permissions",
            io::ErrorKind::IsADirectory => ": it is a folder; name a file in it",
            _ => "",
        };
        Self::failed(format_args!(
            "{}: cannot be read: {error}{hint}",
            path.display()
        ))
    }

    /// The exit code.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Failed(_) => 1,
            Self::ClosedPipe => 0,
        }
    }

    /// The same failure with a place put before its message.
    #[must_use]
    pub fn at(self, place: impl fmt::Display) -> Self {
        match self {
            Self::Usage(message) => Self::Usage(format!("{place}: {message}")),
            Self::Failed(message) => Self::Failed(format!("{place}: {message}")),
            Self::ClosedPipe => Self::ClosedPipe,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(message) | Self::Failed(message) => f.write_str(message),
            Self::ClosedPipe => f.write_str("the reader of the output went away"),
        }
    }
}

impl std::error::Error for Failure {}

impl From<torqcomp_dsp::Error> for Failure {
    fn from(error: torqcomp_dsp::Error) -> Self {
        Self::failed(error)
    }
}

impl From<torqcomp_model::fit::FitError> for Failure {
    fn from(error: torqcomp_model::fit::FitError) -> Self {
        Self::failed(error)
    }
}

/// The known name nearest to a wrong one, as a sentence for the end of a message.
#[must_use]
pub fn did_you_mean<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let wrong = wrong.to_lowercase();
    known
        .into_iter()
        .map(|name| (strsim::jaro_winkler(&wrong, &name.to_lowercase()), name))
        .filter(|(similarity, _)| *similarity > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(String::new, |(_, name)| {
            format!(" (did you mean \"{name}\"?)")
        })
}
