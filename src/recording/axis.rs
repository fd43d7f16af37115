//! Time axis of a channel.

use std::sync::Arc;

use torqcomp_decimal::digits;
use torqcomp_dsp::quality::broken_line::BrokenLine;
use torqcomp_dsp::quality::rounding::{Rounded, uniform_line};

use super::Hole;
use super::moment::Moment;
use super::stamps::StampGrid;
use super::text::ClockOrigin;

/// Largest relative deviation of a step from the typical one in a record with a rate.
const USUAL: f64 = 0.25;
/// Largest relative difference of the typical step from the mean one without ambiguity.
const SAME: f64 = 1e-3;
/// Ratio to the typical step above which a step leaves out a sample.
const GAP: f64 = 1.5;
/// Median deviations from the typical step beyond which a step differs from the others: six standard deviations of a
/// normal distribution.
const BEYOND_SCATTER: f64 = 9.0;
/// Minimum number of different steps that indicate rounding; one or two are gaps.
pub(crate) const FEWEST_UNLIKE: usize = 3;
/// Largest relative deviation of a step that counts as uniform.
pub(super) const UNIFORM: f64 = 0.01;
/// Relative deviation up to which steps are averaged if there are gaps.
const CLOSE: [f64; 2] = [0.01, 0.05];

/// Advice for rows in reverse order.
pub const REVERSED: &str =
    "the time stamps fall from row to row; sort the rows by time, the earliest first";

/// Note on stamps in a column or vector whose unit is unknown or unusable in the file.
pub fn seconds_assumed(name: &str, unit: Option<&str>) -> String {
    let says = match unit {
        Some(unit) => format!("gives the unit \"{unit}\", which is not a unit of time"),
        None => "gives no unit".to_owned(),
    };
    format!("\"{name}\" {says}: seconds were assumed")
}

/// Whether stamps decrease throughout.
pub fn falls(stamps: &[f64]) -> bool {
    stamps.len() > 2 && stamps.windows(2).all(|pair| pair[1] < pair[0])
}

/// The time axis of a channel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TimeAxis {
    /// Sampling rate in Hz; `None` if the file does not give it, or if its stamps have no typical
    /// step.
    pub rate_hz: Option<f64>,
    /// Standard uncertainty of a rate from stamps, due to rounding and jitter, without that of the clock.
    pub rate_std_hz: Option<f64>,
    /// Source of the rate.
    pub rate_from: RateFrom,
    /// Time of the first sample on the file's own axis.
    pub start: Option<Moment>,
    /// Date and time of the first sample, as written.
    pub start_text: Option<String>,
    /// Time of each sample in seconds relative to the origin, as read.
    pub stamps_s: Option<Arc<Vec<f64>>>,
    /// Non-numeric cells among the stamps; the stamps are `NaN` there.
    pub holes: Vec<Hole>,
    /// Origin of the stamps in ns: times since 1970 would lose digits in an `f64`.
    pub origin_ns: i64,
    /// Heading of the column of stamps, or a description.
    pub stamps_in: Option<String>,
    /// For a stream, the grid of its stamps.
    pub(crate) grid: Option<StampGrid>,
    /// For a stream at a given rate, the grid of its additional stamps.
    pub(crate) beside: Option<StampGrid>,
    /// What the clock showed at the origin of the stamps, if the file gives dates or times of day.
    pub(crate) clock: Option<ClockOrigin>,
    /// Rate in the file header, in Hz, used or not.
    pub header_rate_hz: Option<f64>,
    /// Assumption about the axis that should be confirmed before results rely on it:
    /// `the column "Time" gives no unit; seconds were assumed`.
    pub assumed: Option<String>,
    /// Without stamps and rate, heading of a first column that contains rising frequencies.
    pub(crate) frequencies_in: Option<String>,
}

/// Why a record without stamps has no rate, and what to do; `given` tells how to give one.
pub(crate) fn no_stamps(axis: &TimeAxis, given: &str) -> String {
    match &axis.frequencies_in {
        Some(heading) => format!(
            "the file looks like a frequency response: \"{heading}\" contains rising frequencies. A record over time is \
             expected; identify response takes excitation and response as recorded, or write the natural_frequency, \
             damping_ratio and static_gain of this response into [mechanics]"
        ),
        None => format!("the file has neither time stamps nor a rate; {given}"),
    }
}

/// Source of a rate.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum RateFrom {
    /// No rate.
    #[default]
    None,
    /// From the user.
    Given,
    /// From the file header; the words that gave it.
    Header(String),
    /// From a column of stamps; its heading.
    Stamps(String),
}

impl RateFrom {
    /// As text and for JSON: `none`, `given`, `header: Delta_X`, `stamps: Time [s]`.
    pub fn describe(&self) -> String {
        match self {
            Self::None => "none".to_owned(),
            Self::Given => "given".to_owned(),
            Self::Header(words) => format!("header: {words}"),
            Self::Stamps(heading) => format!("stamps: {heading}"),
        }
    }

    /// As part of a sentence.
    pub fn sentence(&self, resampled: bool) -> String {
        match self {
            Self::None => "unknown".to_owned(),
            Self::Given => "given with --rate".to_owned(),
            Self::Header(words) => format!("from the header of the file: {words}"),
            Self::Stamps(heading) if resampled => {
                format!("from the stamps in \"{heading}\", interpolated")
            }
            Self::Stamps(heading) => format!("from the uniform stamps in \"{heading}\""),
        }
    }
}

/// Typical step of time stamps, in their unit. If nearly all steps are within 25 % of their median, it
/// is the mean of these, which averages out the rounding of the stamps; with gaps it is the mean of
/// those within 1 % (or 5, or 25 %) of the median, whichever first includes half of all. `None` if
/// fewer than half of the steps are within 25 %, or fewer than two stamps rise.
///
/// ```
/// use torqcomp::recording::typical_step;
/// // Three steps of 2 and a gap of 6.
/// assert_eq!(typical_step(&[0.0, 2.0, 4.0, 10.0, 12.0]), Some(2.0));
/// assert_eq!(typical_step(&[0.0, 1.0, 10.0, 100.0, 1000.0]), None);
/// ```
pub fn typical_step(stamps: &[f64]) -> Option<f64> {
    if let Some(step) = equal_step(stamps) {
        return Some(step);
    }
    let mut steps: Vec<f64> = stamps
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|step| *step > 0.0)
        .collect();
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    let median = *median;
    let within = |part: f64| {
        stamps
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .filter(|step| (step / median - 1.0).abs() <= part)
            .fold((0.0, 0_usize), |(sum, count), step| (sum + step, count + 1))
    };
    let (sum, count) = within(USUAL);
    if 2 * count < steps.len() {
        return None;
    }
    if 100 * count >= 99 * steps.len() {
        return Some(sum / count as f64);
    }
    let (sum, count) = CLOSE
        .into_iter()
        .map(within)
        .find(|(_, count)| 2 * count >= steps.len())
        .unwrap_or((sum, count));
    Some(sum / count as f64)
}

/// The mean step, if all are about equal to the first one, and so within the typical range of their median.
fn equal_step(stamps: &[f64]) -> Option<f64> {
    let [first, second, ..] = stamps else {
        return None;
    };
    let any = second - first;
    let near = 0.25 * USUAL * any;
    // All steps are evaluated unconditionally, which allows vectorisation.
    let alike = stamps.windows(2).fold(any > 0.0, |alike, pair| {
        alike & ((pair[1] - pair[0] - any).abs() <= near)
    });
    alike.then(|| (stamps[stamps.len() - 1] - first) / (stamps.len() - 1) as f64)
}

/// Step between stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SampleStep {
    /// In the unit of the stamps.
    pub(super) step: f64,
    /// Its relative standard uncertainty, if the stamps determine it.
    pub(super) relative_std: Option<f64>,
}

impl SampleStep {
    fn new(step: f64, relative_std: f64) -> Self {
        let is_known = relative_std > 0.0 && relative_std.is_finite();
        Self {
            step,
            relative_std: is_known.then_some(relative_std),
        }
    }

    /// From a line through rounded stamps over a span: uniform between two bounds, or within one quantum over the
    /// span, with a standard uncertainty of half the width over √3.
    pub(super) fn of_line(line: &Rounded, span: f64) -> Self {
        let [low, high] = line.steps_over(span);
        Self::new(
            line.step_s,
            0.5 * (high - low) / line.step_s / 3.0_f64.sqrt(),
        )
    }

    /// From typical steps: their mean, and for stamps without a gap all of the time that they
    /// cover.
    fn of_mean(usual: f64, stamps: &[f64]) -> Self {
        let steps: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut off: Vec<f64> = steps
            .iter()
            .map(|step| (step / usual - 1.0).abs())
            .collect();
        let middle = off.len() / 2;
        let (_, scatter, _) = off.select_nth_unstable_by(middle, f64::total_cmp);
        // A step far outside the scatter of the others leaves out samples.
        let alike = (BEYOND_SCATTER * *scatter).clamp(GAP - 1.0, 1.0);
        let counts = steps.iter().map(|step| match step / usual {
            part if (part - 1.0).abs() <= alike => 1.0,
            part => part.round().max(0.0),
        });
        let counts: Vec<f64> = counts.collect();
        let count: f64 = counts.iter().sum();
        let span = stamps[stamps.len() - 1] - stamps[0];
        let has_gaps = counts.iter().any(|count| *count != 1.0);
        let step = if has_gaps { usual } else { span / count };
        let mut place = 0.0;
        let places = std::iter::once(&0.0).chain(&counts).map(|count| {
            place += count;
            place
        });
        let off = stamps.iter().zip(places).map(|(t, place)| t - step * place);
        let off: Vec<f64> = off.collect();
        Self::new(step, std_over(&off, count) / (count * step))
    }

    /// Standard uncertainty of the corresponding rate.
    pub(super) fn rate_std_hz(&self, rate_hz: f64) -> Option<f64> {
        self.relative_std.map(|relative| relative * rate_hz)
    }
}

/// Divisor of the record length that gives the range over which the scatter of stamps is followed.
const FOLLOWED: usize = 8;

/// Standard deviation of the difference of two stamps `steps` apart, from their deviations from a uniform grid:
/// `a + b m` over `m` steps, where each stamp has an independent error (`a`), each step one (`b`), or both.
fn std_over(off: &[f64], steps: f64) -> f64 {
    let square = |lag: usize| {
        let pairs = off.iter().zip(&off[lag..]);
        let sum: f64 = pairs.map(|(a, b)| (b - a).powi(2)).sum();
        sum / (off.len() - lag) as f64
    };
    let once = square(1);
    let lag = (off.len() / FOLLOWED).max(1);
    let growth = match lag {
        1 => 0.0,
        _ => ((square(lag) - once) / (lag - 1) as f64).max(0.0),
    };
    (once + growth * (steps - 1.0).max(0.0)).sqrt()
}

/// Step of the straight line that stamps follow except for rounding (3 and 4 ms alternating are a step of 3.5 ms), or
/// of their longest part without a gap; otherwise the typical step.
pub(super) fn step_of(stamps_s: &[f64], origin_s: f64) -> Option<SampleStep> {
    let line = |part: &[f64]| {
        let span = part.last()? - part.first()?;
        line_of(part, origin_s).map(|line| SampleStep::of_line(&line, span))
    };
    if let Some(found) = line(stamps_s) {
        return Some(found);
    }
    if let Some(broken) = BrokenLine::of(stamps_s) {
        let span = stamps_s.last()? - stamps_s.first()?;
        return Some(SampleStep::of_line(&broken.line, span));
    }
    let step = typical_step(stamps_s)?;
    let usual = SampleStep::of_mean(step, stamps_s);
    let span = stamps_s.last()? - stamps_s.first()?;
    let mean = span / (stamps_s.len() - 1) as f64;
    if (step / mean - 1.0).abs() <= SAME {
        return Some(usual);
    }
    let parts = stamps_s.chunk_by(|a, b| (0.0..GAP * step).contains(&(b - a)));
    let longest = parts.max_by_key(|part| part.len())?;
    let is_most = 4 * longest.len() > stamps_s.len();
    Some(line(longest).filter(|_| is_most).unwrap_or(usual))
}

/// Rounding of stamps about a step apart, if that is their only fault.
pub(super) fn rounding(stamps_s: &[f64], step: f64, origin_s: f64) -> Option<Rounded> {
    line_of(stamps_s, origin_s).filter(|_| has_unlike_steps(stamps_s, step))
}

/// Whether more steps than gaps would explain differ from the typical one.
fn has_unlike_steps(stamps_s: &[f64], step: f64) -> bool {
    let unlike = |pair: &&[f64]| ((pair[1] - pair[0]) / step - 1.0).abs() > UNIFORM;
    let some = stamps_s.windows(2).filter(unlike).take(FEWEST_UNLIKE);
    some.count() == FEWEST_UNLIKE
}

/// Line of stamps that deviate from it by their rounding only. `origin_s` is their origin: a clock with that origin
/// in an `f64` is limited by the last bit.
fn line_of(stamps_s: &[f64], origin_s: f64) -> Option<Rounded> {
    let resolution_s = 2.0 * f64::EPSILON * (origin_s.abs() + stamps_s.last()?.abs());
    let line = uniform_line(stamps_s.iter().copied().enumerate(), resolution_s)?;
    // A rounding of more than half a step could hide a single gap.
    let may_hide_gap =
        line.quantum_s > 0.5 * line.step_s && line.farthest_s > 0.05 * line.quantum_s;
    let is_rounding =
        !may_hide_gap || typical_step(stamps_s).is_none_or(|step| has_unlike_steps(stamps_s, step));
    is_rounding.then_some(line)
}

impl TimeAxis {
    /// Takes a rate that does not come from its stamps.
    pub(crate) fn set_rate(&mut self, rate_hz: f64, from: RateFrom) {
        self.rate_hz = Some(rate_hz);
        self.rate_std_hz = None;
        self.rate_from = from;
    }

    /// Takes the rate given by the user, if any.
    pub(crate) fn prefer_given(&mut self, rate_hz: Option<f64>) {
        if let Some(rate_hz) = rate_hz {
            self.set_rate(rate_hz, RateFrom::Given);
        }
    }

    /// An axis of stamps in seconds.
    pub fn of_stamps(heading: &str, stamps_s: Arc<Vec<f64>>) -> Self {
        Self::of_stamps_after(0, heading, stamps_s)
    }

    /// An axis of stamps in seconds relative to an origin in ns.
    pub fn of_stamps_after(origin_ns: i64, heading: &str, stamps_s: Arc<Vec<f64>>) -> Self {
        let origin_s = origin_ns as f64 * 1e-9;
        let step = step_of(&stamps_s, origin_s);
        let rate_hz = step
            .map(|found| without_rounding(1.0 / found.step))
            .filter(|hz| hz.is_finite() && *hz > 0.0);
        Self {
            rate_hz,
            rate_std_hz: rate_hz.and_then(|hz| step?.rate_std_hz(hz)),
            rate_from: rate_hz.map_or(RateFrom::None, |_| RateFrom::Stamps(heading.to_owned())),
            start: stamps_s
                .first()
                .filter(|t| t.is_finite())
                .map(|after_s| Moment {
                    origin_ns,
                    after_s: *after_s,
                }),
            stamps_s: Some(stamps_s),
            origin_ns,
            stamps_in: Some(heading.to_owned()),
            ..Self::default()
        }
    }

    /// Its stamps in seconds relative to another origin.
    pub(crate) fn stamps_after(&self, origin_ns: i64) -> Option<Arc<Vec<f64>>> {
        let stamps = self.stamps_s.as_ref()?;
        let later_s = self.origin_ns.wrapping_sub(origin_ns) as f64 * 1e-9;
        Some(match later_s {
            0.0 => Arc::clone(stamps),
            _ => Arc::new(stamps.iter().map(|stamp| stamp + later_s).collect()),
        })
    }

    /// Source of its rate, with the uncertainty if known.
    pub(crate) fn rate_sentence(&self) -> String {
        let from = self.rate_from.sentence(self.is_resampled());
        match self.rate_std_hz {
            Some(std) => format!("{from}, ± {} Hz", digits::text(std, 2)),
            None => from,
        }
    }

    /// A time on it, in seconds relative to its origin.
    pub(crate) fn moment(&self, after_s: f64) -> Moment {
        Moment {
            origin_ns: self.origin_ns,
            after_s,
        }
    }

    /// Axis of samples resampled to uniform steps.
    pub fn uniform(rate_hz: f64, start: Moment) -> Self {
        Self {
            start: Some(start),
            ..Self::of_header("rate", rate_hz, None)
        }
    }

    /// Axis with a rate from the file header; `words` gave it.
    pub fn of_header(words: &str, rate_hz: f64, start_s: Option<f64>) -> Self {
        Self {
            rate_hz: Some(rate_hz),
            rate_from: RateFrom::Header(words.to_owned()),
            start: start_s.map(Moment::of_seconds),
            header_rate_hz: Some(rate_hz),
            ..Self::default()
        }
    }
}

/// A rate without the rounding errors of its stamps: nine digits, if equivalent.
pub(crate) fn without_rounding(rate_hz: f64) -> f64 {
    let short: f64 = digits::text(rate_hz, 9).parse().unwrap_or(rate_hz);
    if (short / rate_hz - 1.0).abs() < 1e-10 {
        short
    } else {
        rate_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_lose_rounding_but_not_digits() {
        assert_eq!(without_rounding(20_000.000_000_000_735), 20_000.0);
        assert_eq!(without_rounding(20_000.001), 20_000.001);
        assert_eq!(without_rounding(610.351_562_5), 610.351_562_5);
        assert_eq!(without_rounding(1000.0 / 3.0), 1000.0 / 3.0);
    }

    /// Stamps with independent errors, as over a network, and steps with independent errors, as in a waiting loop.
    #[test]
    fn the_rate_of_jittered_stamps_is_as_uncertain_as_it_is_stated() {
        let mut state = 12_345_u64;
        let mut normal = || {
            let mut uniform = || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            };
            (0..12).map(|_| uniform()).sum::<f64>()
        };
        for (of_stamp, of_step) in [
            (0.05, 0.0),
            (0.1, 0.0),
            (0.0, 0.05),
            (0.0, 0.15),
            (0.05, 0.02),
        ] {
            let (mut off, mut stated, runs) = (0.0, 0.0, 60);
            for _ in 0..runs {
                let mut clock = 0.0;
                let stamps: Vec<f64> = (0..2000)
                    .map(|_| {
                        clock += 1e-3 * (1.0 + of_step * normal());
                        clock + 1e-3 * of_stamp * normal()
                    })
                    .collect();
                let found = step_of(&stamps, 0.0).unwrap();
                off += (found.step / 1e-3 - 1.0).powi(2);
                stated += found.relative_std.unwrap().powi(2);
            }
            let ratio = (off / stated).sqrt();
            assert!((0.7..1.4).contains(&ratio), "{of_stamp} {of_step}: {ratio}");
        }
    }

    #[test]
    fn usual_step_is_not_moved_by_a_gap() {
        let mut times: Vec<f64> = (0..100).map(|i| 0.002 * f64::from(i)).collect();
        times.push(5.0);
        assert!((typical_step(&times).unwrap() - 0.002).abs() < 1e-12);
        assert_eq!(typical_step(&[1.0, 1.0]), None);
    }
}
