//! Log of runs: a file of JSON lines, one per event, to which any number of runs append.

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use schemars::JsonSchema;
use serde::Serialize;

use crate::failure::{ErrorReport, Failure};
use crate::file_name::ShowPath;
use crate::io::json_lines::JsonLines;
use crate::io::output;
use crate::print;
use crate::recording::moment::utc;
use crate::warning::Warning;

/// Name and version of the schema of a line.
pub(crate) const SCHEMA: &str = "torqcomp.log/1";
/// Beginning of every line.
pub(crate) const BEGINNING: &str = "{\"schema\":\"torqcomp.log/";

/// The log of this run, if it has one.
static LOG: Mutex<Option<Log>> = Mutex::new(None);

struct Log {
    lines: JsonLines,
    run: String,
    begun: Instant,
    /// Why a line could not be written.
    broken: Option<Failure>,
}

/// An event of a run. A run without the event `end` was killed, or is still running.
#[derive(Serialize, JsonSchema)]
pub(crate) struct LogLine<'a> {
    /// Name and version of the form of this line.
    schema: &'static str,
    /// Version of torqcomp.
    version: &'static str,
    /// Date and time in UTC (ISO 8601).
    time: String,
    /// Identifier of the run, the same in all of its lines and unique on this machine.
    run: &'a str,
    #[serde(flatten)]
    event: LogEvent<'a>,
}

/// What happened.
#[derive(Serialize, JsonSchema)]
#[serde(tag = "event", rename_all = "kebab-case")]
enum LogEvent<'a> {
    /// The run began.
    Start {
        /// The command line, the program first.
        command: Vec<String>,
        /// Folder that paths are relative to; `null` if unknown.
        folder: Option<String>,
    },
    /// A warning.
    Warning {
        /// The recording concerned; `null` in a run over a single one.
        file: Option<&'a str>,
        /// Stable code of the warning.
        code: &'a str,
        /// Human-readable message.
        message: &'a str,
    },
    /// A failure, of the run or of a recording among many.
    Failure {
        #[serde(flatten)]
        report: ErrorReport<'a>,
    },
    /// The run ended.
    End {
        /// Exit code.
        exit: u8,
        /// Time since the start, in s.
        seconds: f64,
    },
}

fn log() -> MutexGuard<'static, Option<Log>> {
    LOG.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Log {
    /// Writes events; the first failure is kept for the end.
    fn append<'a>(&mut self, events: impl IntoIterator<Item = LogEvent<'a>>) {
        let time = now();
        let line = |event| LogLine {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            time: time.clone(),
            run: &self.run,
            event,
        };
        let lines = events
            .into_iter()
            .map(|e| print::json_line(&line(e)))
            .collect();
        if let Err(failure) = self.lines.append(lines) {
            self.broken.get_or_insert(failure);
        }
    }
}

/// Starts the log of this run.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn begin(path: &Path) -> Result<(), Failure> {
    let mut new = Log {
        lines: JsonLines::open(path, BEGINNING, true)?,
        run: format!("{}-{}", now(), std::process::id()),
        begun: Instant::now(),
        broken: None,
    };
    output::keep_free(path);
    let words = std::env::args_os();
    new.append([LogEvent::Start {
        command: words.map(|word| word.shown().to_string()).collect(),
        folder: std::env::current_dir()
            .ok()
            .map(|path| path.shown().to_string()),
    }]);
    match new.broken.take() {
        Some(failure) => Err(failure),
        None => {
            *log() = Some(new);
            Ok(())
        }
    }
}

/// Logs warnings about one of many recordings or the only one.
pub(crate) fn warnings(file: Option<&str>, warnings: &[Warning]) {
    if let Some(log) = log().as_mut()
        && !warnings.is_empty()
    {
        log.append(warnings.iter().map(|warning| LogEvent::Warning {
            file,
            code: warning.code,
            message: &warning.message,
        }));
    }
}

/// Logs a failure of the run or of one of many recordings.
pub(crate) fn failure(failure: &Failure) {
    if let (Some(log), Some(document)) = (log().as_mut(), failure.document()) {
        log.append([LogEvent::Failure {
            report: document.error,
        }]);
    }
}

/// Logs the end of the run.
///
/// # Errors
/// If an event could not be written.
pub(crate) fn end(exit: u8) -> Result<(), Failure> {
    let Some(mut log) = log().take() else {
        return Ok(());
    };
    let seconds = log.begun.elapsed().as_secs_f64();
    log.append([LogEvent::End { exit, seconds }]);
    log.broken.map_or(Ok(()), Err)
}

/// Date and time in UTC, to the millisecond.
fn now() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let since = since.unwrap_or_default();
    format!("{}.{:03}Z", utc(since.as_secs()), since.subsec_millis())
}
