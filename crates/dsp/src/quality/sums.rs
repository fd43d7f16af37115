//! Running statistics of a stream: number, range, mean and standard deviation.

/// Statistics of samples that are not kept.
///
/// Mean and squares without cancellation, sample by sample (B. P. Welford, Technometrics 4 (1962) 419) or of pieces joined
/// afterwards (T. F. Chan, G. H. Golub and R. J. LeVeque, The American Statistician 37 (1983) 242).
///
/// ```
/// use torqcomp_dsp::quality::sums::SampleSums;
/// let mut sums = SampleSums::default();
/// [1.0, 2.0, f64::NAN, 3.0, 6.0].map(|sample| sums.add(sample));
/// assert_eq!((sums.samples, sums.non_finite()), (5, 1));
/// assert_eq!((sums.range(), sums.mean()), (Some((1.0, 6.0)), Some(3.0)));
/// // Squared distances from the mean of 3: 4 + 1 + 0 + 9.
/// assert_eq!(sums.std(), Some(3.5_f64.sqrt()));
/// // The same in two pieces.
/// let mut pieces = SampleSums::of(&[1.0, 2.0]);
/// pieces.join(&SampleSums::of(&[f64::NAN, 3.0, 6.0]));
/// assert_eq!(pieces, sums);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleSums {
    /// Number of samples.
    pub samples: usize,
    finite: usize,
    low: f64,
    high: f64,
    mean: f64,
    /// Sum of squared deviations from the mean.
    squares: f64,
}

impl Default for SampleSums {
    fn default() -> Self {
        Self {
            samples: 0,
            finite: 0,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            mean: 0.0,
            squares: 0.0,
        }
    }
}

/// Sums at a time: independent ones, which a processor adds in parallel.
const LANES: usize = 8;

/// A value folded from all samples, from that of the empty piece on.
#[inline(always)]
fn in_lanes(
    samples: &[f64],
    empty: f64,
    fold: impl Fn(f64, f64) -> f64,
    join: impl Fn(f64, f64) -> f64,
) -> f64 {
    let (groups, rest) = samples.as_chunks::<LANES>();
    let mut lanes = [empty; LANES];
    for group in groups {
        for (lane, sample) in lanes.iter_mut().zip(group) {
            *lane = fold(*lane, *sample);
        }
    }
    let all = lanes.into_iter().fold(empty, join);
    rest.iter().fold(all, |all, sample| fold(all, *sample))
}

impl SampleSums {
    /// Statistics of a piece, which is passed several times.
    #[must_use]
    pub fn of(samples: &[f64]) -> Self {
        let add = |a: f64, b: f64| a + b;
        let sum = in_lanes(samples, 0.0, add, add);
        if samples.is_empty() || !sum.is_finite() {
            let mut sums = Self::default();
            samples.iter().for_each(|sample| sums.add(*sample));
            return sums;
        }
        let mean = sum / samples.len() as f64;
        let squared = |all: f64, sample: f64| all + (sample - mean) * (sample - mean);
        Self {
            samples: samples.len(),
            finite: samples.len(),
            low: in_lanes(samples, f64::INFINITY, f64::min, f64::min),
            high: in_lanes(samples, f64::NEG_INFINITY, f64::max, f64::max),
            mean,
            squares: in_lanes(samples, 0.0, squared, add),
        }
    }

    /// Adds the samples of another piece.
    pub fn join(&mut self, other: &Self) {
        self.samples += other.samples;
        let (before, more) = (self.finite as f64, other.finite as f64);
        if other.finite > 0 {
            let apart = other.mean - self.mean;
            self.mean += apart * more / (before + more);
            self.squares += other.squares + apart * apart * before * more / (before + more);
        }
        self.finite += other.finite;
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    /// Adds a sample.
    pub fn add(&mut self, sample: f64) {
        self.samples += 1;
        if !sample.is_finite() {
            return;
        }
        self.finite += 1;
        self.low = self.low.min(sample);
        self.high = self.high.max(sample);
        let before = sample - self.mean;
        self.mean += before / self.finite as f64;
        self.squares += before * (sample - self.mean);
    }

    /// Number of non-finite samples.
    #[must_use]
    pub fn non_finite(&self) -> usize {
        self.samples - self.finite
    }

    /// Smallest and largest finite sample.
    #[must_use]
    pub fn range(&self) -> Option<(f64, f64)> {
        (self.finite > 0).then_some((self.low, self.high))
    }

    /// Mean of the finite samples.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        (self.finite > 0).then_some(self.mean)
    }

    /// Standard deviation of the finite samples.
    #[must_use]
    pub fn std(&self) -> Option<f64> {
        (self.finite > 0).then(|| (self.squares / self.finite as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn is_near(a: Option<f64>, b: Option<f64>) -> bool {
        let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
        (a - b).abs() <= 1e-9 * (a.abs() + b.abs() + 1.0)
    }

    proptest! {
        #[test]
        fn pieces_give_what_single_samples_give(
            samples in prop::collection::vec(prop_oneof![20 => 1e3..1e3 + 1.0, 1 => Just(f64::NAN)], 0..200),
            size in 1_usize..60,
        ) {
            let (mut single, mut pieces) = (SampleSums::default(), SampleSums::default());
            samples.iter().for_each(|sample| single.add(*sample));
            samples.chunks(size).for_each(|piece| pieces.join(&SampleSums::of(piece)));
            prop_assert_eq!((single.samples, single.non_finite()), (pieces.samples, pieces.non_finite()));
            prop_assert_eq!(single.range(), pieces.range());
            prop_assert!(is_near(single.mean(), pieces.mean()) && is_near(single.std(), pieces.std()));
        }
    }
}
