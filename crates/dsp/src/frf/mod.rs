//! Frequency response functions from blocks of an applied and a measured signal.
//!
//! Blocks are segments of noise, periods of a periodic signal, or hits. Each keeps its spectra, so that a response can
//! be estimated from some blocks and validated on the others.
//!
//! Estimators and bounds: J. S. Bendat, A. G. Piersol, Random Data, 4th ed., 2010, chapters 6 and 9.

mod blocks;
mod hits;
mod limits;

use num_complex::Complex64;

pub use blocks::{Periodic, Window, average_periods, find_period, lines_of, segments, transform};
pub use hits::{Hit, HitFault, Stroke, find_hits, near_half_rate, noise_share, stroke_of};

/// Spectra of one block, at multiples of the frequency step, from 0 to the Nyquist frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Of the applied signal.
    pub applied: Vec<Complex64>,
    /// Of the measured signal.
    pub measured: Vec<Complex64>,
}

/// Estimator of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// S_xy/S_xx: noise in the measured signal does not bias it.
    H1,
    /// S_yy/S_yx: noise in the applied signal does not bias it.
    H2,
    /// Total least squares, noise of equal power in both: between H1 and H2.
    Hv,
}

/// Auto- and cross-power summed over blocks; all estimates follow from them.
#[derive(Debug, Clone, PartialEq)]
pub struct Powers {
    /// S_xx, S_yy and S_xy at each line.
    sums: Vec<(f64, f64, Complex64)>,
    blocks: usize,
}

impl Powers {
    /// Powers of the blocks at a range of lines.
    #[must_use]
    pub fn of<'a>(blocks: impl Iterator<Item = &'a Block>, lines: std::ops::Range<usize>) -> Self {
        let mut all = Self {
            sums: Vec::new(),
            blocks: 0,
        };
        for block in blocks {
            let range = lines.start..lines.end.min(block.applied.len());
            all.sums.resize(range.len(), (0.0, 0.0, Complex64::ZERO));
            let pairs = block.applied[range.clone()]
                .iter()
                .zip(&block.measured[range]);
            for (sum, (x, y)) in all.sums.iter_mut().zip(pairs) {
                sum.0 += x.norm_sqr();
                sum.1 += y.norm_sqr();
                sum.2 += x.conj() * y;
            }
            all.blocks += 1;
        }
        all
    }

    /// Powers of the remaining blocks, `some` being the powers of a subset.
    #[must_use]
    pub fn without(&self, some: &Self) -> Self {
        let pairs = self.sums.iter().zip(&some.sums);
        Self {
            sums: pairs
                // Avoids negative power due to rounding.
                .map(|(all, some)| {
                    let powers = ((all.0 - some.0).max(0.0), (all.1 - some.1).max(0.0));
                    (powers.0, powers.1, all.2 - some.2)
                })
                .collect(),
            blocks: self.blocks.saturating_sub(some.blocks),
        }
    }

    /// The estimated response.
    #[must_use]
    pub fn response(&self, estimator: Estimator) -> Frf {
        let n = self.blocks.max(1) as f64;
        let sums = self.sums.iter();
        Frf {
            response: sums.clone().map(|s| estimate(s, estimator)).collect(),
            coherence: sums
                .clone()
                .map(|(xx, yy, xy)| coherence(*xx, *yy, *xy))
                .collect(),
            applied_power: sums.map(|(xx, ..)| xx / n).collect(),
            blocks: self.blocks,
        }
    }
}

/// A response with its coherence.
#[derive(Debug, Clone, PartialEq)]
pub struct Frf {
    /// Response at each line.
    pub response: Vec<Complex64>,
    /// Ordinary coherence at each line, 0 to 1; always 1 for a single block.
    pub coherence: Vec<f64>,
    /// Power of the applied signal at each line.
    pub applied_power: Vec<f64>,
    /// Blocks that were averaged.
    pub blocks: usize,
}

impl Frf {
    /// The response of these blocks.
    ///
    /// ```
    /// use num_complex::Complex64;
    /// use torqcomp_dsp::frf::{Block, Estimator, Frf};
    /// let line = |x: f64, y: f64| Block { applied: vec![Complex64::new(x, 0.0)], measured: vec![Complex64::new(y, 0.0)] };
    /// // y = 2x without noise: all estimators agree.
    /// let blocks = [line(1.0, 2.0), line(-3.0, -6.0)];
    /// for estimator in [Estimator::H1, Estimator::H2, Estimator::Hv] {
    ///     let frf = Frf::of(blocks.iter(), estimator);
    ///     assert!((frf.response[0].re - 2.0).abs() < 1e-12 && (frf.coherence[0] - 1.0).abs() < 1e-12);
    /// }
    /// ```
    #[must_use]
    pub fn of<'a>(blocks: impl Iterator<Item = &'a Block>, estimator: Estimator) -> Self {
        Self::between(blocks, estimator, 0..usize::MAX)
    }

    /// The response at a range of lines, indexed from its start.
    #[must_use]
    pub fn between<'a>(
        blocks: impl Iterator<Item = &'a Block>,
        estimator: Estimator,
        lines: std::ops::Range<usize>,
    ) -> Self {
        Powers::of(blocks, lines).response(estimator)
    }

    /// Relative standard uncertainty of the magnitude, and standard uncertainty of the phase in rad, at
    /// a line: `√((1 − γ²)/(2 n γ²))`, Bendat & Piersol (9.90), (9.91). `None` for a single block.
    #[must_use]
    pub fn relative_std(&self, line: usize) -> Option<f64> {
        let coherence = self.coherence[line];
        (self.blocks > 1 && coherence > 0.0)
            .then(|| ((1.0 - coherence) / (2.0 * self.blocks as f64 * coherence)).sqrt())
    }
}

fn coherence(xx: f64, yy: f64, xy: Complex64) -> f64 {
    let size = xx * yy;
    if size > 0.0 {
        (xy.norm_sqr() / size).min(1.0)
    } else {
        0.0
    }
}

fn estimate(&(xx, yy, xy): &(f64, f64, Complex64), estimator: Estimator) -> Complex64 {
    match estimator {
        _ if xx == 0.0 => Complex64::ZERO,
        Estimator::H1 => xy / xx,
        Estimator::H2 if xy.norm_sqr() == 0.0 => Complex64::ZERO,
        Estimator::H2 => yy / xy.conj(),
        Estimator::Hv => {
            // The eigenvector of [[xx, xy*], [xy, yy]] with the larger eigenvalue, after scaling both signals to
            // equal power, as their units differ.
            let scale = (yy / xx).sqrt();
            if scale == 0.0 || xy.norm() == 0.0 {
                return Complex64::ZERO;
            }
            // With equal powers the eigenvector is (1, e^{j arg}), so that Hv is the geometric mean.
            scale * xy / xy.norm()
        }
    }
}

/// RMS of `measured − response·applied` relative to that of `measured`, between two lines.
#[must_use]
pub fn prediction_error(
    response: &[Complex64],
    block: &Block,
    lines: std::ops::Range<usize>,
) -> f64 {
    let (mut left, mut all) = (0.0, 0.0);
    for (k, h) in lines.clone().zip(response) {
        left += (block.measured[k] - h * block.applied[k]).norm_sqr();
        all += block.measured[k].norm_sqr();
    }
    if all > 0.0 { (left / all).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(state: &mut u64) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            *state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (*state >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }

    /// One line, many blocks: y = 2j x + noise, recorded x + noise.
    fn blocks(count: usize, in_x: f64, in_y: f64) -> Vec<Block> {
        let mut state = 7;
        let mut draw = move |size: f64| Complex64::new(noise(&mut state), noise(&mut state)) * size;
        (0..count)
            .map(|_| {
                let x = draw(1.0);
                let y = Complex64::new(0.0, 2.0) * x + draw(in_y);
                Block {
                    applied: vec![x + draw(in_x)],
                    measured: vec![y],
                }
            })
            .collect()
    }

    #[test]
    fn each_estimator_is_free_of_its_own_noise() {
        let want = Complex64::new(0.0, 2.0);
        let output = blocks(4000, 0.0, 1.0);
        let h1 = Frf::of(output.iter(), Estimator::H1);
        assert!((h1.response[0] - want).norm() < 0.06, "{}", h1.response[0]);
        // γ² = 4/(4 + 1).
        assert!((h1.coherence[0] - 0.8).abs() < 0.02, "{}", h1.coherence[0]);
        assert!(Frf::of(output.iter(), Estimator::H2).response[0].norm() > 2.4);
        let input = blocks(4000, 0.5, 0.0);
        let h2 = Frf::of(input.iter(), Estimator::H2);
        assert!((h2.response[0] - want).norm() < 0.06, "{}", h2.response[0]);
        assert!(Frf::of(input.iter(), Estimator::H1).response[0].norm() < 1.7);
        let both = blocks(4000, 0.3, 0.6);
        let hv = Frf::of(both.iter(), Estimator::Hv);
        assert!((hv.response[0] - want).norm() < 0.06, "{}", hv.response[0]);
    }

    #[test]
    fn bounds_cover_what_they_say() {
        let all = blocks(6400, 0.0, 1.0);
        let (mut squares, mut said) = (0.0, 0.0);
        for part in all.chunks(32) {
            let frf = Frf::of(part.iter(), Estimator::H1);
            squares += (frf.response[0].norm() / 2.0 - 1.0).powi(2);
            said += frf.relative_std(0).unwrap();
        }
        let (spread, said) = ((squares / 200.0).sqrt(), said / 200.0);
        assert!((spread / said - 1.0).abs() < 0.15, "{spread} {said}");
        assert_eq!(
            Frf::of(all[..1].iter(), Estimator::H1).relative_std(0),
            None
        );
    }
}
