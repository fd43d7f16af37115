//! Channels too long to be kept: their first samples, and what all of them come to.

use super::report::InspectedChannel;
use crate::print::plural;
use crate::warning::Warning;

/// What all samples of a channel come to of which only the first were kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whole {
    /// Samples that were kept.
    pub kept: usize,
    /// Samples in all.
    pub samples: usize,
    /// From the first to the last, in s.
    pub duration_s: f64,
    /// Samples that are no finite numbers.
    pub non_finite: usize,
    /// Least and greatest.
    pub range: Option<(f64, f64)>,
    /// Mean.
    pub mean: Option<f64>,
    /// Standard deviation.
    pub std: Option<f64>,
}

/// Stamps as far as they were kept.
#[derive(Debug, Default)]
pub struct Stamps {
    /// The first, in ns since the clock's zero.
    pub first_ns: Option<i64>,
    /// Each, in s after the first.
    pub from_first_s: Vec<f64>,
}

/// The first samples of a channel that goes by, and sums over all.
#[derive(Debug, Default)]
pub struct Kept {
    most: usize,
    stamps: Stamps,
    samples: Vec<f64>,
    last_ns: i64,
    count: usize,
    finite: usize,
    low: f64,
    high: f64,
    mean: f64,
    /// Sum of the squared distances from the mean.
    squares: f64,
}

impl Kept {
    /// Keeps so many samples.
    pub fn new(most: usize) -> Self {
        Self {
            most,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            ..Self::default()
        }
    }

    /// Takes samples with their stamps in ns.
    pub fn add(&mut self, times_ns: &[i64], values: &[f64]) {
        let Some(last) = times_ns.last() else {
            return;
        };
        let first = *self.stamps.first_ns.get_or_insert(times_ns[0]);
        let room = self
            .most
            .saturating_sub(self.samples.len())
            .min(values.len());
        let from_first = |t: &i64| t.saturating_sub(first) as f64 * 1e-9;
        self.stamps
            .from_first_s
            .extend(times_ns[..room].iter().map(from_first));
        self.samples.extend_from_slice(&values[..room]);
        self.last_ns = *last;
        self.count += values.len();
        for value in values.iter().filter(|value| value.is_finite()) {
            self.sum(*value);
        }
    }

    /// Mean and squares without the loss of digits of a sum of squares: B. P. Welford, Technometrics 4
    /// (1962) 419.
    fn sum(&mut self, value: f64) {
        self.finite += 1;
        self.low = self.low.min(value);
        self.high = self.high.max(value);
        let before = value - self.mean;
        self.mean += before / self.finite as f64;
        self.squares += before * (value - self.mean);
    }

    /// Stamps and samples that were kept, and the sums if there were more.
    pub fn finish(self) -> (Stamps, Vec<f64>, Option<Whole>) {
        let first = self.stamps.first_ns.unwrap_or(self.last_ns);
        let some = self.finite > 0;
        let whole = Whole {
            kept: self.samples.len(),
            samples: self.count,
            duration_s: self.last_ns.saturating_sub(first) as f64 * 1e-9,
            non_finite: self.count - self.finite,
            range: some.then_some((self.low, self.high)),
            mean: some.then_some(self.mean),
            std: some.then(|| (self.squares / self.finite as f64).sqrt()),
        };
        let is_more = self.count > self.samples.len();
        (self.stamps, self.samples, is_more.then_some(whole))
    }
}

impl Whole {
    /// The description of what was kept, with what is known of all samples.
    pub fn describe(&self, kept: InspectedChannel) -> InspectedChannel {
        InspectedChannel {
            samples: self.samples,
            duration_s: Some(self.duration_s),
            smallest: self.range.map(|(low, _)| low),
            largest: self.range.map(|(_, high)| high),
            mean: self.mean,
            rms: self.std,
            non_finite: Some(self.non_finite),
            ..kept
        }
    }
}

/// The warning that only the first samples were looked at, if that is so of any channel.
pub fn warning(wholes: &[Option<Whole>]) -> Option<Warning> {
    let long: Vec<&Whole> = wholes.iter().flatten().collect();
    let longest = long.iter().max_by_key(|whole| whole.samples)?;
    Some(Warning::new(
        "first-samples-only",
        format!(
            "{} too long to be kept in memory: samples, duration, range, mean, rms and missing numbers are those of \
             all samples, all other checks cover the first ones ({} of {} in the longest)",
            plural(long.len(), "channel"),
            longest.kept,
            longest.samples
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_samples_come_to() {
        let values = [1.0, 2.0, f64::NAN, 3.0, 6.0];
        let times: Vec<i64> = (0..5).map(|i| 1_000_000_007 + i * 500_000_000).collect();
        let mut kept = Kept::new(2);
        kept.add(&times[..1], &values[..1]);
        kept.add(&times[1..], &values[1..]);
        let (stamps, samples, whole) = kept.finish();
        assert_eq!(
            (stamps.first_ns, samples),
            (Some(1_000_000_007), vec![1.0, 2.0])
        );
        assert_eq!(stamps.from_first_s, [0.0, 0.5]);
        let whole = whole.unwrap();
        assert_eq!((whole.kept, whole.samples, whole.non_finite), (2, 5, 1));
        assert_eq!((whole.duration_s, whole.range), (2.0, Some((1.0, 6.0))));
        // Mean of 1, 2, 3, 6 is 3; squared distances 4 + 1 + 0 + 9.
        assert_eq!((whole.mean, whole.std), (Some(3.0), Some(3.5_f64.sqrt())));
        assert!(
            warning(&[None, Some(whole)])
                .unwrap()
                .message
                .contains("2 of 5")
        );
        assert_eq!(warning(&[None]), None);
    }

    #[test]
    fn short_channels_are_kept_as_a_whole() {
        let mut kept = Kept::new(2);
        kept.add(&[5, 6], &[1.0, 2.0]);
        assert_eq!(kept.finish().2, None);
    }
}
