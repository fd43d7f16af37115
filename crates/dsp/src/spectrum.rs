//! Power spectral density of a record.

use num_complex::Complex64;

use crate::Error;

/// Power spectrum summed over Hann-windowed blocks of one length.
///
/// The window is applied to the transform of the unwindowed block: a Hann window is equivalent to
/// `X'[k] = ½X[k] − ¼X[k−1] − ¼X[k+1]` (F. J. Harris, Proc. IEEE 66 (1978), 51), so an existing
/// transform can be reused.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerSum {
    block_length: usize,
    sum: Vec<f64>,
    blocks: usize,
}

impl PowerSum {
    /// An empty sum for blocks of an even length.
    #[must_use]
    pub fn new(block_length: usize) -> Self {
        Self {
            block_length,
            sum: vec![0.0; block_length / 2 + 1],
            blocks: 0,
        }
    }

    /// The length of its blocks.
    #[must_use]
    pub fn block_length(&self) -> usize {
        self.block_length
    }

    /// Adds the transform (bins `0..=block_length/2`) of an unwindowed block.
    ///
    /// # Panics
    /// If the number of bins does not match the block length.
    pub fn add_hann(&mut self, spectrum: &[Complex64]) {
        assert_eq!(spectrum.len(), self.sum.len(), "bins of one block length");
        let last = spectrum.len() - 1;
        for (sum, bins) in self.sum[1..last].iter_mut().zip(spectrum.windows(3)) {
            *sum += (bins[1] * 0.5 - (bins[0] + bins[2]) * 0.25).norm_sqr();
        }
        // Beyond the ends lie the conjugates of the bins inside.
        self.sum[0] += (0.5 * spectrum[0].re - 0.5 * spectrum[1].re).powi(2);
        self.sum[last] += (0.5 * spectrum[last].re - 0.5 * spectrum[last - 1].re).powi(2);
        self.blocks += 1;
    }

    /// Adds all half-overlapping blocks of the samples, each without its mean.
    pub fn add_samples(&mut self, samples: &[f64]) {
        let length = self.block_length;
        let transform = torqcomp_fourier::forward(length);
        let mut spectrum = transform.make_output_vec();
        for block in samples.windows(length).step_by(length / 2) {
            let mean = block.iter().sum::<f64>() / length as f64;
            let mut block: Vec<f64> = block.iter().map(|x| x - mean).collect();
            transform
                .process(&mut block, &mut spectrum)
                .expect("buffers were made for this length");
            self.add_hann(&spectrum);
        }
    }

    /// Adds another sum over blocks of the same length.
    ///
    /// # Panics
    /// If the block lengths differ.
    pub fn add(&mut self, other: &Self) {
        assert_eq!(self.block_length, other.block_length, "one block length");
        for (sum, more) in self.sum.iter_mut().zip(&other.sum) {
            *sum += more;
        }
        self.blocks += other.blocks;
    }

    /// Clears the sum.
    pub fn clear(&mut self) {
        self.sum.fill(0.0);
        self.blocks = 0;
    }

    /// One-sided density; `None` if no block was added.
    #[must_use]
    pub fn density(&self, sample_rate_hz: f64) -> Option<Density> {
        if self.blocks == 0 {
            return None;
        }
        // The mean square of the Hann window is 3/8; the two-sided spectrum is folded.
        let scale = 2.0 / (sample_rate_hz * 0.375 * self.block_length as f64 * self.blocks as f64);
        let mut values: Vec<f64> = self.sum.iter().map(|power| power * scale).collect();
        let last = values.len() - 1;
        values[0] *= 0.5;
        values[last] *= 0.5;
        Some(Density {
            step_hz: sample_rate_hz / self.block_length as f64,
            values,
            blocks: self.blocks,
        })
    }
}

/// Welch's density of a streamed record, in bounded memory: equal to [`welch`] of the whole within rounding.
#[derive(Debug, Clone)]
pub struct StreamedPower {
    sum: PowerSum,
    /// Samples of incomplete blocks.
    pending: Vec<f64>,
}

/// Number of blocks transformed at once.
const BLOCKS_AT_ONCE: usize = 16;

impl StreamedPower {
    /// An empty sum for blocks of an even length.
    #[must_use]
    pub fn new(block_length: usize) -> Self {
        Self {
            sum: PowerSum::new(block_length),
            pending: Vec::new(),
        }
    }

    /// Takes the next samples.
    ///
    /// ```
    /// use torqcomp_dsp::spectrum::{StreamedPower, welch};
    /// let x: Vec<f64> = (0..5000).map(|i| (0.3 * i as f64).cos() + 0.001 * i as f64).collect();
    /// let mut streamed = StreamedPower::new(64);
    /// x.chunks(77).for_each(|piece| streamed.push(piece));
    /// let (whole, streamed) = (welch(&x, 1000.0, 64)?, streamed.density(1000.0).unwrap());
    /// assert_eq!(whole.blocks, streamed.blocks);
    /// assert!(whole.values.iter().zip(&streamed.values).all(|(a, b)| (a - b).abs() < 1e-12));
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    pub fn push(&mut self, samples: &[f64]) {
        self.pending.extend_from_slice(samples);
        if self.pending.len() >= BLOCKS_AT_ONCE * self.sum.block_length {
            self.transform();
        }
    }

    fn transform(&mut self) {
        let (length, half) = (self.sum.block_length, self.sum.block_length / 2);
        if self.pending.len() < length {
            return;
        }
        self.sum.add_samples(&self.pending);
        let blocks = (self.pending.len() - length) / half + 1;
        // Keep the start of the next block.
        self.pending.drain(..blocks * half);
    }

    /// The density of all samples; a record shorter than two blocks uses blocks of at most half its length, and fewer
    /// than 8 samples give `None`.
    #[must_use]
    pub fn density(&self, sample_rate_hz: f64) -> Option<Density> {
        let mut whole = self.clone();
        let half = whole.pending.len() / 2;
        if whole.sum.blocks == 0 && half < whole.sum.block_length {
            let block_length = 1 << half.checked_ilog2().filter(|power| *power >= 2)?;
            return welch(&whole.pending, sample_rate_hz, block_length).ok();
        }
        whole.transform();
        whole.sum.density(sample_rate_hz)
    }
}

/// One-sided power spectral density, unit²/Hz, at equally spaced frequencies from zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Density {
    /// Frequency step, in Hz.
    pub step_hz: f64,
    /// The density at `0, step_hz, 2 step_hz, …`.
    pub values: Vec<f64>,
    /// Number of averaged blocks.
    pub blocks: usize,
}

impl Density {
    /// Ratio of median to mean of a noise line averaged over these blocks.
    #[must_use]
    pub fn median_over_mean(&self) -> f64 {
        self.quantile_over_mean(0.0)
    }

    /// Ratio of a quantile to the mean of such a line, chi-squared with 2 degrees of freedom per block; `normal` is that
    /// quantile of the standard normal distribution (E. B. Wilson, M. M. Hilferty, PNAS 17 (1931), 684).
    pub(crate) fn quantile_over_mean(&self, normal: f64) -> f64 {
        let variance = 2.0 / (9.0 * 2.0 * self.blocks as f64);
        (1.0 - variance + normal * variance.sqrt()).powi(3)
    }

    /// The density for a power scaled by `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        self.values.iter_mut().for_each(|value| *value *= factor);
        self
    }

    /// Densities from `from_hz` up to and including `to_hz`, with their frequencies.
    pub fn between(&self, from_hz: f64, to_hz: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let first = (from_hz / self.step_hz).ceil().max(0.0) as usize;
        self.values
            .iter()
            .enumerate()
            .skip(first)
            .map(|(bin, value)| (bin as f64 * self.step_hz, *value))
            .take_while(move |(frequency_hz, _)| *frequency_hz <= to_hz)
    }
}

/// Density of a record by Welch's method: Hann windows, half overlapping, each without its mean.
///
/// Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967), 70.
///
/// # Errors
/// [`Error::TooShort`] if the record is shorter than one block, [`Error::NotPositive`] for an odd
/// or zero block length or rate.
///
/// ```
/// use torqcomp_dsp::spectrum::welch;
/// // A cosine of amplitude 2 has a mean square of 2, all of it near its own frequency.
/// let x: Vec<f64> = (0..4096).map(|i| 2.0 * (0.3 * i as f64).cos()).collect();
/// let density = welch(&x, 1000.0, 512)?;
/// let power: f64 = density.values.iter().map(|v| v * density.step_hz).sum();
/// assert!((power - 2.0).abs() < 1e-3);
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub fn welch(samples: &[f64], sample_rate_hz: f64, block_length: usize) -> Result<Density, Error> {
    check(samples, sample_rate_hz, block_length)?;
    let mut power = PowerSum::new(block_length);
    power.add_samples(samples);
    Ok(power
        .density(sample_rate_hz)
        .expect("the record holds at least one block"))
}

/// Rejects input without a density.
fn check(samples: &[f64], sample_rate_hz: f64, block_length: usize) -> Result<(), Error> {
    if !(sample_rate_hz > 0.0 && sample_rate_hz.is_finite()) {
        return Err(Error::NotPositive {
            name: "sampling rate",
            value: sample_rate_hz,
        });
    }
    if block_length < 4 || !block_length.is_multiple_of(2) {
        return Err(Error::NotPositive {
            name: "even block length",
            value: block_length as f64,
        });
    }
    if samples.len() < block_length {
        return Err(Error::TooShort {
            what: "a spectrum",
            expected: block_length,
            got: samples.len(),
        });
    }
    Ok(())
}

/// Density of a record with the square of the Hann window, `sin⁴`.
///
/// Its leakage falls with the tenth power of the distance, that of the Hann window with the sixth, so that the
/// leakage of a resonance stays below the noise. The main lobe is half as wide again. The mean square of `sin⁴` is
/// 35/128. Blocks begin every quarter of a block, as the window hardly weighs its outer quarters.
///
/// # Errors
/// As for [`welch`].
///
/// ```
/// use torqcomp_dsp::spectrum::welch_steep;
/// let x: Vec<f64> = (0..4096).map(|i| 2.0 * (0.3 * i as f64).cos()).collect();
/// let density = welch_steep(&x, 1000.0, 512)?;
/// let power: f64 = density.values.iter().map(|v| v * density.step_hz).sum();
/// assert!((power - 2.0).abs() < 1e-3);
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub fn welch_steep(
    samples: &[f64],
    sample_rate_hz: f64,
    block_length: usize,
) -> Result<Density, Error> {
    check(samples, sample_rate_hz, block_length)?;
    Ok(SteepSum::of(samples, block_length).density(sample_rate_hz, block_length))
}

/// Density of the parts of a record as by [`welch_steep`], in which signal that is in the ends of a part alone counts as
/// well: they are covered by blocks of a half, a quarter and an eighth of the length, which must be a power of two.
///
/// A shorter block counts at the lines at which it has far more power than that density explains, with its coarser
/// lines: a steady line keeps its width.
///
/// # Errors
/// As for [`welch`], for each part.
///
/// ```
/// use torqcomp_dsp::spectrum::welch_to_the_ends;
/// // A cosine of amplitude 2 in the last sixteenth has a mean square of 2/16.
/// let late = |i: usize| if i < 3840 { 0.0 } else { 2.0 * (0.8 * i as f64).cos() };
/// let x: Vec<f64> = (0..4096).map(late).collect();
/// let density = welch_to_the_ends(&[&x], 1000.0, 1024)?;
/// let power: f64 = density.values.iter().map(|v| v * density.step_hz).sum();
/// assert!((0.8..1.2).contains(&(power / 0.125)));
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub fn welch_to_the_ends(
    parts: &[&[f64]],
    sample_rate_hz: f64,
    block_length: usize,
) -> Result<Density, Error> {
    check(
        parts.first().unwrap_or(&&[][..]),
        sample_rate_hz,
        block_length,
    )?;
    let mut sum = SteepSum::of_parts(parts, sample_rate_hz, block_length)?;
    let whole = sum.powers.clone();
    let count: usize = parts.iter().map(|part| part.len()).sum();
    // The outermost whole blocks stand for what is farther from the ends than three eighths of their length, each
    // shorter one for half of the rest.
    let mut length = block_length / 2;
    let mut share = 3.0 / 16.0 * block_length as f64;
    while length >= (block_length / 8).max(SHORTEST_AT_ENDS) {
        let shorter = SteepBlock::of_length(length);
        let explained = shorter.seen(&whole);
        for part in parts {
            for start in [0, part.len() - length] {
                let power = shorter.power(&part[start..start + length]);
                sum.add_end(&power, &explained, share / count as f64);
            }
        }
        (length, share) = (length / 2, 0.5 * share);
    }
    Ok(sum.density(sample_rate_hz, block_length))
}

/// Shortest block at the ends of a record, in samples.
const SHORTEST_AT_ENDS: usize = 64;
/// Lines of a shorter block that hold the mean with the main lobe of the window.
const MEAN_LINES: usize = 4;
/// Power of a shorter block relative to that explained, from which it counts: that of noise is hardly ever ten times its
/// mean.
const FAR_MORE: f64 = 10.0;
/// Ratio of the number of blocks a quarter apart to that of independent ones: `1 + 2 Σ ρ²` with the correlations
/// `ρ = Σ w w'/Σ w²` of the windows, 0.486 and 0.043.
const ALIKE: f64 = 1.48;

/// Transform of blocks of one length with the window `sin⁴`.
struct SteepBlock {
    window: Vec<f64>,
    transform: std::sync::Arc<dyn torqcomp_fourier::RealToComplex<f64>>,
}

impl SteepBlock {
    fn of_length(length: usize) -> Self {
        let turn = std::f64::consts::PI / length as f64;
        Self {
            window: (0..length)
                .map(|i| (turn * i as f64).sin().powi(4))
                .collect(),
            transform: torqcomp_fourier::forward(length),
        }
    }

    /// The power that a block of this length shows of a spectrum with closer lines: its mean over the squared transform of
    /// the window.
    fn seen(&self, power: &[f64]) -> Vec<f64> {
        let last = power.len() - 1;
        let apart = 2 * last / self.window.len();
        let reach = MEAN_LINES * apart;
        let turn = -std::f64::consts::TAU / (2 * last) as f64;
        let weight = |line: usize| {
            let terms = self.window.iter().enumerate();
            let sum = terms.map(|(i, w)| Complex64::from_polar(*w, turn * (line * i) as f64));
            sum.sum::<Complex64>().norm_sqr()
        };
        let weights: Vec<f64> = (0..=reach).map(weight).collect();
        let whole = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
        let at = |place: usize| {
            let beside = |d: usize| {
                let above = last - last.abs_diff(place + d);
                weights[d] * (power[place.abs_diff(d)] + power[above])
            };
            (weights[0] * power[place] + (1..=reach).map(beside).sum::<f64>()) / whole
        };
        (0..=self.window.len() / 2)
            .map(|line| at(line * apart))
            .collect()
    }

    /// Squared magnitudes of a block without its mean, over its length.
    fn power(&self, block: &[f64]) -> Vec<f64> {
        let length = block.len() as f64;
        let mean = block.iter().sum::<f64>() / length;
        let pairs = block.iter().zip(&self.window);
        let mut block: Vec<f64> = pairs.map(|(x, w)| (x - mean) * w).collect();
        let mut spectrum = self.transform.make_output_vec();
        self.transform
            .process(&mut block, &mut spectrum)
            .expect("buffers were made for this length");
        spectrum.iter().map(|bin| bin.norm_sqr() / length).collect()
    }
}

/// Mean power of the blocks of a record.
struct SteepSum {
    powers: Vec<f64>,
    blocks: usize,
}

impl SteepSum {
    fn of(samples: &[f64], block_length: usize) -> Self {
        let mut powers = vec![0.0; block_length / 2 + 1];
        let last = samples.len() - block_length;
        let step = (block_length / 4).max(1);
        let whole = SteepBlock::of_length(block_length);
        let (mut blocks, mut shares) = (0, 0);
        for start in (0..last).step_by(step).chain([last]) {
            let share = (last - start).min(step).max(1);
            let power = whole.power(&samples[start..start + block_length]);
            let both = powers.iter_mut().zip(power);
            both.for_each(|(sum, power)| *sum += share as f64 * power);
            (blocks, shares) = (blocks + 1, shares + share);
        }
        powers.iter_mut().for_each(|sum| *sum /= shares as f64);
        Self { powers, blocks }
    }

    /// Of the parts of a record, each weighted with its length.
    fn of_parts(parts: &[&[f64]], rate_hz: f64, block_length: usize) -> Result<Self, Error> {
        let mut all = Self::of(parts[0], block_length);
        let mut count = parts[0].len() as f64;
        for part in &parts[1..] {
            check(part, rate_hz, block_length)?;
            let more = Self::of(part, block_length);
            let share = part.len() as f64 / (count + part.len() as f64);
            let both = all.powers.iter_mut().zip(&more.powers);
            both.for_each(|(sum, power)| *sum += share * (power - *sum));
            all.blocks += more.blocks;
            count += part.len() as f64;
        }
        Ok(all)
    }

    /// Adds a share of the power of a shorter block at an end beyond that explained by the others, where that is far
    /// more.
    fn add_end(&mut self, power: &[f64], explained: &[f64], share: f64) {
        let apart = (self.powers.len() - 1) / (power.len() - 1);
        for (line, sum) in self.powers.iter_mut().enumerate().skip(MEAN_LINES * apart) {
            let own = (line + apart / 2) / apart;
            if power[own] > FAR_MORE * explained[own] {
                *sum += share * (power[own] - explained[own]);
            }
        }
    }

    /// One-sided density.
    fn density(self, sample_rate_hz: f64, block_length: usize) -> Density {
        let mean_square = 35.0 / 128.0;
        let scale = 2.0 / (sample_rate_hz * mean_square);
        let mut values = self.powers;
        values.iter_mut().for_each(|power| *power *= scale);
        let last = values.len() - 1;
        values[0] *= 0.5;
        values[last] *= 0.5;
        Density {
            step_hz: sample_rate_hz / block_length as f64,
            values,
            blocks: (self.blocks as f64 / ALIKE).ceil() as usize,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_noise::noise;

    /// Direct transform of the windowed block by definition, term by term.
    fn slow_hann_power(block: &[f64]) -> Vec<f64> {
        let n = block.len() as f64;
        (0..=block.len() / 2)
            .map(|k| {
                let sum: Complex64 = block
                    .iter()
                    .enumerate()
                    .map(|(i, x)| {
                        let turn = std::f64::consts::TAU * i as f64 / n;
                        let window = 0.5 - 0.5 * turn.cos();
                        Complex64::from_polar(x * window, -turn * k as f64)
                    })
                    .sum();
                sum.norm_sqr()
            })
            .collect()
    }

    #[test]
    fn window_in_the_frequency_domain_is_the_window_in_time() {
        let mut block: Vec<f64> = (0..64).map(|i| ((i * i) % 17) as f64 - 3.0).collect();
        let expected = slow_hann_power(&block);
        let transform = torqcomp_fourier::forward(64);
        let mut spectrum = transform.make_output_vec();
        transform.process(&mut block, &mut spectrum).unwrap();
        let mut power = PowerSum::new(64);
        power.add_hann(&spectrum);
        for (got, want) in power.sum.iter().zip(&expected) {
            assert!((got - want).abs() < 1e-9 * (1.0 + want), "{got} {want}");
        }
    }

    #[test]
    fn white_noise_has_a_flat_density_of_twice_variance_over_rate() {
        let mut noise = noise(1);
        // Sums of four uniform numbers of variance 1/12 each.
        let samples: Vec<f64> = (0..1 << 16)
            .map(|_| (0..4).map(|_| noise()).sum())
            .collect();
        let density = welch(&samples, 500.0, 256).unwrap();
        let expected = 2.0 * (4.0 / 12.0) / 500.0;
        for band in [(5.0, 80.0), (80.0, 160.0), (160.0, 245.0)] {
            let (sum, count) = density
                .between(band.0, band.1)
                .fold((0.0, 0), |(s, n), (_, v)| (s + v, n + 1));
            let mean = sum / f64::from(count);
            assert!(
                (mean / expected - 1.0).abs() < 0.03,
                "{band:?}: {mean} {expected}"
            );
        }
    }
}
