//! Overlap-save convolution with the impulse response of an inverse filter.

use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_fourier::{ComplexToReal, RealToComplex};

use super::InverseFilter;
use crate::spectrum::PowerSum;

/// Shortest block: for shorter ones the overhead outside the transform dominates.
const SHORTEST_BLOCK: usize = 1 << 12;
/// Longest block chosen for speed; a longer filter still gets a longer block.
const LONGEST_BLOCK: usize = 1 << 17;

/// Overlap-save convolution for use in one thread.
///
/// A window of `n + 2P` samples gives `n` results, `P` being the filter's half-length.
pub struct BlockConvolver {
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
    /// Transform of the taps, already divided by the block length.
    kernel: Arc<[Complex64]>,
    half_length: usize,
    block: Vec<f64>,
    spectrum: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl BlockConvolver {
    /// Plans the transforms for a filter.
    ///
    /// ```
    /// use std::sync::Arc;
    /// use num_complex::Complex64;
    /// use torqcomp_dsp::{band::Band, compensate::{BlockConvolver, InverseFilter}};
    ///
    /// let band = Band::new(20_000.0, 2400.0)?;
    /// let filter = InverseFilter::design(Arc::new(|_| Complex64::new(2.0, 0.0)), band)?;
    /// let mut convolver = BlockConvolver::new(&filter);
    /// let window = vec![1.5; 10 + 2 * filter.half_length()];
    /// let mut out = vec![0.0; 10];
    /// convolver.convolve(&window, &mut out, None);
    /// assert!(out.iter().all(|y| (y - 3.0).abs() < 1e-13));
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    #[must_use]
    pub fn new(filter: &InverseFilter) -> Self {
        let length = block_length(filter.taps().len());
        let forward = torqcomp_fourier::forward(length);
        let backward = torqcomp_fourier::inverse(length);
        let mut taps = forward.make_input_vec();
        taps[..filter.taps().len()].copy_from_slice(filter.taps());
        let mut kernel = forward.make_output_vec();
        forward
            .process(&mut taps, &mut kernel)
            .expect("buffers were made for this length");
        let scale = 1.0 / length as f64;
        kernel.iter_mut().for_each(|bin| *bin *= scale);
        let scratch_length = forward.get_scratch_len().max(backward.get_scratch_len());
        Self {
            block: forward.make_input_vec(),
            spectrum: forward.make_output_vec(),
            scratch: vec![Complex64::ZERO; scratch_length],
            forward,
            backward,
            kernel: kernel.into(),
            half_length: filter.half_length(),
        }
    }

    /// Another convolver for the same filter, for use in another thread.
    #[must_use]
    pub fn another(&self) -> Self {
        Self {
            forward: self.forward.clone(),
            backward: self.backward.clone(),
            kernel: self.kernel.clone(),
            half_length: self.half_length,
            block: self.block.clone(),
            spectrum: self.spectrum.clone(),
            scratch: self.scratch.clone(),
        }
    }

    /// Length of the transforms, in samples.
    #[must_use]
    pub fn block_length(&self) -> usize {
        self.block.len()
    }

    /// Number of results per transform.
    #[must_use]
    pub fn step(&self) -> usize {
        self.block.len() - 2 * self.half_length
    }

    /// Convolves a window; `out` gets `window.len() - 2P` results.
    ///
    /// Adds the power spectrum of every block entirely inside the window to `power`, if given: the
    /// forward transforms are computed anyway.
    ///
    /// # Panics
    /// If the length of `out` is not `window.len() - 2P`.
    pub fn convolve(&mut self, window: &[f64], out: &mut [f64], mut power: Option<&mut PowerSum>) {
        assert_eq!(
            out.len() + 2 * self.half_length,
            window.len(),
            "a window carries the filter's half-length on both sides of its results"
        );
        let length = self.block.len();
        let step = self.step();
        for (results, start) in out.chunks_mut(step).zip((0..).step_by(step)) {
            let available = (window.len() - start).min(length);
            self.block[..available].copy_from_slice(&window[start..start + available]);
            self.block[available..].fill(0.0);
            self.forward
                .process_with_scratch(&mut self.block, &mut self.spectrum, &mut self.scratch)
                .expect("buffers were made for this length");
            if available == length
                && let Some(power) = power.as_deref_mut()
            {
                power.add_hann(&self.spectrum);
            }
            for (bin, gain) in self.spectrum.iter_mut().zip(self.kernel.iter()) {
                *bin *= gain;
            }
            // Both factors are real at these two bins; remove rounding errors.
            self.spectrum[0].im = 0.0;
            self.spectrum[length / 2].im = 0.0;
            self.backward
                .process_with_scratch(&mut self.spectrum, &mut self.block, &mut self.scratch)
                .expect("buffers were made for this length");
            let first = 2 * self.half_length;
            results.copy_from_slice(&self.block[first..first + results.len()]);
        }
    }
}

/// Block length with the least work per result, or a shorter one (which stays in cache) within 5 %
/// of that.
fn block_length(taps: usize) -> usize {
    let shortest = (2 * taps).next_power_of_two().max(SHORTEST_BLOCK);
    let work = |n: usize| n as f64 * (n as f64).log2() / (n - taps + 1) as f64;
    let candidates: Vec<usize> = std::iter::successors(Some(shortest), |n| Some(2 * n))
        .take_while(|n| *n <= LONGEST_BLOCK.max(shortest))
        .collect();
    let least = candidates
        .iter()
        .map(|n| work(*n))
        .fold(f64::INFINITY, f64::min);
    candidates
        .into_iter()
        .find(|n| work(*n) <= 1.05 * least)
        .unwrap_or(shortest)
}
