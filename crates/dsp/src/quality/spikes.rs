//! Isolated outliers: a missing-value marker such as −9999, a drop-out of one sample, a glitch.

use super::{excerpts, median};

/// Maximum number of samples of a spike; longer drop-outs are handled by [`stuck`](super::stuck).
const LONGEST: usize = 2;
/// Number of samples on each side that must be close together.
const BESIDE: usize = 2;
/// Distance of a spike from its neighbours, relative to their spread.
const APART: f64 = 10.0;
/// The same, relative to the median distance of a sample from the mean of its two neighbours: 16.5 σ in white noise of
/// standard deviation σ.
const FAR: f64 = 20.0;
/// Ratio of the largest step to the mean one up to which there is no spike.
pub(super) const EVEN: f64 = 8.0;
/// Fraction of samples above which spikes are the signal itself.
const MOST: f64 = 0.01;

/// A spike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spike {
    /// Index of its first sample.
    pub index: usize,
    /// The sample.
    pub value: f64,
    /// The preceding sample.
    pub before: f64,
}

/// Spikes of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spikes {
    /// Number of spikes.
    pub count: usize,
    /// The first spike.
    pub first: Spike,
}

impl Spikes {
    /// Summary of several spikes.
    #[must_use]
    pub fn of(spikes: &[Spike]) -> Option<Self> {
        let count = spikes.len();
        spikes.first().map(|&first| Self { count, first })
    }
}

/// Finds one or two consecutive samples far beyond the two on each side of them: at least ten times as far from each as
/// these are apart, and at least twenty times the median (nonzero) distance of a sample from the mean of its
/// neighbours. White noise has none; a peak or a step of the signal is no spike unless it takes less than three
/// samples. If more than one sample in a hundred is a spike, they are the signal.
///
/// ```
/// use torqcomp_dsp::quality::spikes::spikes;
/// let mut samples: Vec<f64> = (0..500).map(|i| 5.0 + (0.3 * f64::from(i)).sin()).collect();
/// assert_eq!(spikes(&samples), []);
/// samples[300] = -9999.0;
/// let found = spikes(&samples);
/// assert_eq!((found.len(), found[0].index, found[0].value), (1, 300, -9999.0));
/// ```
#[must_use]
pub fn spikes(samples: &[f64]) -> Vec<Spike> {
    let far = FAR * usual_bend(samples);
    let mut found: Vec<Spike> = Vec::new();
    let mut at = BESIDE;
    while at + BESIDE < samples.len() {
        let lengths = 1..=LONGEST.min(samples.len() - BESIDE - at);
        let Some(length) = lengths.into_iter().find(|n| is_spike(samples, at, *n, far)) else {
            at += 1;
            continue;
        };
        found.push(Spike {
            index: at,
            value: samples[at],
            before: samples[at - 1],
        });
        at += length;
    }
    if found.len() as f64 > MOST * samples.len() as f64 {
        found.clear();
    }
    found
}

fn is_spike(samples: &[f64], at: usize, length: usize, far: f64) -> bool {
    if (samples[at] - samples[at - 1]).abs() < far {
        return false;
    }
    let (before, rest) = (&samples[at - BESIDE..at], &samples[at..]);
    let (inside, behind) = (&rest[..length], &rest[length..length + BESIDE]);
    let beside = before.iter().chain(behind).copied();
    let low = beside.clone().fold(f64::INFINITY, f64::min);
    let high = beside.fold(f64::NEG_INFINITY, f64::max);
    let least = far.max(APART * (high - low));
    least.is_finite()
        && (inside.iter().all(|x| *x > high && *x - high >= least)
            || inside.iter().all(|x| *x < low && low - *x >= least))
}

/// Median nonzero distance of a sample from the mean of its two neighbours.
fn usual_bend(samples: &[f64]) -> f64 {
    let mut bends: Vec<f64> = excerpts(samples)
        .iter()
        .flat_map(|part| part.windows(3))
        .map(|three| (three[1] - 0.5 * (three[0] + three[2])).abs())
        .filter(|bend| *bend > 0.0)
        .collect();
    median(&mut bends).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, rounded, sine, sum};
    use super::*;

    #[test]
    fn a_sentinel_and_a_drop_out_are_found_in_noise() {
        let mut samples = sum(&sine(1.0, 200.0, 20_000), &noise(1, 20_000));
        samples.iter_mut().for_each(|x| *x += 50.0);
        assert_eq!(spikes(&samples), []);
        samples[5000] = 0.0;
        samples[9000..9002].fill(0.0);
        samples[12_000] = 1e30;
        let found: Vec<usize> = spikes(&samples).iter().map(|s| s.index).collect();
        assert_eq!(found, [5000, 9000, 12_000]);
    }

    #[test]
    fn signals_have_none() {
        let step: Vec<f64> = (0..2000).map(|i| f64::from(u8::from(i > 900))).collect();
        let pulses: Vec<f64> = (0..2000)
            .map(|i| f64::from(u8::from(i % 50 == 0)))
            .collect();
        let hit: Vec<f64> = (0..2000)
            .map(|i| (-(f64::from(i - 1000) / 1.5).powi(2)).exp())
            .collect();
        let ringing: Vec<f64> = (0..2000)
            .map(|i| (-0.01 * f64::from(i)).exp() * (2.0 * f64::from(i)).sin())
            .collect();
        let quiet: Vec<f64> = noise(2, 2000).iter().map(|n| 1e-3 * n).collect();
        for signal in [step, pulses, hit, ringing] {
            assert_eq!(spikes(&rounded(&signal, 0.01)), []);
            assert_eq!(spikes(&sum(&signal, &quiet)), []);
        }
    }
}
