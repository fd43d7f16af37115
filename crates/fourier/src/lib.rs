//! Fourier transforms of real records.
//!
//! `X[k] = Σ x[n] e^{−2πi kn/N}` for `k = 0..=N/2` and its inverse, unscaled: a round trip multiplies by `N`.
//!
//! The planner of `rustfft` is generic, so every crate that uses it recompiles all of its kernels: 0.4 million lines of
//! LLVM code. This crate is the only one to use it.

use std::sync::Arc;

use realfft::RealFftPlanner;
pub use realfft::{ComplexToReal, RealToComplex};

/// The forward transform for records of one length, from samples to `length / 2 + 1` bins.
///
/// ```
/// // A cosine of one period in 8 samples: 8/2 in bin 1, nothing elsewhere.
/// let mut samples: Vec<f64> = (0..8).map(|n| (std::f64::consts::TAU * f64::from(n) / 8.0).cos()).collect();
/// let transform = torqcomp_fourier::forward(8);
/// let mut bins = transform.make_output_vec();
/// transform.process(&mut samples, &mut bins).unwrap();
/// let magnitudes: Vec<f64> = bins.iter().map(|bin| bin.norm().round()).collect();
/// assert_eq!(magnitudes, [0.0, 4.0, 0.0, 0.0, 0.0]);
/// ```
#[inline(never)]
#[must_use]
pub fn forward(length: usize) -> Arc<dyn RealToComplex<f64>> {
    RealFftPlanner::new().plan_fft_forward(length)
}

/// The inverse transform, from `length / 2 + 1` bins to samples multiplied by `length`.
#[inline(never)]
#[must_use]
pub fn inverse(length: usize) -> Arc<dyn ComplexToReal<f64>> {
    RealFftPlanner::new().plan_fft_inverse(length)
}
