//! Running statistics of a stream: number, range, mean and standard deviation.

/// Statistics of samples that are not kept.
///
/// Mean and squares without cancellation: B. P. Welford, Technometrics 4 (1962) 419.
///
/// ```
/// use torqcomp_dsp::quality::sums::SampleSums;
/// let mut sums = SampleSums::default();
/// [1.0, 2.0, f64::NAN, 3.0, 6.0].map(|sample| sums.add(sample));
/// assert_eq!((sums.samples, sums.non_finite()), (5, 1));
/// assert_eq!((sums.range(), sums.mean()), (Some((1.0, 6.0)), Some(3.0)));
/// // Squared distances from the mean of 3: 4 + 1 + 0 + 9.
/// assert_eq!(sums.std(), Some(3.5_f64.sqrt()));
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

impl SampleSums {
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
