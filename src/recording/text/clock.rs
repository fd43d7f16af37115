//! Dates and times of day as written by recorders: `12:34:56.789`, `2026-03-26T14:34:31Z`, `26.03.2026 14:34:31,5`,
//! `3/26/2026 2:34:31 PM`, `26-Mar-2026`; times since a start with days, `0 days 00:00:01.5`.
//!
//! Only differences are used, so a time zone matters only if it changes within a record, and the order of day and month
//! between slashes only if both are at most 12 (the month is then taken to be first).

use super::vocabulary::meaning;
use crate::recording::moment::date_and_time;

/// Seconds since 1970, for 2001 to 2128.
pub const EPOCH_S: std::ops::Range<f64> = 1e9..5e9;
/// Nanoseconds of a second.
const SECOND: i64 = 1_000_000_000;
/// Nanoseconds of a day.
const DAY: i64 = 86_400 * SECOND;

/// A date, a time of day, or both.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Clock {
    /// Days since 1970-01-01.
    pub day: Option<i32>,
    /// Nanoseconds since midnight.
    pub nanoseconds: Option<i64>,
    /// Offset of its time zone from UTC in seconds, if given.
    pub ahead_s: Option<i32>,
    /// Whether it shows only minutes and seconds.
    pub is_without_hours: bool,
}

/// The time that a clock showed at the origin of stamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockOrigin {
    /// Nanoseconds since 1970, or since midnight, in its time zone.
    pub ns: i64,
    /// Offset of its time zone from UTC in seconds, if known.
    pub ahead_s: Option<i32>,
}

impl ClockOrigin {
    /// Nanoseconds since 1970 in UTC.
    pub fn utc(ns: i64) -> Self {
        Self {
            ns,
            ahead_s: Some(0),
        }
    }
}

impl Clock {
    /// What this clock showed, as the origin of stamps.
    pub fn as_origin(self) -> ClockOrigin {
        ClockOrigin {
            ns: self.total(),
            ahead_s: self.ahead_s,
        }
    }

    /// Nanoseconds since 1970, or since midnight, on a clock in the zone of another origin. `None` if only this one's
    /// zone is known.
    pub fn total_in_zone_of(self, origin: ClockOrigin) -> Option<i64> {
        let Some(own) = self.ahead_s else {
            return Some(self.total());
        };
        let ahead_s = i64::from(origin.ahead_s?) - i64::from(own);
        Some(self.total() + ahead_s * SECOND)
    }

    /// Parses a cell that contains nothing else.
    ///
    /// ```
    /// use torqcomp::recording::text::Clock;
    /// let clock = Clock::parse("1970-01-02 00:00:01.5").unwrap();
    /// assert_eq!((clock.day, clock.nanoseconds), (Some(1), Some(1_500_000_000)));
    /// assert_eq!(Clock::parse("1.5"), None);
    /// ```
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if let Some(clock) = Self::compact(text) {
            return Some(clock);
        }
        // The shortest is 1:02:03, the longest has a date, 19 decimals and a zone.
        if !(6..=60).contains(&text.len()) || !may_be_clock(text) {
            return None;
        }
        if let Some(clock) = time_of_day(text).or_else(|| since_start(text)) {
            return Some(clock);
        }
        if let Some(day) = date(text) {
            return Some(Self {
                day: Some(day),
                ..Self::default()
            });
        }
        text.char_indices()
            .filter(|(_, c)| matches!(c, ' ' | 'T' | '_' | ',' | ';'))
            .find_map(|(place, c)| {
                let day = date(text[..place].trim())?;
                let rest = text[place + c.len_utf8()..].trim();
                Some(Self {
                    day: Some(day),
                    ..time_of_day(rest)?
                })
            })
    }

    /// Parses fourteen digits of a date and time, with or without decimals: `20210304235958.05`.
    pub fn compact(text: &str) -> Option<Self> {
        let (whole, decimals) = text.split_once('.').unwrap_or((text, ""));
        if whole.len() != 14 || !whole.bytes().all(|byte| byte.is_ascii_digit()) {
            return None;
        }
        let part = |from: usize, to: usize| whole[from..to].parse::<i64>().ok();
        let (hours, minutes, seconds) = (part(8, 10)?, part(10, 12)?, part(12, 14)?);
        let day = days(part(0, 4)? as i32, part(4, 6)? as u32, part(6, 8)? as u32)?;
        (hours < 24 && minutes < 60 && seconds <= 60).then_some(Self {
            day: Some(day),
            nanoseconds: Some(
                ((hours * 60 + minutes) * 60 + seconds) * SECOND + fraction(decimals)?,
            ),
            ..Self::default()
        })
    }

    /// Date and time in an ISO 8601 format, with the given zone, if a text is unambiguous.
    ///
    /// ```
    /// use torqcomp::recording::text::Clock;
    /// assert_eq!(Clock::iso("14.03.2025 10:11:12,5").unwrap(), "2025-03-14T10:11:12.5");
    /// assert_eq!(Clock::iso("2025-03-14 10:11:12+01:00").unwrap(), "2025-03-14T10:11:12+01:00");
    /// assert_eq!(Clock::iso("03/04/2025 10:11:12"), None);
    /// ```
    pub fn iso(text: &str) -> Option<String> {
        let clock = Self::parse(text)?;
        let (Some(_), Some(_), false) = (clock.day, clock.nanoseconds, is_ambiguous(text)) else {
            return None;
        };
        let utc = date_and_time(clock.total())?;
        let (_, behind_hour) = text.split_once(':')?;
        let zone = match behind_hour.find(['+', '-']) {
            Some(place) => behind_hour[place..].trim(),
            None if behind_hour.ends_with(['Z', 'z', 'C', 'c', 'T', 't']) => "Z",
            None => "",
        };
        let without_zeros = utc.trim_end_matches('Z').trim_end_matches('0');
        Some(format!("{}{zone}", without_zeros.trim_end_matches('.')))
    }

    /// The same, or the text as written if it is ISO 8601 already.
    pub fn iso_or_as_written(text: &str) -> String {
        let is_iso =
            text.as_bytes().get(4) == Some(&b'-') && text.as_bytes().get(10) == Some(&b'T');
        let found = Self::iso(text).filter(|_| !is_iso);
        found.unwrap_or_else(|| text.to_owned())
    }

    /// Seconds after another one; the zone may change between them at the end of daylight saving
    /// time.
    pub fn seconds_after(self, first: Self) -> f64 {
        let zones = self.ahead_s.zip(first.ahead_s);
        let ahead_s = zones.map_or(0, |(own, other)| own - other);
        (self.total() - first.total() - i64::from(ahead_s) * SECOND) as f64 * 1e-9
    }

    /// Seconds after which it starts again: a day, or an hour if it shows only minutes and seconds; `None` with a date.
    ///
    /// ```
    /// use torqcomp::recording::text::Clock;
    /// let period_s = |text| Clock::parse(text).unwrap().period_s();
    /// assert_eq!(period_s("23:59:59.9"), Some(86_400.0));
    /// assert_eq!(period_s("59:59.9"), Some(3600.0));
    /// assert_eq!(period_s("2026-03-26 23:59:59.9"), None);
    /// ```
    pub fn period_s(self) -> Option<f64> {
        let period_s = if self.is_without_hours {
            3600.0
        } else {
            86_400.0
        };
        self.day.is_none().then_some(period_s)
    }

    /// Nanoseconds since 1970, or since midnight without a date.
    pub(crate) fn total(self) -> i64 {
        i64::from(self.day.unwrap_or(0)) * DAY + self.nanoseconds.unwrap_or(0)
    }
}

/// Adds a period, such as a day, to the times of a clock whenever they step back by more than half of it: past midnight.
pub fn unwrap_periods(seconds: &mut [f64], period_s: f64) {
    let mut last = f64::NAN;
    for time in seconds.iter_mut().filter(|time| !time.is_nan()) {
        *time += periods_between(last, &[*time], period_s);
        last = *time;
    }
}

/// Whole periods, in seconds, between a time and the first of the times after it.
pub fn periods_between(last: f64, times: &[f64], period_s: f64) -> f64 {
    let first = times.first().copied().unwrap_or(last);
    let periods = ((last - first) / period_s + 0.5).floor();
    if periods > 0.0 {
        periods * period_s
    } else {
        0.0
    }
}

/// Whether the order of day and month, or of day and year, is ambiguous: `03/04/2025`, `25-03-14`.
fn is_ambiguous(text: &str) -> bool {
    let Some(mark) = text.chars().find(|c| !c.is_ascii_digit()) else {
        return false;
    };
    let parts: Vec<&str> = text
        .splitn(4, |c: char| !c.is_ascii_digit())
        .take(3)
        .collect();
    let number = |place: usize| parts.get(place).and_then(|part| part.parse::<u32>().ok());
    match (mark, parts.as_slice(), number(0), number(1)) {
        ('/' | '-', [first, _, year], Some(a), Some(b)) if first.len() < 4 => {
            let is_year = year.len() == 4;
            a <= 12 && b <= 12 && a != b || !is_year && b <= 12
        }
        _ => false,
    }
}

/// Whether a text contains a mark of dates or times, or ends in a year, as in `2 May 2022`.
fn may_be_clock(text: &str) -> bool {
    let is_year = |word: &str| word.len() == 4 && word.bytes().all(|b| b.is_ascii_digit());
    text.contains([':', '-', '.', '/'])
        || text.rsplit_once(' ').is_some_and(|(_, last)| is_year(last))
}

/// `h:mm:ss`, with decimals after `.`, `,` or `:`, with AM or PM, with a zone; `mm:ss.f`.
fn time_of_day(text: &str) -> Option<Clock> {
    let lower = text.to_ascii_lowercase();
    let ((body, ahead_s), half) = match lower.strip_suffix("pm").or(lower.strip_suffix("p.m.")) {
        Some(body) => ((body.trim_end(), None), Some(12)),
        None => match lower.strip_suffix("am").or(lower.strip_suffix("a.m.")) {
            Some(body) => ((body.trim_end(), None), Some(0)),
            None => (without_zone(&lower), None),
        },
    };
    let (first, rest) = body.split_once(':')?;
    let first: i64 = digits(first, 1..=2)?;
    let (second, rest) = match rest.split_once(':') {
        Some((second, rest)) => (second, Some(rest)),
        None => (rest, None),
    };
    let (hours, minutes, seconds) = match rest {
        Some(rest) => (first, digits(second, 2..=2)?, rest),
        // Minutes and seconds only with decimals, as 12:34 is ambiguous.
        None if second.contains(['.', ',']) => (0, first, second),
        None => return None,
    };
    let (whole, decimals) = match seconds.find(['.', ',', ':']) {
        Some(place) => (&seconds[..place], &seconds[place + 1..]),
        None => (seconds, ""),
    };
    let whole = digits(whole, 1..=2)?;
    let hours = match half {
        Some(half) if (1..=12).contains(&hours) => hours % 12 + half,
        Some(_) => return None,
        None => hours,
    };
    // Hours may exceed a day; minutes and seconds do not exceed 60.
    if minutes >= 60 || whole > 60 {
        return None;
    }
    let seconds = (hours * 60 + minutes) * 60 + whole;
    Some(Clock {
        day: None,
        nanoseconds: Some(seconds * SECOND + fraction(decimals)?),
        ahead_s,
        is_without_hours: rest.is_none(),
    })
}

/// `0 days 00:00:01.5`, `-1 days +23:59:59.5` and `1 day, 0:00:01.5`, as pandas and Python write durations.
fn since_start(text: &str) -> Option<Clock> {
    let (days, rest) = text.split_once(" day")?;
    let time = rest.strip_prefix('s').unwrap_or(rest);
    let time = time.trim_start_matches([',', ' ', '+']);
    let days: i64 = days
        .parse()
        .ok()
        .filter(|days: &i64| days.abs() < 100_000)?;
    let clock = time_of_day(time)?;
    Some(Clock {
        nanoseconds: Some(days * DAY + clock.nanoseconds?),
        ..clock
    })
}

/// A text without a final `Z`, `+02:00`, `-0500` or ` utc`, and the corresponding offset from UTC in
/// seconds.
fn without_zone(text: &str) -> (&str, Option<i32>) {
    let plain = text.trim_end_matches("utc").trim_end_matches("gmt");
    let plain = plain.trim_end().trim_end_matches('z');
    match plain.rfind(['+', '-']) {
        Some(place) if plain.len() - place >= 3 && place >= 5 => {
            (plain[..place].trim_end(), ahead_s(&plain[place..]))
        }
        _ => (plain, (plain.len() < text.len()).then_some(0)),
    }
}

/// Seconds of `+02:00`, `-0500` or `+02`.
fn ahead_s(text: &str) -> Option<i32> {
    let (sign, rest) = text.split_at(1);
    let all = rest.replace(':', "");
    let number = |range: std::ops::Range<usize>| all.get(range)?.parse::<i32>().ok();
    let minutes = number(2..4).or((all.len() == 2).then_some(0))?;
    let seconds = (number(0..2)? * 60 + minutes) * 60;
    Some(if sign == "-" { -seconds } else { seconds })
}

fn fraction(decimals: &str) -> Option<i64> {
    if !decimals.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let nine: String = decimals
        .chars()
        .chain("000000000".chars())
        .take(9)
        .collect();
    nine.parse().ok()
}

fn digits(text: &str, count: std::ops::RangeInclusive<usize>) -> Option<i64> {
    (count.contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit()))
        .then(|| text.parse().ok())?
}

/// Days since 1970 of a date without a time.
fn date(text: &str) -> Option<i32> {
    // Montag, 2. Mai 2022
    let text = match text.split_once(", ") {
        Some((weekday, rest)) if weekday.chars().all(char::is_alphabetic) => rest,
        _ => text,
    };
    // 2. Mai 2022, but 2.5.2022 and 2. 5. 2022 as well; May 2, 2022.
    let spaced = text.replace(". ", " ").replace(", ", " ");
    let text = spaced.as_str();
    let mark = text.chars().find(|c| matches!(c, '-' | '/' | '.' | ' '))?;
    let mut parts = text.split(mark).map(str::trim).filter(|p| !p.is_empty());
    let (a, b, c) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() {
        return None;
    }
    let number = |text: &str| digits(text.trim_end_matches('.'), 1..=2).map(|n| n as u32);
    let (year, month, day) = if a.len() == 4 {
        (digits(a, 4..=4)?, month(b)?, number(c)?)
    } else {
        let year = match c.len() {
            4 => digits(c, 4..=4)?,
            2 => 2000 + digits(c, 2..=2)?,
            _ => return None,
        };
        match (mark, number(a), number(b)) {
            ('/', Some(a), Some(b)) if a <= 12 => (year, a, b),
            (_, Some(day), _) => (year, month(b)?, day),
            (_, None, Some(day)) => (year, month(a)?, day),
            _ => return None,
        }
    };
    days(i32::try_from(year).ok()?, month, day)
}

fn month(text: &str) -> Option<u32> {
    if let Some(number) = digits(text, 1..=2) {
        return Some(number as u32);
    }
    let start: String = text.to_lowercase().chars().take(3).collect();
    meaning("months", &start)?.parse().ok()
}

/// Days from 1970-01-01 to a date of the Gregorian calendar: 365 per year, one more per preceding
/// leap year, and the days of the preceding months.
fn days(year: i32, month: u32, day: u32) -> Option<i32> {
    const BEFORE: [i32; 12] = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || !(1900..=2200).contains(&year) {
        return None;
    }
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let leap_years = |year: i32| year / 4 - year / 100 + year / 400;
    let years = (year - 1970) * 365 + leap_years(year - 1) - leap_years(1969);
    let leap_day = i32::from(is_leap && month > 2);
    Some(years + BEFORE[month as usize - 1] + leap_day + day as i32 - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(text: &str) -> f64 {
        Clock::parse(text).expect(text).total() as f64 * 1e-9
    }

    #[test]
    fn times_of_day() {
        for (text, value) in [
            ("12:34:56.789", 45_296.789),
            ("1:02:03", 3723.0),
            ("12:34:56,789", 45_296.789),
            ("12:34:56:789", 45_296.789),
            ("2:34:31 PM", 52_471.0),
            ("12:00:00 AM", 0.0),
            ("09:51:40.7271890640258789063", 35_500.727_189_064),
            ("05:12.5", 312.5),
            ("14:34:31Z", 52_471.0),
            ("14:34:31.25+02:00", 52_471.25),
            ("0 days 00:00:00.001000", 0.001),
            ("2 days 00:00:01", 172_801.0),
            ("-1 days +23:59:59.5", -0.5),
            ("1 day, 0:00:01.5", 86_401.5),
        ] {
            assert!((seconds(text) - value).abs() < 1e-9, "{text}");
        }
    }

    #[test]
    fn dates() {
        // 2022-05-02 is 19 114 days after 1970-01-01 (52 years of 365 days, 13 leap days, 121 days).
        for text in [
            "2022-05-02",
            "2022/05/02",
            "02.05.2022",
            "2.5.22",
            "5/2/2022",
            "02-May-2022",
            "2. Mai 2022",
            "Montag, 2. Mai 2022",
            "Monday, 2 May 2022",
            "2 MAY 2022",
            "Monday, May 2, 2022",
            "May 2, 2022",
        ] {
            assert_eq!(Clock::parse(text).expect(text).day, Some(19_114), "{text}");
        }
        assert_eq!(Clock::parse("26/3/2026").unwrap().day, Some(20_538));
        assert_eq!(Clock::parse("2000-03-01").unwrap().day, Some(11_017));
    }

    #[test]
    fn dates_with_times() {
        for text in [
            "2022-05-02 15:56:24.376",
            "2022-05-02T15:56:24.376Z",
            "02.05.2022 15:56:24,376",
            "5/2/2022 3:56:24.376 PM",
            "2022/05/02, 15:56:24.376",
            "02-May-2022 15:56:24.376",
            "20220502155624.376",
        ] {
            let clock = Clock::parse(text).expect(text);
            assert_eq!(clock.day, Some(19_114), "{text}");
            assert_eq!(clock.nanoseconds, Some(57_384_376_000_000), "{text}");
        }
    }

    #[test]
    fn zones_count_where_they_change() {
        let at = |text: &str| Clock::parse(text).expect(text);
        for (first, later, seconds) in [
            (
                "2024-10-27T02:59:59.999+02:00",
                "2024-10-27T02:00:00+01:00",
                1e-3,
            ),
            (
                "2024-10-27 02:59:59.999 +0200",
                "2024-10-27 01:00:00Z",
                1e-3,
            ),
            ("23:59:59-05:30", "23:59:59-06", 1800.0),
            ("12:00:00+02:00", "12:00:01", 1.0),
        ] {
            let found = at(later).seconds_after(at(first));
            assert!((found - seconds).abs() < 1e-9, "{later}: {found}");
        }
    }

    #[test]
    fn what_is_no_clock() {
        for text in [
            "1.5",
            "-1.25e-3",
            "192.168.178.20",
            "1-2-3",
            "abc:de",
            "12:34",
            "99.99.2020",
            "1.2.3",
            "",
            "::::::",
            "12:61:00",
            "V2.5.1999x",
            "0.00.0",
            "191179-001",
            "Model 54 2022",
            "Run 12 of 2022",
            "20221502155624",
            "2022050215562",
            "3 days",
            "some days 00:00:01",
        ] {
            assert_eq!(Clock::parse(text), None, "{text}");
        }
    }
}
