//! Statistics of channels whose samples are not all kept.

use torqcomp_dsp::quality::sums::SampleSums;

/// Statistics of all samples of a channel of which only the first were kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AllSamples {
    /// Duration from the first to the last sample in s, if known.
    pub duration_s: Option<f64>,
    /// Number, range, mean and standard deviation.
    pub sums: SampleSums,
}
