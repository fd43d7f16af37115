//! What is known of channels whose samples are not all kept.

use torqcomp_dsp::quality::sums::SampleSums;

/// What all samples of a channel come to of which only the first were kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AllSamples {
    /// From the first to the last, in s, if that is known.
    pub duration_s: Option<f64>,
    /// Their number, range, mean and spread.
    pub sums: SampleSums,
}
