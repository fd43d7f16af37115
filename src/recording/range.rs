//! Selection of a part of a record by its times.

use torqcomp_decimal::number;

use super::moment::Moment;
use super::text::Clock;
use super::{Channel, Recording, TimeAxis};
use crate::failure::{ErrorCode, Failure};
use crate::io::TimeRange;

/// Minimum number of seconds that is a time since 1970: 1973.
const SINCE_1970: f64 = 1e8;

/// One end of a range.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TimeBound {
    /// A number of seconds, and the same in ns where that is more precise.
    Seconds { seconds: f64, ns: i64 },
    /// A date with a time, or a time of day.
    Clock(Clock),
}

impl TimeBound {
    fn parse(text: &str) -> Result<Self, Failure> {
        Self::read(text).ok_or_else(|| {
            ErrorCode::InvalidValue.usage(format_args!(
                "--range: \"{text}\" is not a time; expected seconds, as 0.5, a time of day, as 14:30:00, or a \
                 date with a time, as 2024-03-12T13:26:40"
            ))
        })
    }

    fn read(text: &str) -> Option<Self> {
        if let Ok(seconds) = text.parse::<f64>() {
            let (after, _) = number::read_after(text.as_bytes(), 0, b'.', seconds as i64)?;
            let ns =
                (seconds.trunc() as i64).checked_mul(1_000_000_000)? + (after * 1e9).round() as i64;
            return seconds.is_finite().then_some(Self::Seconds { seconds, ns });
        }
        let clock = Clock::parse(text)?;
        clock.nanoseconds.map(|_| Self::Clock(clock))
    }

    /// The bound in seconds relative to the origin of an axis.
    fn on(self, axis: &TimeAxis) -> Result<f64, Failure> {
        let start = axis.start.unwrap_or_default();
        Ok(match self {
            Self::Seconds { seconds, .. } if axis.origin_ns == 0 => seconds,
            // On a clock that counts from 1970, small numbers are relative to the first sample.
            Self::Seconds { seconds, .. }
                if seconds < SINCE_1970 && start.seconds() >= SINCE_1970 =>
            {
                start.after_s + seconds
            }
            Self::Seconds { ns, .. } => ns.saturating_sub(axis.origin_ns) as f64 * 1e-9,
            Self::Clock(clock) => {
                let origin = axis.clock.ok_or_else(|| {
                    ErrorCode::RangeEmpty.failed(
                        "the record has no dates or times of day; give --range in seconds, as 0.5..2",
                    )
                })?;
                let total_ns = clock.total_in_zone_of(origin).ok_or_else(|| {
                    ErrorCode::RangeEmpty.failed(
                        "--range gives a time zone, but the record's times have none; give the times of --range as the \
                         record's clock shows them, without a zone",
                    )
                })?;
                match clock.period_s() {
                    None => total_ns.saturating_sub(origin.ns) as f64 * 1e-9,
                    Some(period_s) => {
                        let period = (period_s * 1e9) as i64;
                        let first_ns = origin.ns.saturating_add((start.after_s * 1e9) as i64);
                        let after_ns = (total_ns - first_ns).rem_euclid(period);
                        // Shortly before the record rather than a day after it.
                        let is_before = after_ns > period / 2;
                        start.after_s
                            + (after_ns - if is_before { period } else { 0 }) as f64 * 1e-9
                    }
                }
            }
        })
    }
}

impl Recording {
    /// Keeps the samples within a range of time.
    ///
    /// # Errors
    /// If no channel has a sample there, or the range is in times of day and the record has none.
    pub(crate) fn keep(&mut self, range: &TimeRange) -> Result<(), Failure> {
        let whole = self.channels.first().map(Channel::ends);
        for channel in &mut self.channels {
            channel.keep(range)?;
        }
        if self
            .channels
            .iter()
            .all(|channel| channel.samples.is_empty())
        {
            let ends = whole.flatten().map_or_else(String::new, |[from, to]| {
                format!("; the record runs from {} to {}", from.text(), to.text())
            });
            return Err(
                ErrorCode::RangeEmpty.failed(format_args!("--range contains no samples{ends}"))
            );
        }
        Ok(())
    }
}

impl Channel {
    /// Time of the first and the last sample.
    fn ends(&self) -> Option<[Moment; 2]> {
        let last = self.samples.len().checked_sub(1)?;
        Some([0, last].map(|place| self.axis.moment(self.after_s(place))))
    }

    /// Time of a sample relative to the origin of its axis.
    fn after_s(&self, place: usize) -> f64 {
        match (&self.axis.stamps_s, self.axis.rate_hz) {
            (Some(stamps), _) => stamps.get(place).copied().unwrap_or(f64::NAN),
            (None, Some(rate_hz)) => {
                self.axis.start.unwrap_or_default().after_s + place as f64 / rate_hz
            }
            (None, None) => f64::NAN,
        }
    }

    fn keep(&mut self, range: &TimeRange) -> Result<(), Failure> {
        let end = |text: &Option<String>, open: f64| match text {
            Some(text) => TimeBound::parse(text)?.on(&self.axis),
            None => Ok(open),
        };
        let from_s = end(&range.from, f64::NEG_INFINITY)?;
        let to_s = end(&range.to, f64::INFINITY)?;
        if from_s >= to_s {
            return Err(ErrorCode::InvalidValue.usage("--range FROM..TO: FROM must be before TO"));
        }
        // An imprecise time means the nearest sample.
        let slack_s = self.axis.rate_hz.map_or(0.0, |hz| 1e-6 / hz);
        let is_within = |place: &usize| {
            let after_s = self.after_s(*place);
            after_s >= from_s - slack_s && after_s <= to_s + slack_s
        };
        let count = self.samples.len();
        let first = (0..count).find(is_within).unwrap_or(count);
        let end = (first..count)
            .rev()
            .find(is_within)
            .map_or(first, |last| last + 1);
        self.cut(first, end);
        Ok(())
    }

    /// Keeps the samples `first..end`.
    pub(super) fn cut(&mut self, first: usize, end: usize) {
        if first > 0 && first < end {
            self.axis.start = Some(self.axis.moment(self.after_s(first)));
            self.axis.start_text = self.axis.start.and_then(Moment::date);
        }
        self.samples.truncate(end);
        self.samples.drain(..first);
        if let Some(stamps) = &self.axis.stamps_s {
            let end = end.min(stamps.len());
            self.axis.stamps_s = Some(stamps[first.min(end)..end].to_vec().into());
        }
        for holes in [&mut self.holes, &mut self.axis.holes] {
            holes.retain(|hole| (first..end).contains(&hole.index));
            holes.iter_mut().for_each(|hole| hole.index -= first);
        }
    }
}
