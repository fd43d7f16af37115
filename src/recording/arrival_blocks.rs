//! Stamps of samples that arrive in blocks, as over USB or a network, where each block is stamped on its arrival.

use torqcomp_decimal::digits;

/// Least number of samples in a block, and of blocks after the first one.
const FEWEST: usize = 4;
/// Steps within a block, and from one block to the next, relative to the mean step.
const WITHIN: f64 = 0.5;
const BETWEEN: f64 = 3.0;
/// Quantum of rounding, relative to the length of a block, that explains the blocks.
const ROUNDED: [f64; 2] = [0.5, 1.5];
/// Largest relative difference of a given rate from that of the blocks.
const SAME_RATE: f64 = 0.05;

/// Blocks of as many samples each, with stamps close together in a block, and far apart between blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ArrivalBlocks {
    /// Number of samples in a block.
    pub(crate) samples: usize,
    /// Mean time between samples, from block to block, in the unit of the stamps.
    pub(crate) step: f64,
}

impl ArrivalBlocks {
    /// Blocks in stamps, if all of these are in blocks, and rounding to a quantum (0 if it does not explain them) is not the
    /// reason.
    pub(crate) fn of(stamps: &[f64], quantum: f64) -> Option<Self> {
        let is_rounding = |blocks: &Self| {
            let length = blocks.samples as f64 * blocks.step;
            (ROUNDED[0] * length..ROUNDED[1] * length).contains(&quantum)
        };
        Self::of_all(stamps).filter(|blocks| !is_rounding(blocks))
    }

    fn of_all(stamps: &[f64]) -> Option<Self> {
        let span = stamps.last()? - stamps.first()?;
        let mean = span / (stamps.len() - 1) as f64;
        let is_jump = |pair: &[f64]| pair[1] - pair[0] > BETWEEN * mean;
        let steps = stamps.windows(2);
        let is_either = |pair: &[f64]| (0.0..WITHIN * mean).contains(&(pair[1] - pair[0]));
        if !steps.clone().all(|pair| is_jump(pair) || is_either(pair)) {
            return None;
        }
        let starts: Vec<usize> = (1..stamps.len())
            .filter(|i| is_jump(&stamps[i - 1..=*i]))
            .collect();
        let (first, last) = (*starts.first()?, *starts.last()?);
        let samples = starts.get(1)? - first;
        let is_even = starts.windows(2).all(|pair| pair[1] - pair[0] == samples);
        (is_even && samples >= FEWEST && starts.len() >= FEWEST).then(|| Self {
            samples,
            step: (stamps[last] - stamps[first]) / (last - first) as f64,
        })
    }

    /// Whether a rate, in samples per unit of the stamps, is that of the blocks.
    pub(crate) fn are_at(&self, rate: f64) -> bool {
        (rate * self.step - 1.0).abs() < SAME_RATE
    }

    /// Text about the blocks, and what to do; `of_seconds`: seconds per unit of the stamps.
    pub(crate) fn explain(&self, of_seconds: f64) -> String {
        format!(
            "the time stamps come in blocks of {} close together, as times of arrival over USB or a network: if the samples \
             are uniform, give their rate with --rate HZ (all blocks together: {} Hz); if the recorder paused between the \
             blocks, evaluate one of them with --range",
            self.samples,
            digits::text(1.0 / (self.step * of_seconds), 4)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_have_one_length() {
        let stamps = |length: &dyn Fn(usize) -> usize| {
            let block = |k: usize| (0..length(k)).map(move |i| 0.05 * k as f64 + 1e-5 * i as f64);
            (0..10).flat_map(block).collect::<Vec<f64>>()
        };
        let found = ArrivalBlocks::of(&stamps(&|_| 50), 0.0).unwrap();
        assert_eq!(found.samples, 50);
        assert!(found.are_at(1000.0) && !found.are_at(900.0));
        assert_eq!(ArrivalBlocks::of(&stamps(&|_| 50), 0.05), None);
        assert!(found.explain(1.0).contains("1000 Hz"));
        assert_eq!(ArrivalBlocks::of(&stamps(&|k| 50 + k % 2), 0.0), None);
        assert_eq!(
            ArrivalBlocks::of(&(0..100).map(f64::from).collect::<Vec<_>>(), 0.0),
            None
        );
    }
}
