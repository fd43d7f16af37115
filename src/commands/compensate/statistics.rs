//! Mean, rms and range of a result.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::quality::sums::SampleSums;

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
    /// Smallest and largest value away from both ends, where the result does not depend on extrapolation; `null` for a
    /// record without such a part.
    pub(super) inside: Option<Extremes>,
}

/// Smallest and largest value, in the unit of the result.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub(super) struct Extremes {
    /// Smallest value.
    pub(super) smallest: f64,
    /// Largest value.
    pub(super) largest: f64,
}

impl Statistics {
    /// Statistics of the samples times `scale`; zeros if there are none.
    fn of(sums: &SampleSums, scale: f64) -> Self {
        let (smallest, largest) = sums.range().unwrap_or_default();
        Self {
            mean: sums.mean().unwrap_or_default() * scale,
            rms: sums.std().unwrap_or_default() * scale.abs(),
            smallest: smallest * scale,
            largest: largest * scale,
            inside: None,
        }
    }

    /// Largest absolute value away from both ends, or of the whole record if there is no such part.
    pub(super) fn peak(&self) -> f64 {
        let Extremes { smallest, largest } = self.inside.unwrap_or(Extremes {
            smallest: self.smallest,
            largest: self.largest,
        });
        largest.max(-smallest)
    }
}

/// Sums of a result that comes in pieces, of all samples and of those away from both ends.
pub(super) struct ResultSums {
    /// Samples at either end that depend on extrapolation.
    edge: usize,
    /// Samples skipped at the start so far.
    skipped: usize,
    /// The last `edge` samples so far: the end, if no more come.
    last: Vec<f64>,
    all: SampleSums,
    inside: SampleSums,
}

impl ResultSums {
    pub(super) fn new(edge: usize) -> Self {
        Self {
            edge,
            skipped: 0,
            last: Vec::new(),
            all: SampleSums::default(),
            inside: SampleSums::default(),
        }
    }

    /// Takes the next samples with their sums.
    pub(super) fn push(&mut self, values: &[f64], sums: &SampleSums) {
        self.all.join(sums);
        let skipped = (self.edge - self.skipped).min(values.len());
        self.skipped += skipped;
        let values = &values[skipped..];
        let inside = (self.last.len() + values.len()).saturating_sub(self.edge);
        let before = inside.min(self.last.len());
        self.inside.join(&SampleSums::of(&self.last[..before]));
        self.last.drain(..before);
        let (inside, last) = values.split_at(inside - before);
        self.inside.join(&SampleSums::of(inside));
        self.last.extend(last);
    }

    /// Statistics of the samples times `scale`.
    pub(super) fn statistics(&self, scale: f64) -> Statistics {
        let inside = self.inside.range();
        Statistics {
            inside: inside.map(|(smallest, largest)| Extremes {
                smallest: smallest * scale,
                largest: largest * scale,
            }),
            ..Statistics::of(&self.all, scale)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_left_out_however_the_record_is_cut() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        for size in [1, 3, 7, 50, 100] {
            let mut sums = ResultSums::new(5);
            let pieces = values.chunks(size);
            pieces.for_each(|piece| sums.push(piece, &SampleSums::of(piece)));
            let found = sums.statistics(2.0);
            assert_eq!((found.smallest, found.largest), (0.0, 198.0));
            let inside = Extremes {
                smallest: 10.0,
                largest: 188.0,
            };
            assert_eq!(
                (found.inside, found.peak()),
                (Some(inside), 188.0),
                "{size}"
            );
        }
        let mut short = ResultSums::new(50);
        short.push(&values, &SampleSums::of(&values));
        assert_eq!(short.statistics(1.0).inside, None);
        assert_eq!(short.statistics(1.0).peak(), 99.0);
    }
}
