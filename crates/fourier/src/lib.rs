//! Fourier transforms of real records, and sums of products.
//!
//! `X[k] = Σ x[n] e^{−2πi kn/N}` for `k = 0..=N/2` and its inverse, unscaled: a round trip multiplies by `N`.
//!
//! The planner of `rustfft` is generic, so every crate that uses it recompiles all of its kernels: 0.4 million lines of
//! LLVM code. This crate is the only one to use it.

mod dot;
mod plans;

use std::sync::Arc;

use realfft::num_complex::Complex64;
pub use realfft::{ComplexToReal, RealToComplex};

pub use dot::{dot, rms};

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
    plans::with_planner(length, |planner| planner.plan_fft_forward(length))
}

/// The inverse transform, from `length / 2 + 1` bins to samples multiplied by `length`.
#[inline(never)]
#[must_use]
pub fn inverse(length: usize) -> Arc<dyn ComplexToReal<f64>> {
    plans::with_planner(length, |planner| planner.plan_fft_inverse(length))
}

/// Samples after which a rotating phasor is computed anew, which limits its rounding error.
const TURNS: usize = 4096;

/// `e^{iφn}` for `n = first, first + 1, …`, to about 1e-12 beside the rounding of `φn`.
///
/// ```
/// // A quarter of a turn per sample: i, −1, −i, 1.
/// let quarter: Vec<f64> = torqcomp_fourier::phasors(0.25 * std::f64::consts::TAU, 1).map(|z| z.im.round()).take(4).collect();
/// assert_eq!(quarter, [1.0, 0.0, -1.0, 0.0]);
/// ```
pub fn phasors(step_rad: f64, first: usize) -> impl Iterator<Item = Complex64> {
    let turn = Complex64::from_polar(1.0, step_rad);
    let mut phasor = Complex64::ONE;
    (0..).map(move |k: usize| {
        phasor = match k.is_multiple_of(TURNS) {
            true => Complex64::from_polar(1.0, step_rad * (first + k) as f64),
            false => phasor * turn,
        };
        phasor
    })
}
