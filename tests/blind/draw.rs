//! Random numbers, reproducible on every machine.

use std::f64::consts::TAU;

use chacha20::ChaCha8Rng;
use rand::{Rng, SeedableRng};

/// A stream of random numbers (ChaCha with eight rounds).
pub struct Draw(ChaCha8Rng);

impl Draw {
    /// The stream of a case, separated from its other streams by `purpose`.
    pub fn new(seed: u64, purpose: &str) -> Self {
        // FNV-1a of the purpose, for a separate stream per quantity.
        let hash = purpose
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
            });
        let mut bytes = [0; 32];
        bytes[..8].copy_from_slice(&seed.to_le_bytes());
        bytes[8..16].copy_from_slice(&hash.to_le_bytes());
        Self(ChaCha8Rng::from_seed(bytes))
    }

    /// Uniform between 0 and 1, exclusive.
    pub fn unit(&mut self) -> f64 {
        ((self.0.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Between two positive numbers, uniform in the logarithm.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        (self.between(low.ln(), high.ln())).exp()
    }

    /// A phase in rad.
    pub fn phase(&mut self) -> f64 {
        TAU * self.unit()
    }

    /// True with the given probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// 1 or −1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// One of several values.
    pub fn one_of<T: Copy>(&mut self, values: &[T]) -> T {
        let index = (self.unit() * values.len() as f64) as usize;
        values[index.min(values.len() - 1)]
    }

    /// Normally distributed, mean 0, standard deviation 1 (Box and Muller, 1958).
    pub fn normal(&mut self) -> f64 {
        (-2.0 * self.unit().ln()).sqrt() * (TAU * self.unit()).cos()
    }
}
