//! Samples that repeat the one before.

use super::runs::Lengths;
use super::{excerpts, median, range, runs};

/// Bins up to the median step in which steps are counted.
const BINS: usize = 64;
/// Fewest steps from which the bins can be judged.
const FEWEST: usize = 400;
/// Part of the bins that is filled if the resolution is finer than two of them.
const FILLED: f64 = 0.5;
/// Repeats, over what the resolution explains at most, from which there are too many.
const EXCESS: f64 = 3.0;
/// Part of the values that must be repeats before it is worth saying.
const PART: f64 = 0.05;
/// Part of the runs that must be whole multiples of a hold.
const WHOLE: f64 = 0.98;
/// Longest hold that is looked for.
const LONGEST_HOLD: usize = 100;
/// Fewest runs from which a hold is told.
const FEWEST_RUNS: usize = 30;

/// How often samples repeat the one before, and whether they should.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeats {
    /// Part of all samples but the first that equal the one before.
    pub fraction: f64,
    /// Whether that is more than the channel's resolution explains; `None` if it cannot be told.
    pub unexplained: Option<bool>,
    /// Number of samples that every value is held for, if it is one number.
    pub hold: Option<usize>,
    /// Values over samples: the rate at which new values come, over the sampling rate.
    pub fresh: f64,
}

/// Counts samples that equal the one before, and tells whether the resolution explains them; `None`
/// for fewer than two numbers or a constant channel.
///
/// A signal that moves by many resolution steps from one sample to the next hits the same value again
/// about as often as any other value near it. Let `d` be the median of the steps between different
/// values. If the sizes of the steps fill half of 64 bins between 0 and `d`, the resolution is finer
/// than `d/32`; then repeats are expected no more often than steps of up to `d/16`. Three times that
/// (and five standard deviations of a count more, and 5 % of all values) are not explained. Values
/// are counted, not samples: a standstill, however long, is one value. Where the bins stay empty, the
/// resolution is coarse and nothing is claimed, unless 98 % of the values are held for a multiple of
/// the same number `k ≥ 2` of samples; by chance that would be one in `k`, so that with 30 values it
/// never happens.
///
/// ```
/// use torqcomp_dsp::quality::repeats::repeats;
/// // A sensor with 500 values a second, stored a thousand times a second.
/// let held: Vec<f64> = (0..1000).map(|i| (0.7 * f64::from(i / 2)).sin()).collect();
/// let found = repeats(&held).unwrap();
/// assert_eq!((found.hold, found.fresh), (Some(2), 0.5));
/// assert_eq!(found.unexplained, Some(true));
/// ```
#[must_use]
pub fn repeats(samples: &[f64]) -> Option<Repeats> {
    let (low, high) = range(samples).filter(|(low, high)| low < high)?;
    let numbers = samples.iter().filter(|x| !x.is_nan()).count();
    let all = Lengths::of(runs(samples));
    let fresh = all.total() as f64 / numbers as f64;
    // Values at the ends may be clipped, and the first and last are held for longer than is seen.
    let inner = |r: &super::Run| r.value != low && r.value != high && r.start > 0;
    let lengths = Lengths::of(runs(samples).filter(|r| inner(r) && r.end() < samples.len()));
    let hold = hold(&lengths);
    Some(Repeats {
        fraction: (numbers - all.total()) as f64 / (numbers - 1) as f64,
        unexplained: match hold {
            Some(_) => Some(true),
            None => unexplained(samples, &lengths),
        },
        hold,
        fresh,
    })
}

/// The number of samples that every value is held for a multiple of, if there is one above 1.
fn hold(lengths: &Lengths) -> Option<usize> {
    let total = lengths.total();
    if total < FEWEST_RUNS {
        return None;
    }
    let whole = |k: usize| lengths.count(|l| l > 0 && l % k == 0) as f64 >= WHOLE * total as f64;
    // Most values are held once: the hold is the most frequent length.
    (2..=LONGEST_HOLD)
        .rev()
        .find(|k| 2 * lengths.count(|l| l == *k) > total && whole(*k))
}

/// Whether more values are held for several samples than the resolution explains.
fn unexplained(samples: &[f64], lengths: &Lengths) -> Option<bool> {
    let parts = excerpts(samples);
    let mut steps: Vec<f64> = parts
        .iter()
        .flat_map(|part| part.windows(2))
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|step| *step > 0.0 && step.is_finite())
        .collect();
    let count = steps.len();
    let middle = median(&mut steps).filter(|_| count >= FEWEST)?;
    let mut bins = [0_usize; BINS];
    for step in steps.iter().filter(|step| **step < middle) {
        bins[(BINS as f64 * step / middle) as usize] += 1;
    }
    let filled = bins.iter().filter(|bin| **bin > 0).count();
    if (filled as f64) < FILLED * BINS as f64 {
        return None;
    }
    let near: usize = bins[..BINS / 16].iter().sum();
    let values = lengths.total() as f64;
    let expected = near as f64 / count as f64 * values;
    let held = lengths.count(|l| l > 1) as f64;
    Some(held > PART * values && held > EXCESS * expected + 5.0 * expected.sqrt() + 10.0)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, rounded, sine, sum};
    use super::*;

    #[test]
    fn resolution_explains_its_own_repeats() {
        for seed in 0..3 {
            for step in [1e-6, 0.01, 0.1, 0.5, 1.0, 2.0, 5.0] {
                let white = rounded(&noise(seed, 20_000), step);
                let slow = rounded(&sine(40.0, 3000.0 + seed as f64, 20_000), step);
                let mixed = rounded(&sum(&noise(seed, 20_000), &sine(9.0, 50.0, 20_000)), step);
                for (name, record) in [("white", white), ("slow", slow), ("mixed", mixed)] {
                    let claimed = repeats(&record).and_then(|r| r.unexplained);
                    assert_ne!(claimed, Some(true), "{name}, seed {seed}, step {step}");
                }
            }
        }
    }

    #[test]
    fn rest_between_motions_is_not_a_repeat() {
        // A third of the time at rest, in noise below the resolution.
        let moving = sine(30.0, 77.0, 30_000);
        let gated: Vec<f64> = noise(3, 30_000)
            .iter()
            .zip(moving)
            .enumerate()
            .map(|(i, (n, x))| if i % 3000 < 1000 { 0.05 * n } else { x + n })
            .collect();
        let found = repeats(&rounded(&gated, 0.1)).unwrap();
        assert_ne!(found.unexplained, Some(true), "{found:?}");
        assert!(found.fraction > 0.1);
    }

    #[test]
    fn a_part_of_samples_repeated_at_random_is_found() {
        // 30 % of the samples repeat the previous one, in five-digit text.
        let fresh = noise(9, 20_000);
        let chance = noise(10, 20_000);
        let mut record = vec![fresh[0]];
        for i in 1..20_000 {
            let repeat = chance[i] < -0.524;
            record.push(if repeat { record[i - 1] } else { fresh[i] });
        }
        let found = repeats(&rounded(&record, 1e-4)).unwrap();
        assert!((found.fraction - 0.3).abs() < 0.01, "{found:?}");
        assert_eq!((found.unexplained, found.hold), (Some(true), None));
        let few: Vec<f64> = record[..50].to_vec();
        assert_eq!(repeats(&few).unwrap().unexplained, None);
    }

    #[test]
    fn a_hold_is_told_even_of_coarse_values() {
        let held: Vec<f64> = rounded(&noise(2, 500), 0.5)
            .iter()
            .flat_map(|x| [*x; 4])
            .collect();
        assert_eq!(repeats(&held).unwrap().hold, Some(4));
        assert_eq!(repeats(&[3.0; 10]), None);
    }
}
