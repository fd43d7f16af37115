//! How far a long file has been read, said on a terminal.

use std::io::{self, IsTerminal, Read};
use std::time::{Duration, Instant};

use crate::failure::Failure;
use crate::io::Input;
use crate::print;

/// Time after which it is said.
const BEGINS: Duration = Duration::from_secs(2);
/// Time until it is said again.
const REPEATS: Duration = Duration::from_millis(500);

/// A file of known length that is read.
struct Followed {
    file: Box<dyn Read + Send>,
    name: String,
    length: u64,
    read: u64,
    begun: Instant,
    /// When it is said next.
    due: Duration,
}

/// Opens an input; on a terminal, a long way through a file is said.
///
/// # Errors
/// If it cannot be opened.
pub(super) fn open(input: &Input) -> Result<Box<dyn Read + Send>, Failure> {
    let file = input.open()?;
    let length = match input {
        Input::File(path) if io::stderr().is_terminal() => {
            std::fs::metadata(path).map_or(0, |meta| meta.len())
        }
        _ => 0,
    };
    if length == 0 {
        return Ok(file);
    }
    Ok(Box::new(Followed {
        file,
        name: input.name(),
        length,
        read: 0,
        begun: Instant::now(),
        due: BEGINS,
    }))
}

impl Followed {
    /// What is to be said after a time, with no text at the end of the file.
    fn said(&mut self, elapsed: Duration, is_end: bool) -> Option<String> {
        if is_end {
            return (self.due > BEGINS).then(String::new);
        }
        if elapsed < self.due {
            return None;
        }
        self.due = elapsed + REPEATS;
        let percent = (100.0 * self.read as f64 / self.length as f64).min(100.0);
        Some(format!("{percent:.0} % of {} read", self.name))
    }
}

impl Read for Followed {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(bytes)?;
        self.read += count as u64;
        let is_end = count == 0 && !bytes.is_empty();
        if let Some(text) = self.said(self.begun.elapsed(), is_end) {
            print::say_progress(&text);
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_said_after_two_seconds_and_cleared_at_the_end() {
        let mut file = Followed {
            file: Box::new(io::empty()),
            name: "a.csv".to_owned(),
            length: 800,
            read: 0,
            begun: Instant::now(),
            due: BEGINS,
        };
        let at = Duration::from_millis;
        assert_eq!(file.said(at(1900), false), None);
        assert_eq!(file.said(at(1950), true), None);
        file.read = 100;
        assert_eq!(file.said(at(2100), false).unwrap(), "12 % of a.csv read");
        assert_eq!(file.said(at(2500), false), None);
        file.read = 700;
        assert_eq!(file.said(at(2700), false).unwrap(), "88 % of a.csv read");
        assert_eq!(file.said(at(2800), true).unwrap(), "");
    }
}
