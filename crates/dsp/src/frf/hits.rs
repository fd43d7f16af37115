//! Hammer hits in a record, and their faults.

use std::fmt;
use std::ops::Range;

use num_complex::Complex64;

use super::limits::{Grain, is_clipped, near};
use crate::quality;

/// A hit.
#[derive(Debug, Clone, PartialEq)]
pub struct Hit {
    /// Its samples, from shortly before the force rises to the next hit or the end.
    pub range: Range<usize>,
    /// Sample with the largest force.
    pub peak: usize,
    /// Reasons not to use it.
    pub faults: Vec<HitFault>,
    /// Force of a double hit's second stroke relative to the first, if any.
    pub second: Option<f64>,
    /// Amplitude of the response when the next hit follows, relative to its largest; 0 for the last hit.
    pub left: f64,
}

/// A fault of a hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HitFault {
    /// The force is clipped: the input was overdriven.
    ForceClipped,
    /// The measured signal is clipped.
    MeasuredClipped,
    /// The record ends soon after the hit.
    CutShort,
    /// The next hit follows soon.
    TooSoon,
    /// The record begins with the hit, or within it.
    NoRest,
}

impl fmt::Display for HitFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ForceClipped => "its force is clipped",
            Self::MeasuredClipped => "its response is clipped",
            Self::CutShort => "the record ends soon after it",
            Self::TooSoon => {
                "the next hit follows before the response has lasted as long as that of others"
            }
            Self::NoRest => {
                "the record begins within it or just before, so that the level at rest, or a part of the force, is \
                 missing; record from a few ms before the hit (pretrigger)"
            }
        })
    }
}

/// Smallest force of a hit relative to the largest; weaker pulses belong to the preceding hit.
const STRONG: f64 = 0.3;
/// Smallest force of a second stroke, relative to the first, that is reported. It is part of the recorded
/// force.
const SECOND: f64 = 0.05;
/// Smallest force of a second stroke, in standard deviations of the force at rest.
const ABOVE_NOISE: f64 = 8.0;
/// Samples kept before the rise of the force, and the least number of them that shows the level at rest.
const BEFORE: usize = 16;
const AT_REST: usize = 8;

/// Finds the hits. A second stroke within `apart` samples belongs to the first hit; later ones are separate hits.
#[must_use]
pub fn find_hits(force: &[f64], measured: &[f64], apart: usize) -> Vec<Hit> {
    let rest = median(force);
    let size = |i: usize| (force[i] - rest).abs();
    let largest = (0..force.len()).map(size).fold(0.0, f64::max);
    if largest == 0.0 {
        return Vec::new();
    }
    let all = peaks(&size, force.len(), largest, apart);
    let mut peaks: Vec<usize> = Vec::new();
    let mut starts: Vec<usize> = Vec::new();
    let mut begins_with_hit = false;
    for peak in all {
        let rise = rise_of(&size, peak, largest);
        begins_with_hit |= rise < AT_REST && starts.is_empty();
        let start = rise.saturating_sub(BEFORE);
        // A response that is still ringing belongs to the preceding hit.
        if starts
            .last()
            .is_none_or(|last| has_decayed(&measured[*last..start]))
        {
            peaks.push(peak);
            starts.push(start);
        }
    }
    let noise = spread(force, rest);
    let grains = [(force, noise), (measured, noise_of(measured))];
    let grains = grains.map(|(samples, noise)| Grain::of(samples, noise));
    let lengths = |k: usize| starts.get(k + 1).copied().unwrap_or(force.len()) - starts[k];
    let enough = common_length(&(0..starts.len()).map(lengths).collect::<Vec<_>>());
    let mut hits: Vec<Hit> = (0..peaks.len())
        .map(|k| {
            let range = starts[k]..starts[k] + lengths(k);
            let is_last = k + 1 == starts.len();
            let mut faults = faults([force, measured], grains, rest, peaks[k], range.clone());
            let second = (SECOND * size(peaks[k])).max(ABOVE_NOISE * noise);
            let second = second_stroke(&size, peaks[k], range.end, second);
            if k == 0 && begins_with_hit {
                faults.push(HitFault::NoRest);
            }
            if range.len() < enough {
                faults.push(match is_last {
                    true => HitFault::CutShort,
                    false => HitFault::TooSoon,
                });
            }
            Hit {
                left: match is_last {
                    true => 0.0,
                    false => ringing_left(&measured[range.clone()], grains[1].noise),
                },
                range,
                peak: peaks[k],
                faults,
                second,
            }
        })
        .collect();
    mark_at_limit(&mut hits, &size, noise);
    hits
}

/// Marks the hits that reach the limit of another one: they are at it as well.
fn mark_at_limit(hits: &mut [Hit], size: &dyn Fn(usize) -> f64, noise: f64) {
    let is_clipped = |hit: &&Hit| hit.faults.contains(&HitFault::ForceClipped);
    let limits = hits.iter().filter(is_clipped).map(|hit| size(hit.peak));
    let Some(limit) = limits.reduce(f64::min) else {
        return;
    };
    for hit in hits {
        let is_at_limit = (size(hit.peak) - limit).abs() <= near(noise, limit) * limit;
        if is_at_limit && !hit.faults.contains(&HitFault::ForceClipped) {
            hit.faults.insert(0, HitFault::ForceClipped);
        }
    }
}

/// Amplitude of a response in its last twentieth, without noise, relative to its largest.
fn ringing_left(measured: &[f64], noise: f64) -> f64 {
    let last = &measured[measured.len() - measured.len().div_ceil(20)..];
    let level = last.iter().sum::<f64>() / last.len() as f64;
    let power = last.iter().map(|v| (v - level).powi(2)).sum::<f64>() / last.len() as f64;
    let largest = measured
        .iter()
        .fold(0.0_f64, |m, v| m.max((v - level).abs()));
    (2.0 * (power - noise * noise).max(0.0)).sqrt() / largest.max(f64::MIN_POSITIVE)
}

/// The length to which hits are cut: that which keeps most samples of all.
fn common_length(lengths: &[usize]) -> usize {
    let kept = |length: usize| length * lengths.iter().filter(|l| **l >= length).count();
    let all = lengths.iter().copied();
    all.max_by_key(|length| (kept(*length), *length))
        .unwrap_or(0)
}

/// Sample with the largest force of each pulse, except pulses within `apart` samples of the preceding
/// one.
fn peaks(size: &dyn Fn(usize) -> f64, count: usize, largest: f64, apart: usize) -> Vec<usize> {
    let mut peaks: Vec<usize> = Vec::new();
    let mut i = 0;
    while i < count {
        if size(i) < STRONG * largest {
            i += 1;
            continue;
        }
        // The whole pulse, until the force is nearly zero.
        let end = (i..count)
            .find(|k| size(*k) < 0.05 * largest)
            .unwrap_or(count);
        let top = (i..end)
            .max_by(|a, b| size(*a).total_cmp(&size(*b)))
            .unwrap_or(i);
        match peaks.last() {
            Some(last) if top - last < apart => {}
            _ => peaks.push(top),
        }
        i = end.max(i + 1);
    }
    peaks
}

/// Final amplitude of a response, relative to its largest, below which the next hit has a response of
/// its own.
const DECAYED: f64 = 0.1;

/// Whether a response has decayed in its last fifth.
fn has_decayed(measured: &[f64]) -> bool {
    let middle = median(measured);
    let size = |v: &f64| (v - middle).abs();
    let largest = |part: &[f64]| part.iter().map(size).fold(0.0, f64::max);
    largest(&measured[measured.len() - measured.len() / 5..]) < DECAYED * largest(measured)
}

/// Clipped signals of a hit.
fn faults(
    [force, measured]: [&[f64]; 2],
    grains: [Grain; 2],
    rest: f64,
    peak: usize,
    range: Range<usize>,
) -> Vec<HitFault> {
    let mut faults = Vec::new();
    let pulse = range.start..(peak + (peak - range.start).max(BEFORE) * 2).min(range.end);
    if is_clipped(&force[pulse], rest, grains[0]) {
        faults.push(HitFault::ForceClipped);
    }
    let answer = &measured[range];
    if is_clipped(answer, median(answer), grains[1]) {
        faults.push(HitFault::MeasuredClipped);
    }
    faults
}

/// Last sample before the pulse with this peak; the first of the record if it begins within it.
fn rise_of(size: &impl Fn(usize) -> f64, peak: usize, largest: f64) -> usize {
    let mut before = (0..peak).rev();
    before.find(|i| size(*i) < 0.02 * largest).unwrap_or(0)
}

/// Standard deviation of the noise in a mostly slow signal, from its second differences.
fn noise_of(samples: &[f64]) -> f64 {
    let second = samples.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]);
    spread(&second.collect::<Vec<f64>>(), 0.0) / 6.0_f64.sqrt()
}

/// Number of lines evaluated between 0.4 and 0.5 of the rate.
const LINES: usize = 16;

/// Largest spectral magnitude of the initial pulse of a hit between 0.4 and 0.5 of the rate, relative to DC and beyond
/// what its noise explains. It vanishes for a pulse sampled fast enough.
///
/// ```
/// use torqcomp_dsp::frf::near_half_rate;
/// let pulse = |width: f64| -> Vec<f64> {
///     let half_sine = |u: f64| if (0.0..1.0).contains(&u) { (std::f64::consts::PI * u).sin() } else { 0.0 };
///     (0..200).map(|i| half_sine((f64::from(i) - 16.3) / width)).collect()
/// };
/// // Half a sine of the width w: |cos(πfw)/(1 − 4f²w²)|, 0.001 for 30 samples and 0.4 for two.
/// assert!(near_half_rate(&pulse(30.0)) < 0.003);
/// assert!(near_half_rate(&pulse(2.0)) > 0.2);
/// ```
#[must_use]
pub fn near_half_rate(force: &[f64]) -> f64 {
    let rest = median(&force[..BEFORE.min(force.len())]);
    let size = |i: &usize| (force[*i] - rest).abs();
    let top = (0..force.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
    let Some(top) = top else {
        return 0.0;
    };
    let pulse = &force[..(3 * top.max(BEFORE)).min(force.len())];
    let at = |cycles: f64| -> f64 {
        let turn = |i: usize| Complex64::cis(-std::f64::consts::TAU * cycles * i as f64);
        let sum = pulse.iter().enumerate().map(|(i, v)| turn(i) * (v - rest));
        sum.sum::<Complex64>().norm()
    };
    let lines = (0..=LINES).map(|k| 0.4 + 0.1 * k as f64 / LINES as f64);
    let largest = lines.map(at).fold(0.0, f64::max);
    // The largest of many lines of noise is about twice their RMS.
    let noise = 2.5 * noise_of(force) * (pulse.len() as f64).sqrt();
    ((largest - noise) / at(0.0)).max(0.0)
}

/// Relative bias of the response towards zero at low frequencies due to white noise of the force, where it is not
/// corrected: `N σ²/(N σ² + S²)` for `N` samples of standard deviation `σ`, estimated from their second differences,
/// and the sum `S` of the samples of the stroke (D. J. Ewins, *Modal Testing*, 2nd ed., 2000, 3.10).
///
/// ```
/// use torqcomp_dsp::frf::noise_share;
/// // Eight samples of 9, so S = 72, among noise of -0.1, 0 and 0.1 in turn, the second differences of which are 0, -0.3
/// // and 0.3: their median size is 0.3, so σ = 0.3/0.674/√6 = 0.182, and 1000 σ² = 33.
/// let noise = |i: usize| [-0.1, 0.0, 0.1][i % 3];
/// let hit = |i: usize| if (20..28).contains(&i) { 9.0 } else { 0.0 };
/// let force: Vec<f64> = (0..1000).map(|i| noise(i) + hit(i)).collect();
/// assert!((noise_share(&force) - 33.0 / (33.0 + 72.0 * 72.0)).abs() < 1e-4);
/// ```
#[must_use]
pub fn noise_share(force: &[f64]) -> f64 {
    let (middle, noise) = (median(force), noise_of(force));
    let size = |i: &usize| (force[*i] - middle).abs();
    let Some(top) = (0..force.len()).max_by(|a, b| size(a).total_cmp(&size(b))) else {
        return 0.0;
    };
    let sign = (force[top] - middle).signum();
    let is_stroke = |v: &&f64| sign * (**v - middle) > LOUD * noise;
    let before = force[..top].iter().rev().take_while(is_stroke);
    let stroke = before.chain(force[top..].iter().take_while(is_stroke));
    let sum: f64 = stroke.map(|v| v - middle).sum();
    let of_noise = force.len() as f64 * noise * noise;
    of_noise / (of_noise + sum * sum)
}

/// Force pulse of a hit and the level of the force signal otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Stroke {
    /// Its samples.
    pub range: Range<usize>,
    /// Mean after them.
    pub rest: f64,
}

/// Threshold of the force above the baseline, in standard deviations of the noise.
const LOUD: f64 = 6.0;
/// Divisor of the pulse length that gives the margin on either side, where the force is within the
/// noise.
const MARGIN: usize = 4;
/// Minimum number of parts, each as long as the hit, in the remainder.
const PARTS: usize = 4;
/// Allowed excess scatter of their means over that of white noise, in standard deviations.
const SCATTER: f64 = 5.0;

/// The force pulse of a hit, if it is followed by white noise only: the means of parts as long as the hit scatter no
/// more than their samples imply. `None` if something slower follows, as with an AC-coupled hammer.
///
/// The noise after the pulse would count as force and bias the response low by the factor `1 + N σ²/|U|²` for `N`
/// samples of standard deviation `σ` and a spectrum `U` of the force (D. J. Ewins, *Modal Testing*, 2nd ed., 2000,
/// 3.10: force window).
///
/// ```
/// use torqcomp_dsp::frf::stroke_of;
/// // 20 samples before a hit of eight, and noise of -0.1, 0 and 0.1 in turn, about 0.5.
/// let noise = |i: usize| 0.5 + [-0.1, 0.0, 0.1][i % 3];
/// let hit = |i: usize| if (20..28).contains(&i) { 9.0 } else { 0.0 };
/// let force: Vec<f64> = (0..1000).map(|i| noise(i) + hit(i)).collect();
/// let stroke = stroke_of(&force).unwrap();
/// // A quarter of the eight samples, and one, on either side.
/// assert_eq!(stroke.range, 17..31);
/// assert!((stroke.rest - 0.5).abs() < 1e-3);
/// ```
#[must_use]
pub fn stroke_of(force: &[f64]) -> Option<Stroke> {
    let middle = median(force);
    let noise = spread(force, middle);
    let is_force = |v: &f64| (v - middle).abs() > LOUD * noise;
    let (first, last) = (
        force.iter().position(is_force)?,
        force.iter().rposition(is_force)?,
    );
    let margin = (last + 1 - first) / MARGIN + 1;
    let range = first.saturating_sub(margin)..(last + 1 + margin).min(force.len());
    let quiet = &force[range.end..];
    let count = quiet.len() / range.end;
    if count < PARTS {
        return None;
    }
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let rest = mean(quiet);
    let variance = quiet.iter().map(|v| (v - rest).powi(2)).sum::<f64>() / quiet.len() as f64;
    let parts = quiet.chunks_exact(range.end);
    let of_means = parts.map(|part| (mean(part) - rest).powi(2)).sum::<f64>() / count as f64;
    let most = 1.0 + SCATTER * (2.0 / count as f64).sqrt();
    (of_means * range.end as f64 <= most * variance).then_some(Stroke { range, rest })
}

/// Largest force of a second stroke relative to the peak, if it exceeds `second` after the force had vanished.
fn second_stroke(
    size: &impl Fn(usize) -> f64,
    peak: usize,
    end: usize,
    second: f64,
) -> Option<f64> {
    let gone = (peak..end).find(|i| size(*i) < 0.5 * second)?;
    let largest = (gone..end).map(size).fold(0.0, f64::max);
    (largest > second).then(|| largest / size(peak))
}

/// Standard deviation of a signal that is mostly at rest, from the median deviation.
fn spread(samples: &[f64], rest: f64) -> f64 {
    let distances: Vec<f64> = samples.iter().map(|v| (v - rest).abs()).collect();
    median(&distances) / 0.674_489_75
}

fn median(samples: &[f64]) -> f64 {
    quality::median(&mut samples.to_vec()).unwrap_or(0.0)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn pulse(at: usize, height: f64, limit: f64, force: &mut [f64]) {
        for k in 0..21 {
            let value = height * (std::f64::consts::PI * k as f64 / 20.0).sin();
            force[at + k] += value.min(limit);
        }
    }

    #[test]
    fn good_hits_pass_and_bad_ones_are_named() {
        let mut force = vec![0.0; 8000];
        pulse(500, 10.0, f64::INFINITY, &mut force);
        pulse(2500, 10.0, 7.0, &mut force);
        pulse(4500, 10.0, f64::INFINITY, &mut force);
        pulse(4700, 4.0, f64::INFINITY, &mut force);
        pulse(6500, 9.0, f64::INFINITY, &mut force);
        // Decays that start with each hit.
        let ring =
            |i: i32| (f64::from(i) * 0.37).sin() * (-f64::from((i + 1500) % 2000) / 200.0).exp();
        let measured: Vec<f64> = (0..8000).map(ring).collect();
        let hits = find_hits(&force, &measured, 1000);
        assert_eq!(hits.len(), 4, "{hits:?}");
        // While the response is still ringing, later hits belong to the first.
        let endless: Vec<f64> = (0..8000).map(|i| (f64::from(i) * 0.37).sin()).collect();
        assert_eq!(find_hits(&force, &endless, 1000).len(), 1);
        let faults: Vec<&[HitFault]> = hits.iter().map(|h| &h.faults[..]).collect();
        assert_eq!(faults[0], []);
        assert_eq!(faults[1], [HitFault::ForceClipped]);
        assert_eq!(faults[2], []);
        assert!(hits[2].second.is_some_and(|part| (part - 0.4).abs() < 0.01));
        assert_eq!(faults[3], []);
        assert!(hits[0].range.start < 500 && hits[0].range.end < 2500);
        let mut flat = measured.clone();
        flat[600..604].fill(3.0);
        assert_eq!(
            find_hits(&force, &flat, 1000)[0].faults,
            [HitFault::MeasuredClipped]
        );
        assert!(find_hits(&[0.0; 10], &[0.0; 10], 5).is_empty());
    }

    pub fn quiet(i: i32) -> f64 {
        // Different at every sample and never more than 1.
        (f64::from(i) * 12.9898).sin() * (f64::from(i) * 0.618).cos()
    }

    #[test]
    fn weak_second_strokes_are_named_and_noise_is_not() {
        let measured: Vec<f64> = (0..4000).map(quiet).collect();
        for (second, noise, doubled) in [
            (0.0, 0.01, false),
            (2.5, 0.01, true),
            (1.0, 0.01, true),
            (0.6, 0.01, true),
            // Within what noise and a ripple of 2 % explain.
            (0.4, 0.2, false),
            (0.2, 0.01, false),
        ] {
            let mut force: Vec<f64> = (0..4000).map(|i| noise * quiet(i)).collect();
            pulse(500, 10.0, f64::INFINITY, &mut force);
            pulse(900, second, f64::INFINITY, &mut force);
            let hits = find_hits(&force, &measured, 1000);
            assert_eq!(hits.len(), 1);
            let got = hits[0].second;
            assert_eq!(got.is_some(), doubled, "{second} after 10, noise {noise}");
            assert!(got.is_none_or(|part| (part - second / 10.0).abs() < 0.01));
            assert!(hits[0].faults.is_empty());
        }
    }
}
