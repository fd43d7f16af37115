//! Runs of equal samples.

/// A run of equal consecutive samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Index of the first sample.
    pub start: usize,
    /// Number of samples.
    pub length: usize,
    /// Value of the samples.
    pub value: f64,
}

impl Run {
    /// Index after the last sample.
    #[must_use]
    pub fn end(&self) -> usize {
        self.start + self.length
    }
}

/// The runs of a record, from its first sample to its last; `NaN` is in none of them.
///
/// ```
/// use torqcomp_dsp::quality::runs;
/// let lengths: Vec<usize> = runs(&[1.0, 1.0, 2.0, f64::NAN, 2.0]).map(|r| r.length).collect();
/// assert_eq!(lengths, [2, 1, 1]);
/// ```
pub fn runs(samples: &[f64]) -> impl Iterator<Item = Run> + '_ {
    let mut start = 0;
    std::iter::from_fn(move || {
        while samples.get(start).is_some_and(|x| x.is_nan()) {
            start += 1;
        }
        let value = *samples.get(start)?;
        let rest = &samples[start..];
        let length = rest.iter().position(|x| *x != value).unwrap_or(rest.len());
        let run = Run {
            start,
            length,
            value,
        };
        start += length;
        Some(run)
    })
}

/// Longest run length distinguished; longer ones count as this.
const LONGEST: usize = 4096;

/// Distribution of the run lengths of a record.
#[derive(Debug, Clone)]
pub(super) struct Lengths {
    counts: Vec<usize>,
    total: usize,
}

impl Lengths {
    pub(super) fn of(runs: impl Iterator<Item = Run>) -> Self {
        // Only as long as the longest run, as tables of many short columns are processed as well.
        let mut counts = Vec::new();
        let mut total = 0;
        for run in runs {
            let length = run.length.min(LONGEST);
            if length >= counts.len() {
                counts.resize(length + 1, 0);
            }
            counts[length] += 1;
            total += 1;
        }
        Self { counts, total }
    }

    /// Number of runs.
    pub(super) fn total(&self) -> usize {
        self.total
    }

    /// Number of runs whose length satisfies a predicate.
    pub(super) fn count(&self, is: impl Fn(usize) -> bool) -> usize {
        let lengths = self.counts.iter().enumerate();
        lengths
            .filter(|(length, _)| is(*length))
            .map(|(_, count)| count)
            .sum()
    }

    /// Quantile of the run lengths; `None` if there are no runs.
    pub(super) fn quantile(&self, part: f64) -> Option<usize> {
        let wanted = (part * self.total as f64).ceil().max(1.0) as usize;
        let mut sum = 0;
        (0..self.counts.len()).find(|length| {
            sum += self.counts[*length];
            sum >= wanted
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_cover_all_numbers_and_nothing_else() {
        let nan = f64::NAN;
        let samples = [nan, 0.0, -0.0, 1.0, nan, nan, 1.0, 1.0, nan];
        let found: Vec<(usize, usize)> = runs(&samples).map(|r| (r.start, r.length)).collect();
        assert_eq!(found, [(1, 2), (3, 1), (6, 2)]);
        assert_eq!(runs(&[]).count(), 0);
        let lengths = Lengths::of(runs(&samples));
        assert_eq!((lengths.total(), lengths.count(|l| l > 1)), (3, 2));
        assert_eq!(lengths.quantile(0.3), Some(1));
        assert_eq!(lengths.quantile(0.95), Some(2));
        assert_eq!(Lengths::of(runs(&[])).quantile(0.5), None);
    }
}
