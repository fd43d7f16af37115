//! Grid of the stamps of streamed samples.

use torqcomp_decimal::digits;
use torqcomp_dsp::quality::broken_line::BrokenLine;

use super::Channel;
use super::arrival_blocks::ArrivalBlocks;
use super::axis::{RateFrom, TimeAxis, UNIFORM, rounding, step_of, without_rounding};
use super::checkpoints::sharpened;
use super::fill;
use super::moment::Moment;
use super::rollover::rolled_over;
use super::shared_stamps::{refuse_shared_stamps, same_stamps};
use super::uneven::{mean_step, no_step};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::warning::{Warning, WarningCode};

/// Minimum reported rounding of stamps, relative to their step.
pub(crate) const COARSE_STAMPS: f64 = 0.25;
/// Relative uncertainty of the rate of rounded stamps above which the user is asked. With an error of 0.2 %, the
/// inverse response of a stand with a damping ratio of 0.02 has a relative error of 0.002/0.02 = 10 % at the resonance.
/// That is the worst case: a rate of few digits is found exactly.
pub(super) const TOLERABLE: f64 = 2e-3;
/// Limits of a resampled rate relative to the recorded one; the upper one allows for one row in three missing.
const RESAMPLED_RATES: (f64, f64) = (0.9, 1.51);

/// Format and step of stamps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StampGrid {
    /// Their unit as written.
    pub(crate) unit: String,
    pub(crate) seconds_per_unit: f64,
    /// Uniform step, in their unit.
    pub(crate) step: f64,
    /// Whether they need not be uniform, because samples are interpolated between them.
    pub(crate) resampled: bool,
    /// Whether the text of a stamp is a number of seconds in the format of the output.
    pub(crate) copied: bool,
    /// Origin of the stamps in ns.
    pub(crate) origin_ns: i64,
    /// Quantum of their rounding, in their unit, if that is their only fault; otherwise 0.
    pub(super) quantum: f64,
    /// For stamps too coarse for single steps to show it, the first place of missing samples.
    pub(super) missing: Option<MissingSamples>,
    /// Blocks of samples that arrived together.
    pub(super) blocks: Option<ArrivalBlocks>,
}

/// Samples left out by the stamps at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MissingSamples {
    /// The step over that place.
    pub(super) at: IrregularStep,
    /// Number of samples.
    pub(super) samples: usize,
}

/// Location and kind of an irregular stamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct IrregularStep {
    /// Index of the stamp at the end of the step, within its block.
    pub(crate) row: usize,
    /// The preceding stamp.
    pub(crate) before: f64,
    /// The stamp itself.
    pub(crate) after: f64,
}

impl TimeAxis {
    /// The axis of a stream whose stamps begin with `first`, in the unit of the grid; `later` are stamps farther on,
    /// if known in advance.
    ///
    /// # Errors
    /// If they do not rise, or are to be resampled to a rate far from theirs.
    pub(super) fn of_stream(
        heading: &str,
        mut grid: StampGrid,
        first: &[f64],
        later: &[f64],
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let origin = grid.origin_ns as f64 * 1e-9 / grid.seconds_per_unit;
        let typical = match step_of(first, origin) {
            Some(typical) => sharpened(typical, first, later, origin).unwrap_or(typical),
            None => mean_step(first)
                .filter(|_| reading.resample && reading.rate_hz.is_some())
                .ok_or_else(|| ErrorCode::IrregularTime.failed(no_step(heading, first)))?,
        };
        grid.resampled = reading.resample;
        if reading.resample {
            refuse_shared_stamps(first, typical.step, origin, grid.seconds_per_unit)?;
        }
        grid.step = match reading.rate_hz {
            None => typical.step,
            Some(rate_hz) => {
                check_resampled(rate_hz, 1.0 / (typical.step * grid.seconds_per_unit))?;
                1.0 / rate_hz / grid.seconds_per_unit
            }
        };
        grid.allow_rounding(first);
        let start = grid.moment(first[0]);
        let rate_hz = without_rounding(1.0 / (grid.step * grid.seconds_per_unit));
        let rate_std_hz = typical.rate_std_hz(rate_hz);
        Ok(Self {
            rate_hz: Some(rate_hz),
            rate_std_hz: rate_std_hz.filter(|_| reading.rate_hz.is_none()),
            rate_from: RateFrom::Stamps(heading.to_owned()),
            start: Some(start),
            origin_ns: grid.origin_ns,
            stamps_in: Some(heading.to_owned()),
            grid: Some(grid),
            ..Self::default()
        })
    }

    /// Rejects a rate that the rounding of its stamps leaves too uncertain.
    ///
    /// # Errors
    /// If the rates permitted by the stamps differ too much.
    pub(super) fn check_rounding(&self) -> Result<(), Failure> {
        let of_stamps = matches!(self.rate_from, RateFrom::Stamps(_));
        let (Some(grid), Some(rate_hz), true) = (&self.grid, self.rate_hz, of_stamps) else {
            return Ok(());
        };
        match self.rate_std_hz.filter(|_| !grid.resampled) {
            Some(std_hz) => grid.check_rounding(rate_hz, std_hz),
            None => Ok(()),
        }
    }

    /// Whether samples are interpolated between stamps.
    pub(crate) fn is_resampled(&self) -> bool {
        self.grid.as_ref().is_some_and(|grid| grid.resampled)
    }
}

impl StampGrid {
    /// Stamps in seconds, with a step to be determined.
    pub(super) fn of_seconds() -> Self {
        Self {
            unit: "s".to_owned(),
            seconds_per_unit: 1.0,
            step: f64::NAN,
            resampled: false,
            copied: false,
            origin_ns: 0,
            quantum: 0.0,
            missing: None,
            blocks: None,
        }
    }

    /// Uniform stamps in seconds at a rate.
    fn at_rate(rate_hz: f64, origin_ns: i64, stamps_s: &[f64]) -> Self {
        let mut grid = Self {
            step: 1.0 / rate_hz,
            origin_ns,
            ..Self::of_seconds()
        };
        grid.allow_rounding(stamps_s);
        grid
    }

    /// Permits deviations of stamps due to rounding, if that is their only fault.
    fn allow_rounding(&mut self, stamps: &[f64]) {
        if self.first_irregular(None, stamps).is_some() {
            let origin = self.origin_ns as f64 * 1e-9 / self.seconds_per_unit;
            let rounded = rounding(stamps, self.step, origin).map(|line| line.quantum_s);
            let broken = rounded.map_or_else(|| BrokenLine::of(stamps), |_| None);
            self.missing = broken
                .as_ref()
                .and_then(|broken| first_missing(broken, stamps));
            let broken = broken.map(|broken| broken.line.quantum_s);
            self.quantum = rounded.or(broken).unwrap_or(0.0);
            self.blocks = ArrivalBlocks::of(stamps, self.quantum);
        }
    }

    /// Whether stamps on this grid are rounded coarsely.
    pub(super) fn are_coarse(&self, stamps: &[f64]) -> bool {
        let mut grid = self.clone();
        grid.allow_rounding(stamps);
        grid.is_rounded_coarsely()
    }

    /// Whether stamps are so coarse that several samples may share one; their times are then those of the grid.
    pub(crate) fn is_coarse(&self) -> bool {
        self.quantum > self.step
    }

    /// Whether stamps are rounded so coarsely that single steps mean little.
    fn is_rounded_coarsely(&self) -> bool {
        !self.resampled && self.quantum > COARSE_STAMPS * self.step
    }

    /// Rejects the rate of coarsely rounded stamps if its standard uncertainty (rectangular distribution) is too
    /// large.
    fn check_rounding(&self, rate_hz: f64, std_hz: f64) -> Result<(), Failure> {
        let part = 3.0_f64.sqrt() * std_hz / rate_hz;
        if !self.is_rounded_coarsely() || part <= TOLERABLE {
            return Ok(());
        }
        if let Some(blocks) = &self.blocks {
            let said = blocks.explain(self.seconds_per_unit);
            return Err(ErrorCode::IrregularTime.failed(said));
        }
        Err(ErrorCode::IrregularTime.failed(format_args!(
            "the time stamps are rounded to {} s and allow {}; that is too uncertain to divide out a resonance: \
             give the recorder's rate with --rate HZ",
            digits::text(self.quantum * self.seconds_per_unit, 3),
            rates_of([1.0 - part, 1.0 + part].map(|part| part / rate_hz))
        )))
    }

    /// A warning if stamps are rounded so coarsely that single steps mean little; `span` is the time that they cover,
    /// in their unit.
    pub(super) fn rounded_warning(&self, source: &str, span: f64) -> Option<Warning> {
        let of_seconds = self.seconds_per_unit;
        let rate_hz = 1.0 / (self.step * of_seconds);
        self.is_rounded_coarsely().then(|| {
            WarningCode::RoundedTimeStamps.warning(format!(
                "{source}: the time stamps are rounded to {} s; apart from that they are uniform, and together \
                 they give {} Hz (to within {} Hz){}",
                digits::text(self.quantum * of_seconds, 3),
                digits::text(rate_hz, 9),
                digits::text(rate_hz * self.quantum / span, 2),
                same_stamps(self.quantum / self.step, self.quantum * of_seconds),
            ))
        })
    }

    /// First stamp that does not follow the preceding one by the uniform step. `last` is the stamp
    /// before the first of them. For resampled stamps, the first that runs backwards.
    pub(super) fn first_irregular(
        &self,
        last: Option<f64>,
        times: &[f64],
    ) -> Option<IrregularStep> {
        let (&first, &end) = (times.first()?, times.last()?);
        // The precision of a stamp is limited by its last bit.
        let rounding = 2.0 * f64::EPSILON * first.abs().max(end.abs()) + self.quantum;
        let (low, high) = if self.resampled {
            (0.0, f64::INFINITY)
        } else {
            (
                (self.step * (1.0 - UNIFORM) - rounding).max(0.0),
                self.step * (1.0 + UNIFORM) + rounding,
            )
        };
        let good = |before: f64, after: f64| (low..=high).contains(&(after - before));
        if let Some(before) = last
            && !good(before, first)
        {
            return Some(IrregularStep {
                row: 0,
                before,
                after: first,
            });
        }
        let row = first_step(times, &good)? + 1;
        Some(IrregularStep {
            row,
            before: times[row - 1],
            after: times[row],
        })
    }

    /// Text about missing samples, and what to do.
    fn explain_missing(&self, missing: &MissingSamples) -> String {
        let Self { unit, step, .. } = self;
        let (before, after) = (missing.at.before, missing.at.after);
        format!(
            "about {} missing between {} and {}: there the time stamps, which are rounded to {} {unit}, leave the \
             uniform line of {} Hz by {} {unit}; use --fill linear to fill the gap, or --range to exclude it",
            match missing.samples {
                1 => "1 sample is".to_owned(),
                samples => format!("{samples} samples are"),
            },
            self.time_text(before),
            self.time_text(after),
            digits::text(self.quantum, 3),
            digits::text(1.0 / (step * self.seconds_per_unit), 6),
            digits::text(missing.samples as f64 * step, 4),
        )
    }

    /// Failure for samples missing between coarse stamps.
    ///
    /// # Errors
    /// If there are any and the samples are placed by their stamps.
    pub(super) fn check_missing(&self) -> Result<(), Failure> {
        let Some(missing) = self.missing.filter(|_| !self.resampled) else {
            return Ok(());
        };
        let failure = ErrorCode::IrregularTime.failed(self.explain_missing(&missing));
        Err(failure.sample(missing.at.row + 1).with(|place| {
            place.time_s = Some(self.time_s(missing.at.after));
        }))
    }

    /// The time of a stamp.
    fn moment(&self, stamp: f64) -> Moment {
        Moment {
            origin_ns: self.origin_ns,
            after_s: stamp * self.seconds_per_unit,
        }
    }

    /// The time of a stamp in nanoseconds.
    pub(crate) fn nanoseconds(&self, stamp: f64) -> i64 {
        let after_ns = stamp * (self.seconds_per_unit * 1e9);
        self.origin_ns.saturating_add(after_ns.round() as i64)
    }

    /// A stamp as written in the file, with its unit.
    pub(super) fn time_text(&self, stamp: f64) -> String {
        match self.origin_ns {
            0 => format!("{} {}", digits::text(stamp, 12), self.unit),
            _ => self.moment(stamp).text(),
        }
    }

    /// Time of a stamp on the file's own axis.
    pub(super) fn time_s(&self, stamp: f64) -> f64 {
        stamp * self.seconds_per_unit + self.origin_ns as f64 * 1e-9
    }

    /// Bits of the counter that starts again between two stamps, if one does.
    pub(super) fn rolled_over(&self, before: f64, after: f64) -> Option<i32> {
        let [before_s, after_s] = [before, after].map(|stamp| self.time_s(stamp));
        rolled_over(before_s, after_s, self.step * self.seconds_per_unit)
    }

    /// Text about a break, and what to do.
    pub(super) fn explain(&self, found: &IrregularStep) -> String {
        let Self { unit, step, .. } = self;
        if let Some(blocks) = &self.blocks {
            return blocks.explain(self.seconds_per_unit);
        }
        let time = |stamp| self.time_text(stamp);
        let (before, after) = (time(found.before), time(found.after));
        if let Some(bits) = self.rolled_over(found.before, found.after) {
            let hz = digits::text(1.0 / (step * self.seconds_per_unit), 9);
            return format!(
                "the time starts again, from {before} to {after}: a counter of {bits} bits rolled over, and no sample is \
                 missing; give --rate {hz} to continue across it"
            );
        }
        if found.after < found.before {
            return format!(
                "time runs backwards, from {before} to {after}: the clock was set back, two recordings were joined, or \
                 rows were written twice; split the file there, or remove the duplicate rows"
            );
        }
        if found.after == found.before {
            return format!(
                "the time stamp {after} repeats the one before it: a sample is stored twice, or the clock stood still; \
                 use --resample to drop the sample, or --rate HZ if the stamps are wrong or have fewer decimals from there on"
            );
        }
        let length = (found.after - found.before) / step;
        let remedy = match is_gap(length, 0.0) {
            true => fill::remedy(length),
            false => "use --resample to interpolate, or --rate HZ if the stamps are wrong",
        };
        format!(
            "the time stamps are not uniform: the step from {before} to {after} \
             is {} times the usual one of {} {unit}; {remedy}",
            digits::text(length, 4),
            digits::text(*step, 6)
        )
    }
}

/// The first place at which coarse stamps leave out samples.
pub(super) fn first_missing(broken: &BrokenLine, stamps: &[f64]) -> Option<MissingSamples> {
    broken.breaks.first().map(|gap| MissingSamples {
        at: IrregularStep {
            row: gap.index,
            before: stamps[gap.index - 1],
            after: stamps[gap.index],
        },
        samples: gap.missing,
    })
}

/// Whether a step of `length` typical ones, within `slack` of an integer, leaves out whole samples.
pub(super) fn is_gap(length: f64, slack: f64) -> bool {
    length > 1.5 + slack && (length - length.round()).abs() < 0.1 + slack
}

/// The rates corresponding to two steps in s, as text.
pub(crate) fn rates_of([least_s, largest_s]: [f64; 2]) -> String {
    let rate = |step_s: f64, places| digits::text(1.0 / step_s, places);
    let differ = |places: &u32| rate(least_s, *places) != rate(largest_s, *places);
    let places = (4..12).find(differ).unwrap_or(12);
    let hz = |step_s: f64| rate(step_s, places);
    match least_s > 1e-9 * largest_s {
        true => format!("any rate from {} Hz to {} Hz", hz(largest_s), hz(least_s)),
        false => format!("any rate of {} Hz or more", hz(largest_s)),
    }
}

/// Whether stamps in seconds are uniform.
pub(crate) fn is_uniform(stamps_s: &[f64], rate_hz: f64) -> bool {
    let grid = StampGrid::at_rate(rate_hz, 0, stamps_s);
    grid.missing.is_none() && grid.first_irregular(None, stamps_s).is_none()
}

impl Channel {
    /// Whether its stamps, if they are used or replaced by a given rate, are rounded coarsely.
    pub(super) fn has_coarse_stamps(&self) -> bool {
        let of_stamps = matches!(self.axis.rate_from, RateFrom::Stamps(_) | RateFrom::Given);
        let stamps_s = self.axis.stamps_s.as_ref().filter(|_| of_stamps);
        let step =
            stamps_s.and_then(|stamps_s| step_of(stamps_s, self.axis.origin_ns as f64 * 1e-9));
        stamps_s.zip(step).is_some_and(|(stamps_s, found)| {
            StampGrid::at_rate(1.0 / found.step, self.axis.origin_ns, stamps_s)
                .is_rounded_coarsely()
        })
    }

    /// A warning if the stamps in use are rounded coarsely.
    pub(super) fn rounded_stamps(&self, source: &str, rate_hz: f64) -> Option<Warning> {
        let by_stamps = matches!(self.axis.rate_from, RateFrom::Stamps(_));
        let stamps_s = self.axis.stamps_s.as_ref().filter(|_| by_stamps)?;
        let span_s = stamps_s.last()? - stamps_s.first()?;
        let grid = StampGrid::at_rate(rate_hz, self.axis.origin_ns, stamps_s);
        grid.rounded_warning(source, span_s)
    }

    /// Rejects a rate that the rounding of the stamps leaves too uncertain.
    ///
    /// # Errors
    /// If the rates permitted by the stamps differ too much.
    pub(super) fn check_rounding(&self, rate_hz: f64) -> Result<(), Failure> {
        let axis = &self.axis;
        let by_stamps = matches!(axis.rate_from, RateFrom::Stamps(_));
        let stamps_s = axis.stamps_s.as_ref().filter(|_| by_stamps);
        match stamps_s.zip(axis.rate_std_hz) {
            Some((stamps_s, std_hz)) => {
                let grid = StampGrid::at_rate(rate_hz, axis.origin_ns, stamps_s);
                grid.check_rounding(rate_hz, std_hz)
            }
            None => Ok(()),
        }
    }

    /// The first of its stamps that is not uniform, if stamps are used.
    pub(super) fn irregular(&self, rate_hz: f64) -> Option<Failure> {
        let by_stamps = matches!(self.axis.rate_from, RateFrom::Stamps(_));
        let stamps_s = self.axis.stamps_s.as_ref().filter(|_| by_stamps)?;
        let grid = StampGrid::at_rate(rate_hz, self.axis.origin_ns, stamps_s);
        if let Err(missing) = grid.check_missing() {
            return Some(missing);
        }
        let found = grid.first_irregular(None, stamps_s)?;
        let failure = ErrorCode::IrregularTime.failed(format_args!(
            "\"{}\": {}",
            self.name,
            grid.explain(&found)
        ));
        Some(failure.sample(found.row + 1).with(|place| {
            place.time_s = Some(grid.time_s(found.after));
        }))
    }
}

/// Index of the first bad step. Tests many at once, since there rarely is one.
fn first_step(times: &[f64], good: &impl Fn(f64, f64) -> bool) -> Option<usize> {
    const TOGETHER: usize = 64;
    let steps = times.len().saturating_sub(1);
    let is_good = |i: usize| good(times[i], times[i + 1]);
    let start = (0..steps).step_by(TOGETHER).find(|&start| {
        let part = &times[start..(start + TOGETHER + 1).min(times.len())];
        let pairs = part.iter().zip(&part[1..]);
        !pairs.fold(true, |all, (a, b)| all & good(*a, *b))
    })?;
    (start..steps).find(|i| !is_good(*i))
}

/// Rejects resampling to a rate far from the recorded one.
pub(super) fn check_resampled(rate_hz: f64, recorded_hz: f64) -> Result<(), Failure> {
    let (low, high) = RESAMPLED_RATES;
    if (low * recorded_hz..=high * recorded_hz).contains(&rate_hz) {
        return Ok(());
    }
    Err(ErrorCode::IrregularTime.failed(format_args!(
        "the stamps come at {} Hz; --resample with --rate {} would alias high frequencies or invent samples. \
         Resample near the recorded rate, and limit the band with --band",
        digits::text(recorded_hz, 6),
        digits::text(rate_hz, 6)
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(step: f64, resampled: bool) -> StampGrid {
        StampGrid {
            unit: "s".to_owned(),
            seconds_per_unit: 1.0,
            step,
            resampled,
            copied: true,
            origin_ns: 0,
            quantum: 0.0,
            missing: None,
            blocks: None,
        }
    }

    #[test]
    fn one_per_cent_of_a_step_is_uniform_and_more_is_not() {
        let grid = grid(0.001, false);
        assert_eq!(
            grid.first_irregular(None, &[0.0, 0.001, 0.002_009, 0.003_001]),
            None
        );
        let found = grid
            .first_irregular(None, &[0.0, 0.001, 0.002_011, 0.003])
            .unwrap();
        assert_eq!((found.row, found.after), (2, 0.002_011));
        let found = grid.first_irregular(Some(-0.002), &[0.0, 0.001]).unwrap();
        assert_eq!((found.row, found.before), (0, -0.002));
    }

    #[test]
    fn large_stamps_are_allowed_their_rounding() {
        let start = 1.7e9;
        let times: Vec<f64> = (0..1000).map(|i| start + 20e-6 * f64::from(i)).collect();
        assert_eq!(grid(20e-6, false).first_irregular(None, &times), None);
    }

    #[test]
    fn resampled_stamps_may_do_anything_but_run_backwards() {
        let grid = grid(1.0, true);
        assert_eq!(grid.first_irregular(None, &[0.0, 0.5, 0.5, 7.0]), None);
        assert_eq!(grid.first_irregular(None, &[0.0, 0.5, 0.4]).unwrap().row, 2);
    }

    #[test]
    fn messages_say_what_and_what_to_do() {
        let grid = grid(0.5, false);
        let explain = |before, after| {
            grid.explain(&IrregularStep {
                row: 1,
                before,
                after,
            })
        };
        assert!(explain(1.0, 0.5).contains("backwards, from 1 s to 0.5 s"));
        assert!(explain(1.0, 1.0).contains("repeats"));
        let gap = explain(1.0, 2.5);
        assert!(
            gap.contains("3 times") && gap.contains("--fill linear"),
            "{gap}"
        );
    }
}
