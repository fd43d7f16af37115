//! Whether a text that is read as a whole has room in memory.

use crate::failure::Failure;
use crate::io::Input;
use crate::print;

/// Memory for each byte of a text, at least: itself, and eight bytes for each of its numbers.
const LEAST_PER_BYTE: u64 = 2;
/// The same with the copies of a channel or two that a verb works on.
const USUAL_PER_BYTE: u64 = 4;

/// Memory in bytes, as far as the system says.
#[derive(Debug, Clone, Copy, Default)]
struct Room {
    /// What is free, or can be freed, on the machine.
    free: Option<u64>,
    /// What this process may have in all.
    allowed: Option<u64>,
}

/// Says it beforehand if a text will take more memory than the machine has free.
///
/// # Errors
/// If it cannot have room within what the process may have: before anything is read or written.
pub(super) fn look(input: &Input) -> Result<(), Failure> {
    let Input::File(path) = input else {
        return Ok(());
    };
    let length = std::fs::metadata(path).map_or(0, |meta| meta.len());
    if let Some(text) = Room::of_system().said_of(length, &input.name())? {
        print::say(&format!("torqcomp: {text}\n"));
    }
    Ok(())
}

impl Room {
    fn of_system() -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        Self {
            free: number_behind(&read("/proc/meminfo"), "MemAvailable:").map(|kib| 1024 * kib),
            allowed: number_behind(&read("/proc/self/limits"), "Max address space"),
        }
    }

    fn said_of(self, length: u64, name: &str) -> Result<Option<String>, Failure> {
        let least = LEAST_PER_BYTE.saturating_mul(length);
        let usual = USUAL_PER_BYTE.saturating_mul(length);
        let gb = |bytes: u64| print::rounded(bytes as f64 * 1e-9, 2);
        if let Some(allowed) = self.allowed.filter(|allowed| least > *allowed) {
            return Err(Failure::failed(format_args!(
                "{name}: read as a whole it takes at least {} GB of memory, and this process may have {} GB; raise the limit \
                 (ulimit -v), or cut the file into parts",
                gb(least),
                gb(allowed)
            )));
        }
        let is_short = |free: &u64| usual > *free;
        Ok(self.free.filter(is_short).map(|free| {
            format!(
                "{name} is read as a whole, which takes about {} GB of memory, and {} GB are free; if it fails, cut the file \
                 into parts",
                gb(usual),
                gb(free)
            )
        }))
    }
}

/// The whole number behind a name that begins a line.
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
        assert_eq!(room.said_of(700_000_000, "a.csv"), Ok(None));
        // Four times 0.8 GB are 3.2 GB.
        let said = room.said_of(800_000_000, "a.csv").unwrap().unwrap();
        assert!(
            said.contains("about 3.2 GB of memory, and 3 GB are free"),
            "{said}"
        );
        let refused = room
            .said_of(1_100_000_000, "a.csv")
            .unwrap_err()
            .to_string();
        assert!(
            refused.contains("at least 2.2 GB of memory, and this process may have 2 GB"),
            "{refused}"
        );
        assert_eq!(Room::default().said_of(u64::MAX, "a.csv"), Ok(None));
    }
}
