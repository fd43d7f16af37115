//! Findings about the time axis of a channel.

use torqcomp_dsp::quality::broken_line::BrokenLine;
use torqcomp_dsp::quality::is_straight;
use torqcomp_dsp::quality::rate::{Contradiction, contradiction};
use torqcomp_dsp::quality::rounding::{Rounded, rounded};
use torqcomp_dsp::quality::steps::{Event, Events, Steps, broken_steps, rounded_steps, steps};

use crate::print::plural;
use crate::print::rounded as number;
use crate::recording::{
    ArrivalBlocks, COARSE_STAMPS, Channel, FEWEST_UNLIKE, REVERSED, TimeAxis, advice_for_uneven,
    contradicted, falls, no_stamps, rates_of, rolled_over, same_stamps,
};
use crate::warning::{Warning, WarningCode};

/// Largest relative deviation of a step in an axis that counts as uniform.
const UNIFORM: f64 = 0.01;
/// Number of typical steps backwards above which the clock was set back, rather than samples being
/// out of order.
const SET_BACK: f64 = 10.0;

/// Findings about a time axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TimeFindings {
    /// Its steps; `None` without stamps, or if none increases.
    pub steps: Option<Steps>,
    /// Quantum of its stamps, if rounding is their only fault.
    pub rounded: Option<Rounded>,
    /// Blocks of samples that arrived together.
    pub(crate) blocks: Option<ArrivalBlocks>,
    /// A rate in the file header that contradicts the stamps.
    pub contradiction: Option<Contradiction>,
}

impl TimeFindings {
    /// Analyses an axis.
    pub fn of(axis: &TimeAxis) -> Self {
        let Some(stamps_s) = &axis.stamps_s else {
            return Self::default();
        };
        let plain = steps(stamps_s);
        let is_uniform = plain.as_ref().is_some_and(|found| {
            found.jitter.is_none_or(|j| j.peak <= UNIFORM) && found.repeated.count == 0
        });
        // As for the rate: regular gaps may be the rounding of a slower rate.
        let has_gaps = |found: &Steps| found.gaps.count >= FEWEST_UNLIKE;
        let is_whole = is_uniform && !plain.as_ref().is_some_and(has_gaps);
        let mut rounded = if is_whole { None } else { rounded(stamps_s) };
        let may_be_broken = !is_uniform && rounded.is_none();
        let broken = may_be_broken.then(|| BrokenLine::of(stamps_s)).flatten();
        let steps = match (&rounded, &broken) {
            (Some(r), _) => rounded_steps(stamps_s, r.step_s, r.quantum_s),
            (None, Some(broken)) => broken_steps(stamps_s, broken),
            (None, None) => plain,
        };
        rounded = rounded.or(broken.map(|broken| broken.line));
        let contradiction = axis
            .header_rate_hz
            .zip(steps.as_ref())
            .and_then(|(stated, steps)| contradiction(stated, 1.0 / steps.typical_s, steps.stamps));
        Self {
            steps,
            rounded,
            blocks: ArrivalBlocks::of(stamps_s, rounded.map_or(0.0, |line| line.quantum_s)),
            contradiction,
        }
    }

    /// The warnings; `whose` names the channels of the axis.
    pub fn warnings(&self, whose: &str, axis: &TimeAxis) -> Vec<Warning> {
        let mut found: Vec<Warning> = missing(whose, axis).into_iter().collect();
        if let Some(assumed) = &axis.assumed {
            found.push(WarningCode::TimeAssumed.warning(format!("{whose}: {assumed}")));
        }
        found.extend(self.contradiction.map(|c| contradicted(whose, &c)));
        let Some(steps) = &self.steps else {
            return found;
        };
        if steps.non_finite > 0 {
            found.push(WarningCode::NonFiniteStamps.warning(format!(
                "{whose}: {} without a number",
                plural(steps.non_finite, "time stamp")
            )));
        }
        if let Some(blocks) = &self.blocks {
            let said = format!("{whose}: {}", blocks.explain(1.0));
            found.push(WarningCode::TimeJitter.warning(said));
            return found;
        }
        found.extend(backwards(whose, axis, steps));
        found.extend(repeated(whose, axis, steps));
        if axis.rate_hz.is_none() {
            // Without a typical step, every step would be a gap.
            return found;
        }
        found.extend(jumps(whose, axis, steps));
        found.extend(gaps(whose, axis, steps));
        found.extend(match &self.rounded {
            Some(rounded) if rounded.quantum_s <= COARSE_STAMPS * rounded.step_s => None,
            Some(rounded) => Some(rounded_stamps(whose, rounded, axis, steps.gaps.count > 0)),
            None => jitter(whose, steps),
        });
        found
    }
}

/// Warning about a channel that is a time axis itself (in a unit of time, rising along a straight
/// line), if the rate in the file header contradicts it.
pub fn stamps_in_channel(name: &str, channel: &Channel) -> Option<Warning> {
    let stated_hz = channel.axis.header_rate_hz?;
    let unit = channel.unit.as_ref().filter(|unit| unit.is_time())?;
    if channel.axis.stamps_s.is_some() || !is_straight(&channel.samples) {
        return None;
    }
    let step_s = steps(&channel.samples)?.typical_s * unit.unit.factor();
    let found = contradiction(stated_hz, 1.0 / step_s, channel.samples.len())?;
    Some(WarningCode::RateContradictsStamps.warning(format!(
        "\"{name}\" rises like a time axis of {} Hz, but the header gives {} Hz for it; find out which is right, \
         and give it with --rate, or the column with --time-column",
        number(found.stamped_hz, 6),
        number(found.stated_hz, 6)
    )))
}

fn missing(whose: &str, axis: &TimeAxis) -> Option<Warning> {
    if axis.rate_hz.is_some() {
        return None;
    }
    let given = "verbs that need a rate refuse it unless one is given with --rate HZ, or the column of time stamps \
        with --time-column";
    let why = match axis.stamps_s.as_deref().map(Vec::as_slice) {
        // A list without messages has no rate.
        Some([]) => return None,
        Some(stamps) if falls(stamps) => REVERSED.to_owned(),
        Some(stamps) => {
            let advice = advice_for_uneven(stamps).unwrap_or_else(|| given.to_owned());
            format!("the time stamps have no usual step; {advice}")
        }
        None => no_stamps(axis, given),
    };
    let message = format!("{whose}: the sampling rate is unknown, because {why}");
    Some(WarningCode::MissingRate.warning(message))
}

/// `3 of …, the first at …`; `None` if there are none.
fn counted(events: &Events) -> Option<(&Event, &Event)> {
    events.listed.first().zip(events.longest.as_ref())
}

fn backwards(whose: &str, axis: &TimeAxis, steps: &Steps) -> Option<Warning> {
    let (first, longest) = counted(&steps.backwards)?;
    let before_s = axis.origin_ns as f64 * 1e-9 + first.from_s;
    let after_s = before_s + first.step_s;
    if let Some(bits) = rolled_over(before_s, after_s, steps.typical_s) {
        let message = format!(
            "{whose}: the time starts again at {}: a counter of {bits} bits rolled over; if no sample is missing, give \
             --rate HZ to continue across it",
            axis.moment(first.from_s).short()
        );
        return Some(WarningCode::TimeBackwards.warning(message));
    }
    let why = if -longest.step_s > SET_BACK * steps.typical_s {
        "the clock was set back, two recordings were joined, or rows were written twice; split the file there, or \
         remove the duplicate rows"
    } else {
        "the samples are out of order"
    };
    Some(WarningCode::TimeBackwards.warning(format!(
        "{whose}: time runs backwards {}, first at {} and at most by {} s: {why}",
        times(steps.backwards.count),
        axis.moment(first.from_s).short(),
        number(-longest.step_s, 4)
    )))
}

fn repeated(whose: &str, axis: &TimeAxis, steps: &Steps) -> Option<Warning> {
    let (first, _) = counted(&steps.repeated)?;
    Some(WarningCode::RepeatedStamps.warning(format!(
        "{whose}: {} the same as the previous one, first {}: samples stored twice, or a stopped clock",
        plural(steps.repeated.count, "time stamp"),
        axis.moment(first.from_s).short()
    )))
}

fn jumps(whose: &str, axis: &TimeAxis, steps: &Steps) -> Option<Warning> {
    let (first, _) = counted(&steps.jumps)?;
    Some(WarningCode::ClockJump.warning(format!(
        "{whose}: the time stamps jump by {} s after {}, more than the rest of the record lasts: the clock was \
         set, or two recordings were joined; split the file there",
        number(first.step_s, 4),
        axis.moment(first.from_s).short()
    )))
}

fn gaps(whose: &str, axis: &TimeAxis, steps: &Steps) -> Option<Warning> {
    let (first, longest) = counted(&steps.gaps)?;
    let samples = steps.stamps as f64;
    Some(WarningCode::TimeGaps.warning(format!(
        "{whose}: {} in the time stamps, samples missing: about {} ({} %); the first after {}, the longest of {} s \
         after {}; --fill linear fills short ones",
        plural(steps.gaps.count, "gap"),
        number(steps.missing, 6),
        number(100.0 * steps.missing / (samples + steps.missing), 2),
        axis.moment(first.from_s).short(),
        number(longest.step_s, 4),
        axis.moment(longest.from_s).short()
    )))
}

fn jitter(whose: &str, steps: &Steps) -> Option<Warning> {
    let jitter = steps.jitter.filter(|jitter| jitter.peak > UNIFORM)?;
    Some(WarningCode::TimeJitter.warning(format!(
        "{whose}: the time stamps jitter about a step of {} s by {} % rms, {} % at most; --resample interpolates \
         to a uniform step; if the stamps are arrival times, give the recorder's rate with --rate HZ",
        number(steps.typical_s, 6),
        number(100.0 * jitter.std, 3),
        number(100.0 * jitter.peak, 3)
    )))
}

fn rounded_stamps(whose: &str, rounded: &Rounded, axis: &TimeAxis, has_gaps: bool) -> Warning {
    let ends = axis.stamps_s.as_ref().and_then(|stamps_s| {
        let (first, last) = (stamps_s.first()?, stamps_s.last()?);
        Some(last - first)
    });
    let but_for = if has_gaps {
        "that and the gaps"
    } else {
        "that"
    };
    let allowed = ends.map_or_else(String::new, |span_s| {
        format!(" (they allow {})", rates_of(rounded.steps_over(span_s)))
    });
    WarningCode::RoundedTimeStamps.warning(format!(
        "{whose}: the time stamps are written in multiples of {} s; apart from {but_for} they are uniform, and \
         together they give {} Hz{allowed}{}",
        number(rounded.quantum_s, 3),
        number(1.0 / rounded.step_s, 9),
        same_stamps(rounded.quantum_s / rounded.step_s, rounded.quantum_s)
    ))
}

fn times(count: usize) -> String {
    match count {
        1 => "once".to_owned(),
        _ => format!("{count} times"),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn codes(axis: &TimeAxis) -> Vec<&'static str> {
        let found = TimeFindings::of(axis).warnings("\"a\"", axis);
        found.iter().map(|w| w.code).collect()
    }

    fn stamped(stamps: Vec<f64>) -> TimeAxis {
        TimeAxis::of_stamps("t", Arc::new(stamps))
    }

    #[test]
    fn each_fault_has_its_code_and_a_good_axis_none() {
        let good: Vec<f64> = (0..1000).map(|i| 1e-3 * f64::from(i)).collect();
        assert!(codes(&stamped(good.clone())).is_empty());
        assert!(codes(&TimeAxis::of_header("Delta_X", 1000.0, None)).is_empty());
        assert_eq!(codes(&TimeAxis::default()), ["missing-rate"]);
        let empty = TimeAxis {
            stamps_s: Some(Vec::new().into()),
            ..TimeAxis::default()
        };
        assert!(codes(&empty).is_empty());

        let mut gap = good.clone();
        gap.iter_mut().skip(400).for_each(|t| *t += 0.005);
        assert_eq!(codes(&stamped(gap)), ["time-gaps"]);

        let mut back = good.clone();
        back.iter_mut().skip(400).for_each(|t| *t -= 0.1);
        assert_eq!(codes(&stamped(back)), ["time-backwards"]);

        let mut jump = good.clone();
        jump.iter_mut().skip(400).for_each(|t| *t += 5000.0);
        assert_eq!(codes(&stamped(jump)), ["clock-jump"]);

        let jitter: Vec<f64> = (0..1000)
            .map(|i| 1e-3 * f64::from(i) + 1e-4 * f64::from(i * i % 7) / 7.0)
            .collect();
        assert_eq!(codes(&stamped(jitter)), ["time-jitter"]);

        let coarse = (0..999).map(|i| (f64::from(i) / 1.5).round() * 1e-3);
        assert_eq!(codes(&stamped(coarse.collect())), ["rounded-time-stamps"]);

        let mut stated = stamped(good);
        stated.header_rate_hz = Some(2000.0);
        assert_eq!(codes(&stated), ["rate-contradicts-stamps"]);
    }
}
