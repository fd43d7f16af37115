//! Residual of a fit: its size, and its density near the components.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::{SineFit, rotate};
use crate::Error;
use crate::store::SampleStore;

/// Bins of the residual's periodogram, on either side of a component, used for its uncertainty. The
/// nearest one is excluded, as the fit has emptied it.
const NEAR_BINS: std::ops::RangeInclusive<usize> = 2..=12;
/// Minimum number of residual samples for a periodogram; below it, the residual counts as white.
const FEWEST_FOR_SPECTRUM: usize = 256;
/// Number of blocks of a record; within one, the rotation between neighbouring bins is a short
/// Taylor series.
const BLOCKS: usize = 1024;
/// Terms of that series. The angle is at most 2π·12/1024/2 = 0.037 rad, and 0.037⁵/5! = 6e-10.
const TERMS: usize = 5;

/// The residual of a fit.
pub(super) struct Leftover {
    pub(super) sum_squares: f64,
    /// Variance of white noise with the residual's density near each component.
    pub(super) near: Vec<f64>,
}

impl Leftover {
    /// Computed in one pass over the samples of the fit. `lost` is the number of degrees of freedom used by the
    /// fit.
    pub(super) fn of(
        samples: &(impl SampleStore + ?Sized),
        fit: &SineFit,
        lost: usize,
    ) -> Result<Self, Error> {
        let mut sum_squares = 0.0;
        let is_long = fit.length >= FEWEST_FOR_SPECTRUM;
        let mut bins: Vec<NearBins> = match is_long {
            true => fit
                .steps
                .iter()
                .map(|step| NearBins::new(*step, fit.length))
                .collect(),
            false => Vec::new(),
        };
        samples.pass(0..fit.length, &mut |start, piece| {
            let residual = fit.residual(start, piece);
            sum_squares = residual.iter().fold(sum_squares, |sum, x| sum + x * x);
            bins.iter_mut().for_each(|bins| bins.add(start, &residual));
        })?;
        let freedom = (fit.length as f64 - lost as f64).max(1.0);
        let near = match is_long {
            true => bins.iter().map(NearBins::variance).collect(),
            false => vec![sum_squares / freedom; fit.steps.len()],
        };
        Ok(Self { sum_squares, near })
    }
}

/// Transform of a stream of samples at whole bins beside a frequency.
///
/// `X(c + d) = Σ_i x_i e^{−2πj (c + d) i/N}`: the sum over the samples is taken at the component's own frequency c, and
/// those at whole numbers d of bins beside it follow from it block by block. Without a window, as in the fit, and with the
/// component's fraction of a bin, so that the leakage of a strong line into the component shows here, too.
struct NearBins {
    /// The component's frequency in bins.
    centre: f64,
    length: usize,
    /// Samples per block.
    block: usize,
    /// Moments of the current block about its middle: `Σ x_i e^{−2πj c i/N} u^q`, u from −1 to 1.
    moments: [Complex64; TERMS],
    /// Sums at the bins, from the lowest to the highest around the centre.
    sums: Vec<Complex64>,
}

impl NearBins {
    fn new(step: f64, length: usize) -> Self {
        Self {
            centre: step / TAU * length as f64,
            length,
            block: length.div_ceil(BLOCKS),
            moments: [Complex64::ZERO; TERMS],
            sums: vec![Complex64::ZERO; 2 * NEAR_BINS.end() + 1],
        }
    }

    /// Adds the next samples.
    fn add(&mut self, start: usize, samples: &[f64]) {
        let (mut at, end) = (start, start + samples.len());
        while at < end {
            let first = at - at % self.block;
            let last = (first + self.block).min(self.length);
            let to = last.min(end);
            self.add_to_block(first, at, &samples[at - start..to - start]);
            if to == last {
                self.close(first);
            }
            at = to;
        }
    }

    /// Half-length of a block, and its middle.
    fn half_and_middle(&self, first: usize) -> (f64, f64) {
        let half = 0.5 * self.block as f64;
        (half, first as f64 + half - 0.5)
    }

    fn add_to_block(&mut self, first: usize, at: usize, samples: &[f64]) {
        let (half, middle) = self.half_and_middle(first);
        let step = -TAU * self.centre / self.length as f64;
        let mut moments = self.moments;
        rotate(at..at + samples.len(), self.length, step, |i, turn| {
            let u = (i as f64 - middle) / half;
            let mut term = turn * samples[i - at];
            for moment in &mut moments {
                *moment += term;
                term *= u;
            }
        });
        self.moments = moments;
    }

    /// Adds a complete block to the bins.
    fn close(&mut self, first: usize) {
        let (half, middle) = self.half_and_middle(first);
        let widest = *NEAR_BINS.end() as f64;
        // `Σ_q m_q (j w)^q/q!`, w being the angle from the middle of the block to its end.
        let (mut terms, mut factorial) = (self.moments, 1.0);
        for (next, term) in (1..).zip(&mut terms) {
            *term /= factorial;
            factorial *= f64::from(next);
        }
        // The angle grows by the same step from bin to bin.
        let bin = -TAU / self.length as f64;
        let at_middle = bin * (middle - 0.5 * (self.length - 1) as f64);
        let mut turn = Complex64::from_polar(1.0, -widest * at_middle);
        let advance = Complex64::from_polar(1.0, at_middle);
        for (place, sum) in self.sums.iter_mut().enumerate() {
            let w = bin * (place as f64 - widest) * half;
            let times = |value: Complex64| Complex64::new(-w * value.im, w * value.re);
            let series = terms.iter().rev();
            *sum += turn * series.fold(Complex64::ZERO, |value, term| term + times(value));
            turn *= advance;
        }
        self.moments = [Complex64::ZERO; TERMS];
    }

    /// Variance of white noise with the mean density over the bins. Negative frequencies mirror positive ones, and those
    /// within a bin of zero are excluded because the constant is fitted as well.
    fn variance(&self) -> f64 {
        let (last, widest) = (0.5 * self.length as f64, *NEAR_BINS.end());
        let near: Vec<f64> = NEAR_BINS
            .flat_map(|away| {
                let bins = [self.centre + away as f64, self.centre - away as f64];
                [widest + away, widest - away].into_iter().zip(bins)
            })
            .filter(|(_, bin)| (1.0..=last).contains(&bin.abs()))
            .map(|(place, bin)| {
                // All of the power at half the sampling rate is in one bin.
                let is_alone = bin == last;
                self.sums[place].norm_sqr() * if is_alone { 0.5 } else { 1.0 }
            })
            .collect();
        near.iter().sum::<f64>() / (near.len().max(1) * self.length) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directly from the definition, term by term.
    fn power(samples: &[f64], bin: f64) -> f64 {
        let turn = |i: usize| -TAU * (bin * i as f64 / samples.len() as f64).fract();
        let terms = samples.iter().enumerate();
        let sum: Complex64 = terms.map(|(i, x)| x * Complex64::cis(turn(i))).sum();
        let is_alone = 2.0 * bin == samples.len() as f64;
        sum.norm_sqr() / samples.len() as f64 * if is_alone { 0.5 } else { 1.0 }
    }

    #[test]
    fn bins_beside_a_line_are_those_of_a_transform_of_all() {
        let noise = |i: usize| ((i * i % 1009) as f64).sin() + 0.3 * ((i * i % 97) as f64).cos();
        for length in [300, 4096, 5001] {
            let samples: Vec<f64> = (0..length).map(noise).collect();
            for frequency in [0.01, 0.123, 0.495] {
                let mut bins = NearBins::new(TAU * frequency, length);
                for (place, piece) in samples.chunks(1000).enumerate() {
                    bins.add(1000 * place, piece);
                }
                let centre = frequency * length as f64;
                let near: Vec<f64> = NEAR_BINS
                    .flat_map(|away| [centre + away as f64, centre - away as f64])
                    .filter(|bin| (1.0..=0.5 * length as f64).contains(&bin.abs()))
                    .map(|bin| power(&samples, bin))
                    .collect();
                let want = near.iter().sum::<f64>() / near.len() as f64;
                let got = bins.variance();
                assert!(
                    (got / want - 1.0).abs() < 1e-7,
                    "{length} {frequency}: {got} {want}"
                );
            }
        }
    }
}
