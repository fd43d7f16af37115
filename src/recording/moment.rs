//! Times of a record with nanosecond resolution, as text and as dates.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_decimal::digits;

/// Nanoseconds of a second.
const SECOND: i64 = 1_000_000_000;

/// A time of a record: seconds after an origin in nanoseconds, since those since 1970 would cost an `f64` its last
/// digits.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "StartMoment")]
#[schemars(from = "StartMoment")]
pub struct Moment {
    /// Nanoseconds at which the clock was at the origin; 0 for a clock that begins with the record.
    pub origin_ns: i64,
    /// Seconds after that.
    pub after_s: f64,
}

impl Moment {
    /// A time on a clock with its own origin.
    pub fn of_seconds(after_s: f64) -> Self {
        Self {
            origin_ns: 0,
            after_s,
        }
    }

    /// The time in seconds, to the precision of an `f64`.
    pub fn seconds(self) -> f64 {
        if self.origin_ns == 0 {
            return self.after_s;
        }
        let ns = self.nanoseconds();
        ns.div_euclid(SECOND) as f64 + ns.rem_euclid(SECOND) as f64 * 1e-9
    }

    /// The time in nanoseconds.
    pub fn nanoseconds(self) -> i64 {
        self.origin_ns
            .saturating_add((self.after_s * 1e9).round() as i64)
    }

    /// The time `seconds` later.
    #[must_use]
    pub fn later(self, seconds: f64) -> Self {
        Self {
            after_s: self.after_s + seconds,
            ..self
        }
    }

    /// Date and time in UTC, if the clock counts from 1970.
    pub fn date(self) -> Option<String> {
        date_and_time(self.nanoseconds()).filter(|_| self.origin_ns != 0)
    }

    /// The time as text, to seven digits if that loses nothing.
    pub fn short(self) -> String {
        match self.origin_ns {
            0 => format!("{} s", digits::text(self.after_s, 7)),
            _ => format!("{} s", seconds(self.nanoseconds())),
        }
    }

    /// The time as text with all digits, and its date if it is one.
    ///
    /// ```
    /// use torqcomp::recording::moment::Moment;
    /// assert_eq!(Moment::of_seconds(0.25).text(), "0.25 s");
    /// let moment = Moment { origin_ns: 1_710_250_000_000_000_000, after_s: 0.123_456_789 };
    /// assert_eq!(moment.text(), "1710250000.123456789 s (2024-03-12T13:26:40.123456789Z)");
    /// ```
    pub fn text(self) -> String {
        if self.origin_ns == 0 {
            return format!("{} s", digits::text(self.after_s, 12));
        }
        let text = format!("{} s", seconds(self.nanoseconds()));
        match self.date() {
            Some(date) => format!("{text} ({date})"),
            None => text,
        }
    }
}

/// A moment in a document: beside the seconds, which lose the last digits of a date, the nanoseconds and the date.
#[derive(Serialize, JsonSchema)]
struct StartMoment {
    /// Time of the first sample on the time axis of the record, in s.
    start_s: f64,
    /// Time of the first sample in ns, `null` if the clock starts with the record.
    start_ns: Option<i64>,
    /// Date and time of the first sample in UTC, `null` if the clock does not count from 1970.
    start_time: Option<String>,
}

impl From<Moment> for StartMoment {
    fn from(moment: Moment) -> Self {
        Self {
            start_s: moment.seconds(),
            start_ns: (moment.origin_ns != 0).then(|| moment.nanoseconds()),
            start_time: moment.date(),
        }
    }
}

/// Nanoseconds as seconds, without trailing zeros.
fn seconds(ns: i64) -> String {
    let sign = if ns < 0 { "-" } else { "" };
    let (whole, part) = (
        ns.unsigned_abs() / SECOND as u64,
        ns.unsigned_abs() % SECOND as u64,
    );
    let text = format!("{sign}{whole}.{part:09}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Date and time in UTC from nanoseconds since 1970, if plausible: from 2000 on.
pub fn date_and_time(ns: i64) -> Option<String> {
    const YEAR_2000_NS: i64 = 946_684_800_000_000_000;
    let (seconds, rest) = (ns / SECOND, ns % SECOND);
    (ns >= YEAR_2000_NS).then(|| format!("{}.{rest:09}Z", utc(seconds.unsigned_abs())))
}

/// Date and time in UTC of seconds since 1970.
///
/// The date with years counted from March of year 0, so that leap days come last: an era of 400
/// years has 146 097 days (ISO 8601, proleptic Gregorian calendar).
pub(crate) fn utc(seconds: u64) -> String {
    let (days, of_day) = (seconds / 86_400 + 719_468, seconds % 86_400);
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (month, later) = if month < 10 {
        (month + 3, 0)
    } else {
        (month - 9, 1)
    };
    format!(
        "{:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}",
        400 * era + year + later,
        of_day / 3600,
        of_day / 60 % 60,
        of_day % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        let at = |seconds: i64| date_and_time(seconds * 1_000_000_000).unwrap();
        assert_eq!(at(946_684_800), "2000-01-01T00:00:00.000000000Z");
        assert_eq!(at(951_782_400), "2000-02-29T00:00:00.000000000Z");
        assert_eq!(at(1_000_000_000), "2001-09-09T01:46:40.000000000Z");
        assert_eq!(at(1_709_210_096), "2024-02-29T12:34:56.000000000Z");
        assert_eq!(at(4_102_444_799), "2099-12-31T23:59:59.000000000Z");
        assert_eq!(date_and_time(12), None);
        assert_eq!(utc(0), "1970-01-01T00:00:00");
    }

    #[test]
    fn seconds_keep_their_nanoseconds() {
        assert_eq!(seconds(1_710_250_000_000_000_001), "1710250000.000000001");
        assert_eq!(seconds(-1_500_000_000), "-1.5");
        assert_eq!(seconds(20_000_000_000), "20");
        let late = Moment {
            origin_ns: i64::MAX,
            after_s: 1.0,
        };
        assert_eq!(late.nanoseconds(), i64::MAX);
    }
}
