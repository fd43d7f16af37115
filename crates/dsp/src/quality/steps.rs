//! The time axis: its typical step, and all irregular steps.

use schemars::JsonSchema;
use serde::Serialize;

use super::broken_line::BrokenLine;
use super::median;

/// Ratio to the typical step above which a step leaves out a sample.
const GAP: f64 = 1.5;
/// Additional minimum deviation of a gap from the typical step, in robust standard deviations.
const OUTLIER: f64 = 6.0;
/// Ratio of standard deviation to median absolute deviation of a normal distribution.
const NORMAL: f64 = 1.4826;
/// Maximum number of listed events of one kind; all are counted.
const MOST_LISTED: usize = 100;

/// Analysis of the steps between time stamps.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// Number of finite stamps.
    pub stamps: usize,
    /// Number of non-finite stamps.
    pub non_finite: usize,
    /// Typical step, in s.
    pub typical_s: f64,
    /// Relative deviations from it, without gaps, backward and repeated steps; `None` for fewer
    /// than two steps.
    pub jitter: Option<Jitter>,
    /// Steps that leave out samples.
    pub gaps: Events,
    /// Number of samples left out by the gaps, if the clock is right.
    pub missing: f64,
    /// Forward steps longer than the rest of the recorded time: the clock was set, or two
    /// recordings were joined.
    pub jumps: Events,
    /// Backward steps.
    pub backwards: Events,
    /// Stamps equal to the preceding one.
    pub repeated: Events,
}

/// Deviations of the regular steps from the typical one, relative to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jitter {
    /// Standard deviation.
    pub std: f64,
    /// Largest deviation.
    pub peak: f64,
}

/// Irregular steps of one kind.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Events {
    /// Number of events.
    pub count: usize,
    /// The first hundred of them.
    pub listed: Vec<Event>,
    /// The longest event.
    pub longest: Option<Event>,
}

/// An irregular step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Event {
    /// Index of the stamp that ends it.
    #[serde(skip)]
    pub index: usize,
    /// Previous stamp, in s.
    #[serde(rename = "after_s")]
    pub from_s: f64,
    /// Length in s; negative if time runs backwards.
    #[serde(rename = "length_s")]
    pub step_s: f64,
}

impl Events {
    fn push(&mut self, event: Event) {
        self.count += 1;
        if self.listed.len() < MOST_LISTED {
            self.listed.push(event);
        }
        if self
            .longest
            .is_none_or(|e| event.step_s.abs() > e.step_s.abs())
        {
            self.longest = Some(event);
        }
    }
}

/// Analyses the steps of time stamps in s. `None` if fewer than two stamps are finite or no stamp
/// lies after another.
///
/// The typical step `T` is the mean of the steps within 25 % of the median positive step; if more
/// than 1 % of the steps are farther away (gaps), of those within 1 % (or 5 %) of it, if these are
/// half of all. A fault of fewer than half of the steps cannot move it. With `s = 1.4826·MAD` of the
/// steps:
/// * a step longer than `max(1.5 T, T + 6 s)` is a gap that leaves out `round(step/T) − 1` samples
///   (normally distributed jitter of any size exceeds 6 s once in 10⁹ steps);
/// * a step longer than all regular steps together is a clock jump, not a gap;
/// * zero and negative steps are counted as such.
///
/// Jitter is the standard deviation and the largest deviation of the remaining steps, relative to
/// `T`.
///
/// ```
/// use torqcomp_dsp::quality::steps::steps;
/// let found = steps(&[0.0, 1.0, 2.0, 3.0, 6.0, 7.0, 7.0, 8.0, 7.5, 8.5]).unwrap();
/// assert_eq!(found.typical_s, 1.0);
/// assert_eq!((found.gaps.count, found.gaps.listed[0].from_s, found.missing), (1, 3.0, 2.0));
/// assert_eq!((found.repeated.count, found.backwards.listed[0].step_s), (1, -0.5));
/// ```
#[must_use]
pub fn steps(stamps_s: &[f64]) -> Option<Steps> {
    steps_about(stamps_s, None)
}

/// As [`steps`](fn@steps), for a known typical step of samples whose stamps are rounded to multiples
/// of `quantum_s`. Steps explained by rounding are then neither gaps nor repeats.
#[must_use]
pub fn rounded_steps(stamps_s: &[f64], step_s: f64, quantum_s: f64) -> Option<Steps> {
    steps_about(stamps_s, Some((step_s, quantum_s)))
}

/// As [`steps`](fn@steps), for rounded stamps that leave out samples at known places.
#[must_use]
pub fn broken_steps(stamps_s: &[f64], broken: &BrokenLine) -> Option<Steps> {
    let step_s = broken.line.step_s;
    let mut found = steps_about(stamps_s, Some((step_s, broken.line.quantum_s)))?;
    found.missing = broken.missing() as f64;
    found.gaps = Events::default();
    for gap in &broken.breaks {
        found.gaps.push(Event {
            index: gap.index,
            from_s: stamps_s[gap.index - 1],
            step_s: step_s * (gap.missing + 1) as f64,
        });
    }
    Some(found)
}

fn steps_about(stamps_s: &[f64], rounded: Option<(f64, f64)>) -> Option<Steps> {
    let typical_s = match rounded {
        Some((step_s, _)) => step_s,
        None => usual(stamps_s)?,
    };
    let quantum_s = rounded.map_or(0.0, |(_, quantum_s)| quantum_s);
    let limit_s = gap_limit(stamps_s, typical_s).max(GAP * typical_s + quantum_s);
    let regular = |step: f64| step > 0.0 && step <= limit_s;
    let (mut count, mut sum, mut square, mut peak) = (0.0, 0.0, 0.0, 0.0_f64);
    for (_, _, step) in walk(stamps_s).filter(|(_, _, step)| regular(*step)) {
        let deviation = step / typical_s - 1.0;
        count += 1.0;
        sum += deviation;
        square += deviation * deviation;
        peak = peak.max(deviation.abs());
    }
    let mut found = Steps {
        stamps: stamps_s.iter().filter(|t| t.is_finite()).count(),
        non_finite: stamps_s.iter().filter(|t| !t.is_finite()).count(),
        typical_s,
        jitter: (count > 1.0).then(|| Jitter {
            std: (square / count - (sum / count).powi(2)).max(0.0).sqrt(),
            peak,
        }),
        gaps: Events::default(),
        missing: 0.0,
        jumps: Events::default(),
        backwards: Events::default(),
        repeated: Events::default(),
    };
    let recorded_s = (count + sum) * typical_s;
    for (index, from_s, step_s) in walk(stamps_s).filter(|(_, _, step)| !regular(*step)) {
        found.sort_in(
            Event {
                index,
                from_s,
                step_s,
            },
            recorded_s,
            quantum_s,
        );
    }
    Some(found)
}

impl Steps {
    fn sort_in(&mut self, event: Event, recorded_s: f64, quantum_s: f64) {
        if event.step_s < 0.0 {
            self.backwards.push(event);
        } else if event.step_s == 0.0 {
            // Samples closer than the quantum have equal rounded stamps.
            if quantum_s < self.typical_s {
                self.repeated.push(event);
            }
        } else if event.step_s > recorded_s {
            self.jumps.push(event);
        } else {
            self.missing += (event.step_s / self.typical_s).round().max(2.0) - 1.0;
            self.gaps.push(event);
        }
    }
}

/// Steps between finite stamps: index of the later one, the earlier one, mean step between them.
fn walk(stamps_s: &[f64]) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
    let mut before: Option<(usize, f64)> = None;
    stamps_s.iter().enumerate().filter_map(move |(index, &t)| {
        if !t.is_finite() {
            return None;
        }
        let last = before.replace((index, t));
        last.map(|(i, from)| (index, from, (t - from) / (index - i) as f64))
    })
}

/// Relative deviation from the median up to which a step is typical.
const USUAL: f64 = 0.25;
/// The same where there are gaps; the first that includes half of the steps applies.
const CLOSE: [f64; 2] = [0.01, 0.05];
/// Minimum fraction of typical steps in the absence of gaps.
const NEARLY_ALL: f64 = 0.99;
/// Maximum number of steps used for a median.
const MOST_STEPS: usize = 1 << 18;

/// All steps, or an evenly spread selection of very many.
fn some_steps(stamps_s: &[f64]) -> Vec<f64> {
    let stride = stamps_s.len() / MOST_STEPS + 1;
    walk(stamps_s)
        .step_by(stride)
        .map(|(_, _, step)| step)
        .collect()
}

/// Mean of the steps near the median positive step.
fn usual(stamps_s: &[f64]) -> Option<f64> {
    let mut positive = some_steps(stamps_s);
    positive.retain(|step| *step > 0.0);
    let middle = median(&mut positive)?;
    let near = |part: f64| {
        walk(stamps_s)
            .map(|(_, _, step)| step)
            .filter(|step| (step / middle - 1.0).abs() <= part)
            .fold((0.0, 0.0), |(sum, count), step| (sum + step, count + 1.0))
    };
    let all = walk(stamps_s).filter(|(_, _, step)| *step > 0.0).count() as f64;
    let (sum, count) = near(USUAL);
    let closer = || CLOSE.into_iter().map(near).find(|(_, n)| *n >= 0.5 * all);
    let (sum, count) = if count >= NEARLY_ALL * all {
        (sum, count)
    } else {
        closer().unwrap_or((sum, count))
    };
    Some(sum / count)
}

/// Length above which a step is an outlier.
fn gap_limit(stamps_s: &[f64], typical_s: f64) -> f64 {
    let mut deviations = some_steps(stamps_s);
    for step in &mut deviations {
        *step = (*step - typical_s).abs();
    }
    let scatter = NORMAL * median(&mut deviations).unwrap_or(0.0);
    typical_s + OUTLIER * scatter
}

#[cfg(test)]
mod tests {
    use super::super::testing::noise;
    use super::*;

    fn uniform(count: usize) -> Vec<f64> {
        (0..count).map(|i| 1e-3 * i as f64).collect()
    }

    #[test]
    fn a_uniform_axis_has_nothing_to_say() {
        let found = steps(&uniform(10_000)).unwrap();
        assert!((found.typical_s / 1e-3 - 1.0).abs() < 1e-12);
        assert!(found.jitter.unwrap().peak < 1e-9);
        let events = [&found.gaps, &found.jumps, &found.backwards, &found.repeated];
        assert!(events.iter().all(|e| e.count == 0));
        assert_eq!(steps(&[1.0]), None);
        assert_eq!(steps(&[1.0, 1.0]), None);
    }

    #[test]
    fn jitter_has_the_size_it_was_made_with_and_makes_no_gaps() {
        // Independent stamp errors of standard deviation 0.05 T: √2 of that for the steps.
        let stamps: Vec<f64> = uniform(100_000)
            .iter()
            .zip(noise(5, 100_000))
            .map(|(t, n)| t + 5e-5 * n)
            .collect();
        let found = steps(&stamps).unwrap();
        let std = found.jitter.unwrap().std;
        assert!((std / (0.05 * 2.0_f64.sqrt()) - 1.0).abs() < 0.02, "{std}");
        assert_eq!((found.gaps.count, found.backwards.count), (0, 0));
    }

    #[test]
    fn faults_are_found_where_they_were_put() {
        let mut stamps = uniform(2000);
        stamps.iter_mut().skip(500).for_each(|t| *t += 0.007);
        stamps[900] = stamps[899];
        stamps.iter_mut().skip(1500).for_each(|t| *t -= 0.3);
        stamps[1700] = f64::NAN;
        let found = steps(&stamps).unwrap();
        assert_eq!(
            found.gaps.count, 2,
            "the repeat leaves a step of two behind"
        );
        let gap = found.gaps.longest.unwrap();
        assert_eq!((gap.index, found.missing), (500, 8.0));
        assert!((gap.step_s - 0.008).abs() < 1e-12);
        assert_eq!(found.repeated.listed[0].index, 900);
        let back = found.backwards.listed[0];
        assert_eq!((back.index, found.backwards.count), (1500, 1));
        assert!((back.step_s + 0.299).abs() < 1e-12);
        assert_eq!((found.stamps, found.non_finite), (1999, 1));
    }

    #[test]
    fn a_step_longer_than_the_record_is_a_jump() {
        let mut stamps = uniform(1000);
        stamps.iter_mut().skip(300).for_each(|t| *t += 1.7e9);
        let found = steps(&stamps).unwrap();
        assert_eq!((found.jumps.count, found.gaps.count), (1, 0));
        assert_eq!(found.jumps.listed[0].index, 300);
    }

    #[test]
    fn rounding_is_no_gap_and_no_repeat() {
        let stamps: Vec<f64> = (0..3000)
            .map(|i| (f64::from(i) / 1.5).round() * 1e-3)
            .collect();
        let rounded = super::super::rounding::rounded(&stamps).unwrap();
        let found = rounded_steps(&stamps, rounded.step_s, rounded.quantum_s).unwrap();
        assert_eq!((found.gaps.count, found.repeated.count), (0, 0));
        assert!((found.typical_s * 1500.0 - 1.0).abs() < 1e-5);
    }
}
