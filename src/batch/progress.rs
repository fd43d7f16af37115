//! How far the work over many recordings has got, said on a terminal.

use std::io::{self, IsTerminal};
use std::time::{Duration, Instant};

use crate::print;

/// Time until it is said again.
const REPEATS: Duration = Duration::from_millis(200);

/// Recordings and bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Amount {
    pub(super) files: usize,
    pub(super) bytes: u64,
}

/// What there is to do, and what is done.
pub(super) struct BatchProgress {
    all: Amount,
    done: Amount,
    begun: Instant,
    said: Option<Duration>,
    is_shown: bool,
}

impl BatchProgress {
    pub(super) fn new(all: Amount, quiet: bool) -> Self {
        Self {
            all,
            done: Amount::default(),
            begun: Instant::now(),
            said: None,
            is_shown: !quiet && io::stderr().is_terminal(),
        }
    }

    /// Counts a recording that is done.
    pub(super) fn add(&mut self, bytes: u64) {
        self.done.files += 1;
        self.done.bytes += bytes;
        let elapsed = self.begun.elapsed();
        let is_due = self.said.is_none_or(|said| elapsed >= said + REPEATS);
        if self.is_shown && is_due {
            self.said = Some(elapsed);
            print::show_progress(&self.text(elapsed));
        }
    }

    /// Clears the line.
    pub(super) fn end(&self) {
        if self.said.is_some() {
            print::show_progress("");
        }
    }

    fn text(&self, elapsed: Duration) -> String {
        let seconds = elapsed.as_secs_f64().max(1e-3);
        let Amount { files, bytes } = self.done;
        let mut text = format!(
            "{files} of {} recordings, {}",
            self.all.files,
            rate(self.done, seconds)
        );
        if bytes > 0 && self.all.bytes > bytes {
            let left = seconds * (self.all.bytes - bytes) as f64 / bytes as f64;
            text += &format!(", {} left", duration(left));
        }
        text
    }
}

/// Recordings and megabytes a second.
pub(super) fn rate(amount: Amount, seconds: f64) -> String {
    format!(
        "{} recordings/s, {} MB/s",
        print::rounded(amount.files as f64 / seconds, 3),
        print::rounded(1e-6 * amount.bytes as f64 / seconds, 3)
    )
}

/// A time to come, as coarse as it is known.
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
    fn the_time_left_follows_the_bytes() {
        let mut progress = BatchProgress::new(
            Amount {
                files: 10,
                bytes: 40_000_000,
            },
            true,
        );
        progress.add(4_000_000);
        assert_eq!(
            progress.text(Duration::from_secs(8)),
            "1 of 10 recordings, 0.125 recordings/s, 0.5 MB/s, 1 min 12 s left"
        );
        assert_eq!(duration(7262.0), "2 h 1 min");
        assert_eq!(duration(0.4), "1 s");
    }
}
