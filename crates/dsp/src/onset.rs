//! Onset of free decays in a record.

use std::ops::Range;

use crate::peaks;

/// Number of blocks of a record.
const BLOCKS: usize = 400;
/// Minimum number of samples per block.
const LEAST_BLOCK: usize = 8;
/// Amplitude of a block after a hit, relative to that of the blocks before it …
const RISE: f64 = 3.0;
/// … and to the largest amplitude in the record.
const SIZE: f64 = 0.15;
/// Amplitude of a ringing block relative to the noise.
const ABOVE: f64 = 2.0;
/// Amplitude in the third quarter of a record, relative to that in the last, above which it is
/// still decaying.
const FALLS: f64 = 1.1;
/// Mean-square difference of successive samples, relative to the variance, below which they are not noise: 2 − 2
/// cos(2π/15).
const ALIKE: f64 = 0.173;
/// Number of blocks before a hit with which it is compared.
const BEFORE: usize = 4;
/// Means in a period of the strongest line, among which a hit is looked for that samples do not show in their noise.
const A_PERIOD: f64 = 6.0;

/// The free decays: each begins at the largest amplitude after a hit and ends before the next hit or at the end.
/// Ringing from the first sample on also counts.
///
/// ```
/// // Silence, then a decay from sample 500 on.
/// let decay = |i: i32| if i < 500 { 0.0 } else { (-0.005 * f64::from(i - 500)).exp() * (0.3 * f64::from(i - 500)).cos() };
/// let record: Vec<f64> = (0..2000).map(decay).collect();
/// assert_eq!(torqcomp_dsp::onset::decays(&record), [500..2000]);
/// ```
///
/// In noise of a tenth of the swing, means of a sixth of a period show where the decay begins:
///
/// ```
/// let noise = |i: i32| 0.1 * f64::from(i * 7919 % 1001 - 500) / 290.0;
/// let decay = |i: i32| if i < 500 { 0.0 } else { (-0.002 * f64::from(i - 500)).exp() * (0.1 * f64::from(i - 500)).sin() };
/// let record: Vec<f64> = (0..4000).map(|i| decay(i) + noise(i)).collect();
/// let found = torqcomp_dsp::onset::decays(&record);
/// assert!(found.len() == 1 && found[0].start.abs_diff(516) < 16, "{found:?}");
/// ```
#[must_use]
pub fn decays(samples: &[f64]) -> Vec<Range<usize>> {
    let found = Onsets::of(samples);
    if found.ranges.len() != 1 || !found.rings_first {
        return found.ranges;
    }
    // No hit was found, which noise may have hidden.
    let (factor, means) = peaks::averaged(samples, A_PERIOD);
    let of_means = Onsets::of(&means);
    if factor == 1 || of_means.rings_first || of_means.ranges.is_empty() {
        return found.ranges;
    }
    let end = |range: &Range<usize>| match range.end == means.len() {
        true => samples.len(),
        false => range.end * factor,
    };
    let ranges = of_means.ranges.iter();
    ranges
        .map(|range| range.start * factor..end(range))
        .collect()
}

fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len().max(1) as f64
}

/// Stretches of free ringing by the swing of blocks.
#[derive(Default)]
struct Onsets {
    ranges: Vec<Range<usize>>,
    /// Whether the first one begins with the record.
    rings_first: bool,
}

impl Onsets {
    fn of(samples: &[f64]) -> Self {
        let block = (samples.len() / BLOCKS).max(LEAST_BLOCK);
        let swings: Vec<f64> = samples.chunks(block).map(swing).collect();
        let largest = swings.iter().fold(0.0_f64, |m, s| m.max(*s));
        if largest == 0.0 {
            return Self::default();
        }
        let floor = {
            let mut sorted = swings.clone();
            sorted.sort_by(f64::total_cmp);
            sorted[sorted.len() / 20]
        };
        let mut hits = Vec::new();
        for i in 1..swings.len() {
            let before = &swings[i.saturating_sub(BEFORE)..i];
            let quiet = before.iter().fold(floor, |m, s| m.max(*s));
            let recent = hits.last().is_some_and(|h| i - h <= BEFORE);
            if swings[i] > SIZE * largest && swings[i] > RISE * quiet && !recent {
                hits.push(i);
            }
        }
        // Ringing from the first sample on is one more, if it has decayed before the first hit.
        let rings_first = hits.first().is_none_or(|hit| {
            let ended = swings[hit.saturating_sub(BEFORE)..*hit].iter();
            *hit > BEFORE
                && swings[0] > SIZE * largest
                && swings[0] > RISE * ended.fold(floor, |m, s| m.max(*s))
        });
        let starts: Vec<usize> = rings_first
            .then_some(0)
            .into_iter()
            .chain(hits.iter().map(|hit| hit * block))
            .collect();
        let ends = starts[1..]
            .iter()
            .map(|s| s.saturating_sub(block))
            .chain([samples.len()]);
        let ranges = starts.iter().zip(ends);
        let ranges = ranges.map(|(start, end)| peak_after(samples, *start, end, block)..end);
        Self {
            ranges: ranges
                .filter(|range| range.len() >= 4 * LEAST_BLOCK)
                .collect(),
            rings_first,
        }
    }
}

/// Number of samples up to twice the time at which the decay is lost in the noise; all of them if it still decays at
/// the end.
///
/// ```
/// // A decay of 0.01 a sample in a noise of ±0.01 is lost after about ln(100/2)/0.01 = 390 of 40 000 samples.
/// let noise = |i: i32| 0.01 * f64::from(i * 7919 % 1001 - 500) / 500.0;
/// let record: Vec<f64> = (0..40_000)
///     .map(|i| (-0.01 * f64::from(i)).exp() * (0.3 * f64::from(i)).cos() + noise(i))
///     .collect();
/// let kept = torqcomp_dsp::onset::until_noise(&record);
/// assert!((700..=1200).contains(&kept), "{kept}");
/// assert_eq!(torqcomp_dsp::onset::until_noise(&record[..300]), 300);
/// ```
#[must_use]
pub fn until_noise(samples: &[f64]) -> usize {
    let block = (samples.len() / BLOCKS).max(LEAST_BLOCK);
    let swings: Vec<f64> = samples.chunks_exact(block).map(swing).collect();
    let median = |part: &[f64]| {
        let mut sorted = part.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or_default()
    };
    let quarter = swings.len() / 4;
    let (before, floor) = (
        median(&swings[2 * quarter..3 * quarter]),
        median(&swings[3 * quarter..]),
    );
    // Slow oscillation is not noise: it outlasts the faster modes.
    let still_falls =
        before > FALLS * floor || is_slow(&samples[samples.len() - samples.len() / 4..]);
    let lost = swings.iter().rposition(|swing| *swing > ABOVE * floor);
    match lost {
        Some(last) if !still_falls => (2 * (last + 1) * block).min(samples.len()),
        _ => samples.len(),
    }
}

/// Whether successive samples are strongly correlated: a sine of at least 15 samples per period with little
/// noise. The ratio is 2 for white noise (J. von Neumann, Ann. Math. Statist. 12 (1941) 367) and `2 − 2 cos ω`
/// for a sine.
fn is_slow(samples: &[f64]) -> bool {
    let mean = mean(samples);
    let power: f64 = samples.iter().map(|v| (v - mean).powi(2)).sum();
    let steps: f64 = samples
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).powi(2))
        .sum();
    steps < ALIKE * power
}

/// Half the peak-to-peak value.
fn swing(block: &[f64]) -> f64 {
    let (low, high) = block
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        });
    0.5 * (high - low)
}

/// The sample farthest from the final level of the interval, within its first blocks.
fn peak_after(samples: &[f64], start: usize, end: usize, block: usize) -> usize {
    let tail = &samples[start + (end - start) * 3 / 4..end];
    let rest = mean(tail);
    let near = &samples[start..end.min(start + 2 * (BEFORE + 1) * block)];
    let far = |i: &usize| (near[*i] - rest).abs();
    let peak = (0..near.len()).max_by(|a, b| far(a).total_cmp(&far(b)));
    // The first of equal samples.
    let first = peak.and_then(|p| (0..=p).find(|i| far(i) >= far(&p)));
    start + first.unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ringing(starts: &[usize], count: usize) -> Vec<f64> {
        (0..count)
            .map(|i| {
                starts
                    .iter()
                    .filter(|s| **s <= i)
                    .map(|s| (i - s) as f64)
                    .map(|t| (-0.01 * t).exp() * (0.4 * t).cos())
                    .sum()
            })
            .collect()
    }

    #[test]
    fn every_hit_has_its_stretch() {
        let record = ringing(&[300, 1700, 3100], 4500);
        let found = decays(&record);
        assert_eq!(found.len(), 3, "{found:?}");
        for (range, hit) in found.iter().zip([300, 1700, 3100]) {
            assert!(range.start.abs_diff(hit) <= 2, "{range:?} for {hit}");
        }
        assert!(found[0].end <= 1700 && found[2].end == 4500);
    }

    #[test]
    fn a_record_that_rings_throughout_is_one_stretch() {
        let record = ringing(&[0], 1000);
        let found = decays(&record);
        assert_eq!((found.len(), found[0].clone()), (1, 0..1000));
        assert!(decays(&[1.0; 100]).is_empty() && decays(&[]).is_empty());
        let record = ringing(&[0, 1700], 3000);
        let found = decays(&record);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].start == 0 && found[0].end <= 1700, "{found:?}");
    }

    #[test]
    fn a_slow_mode_rings_on_behind_a_fast_one() {
        let noise = |i: usize| 0.01 * ((i * 7919 % 1001) as f64 - 500.0) / 500.0;
        // The slow one loses a tenth of its amplitude over the record, the fast one has decayed after a
        // hundredth.
        let slow = |i: usize| 0.3 * (-2.5e-6 * i as f64).exp() * (0.05 * i as f64).cos();
        let fast = |i: usize| (-0.01 * i as f64).exp() * (0.4 * i as f64).cos();
        let both: Vec<f64> = (0..40_000).map(|i| fast(i) + slow(i) + noise(i)).collect();
        assert_eq!(until_noise(&both), 40_000);
        let alone: Vec<f64> = (0..40_000).map(|i| fast(i) + noise(i)).collect();
        assert!(until_noise(&alone) < 1500);
    }

    #[test]
    fn a_step_rings_about_its_new_rest() {
        let record: Vec<f64> = ringing(&[400], 2000)
            .iter()
            .enumerate()
            .map(|(i, v)| if i < 400 { 0.0 } else { 1.0 - v })
            .collect();
        let found = decays(&record);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].start.abs_diff(400) <= 10, "{found:?}");
    }
}
