//! Mains hum: spectral lines at 50 or 60 Hz and their multiples.

use schemars::JsonSchema;
use serde::Serialize;

use super::median;
use crate::spectrum::{Density, PowerSum};

/// Mains frequencies of the world, Hz.
const NOMINAL_HZ: [f64; 2] = [50.0, 60.0];
/// Highest order examined.
const ORDERS: usize = 10;
/// Block length, for a resolution of 0.5 Hz.
const BLOCK_S: f64 = 2.0;
/// Shortest permitted block length: 1 Hz.
const SHORTEST_S: f64 = 1.0;
/// Maximum number of blocks transformed.
const MOST_BLOCKS: usize = 32;
/// Relative tolerance of the mains frequency: 0.1 Hz at 50 Hz, exceeded by grids only for seconds.
const OFF: f64 = 0.002;
/// Half-width of a line in bins with a Hann window.
const LOBE: usize = 3;
/// Number of bins beyond that, on either side, that a line must exceed.
const BESIDE: usize = 14;
/// Minimum power of a line relative to the highest of the neighbouring bins.
const PROMINENCE: f64 = 6.0;
/// Minimum amplitude of the strongest line, relative to the RMS of the record without its mean.
const SMALLEST: f64 = 1e-3;
/// Amplitude, relative to the RMS of the record with its mean, explained by rounding of the
/// transform.
const ROUNDING: f64 = 1e-9;
/// Largest denominator of a simple fraction of the mains frequency: a shaft whose order falls on the
/// mains is expected to show a line there.
const LARGEST_DENOMINATOR: usize = 6;
/// Number of shaft orders used to attribute a line to a shaft.
const SHAFT_ORDERS: usize = 6;

/// Mains lines in a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Mains {
    /// 50 or 60 Hz.
    pub nominal_hz: f64,
    /// The lines in ascending order.
    pub lines: Vec<MainsLine>,
    /// Frequency resolution: lines closer together are not resolved.
    pub resolution_hz: f64,
    /// A line at a simple fraction of the mains frequency (denominator up to 6), if any: all lines may
    /// then be shaft orders.
    pub shaft_hz: Option<f64>,
}

/// A line at a multiple of the mains frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct MainsLine {
    /// Multiple of the mains frequency.
    #[serde(skip)]
    pub order: usize,
    /// Frequency of the highest bin, in Hz.
    pub frequency_hz: f64,
    /// Peak value of the line's sine, in the channel's unit.
    pub amplitude: f64,
    /// Power of the line over that of the highest bin beside it.
    pub prominence: f64,
}

/// Looks for mains lines in a uniformly sampled record. `None` if there are none, or if the record is too short (1
/// s), too slow (the mains must lie below 0.45 of the rate) or contains no whole block of finite samples.
///
/// Welch's method with Hann windows of 2 s (at least 1 s), over which grids keep their frequency within a bin. A bin
/// within 0.2 % and half a bin of a multiple is a line if it is higher than its neighbours and at least 6 times as
/// high as the highest of the 14 bins on either side beyond the window's own width. For locally white noise, the
/// false-alarm probability of one transform is `∏ j/(j+6), j = 1…28` = 7·10⁻⁷ per bin (ratio of an exponential
/// variable to the largest of 28), less with several transforms; in a comb of lines, as from shaft orders or a
/// multisine, or on a broad resonance, no bin passes. Mains is reported if the fundamental is a line, or two of its
/// multiples are, and the strongest has an amplitude of at least a thousandth of the record's RMS.
///
/// A line of another origin can lie at 50 Hz as well: a mains-fed motor, or a shaft at a fraction of it. It cannot
/// be distinguished from mains if it is closer than the resolution.
///
/// The amplitude is `√(2 Σ(S − S₀) Δf)` over the 5 bins about the line, `S₀` being the median of the neighbouring
/// bins.
///
/// ```
/// use torqcomp_dsp::quality::mains::mains;
/// let hum = |i: i32| {
///     let t = 1e-3 * f64::from(i);
///     (7.0 * t).sin() + 0.02 * (std::f64::consts::TAU * 50.0 * t).sin()
/// };
/// let record: Vec<f64> = (0..8000).map(hum).collect();
/// let found = mains(&record, 1000.0).unwrap();
/// assert_eq!((found.nominal_hz, found.lines.len()), (50.0, 1));
/// assert!((found.lines[0].amplitude - 0.02).abs() < 0.0002);
/// ```
#[must_use]
pub fn mains(samples: &[f64], rate_hz: f64) -> Option<Mains> {
    let (density, variance, square) = spectrum(samples, rate_hz)?;
    let mut best: Option<(f64, Mains)> = None;
    for nominal_hz in NOMINAL_HZ {
        let lines: Vec<MainsLine> = (1..=ORDERS)
            .filter_map(|order| line(&density, nominal_hz, order))
            .collect();
        let strongest = lines.iter().map(|l| l.amplitude).fold(0.0, f64::max);
        let told = lines.iter().any(|l| l.order == 1) || lines.len() > 1;
        let least = (SMALLEST * variance.sqrt()).max(ROUNDING * square.sqrt());
        if !told || strongest < least {
            continue;
        }
        // Multiples of 300 Hz belong to both: lines that are not shaft orders decide, then the fundamental, then the
        // number of lines.
        let shaft_hz = shaft(&density, nominal_hz);
        let weight = lines.len() as f64
            + if lines[0].order == 1 { 100.0 } else { 0.0 }
            + if shaft_hz.is_none() { 1000.0 } else { 0.0 };
        if best.as_ref().is_none_or(|(other, _)| weight > *other) {
            let found = Mains {
                nominal_hz,
                lines,
                resolution_hz: density.step_hz,
                shaft_hz,
            };
            best = Some((weight, found));
        }
    }
    best.map(|(_, found)| found)
}

/// The lowest line at `p/q` of a mains frequency below twice that frequency, `q` from 2 to 6, of a shaft that may also
/// produce a line at the mains frequency.
fn shaft(density: &Density, nominal_hz: f64) -> Option<f64> {
    let fractions = (2..=LARGEST_DENOMINATOR).flat_map(|q| (1..2 * q).map(move |p| (p, q)));
    let fractions = fractions.filter(|(p, q)| p % q != 0);
    let lines = fractions.filter_map(|(p, q)| {
        let hz = nominal_hz * p as f64 / q as f64;
        let bin = peak(density, hz)?;
        (!is_of_another_shaft(density, nominal_hz, hz)).then_some(bin)
    });
    lines.min().map(|bin| bin as f64 * density.step_hz)
}

/// Whether a line is one of the first orders of a shaft that shows its first three orders, none of them at the mains
/// frequency.
fn is_of_another_shaft(density: &Density, nominal_hz: f64, line_hz: f64) -> bool {
    (1..=SHAFT_ORDERS).any(|order| {
        let shaft_hz = line_hz / order as f64;
        let mains = nominal_hz / shaft_hz;
        let is_order = (mains - mains.round()).abs() < OFF * mains;
        let mut first = (1..=3).map(|n| f64::from(n) * shaft_hz);
        !is_order && first.all(|hz| peak(density, hz).is_some())
    })
}

/// Density, variance and mean square of the record, from blocks spread over it.
fn spectrum(samples: &[f64], rate_hz: f64) -> Option<(Density, f64, f64)> {
    let usable = rate_hz.is_finite() && 0.45 * rate_hz > NOMINAL_HZ[0];
    if !usable || (samples.len() as f64) < SHORTEST_S * rate_hz {
        return None;
    }
    let wanted = ((BLOCK_S * rate_hz) as usize).min(samples.len());
    let length = wanted & !1;
    let mut power = PowerSum::new(length);
    let half_steps = (samples.len() - length) / (length / 2);
    let blocks = (half_steps + 1).min(MOST_BLOCKS);
    let (mut sum, mut square, mut count) = (0.0, 0.0, 0.0);
    for i in 0..blocks {
        let start = (samples.len() - length) * i / blocks.max(2).saturating_sub(1);
        let block = &samples[start..start + length];
        if block.iter().all(|x| x.is_finite()) {
            power.add_samples(block);
            sum += block.iter().sum::<f64>();
            square += block.iter().map(|x| x * x).sum::<f64>();
            count += length as f64;
        }
    }
    let mean = sum / count;
    let density = power.density(rate_hz)?;
    let square = square / count;
    Some((density, (square - mean * mean).max(0.0), square))
}

/// The line at a multiple of a mains frequency, if any.
fn line(density: &Density, nominal_hz: f64, order: usize) -> Option<MainsLine> {
    let bin = peak(density, nominal_hz * order as f64)?;
    let mut beside = beside(density, bin)?;
    let highest = beside.iter().copied().fold(0.0, f64::max);
    let floor = median(&mut beside)?;
    let power: f64 = density.values[bin - 2..=bin + 2]
        .iter()
        .map(|s| (s - floor) * density.step_hz)
        .sum();
    Some(MainsLine {
        order,
        frequency_hz: bin as f64 * density.step_hz,
        amplitude: (2.0 * power.max(0.0)).sqrt(),
        prominence: density.values[bin] / highest,
    })
}

/// The bin near a frequency that exceeds its neighbours.
fn peak(density: &Density, frequency_hz: f64) -> Option<usize> {
    let off = 0.5 * density.step_hz + OFF * frequency_hz;
    let first = ((frequency_hz - off) / density.step_hz).ceil().max(1.0) as usize;
    let last = ((frequency_hz + off) / density.step_hz).floor() as usize;
    let values = &density.values;
    let bin = (first..=last.min(values.len().saturating_sub(2)))
        .max_by(|a, b| values[*a].total_cmp(&values[*b]))?;
    let beside = beside(density, bin)?;
    let highest = beside.into_iter().fold(0.0, f64::max);
    let is_top = values[bin] >= values[bin - 1] && values[bin] >= values[bin + 1];
    (is_top && values[bin] > 0.0 && values[bin] >= PROMINENCE * highest).then_some(bin)
}

/// Densities on both sides of a line, beyond its own width; `None` if there are too few.
fn beside(density: &Density, bin: usize) -> Option<Vec<f64>> {
    let left = bin.checked_sub(LOBE + BESIDE)?;
    let right = density.values.get(bin + LOBE + 1..=bin + LOBE + BESIDE)?;
    let left = &density.values[left..bin - LOBE];
    Some([left, right].concat())
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, sum};
    use super::*;
    use std::f64::consts::TAU;

    fn tone(amplitude: f64, frequency_hz: f64, rate_hz: f64, count: usize) -> Vec<f64> {
        (0..count)
            .map(|i| amplitude * (TAU * frequency_hz * i as f64 / rate_hz + 1.0).cos())
            .collect()
    }

    #[test]
    fn noise_combs_and_resonances_have_no_mains() {
        for seed in 0..40 {
            assert_eq!(mains(&noise(seed, 4000), 2000.0), None, "seed {seed}");
        }
        let comb = (1..80).fold(noise(1, 20_000), |comb, order| {
            sum(&comb, &tone(1.0, 5.0 * f64::from(order), 2000.0, 20_000))
        });
        assert_eq!(mains(&comb, 2000.0), None);
        // A decay at 50 Hz with a damping ratio of 0.01.
        let ring: Vec<f64> = tone(1.0, 50.0, 2000.0, 20_000)
            .iter()
            .enumerate()
            .map(|(i, x)| x * (-0.01 * TAU * 50.0 * i as f64 / 2000.0).exp())
            .collect();
        let found = mains(&sum(&ring, &noise(4, 20_000)), 2000.0);
        assert_eq!(found, None);
    }

    #[test]
    fn drifting_mains_is_found_with_its_size() {
        for (nominal, actual) in [(50.0, 49.93), (60.0, 60.04)] {
            let third = tone(0.05, 3.0 * actual, 5000.0, 100_000);
            let hum = sum(&tone(0.2, actual, 5000.0, 100_000), &third);
            let found = mains(&sum(&hum, &noise(2, 100_000)), 5000.0).unwrap();
            assert_eq!((found.nominal_hz, found.shaft_hz), (nominal, None));
            assert_eq!(found.lines[0].order, 1);
            assert!((found.lines[0].amplitude - 0.2).abs() < 0.02, "{found:?}");
        }
    }

    #[test]
    fn a_shaft_in_step_is_pointed_out() {
        let orders = sum(
            &tone(1.0, 25.0, 1000.0, 10_000),
            &tone(0.5, 50.0, 1000.0, 10_000),
        );
        let found = mains(&sum(&orders, &noise(8, 10_000)), 1000.0).unwrap();
        assert_eq!(found.shaft_hz, Some(25.0));
    }

    /// 50 Hz is not an order of a shaft at 30 Hz that shows its own orders, nor is 60 Hz one at 25
    /// Hz.
    #[test]
    fn hum_beside_the_orders_of_a_shaft_is_found() {
        for (shaft, mains_hz, rate_hz) in [(30.0, 50.0, 1000.0), (25.0, 60.0, 2000.0)] {
            let count = (10.0 * rate_hz) as usize;
            let order = |n: f64| tone(1.0 / n, n * shaft, rate_hz, count);
            let orders = [1.0, 2.0, 3.0].map(order);
            let orders = orders
                .iter()
                .fold(noise(6, count), |all, one| sum(&all, one));
            let hum = sum(&orders, &tone(0.3, mains_hz, rate_hz, count));
            let found = mains(&hum, rate_hz).unwrap();
            assert_eq!((found.nominal_hz, found.shaft_hz), (mains_hz, None));
            assert!((found.lines[0].amplitude - 0.3).abs() < 0.02, "{found:?}");
            let without = mains(&orders, rate_hz);
            assert!(without.is_none_or(|m| m.shaft_hz.is_some()), "{shaft}");
        }
    }

    #[test]
    fn records_that_cannot_show_it_are_not_judged() {
        assert_eq!(mains(&tone(1.0, 50.0, 1000.0, 900), 1000.0), None);
        assert_eq!(mains(&tone(1.0, 10.0, 90.0, 9000), 90.0), None);
        assert_eq!(mains(&[f64::NAN; 5000], 1000.0), None);
    }
}
