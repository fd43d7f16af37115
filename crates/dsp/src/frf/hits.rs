//! Hammer hits in a record, and their faults.

use std::fmt;
use std::ops::Range;

use num_complex::Complex64;

use crate::quality;
use crate::quality::quantisation::quantisation;
use crate::quality::repeats::repeats;

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
/// Relative distance from the extreme value within which a sample counts as clipped.
const LEVEL: f64 = 0.01;
/// The same in standard deviations of the noise, and its upper limit: noise spreads a limit this far.
const NOISE: (f64, f64) = (6.0, 0.06);
/// Consecutive samples at the extreme, relative to those beyond half of it: 0.13 for a half-sine and 0.12 for a bell;
/// more means that an amplifier saturated.
const STANDING: f64 = 0.3;
/// The same, relative to that of a half-sine.
const LONGER: f64 = 1.5;
/// Smallest extreme of the opposite sign, relative to the largest, that can be a limit.
const OTHER_SIDE: f64 = 0.1;
/// Minimum number of such samples; one less if none is a little lower, which a round top has: beside three samples within
/// `w` of its peak, the next are within `4w`.
const LEAST_STANDING: usize = 4;
const ROUND: f64 = 6.0;
/// Number of equal consecutive samples that means clipping.
const FLAT: usize = 3;
/// Smallest ratio of the samples at the extreme to those one step below it that is no round top, where it is at most
/// `1/(√2 − 1)`.
const NEXT: usize = 3;
/// Samples by which the ratio is off, as both are whole numbers.
const UNEVEN: usize = 2;
/// Largest number of samples at the extreme of a round top that has none one step below.
const MOST_BARE: usize = 4;
/// Samples kept before the rise of the force.
const BEFORE: usize = 16;

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
    for peak in all {
        let start = start_of(&size, peak, largest);
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
    let noises = [noise, noise_of(measured)];
    let grains = [force, measured].map(Grain::of);
    let lengths = |k: usize| starts.get(k + 1).copied().unwrap_or(force.len()) - starts[k];
    let enough = common_length(&(0..starts.len()).map(lengths).collect::<Vec<_>>());
    let mut hits: Vec<Hit> = (0..peaks.len())
        .map(|k| {
            let range = starts[k]..starts[k] + lengths(k);
            let is_last = k + 1 == starts.len();
            let mut faults = faults(
                [force, measured],
                (noises, grains),
                rest,
                peaks[k],
                range.clone(),
            );
            let second = (SECOND * size(peaks[k])).max(ABOVE_NOISE * noise);
            let second = second_stroke(&size, peaks[k], range.end, second);
            if range.len() < enough {
                faults.push(match is_last {
                    true => HitFault::CutShort,
                    false => HitFault::TooSoon,
                });
            }
            Hit {
                left: match is_last {
                    true => 0.0,
                    false => ringing_left(&measured[range.clone()], noises[1]),
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

/// Relative distance from a limit within which its noise leaves samples that are at it.
fn near(noise: f64, limit: f64) -> f64 {
    (NOISE.0 * noise / limit).clamp(LEVEL, NOISE.1)
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
    (noises, grains): ([f64; 2], [Grain; 2]),
    rest: f64,
    peak: usize,
    range: Range<usize>,
) -> Vec<HitFault> {
    let mut faults = Vec::new();
    let pulse = range.start..(peak + (peak - range.start).max(BEFORE) * 2).min(range.end);
    if is_clipped(&force[pulse], rest, noises[0], grains[0]) {
        faults.push(HitFault::ForceClipped);
    }
    let answer = &measured[range];
    if is_clipped(answer, median(answer), noises[1], grains[1]) {
        faults.push(HitFault::MeasuredClipped);
    }
    faults
}

/// How finely a channel is resolved.
#[derive(Clone, Copy)]
struct Grain {
    /// Distance of its levels; 0 if it shows none.
    step: f64,
    /// Number of samples for which each value is held.
    hold: usize,
}

impl Grain {
    fn of(samples: &[f64]) -> Self {
        let held = repeats(samples).and_then(|found| found.hold);
        Self {
            step: quantisation(samples).map_or(0.0, |found| found.step),
            hold: held.unwrap_or(1),
        }
    }
}

/// Whether part of a channel is clipped.
fn is_clipped(samples: &[f64], rest: f64, noise: f64, grain: Grain) -> bool {
    let fresh: Vec<f64> = samples.iter().step_by(grain.hold).copied().collect();
    flat(&fresh, rest, grain.step) || stands(&fresh, rest, noise, grain.step)
}

/// Start of the pulse with this peak.
fn start_of(size: &impl Fn(usize) -> f64, peak: usize, largest: f64) -> usize {
    let quiet = (0..peak)
        .rev()
        .find(|i| size(*i) < 0.02 * largest)
        .unwrap_or(0);
    quiet.saturating_sub(BEFORE)
}

/// Whether the largest or smallest value occurs several times in a row, more often than on a round top in steps of the
/// channel's resolution.
fn flat(samples: &[f64], rest: f64, step: f64) -> bool {
    let far = |v: f64| (v - rest).abs();
    [f64::max as fn(f64, f64) -> f64, f64::min]
        .into_iter()
        .any(|pick| {
            let extreme = samples.iter().copied().fold(rest, pick);
            let at_extreme = quality::runs(samples).filter(|run| run.value == extreme);
            let longest = at_extreme.max_by_key(|run| run.length);
            let longest = longest.filter(|run| far(extreme) > 0.0 && run.length >= FLAT);
            longest.is_some_and(|run| !is_round(samples, run.start..run.end(), step))
        })
}

/// Whether equal samples are the top of a parabola in steps: of its samples within two steps of the peak, at least
/// `1 − 1/√2` are in the second one. Where there is none, the next sample is no farther below than on a parabola that
/// falls by one step from the middle to the ends of the top.
fn is_round(samples: &[f64], top: Range<usize>, step: f64) -> bool {
    let extreme = samples[top.start];
    let below = |v: &f64| (v - extreme).abs();
    let is_next = |v: &&f64| below(v) < 1.5 * step;
    let (before, after) = (&samples[..top.start], &samples[top.end..]);
    let next =
        before.iter().rev().take_while(is_next).count() + after.iter().take_while(is_next).count();
    let count = top.len();
    if next > 0 {
        return NEXT * next + UNEVEN >= count;
    }
    let neighbours = before.last().into_iter().chain(after.first());
    let fall = neighbours.map(below).fold(f64::INFINITY, f64::min);
    let farther = (count + 2) as f64 / count as f64;
    count <= MOST_BARE && fall < (1.0 + farther * farther) * step
}

/// Whether a signal stays near its largest or smallest value longer than a pulse or oscillation does: with an amplifier
/// that saturates before the converter, the limit is noisy. In each half cycle beyond half of the extreme, the samples
/// near the extreme are counted; for a half-sine, the fraction `arccos(1 − w)/(π/3)` lies within `w` of its peak.
fn stands(samples: &[f64], rest: f64, noise: f64, step: f64) -> bool {
    let extreme = |side: f64| {
        samples
            .iter()
            .map(|v| side * (v - rest))
            .fold(0.0, f64::max)
    };
    let extremes = [1.0, -1.0].map(extreme);
    let largest = extremes[0].max(extremes[1]);
    let sides = [1.0, -1.0].into_iter().zip(extremes);
    // With AC coupling, a pulse is followed by a low and long swing of the opposite sign.
    let mut limits = sides.filter(|(_, extreme)| *extreme > OTHER_SIDE * largest);
    limits.any(|(side, extreme)| {
        let size = |v: &f64| side * (v - rest);
        let near = near(noise, extreme);
        let within = (near + step / extreme).min(0.5);
        let usual = (1.0 - within).acos() / std::f64::consts::FRAC_PI_3;
        let least = STANDING.max(LONGER * usual);
        let is_high = |v: &f64| size(v) >= 0.5 * extreme;
        let mut swings = samples.chunk_by(|a, b| is_high(a) == is_high(b));
        swings.any(|swing| {
            let within = |part: f64| {
                swing
                    .iter()
                    .filter(|v| size(v) >= (1.0 - part) * extreme)
                    .count()
            };
            let standing = within(near);
            let is_sharp = standing + 1 == LEAST_STANDING && within(ROUND * near) == standing;
            (standing >= LEAST_STANDING || is_sharp) && standing as f64 > least * swing.len() as f64
        })
    })
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
mod tests {
    use super::*;

    fn pulse(at: usize, height: f64, limit: f64, force: &mut [f64]) {
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

    fn quiet(i: i32) -> f64 {
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

    #[test]
    fn a_limit_with_noise_on_it_is_named() {
        let swing = |limit: f64| -> Vec<f64> {
            let one = |i: i32| {
                let t = f64::from(i - 500).max(0.0);
                let free = 10.0 * (-0.004 * t).exp() * (0.1 * t).sin();
                free.clamp(-limit, limit) + 0.01 * quiet(i)
            };
            (0..4000).map(one).collect()
        };
        for (force_limit, swing_limit, want) in [
            (f64::INFINITY, 50.0, vec![]),
            (7.0, 50.0, vec![HitFault::ForceClipped]),
            (f64::INFINITY, 6.0, vec![HitFault::MeasuredClipped]),
            (
                8.0,
                7.0,
                vec![HitFault::ForceClipped, HitFault::MeasuredClipped],
            ),
        ] {
            let mut force: Vec<f64> = (0..4000).map(|i| 0.005 * quiet(3 * i)).collect();
            pulse(500, 10.0, force_limit, &mut force);
            let hits = find_hits(&force, &swing(swing_limit), 1000);
            assert_eq!(
                hits[0].faults, want,
                "limits {force_limit} and {swing_limit}"
            );
        }
    }

    /// A converter of few steps, or a slow one, repeats the values of a round top.
    #[test]
    fn coarse_and_held_responses_are_not_clipped() {
        for seed in 0..40 {
            let cycle = 20.0 + 1.7 * f64::from(seed);
            let limited = |limit: f64| -> Vec<f64> {
                let one = |i: i32| {
                    let t = f64::from(i - 500).max(0.0);
                    let free = 10.0 * (-0.2 / cycle * t).exp();
                    (free * (std::f64::consts::TAU * t / cycle).sin()).clamp(-limit, limit)
                };
                (0..4000).map(one).collect()
            };
            let mut force = vec![0.0; 4000];
            pulse(500, 10.0, f64::INFINITY, &mut force);
            let faults = |measured: &[f64]| find_hits(&force, measured, 1000)[0].faults.clone();
            let (whole, cut) = (limited(f64::INFINITY), limited(5.5));
            for steps in [20.0, 30.0, 60.0, 250.0] {
                let coarse = |samples: &[f64]| -> Vec<f64> {
                    let step = 20.0 / steps;
                    samples.iter().map(|v| (v / step).round() * step).collect()
                };
                assert!(faults(&coarse(&whole)).is_empty(), "{cycle} {steps}");
                assert_eq!(
                    faults(&coarse(&cut)),
                    [HitFault::MeasuredClipped],
                    "{cycle} {steps}"
                );
            }
            let held: Vec<f64> = (0..4000).map(|i| whole[i - i % 3]).collect();
            assert!(faults(&held).is_empty(), "{cycle}");
        }
    }

    /// Strokes of seven samples: three stand at the limit, or fewer where another hit shows it.
    #[test]
    fn short_strokes_at_a_noisy_limit_are_named() {
        let stroke = |at: f64, height: f64, limit: f64, force: &mut [f64]| {
            for (i, value) in force.iter_mut().enumerate() {
                let u = (i as f64 - at) / 8.0;
                if (0.0..1.0).contains(&u) {
                    *value += (height * (std::f64::consts::PI * u).sin().powi(2)).min(limit);
                }
            }
        };
        let faults = |limit: f64| {
            let mut force: Vec<f64> = (0..6000).map(|i| 0.005 * quiet(3 * i)).collect();
            stroke(500.3, 16.0, limit, &mut force);
            stroke(2500.1, 10.2, limit, &mut force);
            stroke(4500.4, 7.0, limit, &mut force);
            let ring = |i: i32| {
                let t = f64::from((i + 1500) % 2000);
                (-0.01 * t).exp() * (0.37 * t).sin()
            };
            let measured: Vec<f64> = (0..6000).map(ring).collect();
            let hits = find_hits(&force, &measured, 1000);
            hits.into_iter().map(|hit| hit.faults).collect::<Vec<_>>()
        };
        let clipped = vec![HitFault::ForceClipped];
        assert_eq!(faults(f64::INFINITY), [vec![], vec![], vec![]]);
        assert_eq!(faults(9.0), [clipped.clone(), clipped, vec![]]);
    }
}
