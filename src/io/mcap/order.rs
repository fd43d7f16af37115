//! Sorting of samples by time.

use std::collections::VecDeque;

/// Number of samples held back for sorting.
pub const WINDOW: usize = 1 << 16;

/// A sorting window for samples: one that is at most [`WINDOW`] samples late is put in its place.
/// Records of up to that many samples are sorted completely.
#[derive(Debug, Default)]
pub struct Sorter {
    held: VecDeque<(i64, f64)>,
    /// Time of the last sample output.
    given: Option<i64>,
    /// Latest time seen.
    latest: Option<i64>,
    /// Number of samples that came after a later one.
    pub out_of_order: u64,
    /// Number of samples dropped because they came too late to be sorted.
    pub too_late: u64,
    run: LateRun,
    /// Latest time before the times started again, and the first one after that.
    pub restart: Option<[i64; 2]>,
}

/// Number of successive late samples, each with earlier ones before and after it, from which the times have started again:
/// samples that only arrived late fill a gap.
const RESTART: usize = 50;

/// Successive late samples.
#[derive(Debug, Default)]
struct LateRun {
    /// Latest time before them.
    latest_ns: i64,
    first_ns: i64,
    /// Index after that of the last one.
    next: usize,
    /// Number of them beyond earlier samples that follow the preceding one.
    crossed: usize,
}

impl Sorter {
    /// Takes a sample.
    #[inline]
    pub fn push(&mut self, time_ns: i64, value: f64) {
        match self.latest {
            Some(latest) if time_ns < latest => self.push_late(time_ns, value),
            _ => {
                self.latest = Some(time_ns);
                self.held.push_back((time_ns, value));
            }
        }
    }

    fn push_late(&mut self, time_ns: i64, value: f64) {
        self.out_of_order += 1;
        if self.given.is_some_and(|given| time_ns < given) {
            self.too_late += 1;
            return;
        }
        // After all of the same time, to preserve the order of the file.
        let place = self.held.partition_point(|(held, _)| *held <= time_ns);
        self.held.insert(place, (time_ns, value));
        let latest_ns = self.latest.unwrap_or(time_ns);
        if self.run.latest_ns != latest_ns || self.run.crossed == 0 && place < self.run.next {
            self.run = LateRun {
                latest_ns,
                first_ns: time_ns,
                ..LateRun::default()
            };
        }
        let run = &mut self.run;
        run.crossed += usize::from(place > run.next);
        run.next = place + 1;
        if run.crossed == RESTART {
            self.restart.get_or_insert([latest_ns, run.first_ns]);
        }
    }

    /// Outputs the samples that need not be held back any more, or all at the end.
    pub fn give(&mut self, all: bool, times_ns: &mut Vec<i64>, values: &mut Vec<f64>) {
        let keep = if all { 0 } else { WINDOW };
        let count = self.held.len().saturating_sub(keep);
        times_ns.reserve(count);
        values.reserve(count);
        for (time_ns, value) in self.held.drain(..count) {
            times_ns.push(time_ns);
            values.push(value);
            self.given = Some(time_ns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(samples: &[(i64, f64)]) -> (Vec<i64>, Vec<f64>, Sorter) {
        let mut sorter = Sorter::default();
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for (time, value) in samples {
            sorter.push(*time, *value);
            sorter.give(false, &mut times, &mut values);
        }
        sorter.give(true, &mut times, &mut values);
        (times, values, sorter)
    }

    #[test]
    fn few_samples_are_sorted_as_a_whole() {
        let (times, values, sorter) = sorted(&[(3, 0.3), (1, 0.1), (2, 0.2), (1, 0.11), (5, 0.5)]);
        assert_eq!(times, [1, 1, 2, 3, 5]);
        assert_eq!(values, [0.1, 0.11, 0.2, 0.3, 0.5]);
        assert_eq!((sorter.out_of_order, sorter.too_late), (3, 0));
    }

    #[test]
    fn times_that_start_again_are_not_a_late_block() {
        let run = |from: i64, to: i64| (from..to).map(|i| (i, 0.0)).collect::<Vec<_>>();
        let again = [run(0, 200), run(100, 300)].concat();
        assert_eq!(sorted(&again).2.restart, Some([199, 100]));
        let late = [run(0, 100), run(200, 300), run(100, 200)].concat();
        assert_eq!(sorted(&late).2.restart, None);
    }

    #[test]
    fn a_sample_later_than_the_window_is_left_out_and_counted() {
        let mut samples: Vec<_> = (0..100_000).map(|i| (i, i as f64)).collect();
        samples.push((99_000, -1.0));
        samples.push((10, -2.0));
        let (times, values, sorter) = sorted(&samples);
        assert_eq!(times.len(), 100_001);
        assert!(times.is_sorted());
        assert_eq!(values[99_001], -1.0);
        assert_eq!((sorter.out_of_order, sorter.too_late), (2, 1));
    }
}
