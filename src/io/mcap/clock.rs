//! Comparison of the clock of the messages' own stamps with that of the recorder.

use crate::print::plural;

/// Largest difference of two clocks without a warning, in ns: one day.
const DAY_NS: i64 = 86_400_000_000_000;
/// Largest drift between the clocks without a warning, relative to the record's length.
const DRIFT: f64 = 0.01;
/// The same in ns.
const DRIFT_NS: i64 = 100_000_000;

/// Statistics of both clocks.
#[derive(Debug, Default)]
pub struct ClockCheck {
    /// Stamp minus log time in ns: of the first message, minimum and maximum.
    offsets: Option<(i64, i64, i64)>,
    /// First and last log time, in ns.
    log: Option<(i64, i64)>,
    /// Number of zero stamps.
    zeros: u64,
}

impl ClockCheck {
    /// Records the two times of a message.
    #[inline]
    pub fn note(&mut self, stamp_ns: Option<i64>, log_time_ns: u64) {
        let Some(stamp_ns) = stamp_ns else {
            return;
        };
        self.zeros += u64::from(stamp_ns == 0);
        let Ok(log_ns) = i64::try_from(log_time_ns) else {
            return;
        };
        let offset = stamp_ns.saturating_sub(log_ns);
        self.offsets = Some(match self.offsets {
            None => (offset, offset, offset),
            Some((first, least, greatest)) => (first, least.min(offset), greatest.max(offset)),
        });
        self.log = Some(match self.log {
            None => (log_ns, log_ns),
            Some((first, last)) => (first.min(log_ns), last.max(log_ns)),
        });
    }

    /// Warnings about the clocks.
    pub fn warnings(&self) -> Vec<String> {
        let mut said = Vec::new();
        if self.zeros > 0 {
            let messages = plural(self.zeros, "message");
            said.push(format!("{messages} with a time stamp of zero"));
        }
        let (Some((first, least, greatest)), Some((start, end))) = (self.offsets, self.log) else {
            return said;
        };
        let drift = greatest.saturating_sub(least);
        let length = end.saturating_sub(start) as f64;
        if first.saturating_abs() > DAY_NS {
            said.push(format!(
                "the messages' own clock and the recorder's differ by {:.0} s: they have different epochs",
                first as f64 / 1e9
            ));
        }
        if drift > DRIFT_NS && drift as f64 > DRIFT * length {
            said.push(format!(
                "the messages' own stamps and the log times drift apart by {:.3} s over {:.3} s: \
                 one of the clocks is wrong or was set, or messages were delayed",
                drift as f64 / 1e9,
                length / 1e9
            ));
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(times: &[(i64, u64)]) -> Vec<String> {
        let mut clock = ClockCheck::default();
        for (stamp, log) in times {
            clock.note(Some(*stamp), *log);
        }
        clock.warnings()
    }

    #[test]
    fn clocks_that_agree_need_no_word() {
        assert!(said(&[(1_000, 2_000), (1_000_001_000, 1_050_000_000)]).is_empty());
        assert!(said(&[]).is_empty());
    }

    #[test]
    fn other_zeros_and_drift_are_said() {
        let day = 100_000 * 1_000_000_000_u64;
        assert!(said(&[(1, day)])[0].contains("they have different epochs"));
        let second = 1_000_000_000;
        assert!(said(&[(1, 1), (2 * second, 1_000_000_000)])[0].contains("drift apart by 1.000 s"));
        assert!(said(&[(0, 1)])[0].contains("time stamp of zero"));
    }
}
