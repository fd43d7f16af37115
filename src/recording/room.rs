//! Check that a job fits in memory.

use super::text::TextFile;
use crate::failure::{ErrorCode, Failure};
use crate::io::Input;
use crate::print;

/// Minimum memory per number of a text, in bytes.
const LEAST: u64 = 8;
/// The same including the processing by a command.
const USUAL: u64 = 24;

/// Memory in bytes, as reported by the system.
#[derive(Debug, Clone, Copy, Default)]
struct Room {
    /// Free or reclaimable memory of the machine.
    free: Option<u64>,
    /// Limit of this process.
    allowed: Option<u64>,
}

/// Memory that a job takes, in bytes.
pub(crate) struct MemoryNeed<'a> {
    /// The input, for messages.
    pub(crate) name: &'a str,
    /// What takes it, in the warning, after the name, and in the failure.
    pub(crate) takes: [&'a str; 2],
    /// What to do instead.
    pub(crate) remedy: &'a str,
    pub(crate) least: u64,
    pub(crate) usual: u64,
}

impl MemoryNeed<'_> {
    /// Warns if it is more than is free.
    ///
    /// # Errors
    /// If it exceeds the limit of the process.
    pub(crate) fn look(&self) -> Result<(), Failure> {
        if let Some(text) = Room::of_system().said_of(self)? {
            print::note(&format!("torqcomp: {text}\n"));
        }
        Ok(())
    }

    /// Reading a number of numbers of a text.
    fn of_numbers(numbers: u64, name: &str) -> MemoryNeed<'_> {
        MemoryNeed {
            name,
            takes: [" is read as a whole, which takes", "its numbers take"],
            remedy: "cut the file into parts",
            least: LEAST.saturating_mul(numbers),
            usual: USUAL.saturating_mul(numbers),
        }
    }
}

/// Warns if the numbers of a text, up to `most`, will take more memory than is free.
///
/// # Errors
/// If they exceed the limit of the process, before they are read or anything is written.
pub(super) fn look(input: &Input, text: &TextFile, most: usize) -> Result<(), Failure> {
    let Some(path) = input.plain_file() else {
        return Ok(());
    };
    let length = std::fs::metadata(path).map_or(0, |meta| meta.len());
    let numbers = text.numbers_in(length).min(most as u64);
    MemoryNeed::of_numbers(numbers, &input.name()).look()
}

impl Room {
    fn of_system() -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        Self {
            free: number_behind(&read("/proc/meminfo"), "MemAvailable:").map(|kib| 1024 * kib),
            allowed: number_behind(&read("/proc/self/limits"), "Max address space"),
        }
    }

    fn said_of(self, need: &MemoryNeed) -> Result<Option<String>, Failure> {
        let MemoryNeed {
            name,
            takes: [takes, take],
            remedy,
            least,
            usual,
        } = *need;
        let gb = |bytes: u64| print::rounded(bytes as f64 * 1e-9, 2);
        if let Some(allowed) = self.allowed.filter(|allowed| least > *allowed) {
            return Err(ErrorCode::NotEnoughRoom.failed(format_args!(
                "{take} at least {} GB of memory, and this process may have {} GB; raise the limit (ulimit -v), or \
                 {remedy}",
                gb(least),
                gb(allowed)
            ))
            .at(name));
        }
        let is_short = |free: &u64| usual > *free;
        Ok(self.free.filter(is_short).map(|free| {
            format!(
                "{name}{takes} about {} GB of memory, and {} GB are free; if it fails, {remedy}",
                gb(usual),
                gb(free)
            )
        }))
    }
}

/// The whole number after a name that begins a line.
fn number_behind(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_system_says_is_read() {
        let memory = "MemTotal:       24000000 kB\nMemAvailable:    3000000 kB\n";
        assert_eq!(number_behind(memory, "MemAvailable:"), Some(3_000_000));
        let limits =
            "Max address space         1024000000           unlimited            bytes     \n";
        assert_eq!(
            number_behind(limits, "Max address space"),
            Some(1_024_000_000)
        );
        let none =
            "Max address space         unlimited            unlimited            bytes     \n";
        assert_eq!(number_behind(none, "Max address space"), None);
    }

    #[test]
    fn a_text_that_has_no_room_is_refused_and_a_tight_one_is_said() {
        let room = Room {
            free: Some(3_000_000_000),
            allowed: Some(2_000_000_000),
        };
        assert_eq!(
            room.said_of(&MemoryNeed::of_numbers(120_000_000, "a.csv")),
            Ok(None)
        );
        // 0.15 thousand million numbers of 24 bytes.
        let said = room
            .said_of(&MemoryNeed::of_numbers(150_000_000, "a.csv"))
            .unwrap()
            .unwrap();
        assert!(
            said.contains("about 3.6 GB of memory, and 3 GB are free"),
            "{said}"
        );
        let refused = room
            .said_of(&MemoryNeed::of_numbers(300_000_000, "a.csv"))
            .unwrap_err()
            .to_string();
        assert!(
            refused.contains("at least 2.4 GB of memory, and this process may have 2 GB"),
            "{refused}"
        );
        assert_eq!(
            Room::default().said_of(&MemoryNeed::of_numbers(u64::MAX, "a.csv")),
            Ok(None)
        );
    }
}
