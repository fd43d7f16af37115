//! Signals for the tests of this module.

use std::f64::consts::TAU;

/// Seeded white noise of unit variance, nearly normal: sums of twelve uniform numbers.
pub fn noise(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..count)
        .map(|_| (0..12).map(|_| uniform()).sum())
        .collect()
}

/// A sine of this amplitude and number of samples per period.
pub fn sine(amplitude: f64, period: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| amplitude * (TAU * i as f64 / period + 0.3).sin())
        .collect()
}

/// Every value rounded to a multiple of a step.
pub fn rounded(values: &[f64], step: f64) -> Vec<f64> {
    values.iter().map(|x| (x / step).round() * step).collect()
}

/// The sum of two signals.
pub fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}
