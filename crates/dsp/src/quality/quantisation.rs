//! Quantisation step of a channel.

use super::{excerpts, range};

/// Candidates for the step: fractions of the distances between neighbouring levels that are
/// smaller.
const CANDIDATES: [f64; 4] = [0.0, 0.02, 0.1, 0.5];
/// Longest distance used, in steps, as the error of the step accumulates.
const MOST_STEPS: f64 = 20.0;
/// Largest deviation from a whole number of steps, in steps.
const OFF: f64 = 0.12;
/// Minimum fraction of the distances within that deviation.
const PART: f64 = 0.99;
/// Minimum number of distances for evidence with that deviation.
const ENOUGH: usize = 8;
/// Deviation with fewer distances.
const EXACT: f64 = 1e-4;
/// Relative difference below which two values are equal.
const SAME: f64 = 1e-9;

/// Resolution of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantisation {
    /// The step, in the channel's unit.
    pub step: f64,
    /// Number of levels from the smallest to the largest sample, used or not.
    pub levels: f64,
    /// `log2(levels)`: effective bits over the range used.
    pub bits: f64,
    /// Number of levels that occur (in the excerpts of a long record).
    pub seen: usize,
}

/// Finds the step `q` of which all values are multiples, apart from a common offset; `None` if the
/// channel is constant or too finely resolved to show a step.
///
/// The levels that occur are sorted; each distance `d` of neighbours is `round(d/q)` steps. A `q` is
/// accepted if 99 % of the distances up to 20 steps, which must be at least half of all, lie within
/// 0.12 steps of a whole number (text and floating point round the levels). For values that are not
/// on a grid, a distance passes with a probability of 0.24, so eight of them with 10⁻⁵, and there
/// are usually hundreds. With fewer than nine levels, distances must be exact to 10⁻⁴.
///
/// Long records are examined in 32 evenly spread excerpts of 4096 samples.
///
/// ```
/// use torqcomp_dsp::quality::quantisation::quantisation;
/// // An 8-bit ramp over 0…2.55.
/// let ramp: Vec<f64> = (0..1000).map(|i| (i as f64 * 0.2555).floor() * 0.01).collect();
/// let found = quantisation(&ramp).unwrap();
/// assert!((found.step - 0.01).abs() < 1e-9);
/// assert_eq!((found.levels, found.bits), (256.0, 8.0));
/// ```
#[must_use]
pub fn quantisation(samples: &[f64]) -> Option<Quantisation> {
    let (low, high) = range(samples)?;
    let levels = levels(samples, SAME * low.abs().max(high.abs()));
    let mut distances: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if distances.is_empty() {
        return None;
    }
    distances.sort_unstable_by(f64::total_cmp);
    let step = CANDIDATES.iter().find_map(|part| {
        let place = (part * (distances.len() - 1) as f64) as usize;
        refined(&distances, distances[place])
    })?;
    let levels_of_range = ((high - low) / step).round() + 1.0;
    Some(Quantisation {
        step,
        levels: levels_of_range,
        bits: levels_of_range.log2(),
        seen: levels.len(),
    })
}

/// The values that occur, ascending; those closer than `same` are merged.
fn levels(samples: &[f64], same: f64) -> Vec<f64> {
    let parts = excerpts(samples);
    let finite = parts.iter().copied().flatten().filter(|x| x.is_finite());
    let mut values: Vec<f64> = finite.copied().collect();
    values.sort_unstable_by(f64::total_cmp);
    values.dedup_by(|next, kept| *next - *kept <= same);
    values
}

/// A step near an initial guess of which the distances, in ascending order, are multiples.
fn refined(distances: &[f64], guess: f64) -> Option<f64> {
    let mut step = guess;
    for _ in 0..3 {
        // They are ascending.
        let usable = distances.partition_point(|d| *d < MOST_STEPS * step);
        let (sum, count) = distances[..usable]
            .iter()
            .fold((0.0, 0.0), |(sum, count), d| {
                let steps = (d / step).round();
                if steps < 1.0 {
                    (sum, count)
                } else {
                    (sum + d, count + steps)
                }
            });
        if count == 0.0 {
            return None;
        }
        step = sum / count;
    }
    let usable = distances.partition_point(|d| *d < MOST_STEPS * step);
    let off = if usable < ENOUGH { EXACT } else { OFF };
    let close = |d: &&f64| {
        let steps = **d / step;
        steps > 0.5 && (steps - steps.round()).abs() <= off
    };
    let good = distances[..usable].iter().filter(close).count();
    (2 * usable >= distances.len() && good as f64 >= PART * usable as f64).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, rounded};
    use super::*;

    #[test]
    fn the_step_is_found_through_text_of_six_digits() {
        // A converter's step of 5/4096, written as %.5e.
        let volts: Vec<f64> = noise(3, 50_000)
            .iter()
            .map(|n| (0.6 + 0.05 * n) / (5.0 / 4096.0))
            .map(|codes| {
                format!("{:.5e}", codes.round() * 5.0 / 4096.0)
                    .parse()
                    .unwrap()
            })
            .collect();
        let found = quantisation(&volts).unwrap();
        assert!((found.step * 4096.0 / 5.0 - 1.0).abs() < 1e-4, "{found:?}");
        assert!(found.levels < 500.0);
    }

    #[test]
    fn noise_without_a_grid_has_no_step() {
        for seed in 0..50 {
            for count in [10, 30, 100, 1000, 20_000] {
                let found = quantisation(&noise(seed, count));
                assert_eq!(found, None, "seed {seed}, {count} samples");
            }
        }
    }

    #[test]
    fn offsets_missing_levels_and_few_levels() {
        let offset: Vec<f64> = rounded(&noise(4, 5000), 0.25)
            .iter()
            .map(|x| x + 0.07)
            .collect();
        assert!((quantisation(&offset).unwrap().step - 0.25).abs() < 1e-9);
        let two = quantisation(&[0.0, 5.0, 5.0, 0.0]).unwrap();
        assert_eq!((two.step, two.levels, two.seen), (5.0, 2.0, 2));
        assert_eq!(quantisation(&[1.0; 100]), None);
        assert_eq!(quantisation(&[f64::NAN; 3]), None);
    }
}
