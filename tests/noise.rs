//! Reproducible noise.

use std::f64::consts::TAU;

/// A nonzero state.
pub struct Noise(pub u64);

impl Noise {
    /// Uniform between 0 and 1.
    pub fn uniform(&mut self) -> f64 {
        // xorshift64*, S. Vigna.
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Normal, of unit variance (G. E. P. Box, M. E. Muller, 1958).
    pub fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}
