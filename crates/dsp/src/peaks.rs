//! Strongest spectral line of a record, as a start value for a fit.

use std::borrow::Cow;
use std::ops::Range;

use crate::harmonics::without;

/// A peak of a power spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Full width at half power, in Hz.
    pub width_hz: f64,
    /// Power relative to the median power of the spectrum.
    pub prominence: f64,
}

/// Maximum transform length; longer records are truncated, which is enough for a start value.
const LONGEST: usize = 1 << 20;

/// The part of a record that is transformed.
#[must_use]
pub fn looked_at(samples: &[f64]) -> &[f64] {
    &samples[..samples.len().min(LONGEST)]
}

/// Power at frequencies k·rate/size, with the record padded to at least twice its length.
fn power(samples: &[f64]) -> (Vec<f64>, usize) {
    let used = looked_at(samples);
    let size = (2 * used.len()).next_power_of_two().max(16);
    let mut padded = used.to_vec();
    padded.resize(size, 0.0);
    let transform = torqcomp_fourier::forward(size);
    let mut spectrum = transform.make_output_vec();
    transform
        .process(&mut padded, &mut spectrum)
        .expect("buffers were made for this length");
    (spectrum.iter().map(|bin| bin.norm_sqr()).collect(), size)
}

/// The strongest peak between two frequencies; `None` if the record is too short or has no power there.
///
/// ```
/// let sine: Vec<f64> = (0..1000).map(|i| (0.5 * f64::from(i)).sin()).collect();
/// let peak = torqcomp_dsp::peaks::strongest(&sine, 100.0, 1.0, 50.0).unwrap();
/// // 0.5 rad a sample at 100 samples a second: 7.958 Hz.
/// assert!((peak.frequency_hz - 7.958).abs() < 0.05);
/// ```
#[must_use]
pub fn strongest(samples: &[f64], rate_hz: f64, from_hz: f64, to_hz: f64) -> Option<Peak> {
    if samples.len() < 8 {
        return None;
    }
    let (power, size) = power(samples);
    let step = rate_hz / size as f64;
    let first = ((from_hz / step).ceil() as usize).max(1);
    let last = ((to_hz / step).floor() as usize).min(power.len() - 2);
    let best = (first..=last).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let top = power[best];
    if top <= 0.0 {
        return None;
    }
    let below = |k: &usize| power[*k] < 0.5 * top;
    let left = (0..best).rev().find(below).unwrap_or(0);
    let right = (best + 1..power.len())
        .find(below)
        .unwrap_or(power.len() - 1);
    let mut sorted = power[1..].to_vec();
    let middle = sorted.len() / 2;
    let (_, median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    Some(Peak {
        frequency_hz: best as f64 * step,
        width_hz: (right - left - 1).max(1) as f64 * step,
        prominence: top / median.max(f64::MIN_POSITIVE),
    })
}

/// Power above which a bin is significant: `share` times the strongest and 50 times the median.
fn significant(power: &[f64], share: f64) -> f64 {
    let top = power[1..].iter().fold(0.0_f64, |m, p| m.max(*p));
    let mut sorted = power[1..].to_vec();
    let middle = sorted.len() / 2;
    let (_, median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    (50.0 * *median).max(share * top)
}

/// Number of record lengths for the search for lines, each a quarter of the previous one: a short-lived mode does not
/// show over a long one.
const LENGTHS: usize = 4;
/// Shortest of these lengths, in samples.
const SHORTEST: usize = 1 << 12;
/// Bins on either side that belong to a line.
const BINS: f64 = 2.0;
/// Relative frequency difference within which lines of different lengths are the same.
const SAME: f64 = 0.01;
/// Blackman–Harris window, with sidelobes of −92 dB (F. J. Harris, Proc. IEEE 66 (1978), 51).
const WINDOW: [f64; 4] = [0.358_75, -0.488_29, 0.141_28, -0.011_68];

/// A line of a free decay, or several overlapping ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Range of significant power, in cycles per sample.
    pub place: Range<f64>,
    /// Number of leading samples of the record over which it is visible.
    pub over: usize,
}

impl Line {
    /// The line widened by the fraction `beside` of its frequency, and by at least two bins.
    #[must_use]
    pub fn band(&self, beside: f64) -> Range<f64> {
        let bins = BINS / self.over as f64;
        let from = self.place.start - bins.max(beside * self.place.start);
        from.max(0.0)..(self.place.end + bins.max(beside * self.place.end)).min(0.5)
    }

    fn is_in(&self, other: &Self) -> bool {
        let (own, other) = (self.band(0.0), other.band(SAME));
        own.start <= other.end && other.start <= own.end
    }
}

/// All lines of a free decay that are significant as in [`highest`], over a decreasing number of its first samples.
/// They are windowed, as the leakage of a truncated line would be mistaken for others.
#[must_use]
pub fn lines(samples: &[f64], share: f64) -> Vec<Line> {
    let mut all = Vec::new();
    let longest = looked_at(samples).len();
    for over in (0..LENGTHS).map(|k| longest >> (2 * k)) {
        if over < SHORTEST {
            break;
        }
        let (power, size) = power(&tapered(&samples[..over]));
        let limit = significant(&power, share);
        let high = (1..power.len()).filter(|k| power[*k] > limit);
        for place in high.map(|k| k as f64 / size as f64) {
            match all.last_mut() {
                Some(Line {
                    place: last,
                    over: o,
                }) if *o == over && place - last.end < BINS / over as f64 => {
                    last.end = place;
                }
                _ => all.push(Line {
                    place: place..place,
                    over,
                }),
            }
        }
    }
    all
}

/// Vertex of the parabola through three values at equal distances, the middle one a maximum: its place relative to that, in
/// these distances, and its height. The middle value itself where they do not bend down.
///
/// ```
/// // 3 − (t − ¼)² at t = −1, 0 and 1.
/// let values = [1.4375, 2.9375, 2.4375];
/// assert_eq!(torqcomp_dsp::peaks::vertex(values), (0.25, 3.0));
/// ```
#[must_use]
pub fn vertex([before, at, after]: [f64; 3]) -> (f64, f64) {
    let bend = before - 2.0 * at + after;
    let place = if bend < 0.0 {
        0.5 * (before - after) / bend
    } else {
        0.0
    };
    (place, at - 0.25 * (before - after) * place)
}

/// Bins on either side of a steady line that its window occupies, and number of bins beyond them that it must exceed.
const LOBE: f64 = 4.0;
const BESIDE: f64 = 16.0;
/// Minimum power of a steady line relative to the highest of those bins.
const PROMINENCE: f64 = 30.0;
/// Maximum number of steady lines, the strongest ones, and number of times that they are searched for: the first fit
/// leaves the error of its frequencies.
const MOST_STEADY: usize = 60;
const TIMES: usize = 3;

/// A record without the lines that are steady over all of it, such as the orders of a shaft at constant speed. `None` if
/// it has none. What decays within it is wider than its resolution and is kept.
///
/// ```
/// use torqcomp_dsp::peaks::without_steady;
/// let hum = |i: i32| (0.5 * f64::from(i)).sin();
/// let ring = |i: i32| (-0.01 * f64::from(i % 4000)).exp() * (0.7 * f64::from(i % 4000)).sin();
/// let record: Vec<f64> = (0..20_000).map(|i| hum(i) + ring(i)).collect();
/// let left = without_steady(&record, 1000.0).unwrap();
/// let off = (0..20_000).map(|i| (left[i] - ring(i as i32)).abs()).fold(0.0, f64::max);
/// assert!(off < 0.03, "{off}");
/// assert_eq!(without_steady(&left, 1000.0), None);
/// ```
#[must_use]
pub fn without_steady(samples: &[f64], rate_hz: f64) -> Option<Vec<f64>> {
    let mut left = None;
    for _ in 0..TIMES {
        let before = left.as_deref().unwrap_or(looked_at(samples));
        let found = steady_lines(before, rate_hz);
        if found.is_empty() {
            break;
        }
        left = Some(without(before, rate_hz, &found).ok()?);
    }
    left
}

/// Frequencies in Hz of the steady lines of a record.
fn steady_lines(samples: &[f64], rate_hz: f64) -> Vec<f64> {
    let (power, size) = power(&tapered(samples));
    let bin = size as f64 / samples.len() as f64;
    let [lobe, beside] = [LOBE, LOBE + BESIDE].map(|bins| (bins * bin).ceil() as usize);
    let is_line = |k: &usize| {
        let top = power[*k];
        let sides = [k - beside..k - lobe, k + lobe + 1..k + beside + 1];
        let is_above =
            |range: Range<usize>, times: f64| power[range].iter().all(|p| times * p <= top);
        is_above(k - lobe..k + lobe + 1, 1.0) && sides.into_iter().all(|s| is_above(s, PROMINENCE))
    };
    let last = power.len().saturating_sub(beside + 1);
    let mut lines: Vec<usize> = (beside..last).filter(is_line).collect();
    lines.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    lines.truncate(MOST_STEADY);
    let step_hz = rate_hz / size as f64;
    let logarithm = |k: usize| power[k].max(f64::MIN_POSITIVE).ln();
    let place = |k: usize| k as f64 + vertex([k - 1, k, k + 1].map(logarithm)).0;
    lines.into_iter().map(|k| step_hz * place(k)).collect()
}

/// Number of samples over which the shortest-lived line is visible.
#[must_use]
pub fn briefest(lines: &[Line]) -> Option<usize> {
    let is_new = |line: &&Line| {
        let mut longer = lines.iter().filter(|other| other.over > line.over);
        !longer.any(|other| line.is_in(other))
    };
    lines.iter().filter(is_new).map(|line| line.over).min()
}

/// Means of neighbouring samples, about `per_period` of them in a period of the strongest line, and the number of samples
/// in each.
///
/// ```
/// // 60 samples a period: with 20 means a period, each is of 3 samples.
/// let record: Vec<f64> = (0..600).map(|i| (std::f64::consts::TAU * f64::from(i) / 60.0).sin()).collect();
/// let (factor, means) = torqcomp_dsp::peaks::averaged(&record, 19.5);
/// assert_eq!((factor, means.len()), (3, 200));
/// assert!((means[0] - (record[0] + record[1] + record[2]) / 3.0).abs() < 1e-15);
/// ```
#[must_use]
pub fn averaged(samples: &[f64], per_period: f64) -> (usize, Cow<'_, [f64]>) {
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let middle = mean(samples);
    let about: Vec<f64> = looked_at(samples).iter().map(|v| v - middle).collect();
    // In cycles per sample, from two periods in the record on.
    let lowest = 2.0 / samples.len() as f64;
    let line = strongest(&about, 1.0, lowest, 0.5).map_or(0.5, |peak| peak.frequency_hz);
    match (1.0 / (per_period * line)) as usize {
        0 | 1 => (1, samples.into()),
        factor => (factor, samples.chunks_exact(factor).map(mean).collect()),
    }
}

/// Samples without their mean, windowed.
fn tapered(samples: &[f64]) -> Vec<f64> {
    let count = samples.len() as f64;
    let weight = |i: usize| {
        let turn = std::f64::consts::TAU * (i as f64 + 0.5) / count;
        let terms = WINDOW.iter().enumerate();
        terms.map(|(k, a)| a * (k as f64 * turn).cos()).sum::<f64>()
    };
    let weights: Vec<f64> = (0..samples.len()).map(weight).collect();
    let products = samples.iter().zip(&weights).map(|(x, w)| x * w);
    let mean = products.sum::<f64>() / (WINDOW[0] * count);
    let pairs = samples.iter().zip(weights);
    pairs.map(|(x, w)| (x - mean) * w).collect()
}

/// Highest frequency with a significant peak: at least `share` times the power of the strongest and 50 times the median.
#[must_use]
pub fn highest(samples: &[f64], rate_hz: f64, share: f64) -> Option<f64> {
    if samples.len() < 8 {
        return None;
    }
    let (power, size) = power(samples);
    let limit = significant(&power, share);
    let peak = |k: &usize| {
        power[*k] > limit
            && power[*k] >= power[k - 1]
            && power[*k] >= power[(k + 1).min(power.len() - 1)]
    };
    let found = (1..power.len()).rev().find(peak)?;
    Some(found as f64 * rate_hz / size as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_what_rings_long_and_short() {
        let line = |f: f64, sigma: f64, i: i32| {
            let t = f64::from(i);
            (-sigma * t).exp() * (std::f64::consts::TAU * f * t).cos()
        };
        let mut state = 1_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let record: Vec<f64> = (0..300_000)
            .map(|i| line(0.02, 1e-6, i) + 0.1 * line(0.2, 1e-3, i) + 0.05 * noise())
            .collect();
        let found = lines(&record, 1e-6);
        for (beside, far) in [(0.01, 0.0199), (0.003, 0.01995)] {
            let holds = |f: f64| found.iter().any(|line| line.band(beside).contains(&f));
            assert!(
                holds(far) && holds(0.04 - far) && holds(0.2) && !holds(0.1),
                "{found:?}"
            );
        }
        // 0.1 exp(−0.001 i) is below the noise in the middle of 18 750 samples, but not in that of 4 687.
        assert!(briefest(&found).unwrap() < 75_000, "{found:?}");
        let long: Vec<Line> = lines(&record[..1 << 17], 1e-6)
            .into_iter()
            .filter(|line| line.place.end < 0.1)
            .collect();
        assert_eq!(briefest(&long), Some(1 << 17), "{long:?}");
        assert!(lines(&record[..1000], 1e-6).is_empty());
    }

    #[test]
    fn width_is_that_of_the_decay() {
        // |1/(σ + jΔω)|² halves at Δω = ±σ: σ/π wide.
        let (rate_hz, sigma) = (1000.0, 20.0);
        let record: Vec<f64> = (0..4000)
            .map(|i| f64::from(i) / rate_hz)
            .map(|t| (-sigma * t).exp() * (std::f64::consts::TAU * 100.0 * t).sin())
            .collect();
        let peak = strongest(&record, rate_hz, 10.0, 400.0).unwrap();
        assert!(
            (peak.frequency_hz - 100.0).abs() < 0.5 && (peak.width_hz - 6.37).abs() < 0.6,
            "{peak:?}"
        );
        assert!(highest(&record, rate_hz, 1e-4).unwrap() < 150.0);
        assert_eq!(strongest(&record[..7], rate_hz, 0.0, 1.0), None);
        assert_eq!(strongest(&[0.0; 100], rate_hz, 0.0, 100.0), None);
    }
}
