//! Failures of a command and their exit codes.

mod code;

use std::fmt;
use std::io;
use std::path::Path;

use crate::file_name::ShowPath;
use schemars::JsonSchema;
use serde::Serialize;

pub use code::ErrorCode;

/// Reason why a command failed.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// Invalid command line: exit code 2.
    Usage(Box<Fault>),
    /// The work failed: exit code 1.
    Failed(Box<Fault>),
    /// The reader of the output has closed it: exit code 0.
    ClosedPipe,
}

/// Fault and its location.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    code: ErrorCode,
    place: ErrorPlace,
    /// The fault; after the first semicolon, the remedy.
    message: String,
}

/// Kind of the rows of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowKind {
    /// Lines of a text.
    Line,
    /// Samples without lines.
    Sample,
    /// Messages of a topic.
    Message,
}

/// Where a failure is, as far as that is known. Numbers count from 1, bytes from 0.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct ErrorPlace {
    /// Name of the file, as given.
    pub file: Option<String>,
    /// Line of the file.
    pub line: Option<usize>,
    /// Column of a table, or character of a line of a stand file.
    pub column: Option<usize>,
    /// Byte of the file.
    pub byte: Option<u64>,
    /// Sample of the channel.
    pub sample: Option<usize>,
    /// Message of the topic.
    pub message: Option<usize>,
    /// Time on the axis of the record, in s.
    pub time_s: Option<f64>,
}

impl ErrorPlace {
    /// RowKind `number`, from 1, of a file.
    pub fn of_row(file: &str, row: RowKind, number: usize) -> Self {
        let mut place = Self {
            file: Some(file.to_owned()),
            ..Self::default()
        };
        match row {
            RowKind::Line => place.line = Some(number),
            RowKind::Sample => place.sample = Some(number),
            RowKind::Message => place.message = Some(number),
        }
        place
    }

    fn is_known(&self) -> bool {
        *self != Self::default()
    }
}

impl fmt::Display for ErrorPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = [
            ("line", self.line),
            ("sample", self.sample),
            ("message", self.message),
        ];
        let rows = rows
            .iter()
            .filter_map(|(name, number)| Some(format!("{name} {}", (*number)?)));
        let parts: Vec<String> = self.file.clone().into_iter().chain(rows).collect();
        f.write_str(&parts.join(", "))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place.to_string() {
            place if place.is_empty() => f.write_str(&self.message),
            place => write!(f, "{place}: {}", self.message),
        }
    }
}

impl Failure {
    /// A failure of the work caused by another error.
    pub fn of<E: fmt::Display>(code: ErrorCode) -> impl Fn(E) -> Self {
        move |error| code.failed(error)
    }

    /// A failure to write to `place`.
    pub fn writing(place: &str, error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::ClosedPipe,
            io::ErrorKind::StorageFull => ErrorCode::DiskFull
                .failed("no space left on the disk; free some space or write elsewhere with -o")
                .at(place),
            _ => ErrorCode::CannotWrite
                .failed(format_args!("cannot be written: {error}"))
                .at(place),
        }
    }

    /// A failure to continue reading a file whose name is added elsewhere.
    pub fn unreadable(error: &io::Error) -> Self {
        let code = match error.kind() {
            io::ErrorKind::InvalidData => ErrorCode::DamagedFile,
            _ => ErrorCode::CannotRead,
        };
        code.failed(format_args!("cannot be read: {error}"))
    }

    /// A failure to read a file.
    pub fn reading(path: &Path, error: &io::Error) -> Self {
        let (code, hint) = match error.kind() {
            io::ErrorKind::NotFound => (ErrorCode::NotFound, "; check the path"),
            io::ErrorKind::PermissionDenied => (ErrorCode::CannotRead, "; check its permissions"),
            io::ErrorKind::IsADirectory => {
                (ErrorCode::CannotRead, ": it is a folder; name a file in it")
            }
            _ => (ErrorCode::CannotRead, ""),
        };
        code.failed(format_args!("cannot be read: {error}{hint}"))
            .at(path.shown())
    }

    /// The exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Failed(_) => 1,
            Self::ClosedPipe => 0,
        }
    }

    /// The same failure in a file, unless its file is already known.
    #[must_use]
    pub fn at(self, file: impl fmt::Display) -> Self {
        self.with(|place| {
            place.file.get_or_insert_with(|| file.to_string());
        })
    }

    /// The same failure in a line.
    #[must_use]
    pub fn line(self, line: usize) -> Self {
        self.with(|place| place.line = Some(line))
    }

    /// The same failure at a sample.
    #[must_use]
    pub fn sample(self, sample: usize) -> Self {
        self.with(|place| place.sample = Some(sample))
    }

    /// The same failure with a more precise location.
    #[must_use]
    pub(crate) fn with(mut self, change: impl FnOnce(&mut ErrorPlace)) -> Self {
        if let Self::Usage(fault) | Self::Failed(fault) = &mut self {
            change(&mut fault.place);
        }
        self
    }

    /// Kind of failure; `None` for a closed pipe.
    pub fn code(&self) -> Option<ErrorCode> {
        match self {
            Self::Usage(fault) | Self::Failed(fault) => Some(fault.code),
            Self::ClosedPipe => None,
        }
    }

    /// JSON document of the failure; `None` for a closed pipe.
    pub fn document(&self) -> Option<ErrorDocument<'_>> {
        match self {
            Self::Usage(fault) | Self::Failed(fault) => Some(fault.document()),
            Self::ClosedPipe => None,
        }
    }
}

impl Fault {
    fn new(code: ErrorCode, message: impl fmt::Display) -> Box<Self> {
        Box::new(Self {
            code,
            place: ErrorPlace::default(),
            message: message.to_string(),
        })
    }

    fn document(&self) -> ErrorDocument<'_> {
        let (message, hint) = what_and_hint(&self.message);
        ErrorDocument {
            error: ErrorReport {
                code: self.code,
                message,
                place: self.place.is_known().then_some(&self.place),
                hint,
            },
        }
    }
}

/// Name and version of the failure document.
pub const SCHEMA: &str = "torqcomp.error/1";

/// A failure, printed in place of a report.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ErrorDocument<'a> {
    /// Why the command failed.
    pub(crate) error: ErrorReport<'a>,
}

/// Why a command failed.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ErrorReport<'a> {
    /// Kind of the failure.
    code: ErrorCode,
    /// Human-readable message; its wording may change.
    message: &'a str,
    /// Location of the failure; `null` if there is no single one.
    #[serde(rename = "where")]
    place: Option<&'a ErrorPlace>,
    /// What was expected, or what to do; `null` if the message is sufficient.
    hint: Option<&'a str>,
}

/// Fault and remedy: the text before and after the first semicolon outside quotation marks and parentheses.
fn what_and_hint(message: &str) -> (&str, Option<&str>) {
    let (mut is_quoted, mut depth) = (false, 0_usize);
    for (i, c) in message.char_indices() {
        match c {
            '"' => is_quoted = !is_quoted,
            '(' if !is_quoted => depth += 1,
            ')' if !is_quoted => depth = depth.saturating_sub(1),
            ';' if !is_quoted && depth == 0 && message[i..].starts_with("; ") => {
                return (&message[..i], Some(&message[i + 2..]));
            }
            _ => {}
        }
    }
    (message, None)
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(fault) | Self::Failed(fault) => fault.fmt(f),
            Self::ClosedPipe => f.write_str("the reader of the output went away"),
        }
    }
}

impl std::error::Error for Failure {}

impl From<torqcomp_dsp::Error> for Failure {
    fn from(error: torqcomp_dsp::Error) -> Self {
        ErrorCode::UnsuitableRecord.failed(error)
    }
}

impl From<torqcomp_model::fit::FitError> for Failure {
    fn from(error: torqcomp_model::fit::FitError) -> Self {
        ErrorCode::NotIdentifiable.failed(error)
    }
}

/// The known name closest to a wrong one, as a sentence to end a message.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_stands_before_the_message_and_the_hint_behind_it() {
        let failure = ErrorCode::InvalidSample
            .failed("the cell reads \"a; b\" (or c; d); correct it; or cut the record there");
        let failure = failure.line(3).at("a.csv").at("b.csv");
        assert_eq!(
            failure.to_string(),
            "a.csv, line 3: the cell reads \"a; b\" (or c; d); correct it; or cut the record there"
        );
        let document = serde_json::to_value(failure.document()).unwrap();
        let error = &document["error"];
        assert_eq!(error["code"], "invalid-sample");
        assert_eq!(error["message"], "the cell reads \"a; b\" (or c; d)");
        assert_eq!(error["hint"], "correct it; or cut the record there");
        assert_eq!(error["where"]["file"], "a.csv");
        assert_eq!(error["where"]["line"], 3);
        assert!(error["where"]["byte"].is_null());
        assert!(Failure::ClosedPipe.document().is_none());
    }
}
