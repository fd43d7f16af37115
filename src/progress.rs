//! Progress on standard error: a line on a terminal, or JSON lines for programs.

use std::io::{self, IsTerminal};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::Serialize;

use crate::cli::ProgressMode;
use crate::print;

/// Delay before progress is shown on a terminal.
const BEGINS: Duration = Duration::from_secs(2);
/// Interval between progress lines.
const REPEATS: Duration = Duration::from_millis(500);

/// Name and version of the schema of a line.
pub(crate) const SCHEMA: &str = "torqcomp.progress/1";

/// Progress output of this process.
struct Display {
    style: Option<Style>,
    /// Time of the last progress line.
    last: Option<Instant>,
    /// Whether recordings are counted, so that none has progress lines of its own.
    counts_recordings: bool,
}

/// Form of progress output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    Line,
    Json,
}

static DISPLAY: Mutex<Display> = Mutex::new(Display {
    style: None,
    last: None,
    counts_recordings: false,
});

fn display() -> MutexGuard<'static, Display> {
    DISPLAY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Chooses the form of progress output. `--quiet` suppresses it, except for programs.
pub(crate) fn choose(mode: Option<ProgressMode>, is_quiet: bool) {
    let is_for_people = !is_quiet && io::stderr().is_terminal();
    display().style = match mode.unwrap_or(ProgressMode::Auto) {
        ProgressMode::Json => Some(Style::Json),
        ProgressMode::Auto if is_for_people => Some(Style::Line),
        ProgressMode::Auto | ProgressMode::Never => None,
    };
}

/// Kind of long task.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Task {
    /// Reading a file.
    Read(String),
    /// Processing many recordings.
    Recordings,
    /// Fitting models.
    Fits,
}

/// Amount of work, total or done: number of items, and bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Amount {
    pub(crate) count: u64,
    pub(crate) bytes: u64,
}

impl Amount {
    pub(crate) fn of_bytes(bytes: u64) -> Self {
        Self { count: 0, bytes }
    }

    pub(crate) fn of_count(count: usize) -> Self {
        Self {
            count: count as u64,
            bytes: 0,
        }
    }

    /// Fraction of a total: of its bytes, or of its items if it has none.
    fn share_of(self, all: Self) -> Option<f64> {
        let (part, whole) = match all.bytes {
            0 => (self.count, all.count),
            bytes => (self.bytes, bytes),
        };
        (whole > 0).then(|| (part as f64 / whole as f64).min(1.0))
    }
}

/// A task in progress.
pub(crate) struct Progress {
    task: Task,
    begun: Instant,
}

impl Progress {
    pub(crate) fn new(task: Task) -> Self {
        if task == Task::Recordings {
            display().counts_recordings = true;
        }
        Self {
            task,
            begun: Instant::now(),
        }
    }

    /// Prints the amount done and the total, if due.
    pub(crate) fn report(&self, done: Amount, all: Option<Amount>) {
        let mut display = display();
        let Some(style) = display.style else {
            return;
        };
        let is_part = display.counts_recordings && self.task != Task::Recordings;
        let elapsed = self.begun.elapsed();
        let since = display.last.map(|last| last.elapsed());
        if is_part || !is_due(style, elapsed, since) {
            return;
        }
        match style {
            Style::Json => print::say_line(&self.json(elapsed, done, all)),
            Style::Line => match self.text(elapsed, done, all) {
                Some(text) => print::show_line(text),
                None => return,
            },
        }
        display.last = Some(Instant::now());
    }

    /// The line for people; `None` as long as there is nothing to report.
    fn text(&self, elapsed: Duration, done: Amount, all: Option<Amount>) -> Option<String> {
        let all = all?;
        let share = done.share_of(all)?;
        Some(match &self.task {
            Task::Read(name) => format!("{:.0} % of {name} read", 100.0 * share),
            Task::Fits => format!("{} of {} fits", done.count, all.count),
            Task::Recordings => {
                let seconds = elapsed.as_secs_f64().max(1e-3);
                let mut text = format!(
                    "{} of {} recordings, {}",
                    done.count,
                    all.count,
                    rate(done, seconds)
                );
                if let Some(left) = seconds_left(seconds, share) {
                    text += &format!(", {} left", duration(left));
                }
                text
            }
        })
    }

    /// The line for programs.
    fn json(&self, elapsed: Duration, done: Amount, all: Option<Amount>) -> String {
        let share = all.and_then(|all| done.share_of(all));
        let (task, file) = match &self.task {
            Task::Read(name) => ("read", Some(name.as_str())),
            Task::Recordings => ("recordings", None),
            Task::Fits => ("fits", None),
        };
        let counts = |amount: Amount| (task != "read").then_some(amount.count);
        let bytes = |amount: Amount| (task != "fits").then_some(amount.bytes);
        let seconds = elapsed.as_secs_f64();
        print::json_line(&ProgressLine {
            progress: share,
            schema: SCHEMA,
            task,
            file,
            done: counts(done),
            total: all.and_then(counts),
            bytes_done: bytes(done),
            bytes_total: all.and_then(bytes),
            seconds,
            seconds_left: share.and_then(|share| seconds_left(seconds, share)),
        })
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        let is_whole = self.task == Task::Recordings;
        if is_whole || !display().counts_recordings {
            print::clear_line();
        }
    }
}

/// Progress of a task: a line on standard error with `--progress json`, at most one in half a second.
#[derive(Serialize, JsonSchema)]
pub(crate) struct ProgressLine<'a> {
    /// Fraction done, from 0 to 1; `null` if the total is unknown.
    progress: Option<f64>,
    /// Name and version of the form of this line.
    schema: &'static str,
    /// Current task: `read` (a file), `recordings` (many, each by itself) or `fits` (of models).
    task: &'static str,
    /// Name of the file being read; `null` for other tasks.
    file: Option<&'a str>,
    /// Recordings or fits done; `null` for a file being read.
    done: Option<u64>,
    /// Recordings or fits in all; `null` if unknown.
    total: Option<u64>,
    /// Bytes read, or in the recordings done; `null` for fits.
    bytes_done: Option<u64>,
    /// Bytes in all; `null` if unknown.
    bytes_total: Option<u64>,
    /// Time since the task began, in s.
    seconds: f64,
    /// Estimated time remaining, in s; `null` if unknown.
    seconds_left: Option<f64>,
}

/// Whether a line is due, given the times since the start of the task and since the last line.
fn is_due(style: Style, elapsed: Duration, since: Option<Duration>) -> bool {
    let has_begun = style == Style::Json || elapsed >= BEGINS;
    has_begun && since.is_none_or(|since| since >= REPEATS)
}

/// Recordings and megabytes per second.
pub(crate) fn rate(amount: Amount, seconds: f64) -> String {
    format!(
        "{} recordings/s, {} MB/s",
        print::rounded(amount.count as f64 / seconds, 3),
        print::rounded(1e-6 * amount.bytes as f64 / seconds, 3)
    )
}

fn seconds_left(seconds: f64, share: f64) -> Option<f64> {
    (share > 0.0 && share < 1.0).then(|| seconds * (1.0 - share) / share)
}

/// Remaining time, rounded to what the estimate supports.
fn duration(seconds: f64) -> String {
    let seconds = seconds.ceil() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes} min {seconds} s"),
        (hours, minutes, _) => format!("{hours} h {minutes} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_shows_it_after_two_seconds_and_a_program_at_once() {
        let ms = Duration::from_millis;
        assert!(!is_due(Style::Line, ms(1999), None));
        assert!(is_due(Style::Line, ms(2000), None));
        assert!(is_due(Style::Json, ms(0), None));
        for style in [Style::Line, Style::Json] {
            assert!(!is_due(style, ms(9000), Some(ms(499))));
            assert!(is_due(style, ms(9000), Some(ms(500))));
        }
    }

    #[test]
    fn the_share_of_a_file_is_said_if_its_length_is_known() {
        let read = Progress::new(Task::Read("a.csv".to_owned()));
        let of = |bytes| Some(Amount::of_bytes(bytes));
        let text = read.text(Duration::ZERO, Amount::of_bytes(100), of(800));
        assert_eq!(text.unwrap(), "12 % of a.csv read");
        assert_eq!(read.text(Duration::ZERO, Amount::of_bytes(100), None), None);
        let line = read.json(Duration::from_secs(3), Amount::of_bytes(200), of(800));
        assert_eq!(
            line,
            "{\"progress\":0.25,\"schema\":\"torqcomp.progress/1\",\"task\":\"read\",\"file\":\"a.csv\",\"done\":null,\
             \"total\":null,\"bytes_done\":200,\"bytes_total\":800,\"seconds\":3.0,\"seconds_left\":9.0}\n"
        );
        let unknown = read.json(Duration::ZERO, Amount::of_bytes(200), None);
        assert!(unknown.starts_with("{\"progress\":null,"), "{unknown}");
    }

    #[test]
    fn the_time_left_of_many_recordings_follows_the_bytes() {
        // Not by `new`, which affects the whole process.
        let progress = Progress {
            task: Task::Recordings,
            begun: Instant::now(),
        };
        let amount = |count, bytes| Amount { count, bytes };
        let (done, all) = (amount(1, 4_000_000), amount(10, 40_000_000));
        assert_eq!(
            progress
                .text(Duration::from_secs(8), done, Some(all))
                .unwrap(),
            "1 of 10 recordings, 0.125 recordings/s, 0.5 MB/s, 1 min 12 s left"
        );
        assert_eq!(duration(7262.0), "2 h 1 min");
        assert_eq!(duration(0.4), "1 s");
    }
}
