//! Channels too long to be kept: their first samples, and statistics of all.

use torqcomp_dsp::quality::sums::SampleSums;

use super::report::InspectedChannel;
use crate::print::plural;
use crate::recording::{AllSamples, Channel};
use crate::warning::{Warning, WarningCode};

/// Time stamps as far as kept.
#[derive(Debug, Default)]
pub struct Stamps {
    /// The first, in ns since the clock's zero.
    pub first_ns: Option<i64>,
    /// Each, in s after the first.
    pub from_first_s: Vec<f64>,
}

/// The first samples of a channel read as a stream, and sums over all.
#[derive(Debug, Default)]
pub struct Kept {
    most: usize,
    stamps: Stamps,
    samples: Vec<f64>,
    last_ns: i64,
    sums: SampleSums,
}

impl Kept {
    /// Keeps the given number of samples.
    pub fn new(most: usize) -> Self {
        Self {
            most,
            ..Self::default()
        }
    }

    /// Takes samples with their time stamps in ns.
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
        values.iter().for_each(|value| self.sums.add(*value));
    }

    /// The time stamps and samples kept, and the sums if there were more.
    pub fn finish(self) -> (Stamps, Vec<f64>, Option<AllSamples>) {
        let first = self.stamps.first_ns.unwrap_or(self.last_ns);
        let all = AllSamples {
            duration_s: Some(self.last_ns.saturating_sub(first) as f64 * 1e-9),
            sums: self.sums,
        };
        let is_more = self.sums.samples > self.samples.len();
        (self.stamps, self.samples, is_more.then_some(all))
    }
}

/// Description of the kept part of a channel, with the statistics of all samples.
pub fn describe(all: &AllSamples, kept: InspectedChannel) -> InspectedChannel {
    InspectedChannel {
        samples: all.sums.samples,
        duration_s: all.duration_s,
        smallest: all.sums.range().map(|(low, _)| low),
        largest: all.sums.range().map(|(_, high)| high),
        mean: all.sums.mean(),
        rms: all.sums.std(),
        non_finite: Some(all.sums.non_finite()),
        ..kept
    }
}

/// The warning that only the first samples were checked, if this applies to any channel.
pub fn warning(channels: &[Channel], all: &[Option<AllSamples>]) -> Option<Warning> {
    let long = channels.iter().zip(all);
    let long: Vec<(usize, usize)> = long
        .filter_map(|(kept, all)| Some((kept.samples.len(), all.as_ref()?.sums.samples)))
        .collect();
    let (kept, samples) = long.iter().max_by_key(|(_, samples)| *samples)?;
    Some(WarningCode::FirstSamplesOnly.warning(format!(
        "{} too long to be kept in memory: samples, duration, range, mean, rms and missing numbers are those of \
         all samples; all other checks cover the first ones ({kept} of {samples} in the longest)",
        plural(long.len(), "channel"),
    )))
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
        assert_eq!((whole.sums.samples, whole.duration_s), (5, Some(2.0)));
        // Mean of 1, 2, 3, 6 is 3.
        assert_eq!(
            describe(&whole, InspectedChannel::default()).mean,
            Some(3.0)
        );
    }

    #[test]
    fn short_channels_are_kept_as_a_whole() {
        let mut kept = Kept::new(2);
        kept.add(&[5, 6], &[1.0, 2.0]);
        assert_eq!(kept.finish().2, None);
    }
}
