//! Mean, rms and range of a result.

use schemars::JsonSchema;
use serde::Serialize;

/// A result in figures, in its unit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub(super) struct Statistics {
    /// Mean, in the unit of the result.
    pub(super) mean: f64,
    /// Root mean square about the mean, in the unit of the result.
    pub(super) rms: f64,
    /// Smallest value, in the unit of the result.
    pub(super) smallest: f64,
    /// Largest value, in the unit of the result.
    pub(super) largest: f64,
}

/// Sums and extremes of samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sums {
    count: f64,
    sum: f64,
    square: f64,
    smallest: f64,
    largest: f64,
}

impl Sums {
    pub(super) fn of(values: &[f64]) -> Self {
        // Several independent sums, which a processor can add in parallel.
        const SIDE_BY_SIDE: usize = 8;
        let (groups, rest) = values.as_chunks::<SIDE_BY_SIDE>();
        let mut parts = [Self::NONE; SIDE_BY_SIDE];
        for group in groups {
            for (part, value) in parts.iter_mut().zip(group) {
                part.take(*value);
            }
        }
        let mut all = Self::NONE;
        for part in &parts {
            all.join(part);
        }
        rest.iter().for_each(|value| all.take(*value));
        all.count = values.len() as f64;
        all
    }

    pub(super) const NONE: Self = Self {
        count: 0.0,
        sum: 0.0,
        square: 0.0,
        smallest: f64::INFINITY,
        largest: f64::NEG_INFINITY,
    };

    #[inline(always)]
    fn take(&mut self, value: f64) {
        self.sum += value;
        self.square += value * value;
        self.smallest = self.smallest.min(value);
        self.largest = self.largest.max(value);
    }

    pub(super) fn join(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.square += other.square;
        self.smallest = self.smallest.min(other.smallest);
        self.largest = self.largest.max(other.largest);
    }

    /// Statistics of the samples times `scale`.
    pub(super) fn statistics(self, scale: f64) -> Statistics {
        let mean = self.sum / self.count;
        Statistics {
            mean: mean * scale,
            rms: (self.square / self.count - mean * mean).max(0.0).sqrt() * scale.abs(),
            smallest: self.smallest * scale,
            largest: self.largest * scale,
        }
    }
}
