//! What the checks of a fit look at: a record, and the fundamental and orders of its components.

use torqcomp_dsp::harmonics::{Fundamental, Harmonics, fit};
use torqcomp_dsp::store::SampleStore;

use crate::recording::UniformRecord;

/// A record of a shaft that turns, and the orders that are fitted to it.
#[derive(Clone, Copy)]
pub(super) struct Rotation<'a> {
    pub record: &'a UniformRecord,
    pub fundamental_hz: f64,
    pub orders: &'a [f64],
}

impl Rotation<'_> {
    /// Number of samples of the record.
    pub fn count(&self) -> usize {
        self.record.samples.count()
    }

    /// The first samples of the record, up to a number of them.
    pub fn first(&self, most: usize) -> Option<Vec<f64>> {
        let end = self.count().min(most);
        self.record.samples.part(0..end).ok()
    }

    /// The samples of a window; `place` of `count` windows of a length that are evenly spread over the record.
    pub fn window(&self, (place, count): (usize, usize), length: usize) -> Option<Vec<f64>> {
        let start = place * (self.count() - length) / (count - 1);
        self.record.samples.part(start..start + length).ok()
    }

    /// The orders at a fundamental, fitted to some samples.
    pub fn fitted(&self, samples: &[f64], fundamental_hz: f64) -> Option<Harmonics> {
        let fundamental = Fundamental::given(fundamental_hz);
        fit(samples, self.record.rate_hz, 0.0, fundamental, self.orders).ok()
    }

    /// The lowest order, at most 1.
    pub fn lowest(&self) -> f64 {
        self.orders.iter().copied().fold(1.0, f64::min)
    }
}
