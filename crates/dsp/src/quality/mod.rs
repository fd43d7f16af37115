//! Faults of a recording that its samples and time stamps show by themselves.
//!
//! Each file has one criterion, with its assumptions and its false-alarm rate on good data. All take plain slices;
//! `NaN` belongs to no run, level or line.
//!
//! | fault | where |
//! |---|---|
//! | jitter, gaps, time running backwards, repeated stamps, clock jumps | [`steps`](mod@steps) |
//! | rounded stamps | [`rounding`], with missing samples [`broken_line`] |
//! | a stated rate that contradicts the stamps | [`rate`] |
//! | non-finite cells | [`finite`] |
//! | clipping | [`clipping`](mod@clipping), under noise [`pile_up`](mod@pile_up), of a decay before a filter [`flat_tops`](mod@flat_tops) |
//! | a stuck channel | [`stuck`] |
//! | isolated outliers | [`spikes`](mod@spikes) |
//! | the last three in a stream | [`streamed`] |
//! | straight lines between samples | [`interpolated`](mod@interpolated) |
//! | two signals in turn | [`interleaved`](mod@interleaved) |
//! | repeated samples | [`repeats`](mod@repeats) |
//! | coarse resolution | [`quantisation`](mod@quantisation) |
//! | mains hum | [`mains`](mod@mains) |
//! | a resonance or damping other than the declared one | [`resonance`] |
//! | free decays far from the declared modes | [`ringing`] |
//! | number, range, mean and standard deviation of a stream | [`sums`] |
//! | channels that are copies of each other | [`copies`](mod@copies) |

pub mod broken_line;
pub mod clipping;
pub mod copies;
pub mod finite;
pub mod flat_tops;
pub mod interleaved;
pub mod interpolated;
pub mod mains;
pub mod pile_up;
pub mod quantisation;
pub mod rate;
pub mod repeats;
pub mod resonance;
pub mod ringing;
pub mod rounding;
mod runs;
pub mod spikes;
pub mod steps;
pub mod streamed;
pub mod stuck;
pub mod sums;
#[cfg(test)]
mod testing;

pub use runs::{Run, runs};

/// Smallest and largest finite sample; `None` if there is none.
///
/// ```
/// use torqcomp_dsp::quality::range;
/// assert_eq!(range(&[2.0, f64::NAN, -1.0]), Some((-1.0, 2.0)));
/// assert_eq!(range(&[f64::NAN]), None);
/// ```
#[must_use]
pub fn range(samples: &[f64]) -> Option<(f64, f64)> {
    let (low, high) = samples
        .iter()
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(*x), high.max(*x))
        });
    (low <= high).then_some((low, high))
}

/// Relative distance from a straight line within which a channel counts as one.
const STRAIGHT: f64 = 1e-3;

/// Whether all samples lie within a thousandth of the range of the line through the first and the
/// last: a counter, a time axis, a constant. False if any sample is NaN.
///
/// ```
/// use torqcomp_dsp::quality::is_straight;
/// assert!(is_straight(&[1.0, 3.0, 5.0, 7.0]));
/// assert!(!is_straight(&[1.0, 3.0, 4.0, 7.0]));
/// ```
#[must_use]
pub fn is_straight(samples: &[f64]) -> bool {
    let (Some((low, high)), [first, .., last]) = (range(samples), samples) else {
        return false;
    };
    let near = STRAIGHT * (high - low);
    let slope = (last - first) / (samples.len() - 1) as f64;
    let mut samples = samples.iter().enumerate();
    samples.all(|(i, x)| (x - first - slope * i as f64).abs() <= near)
}

/// Number of blocks examined in a long record, and samples of each.
const BLOCKS: usize = 32;
const BLOCK_LENGTH: usize = 4096;

/// All samples, or evenly spread blocks of a long record.
fn excerpts(samples: &[f64]) -> Vec<&[f64]> {
    if samples.len() <= BLOCKS * BLOCK_LENGTH {
        return vec![samples];
    }
    let last = samples.len() - BLOCK_LENGTH;
    (0..BLOCKS)
        .map(|i| last / (BLOCKS - 1) * i)
        .map(|start| &samples[start..start + BLOCK_LENGTH])
        .collect()
}

/// Median of a set (the upper one of two); `None` if it is empty.
///
/// ```
/// assert_eq!(torqcomp_dsp::quality::median(&mut [3.0, 1.0, 9.0, 2.0]), Some(3.0));
/// assert_eq!(torqcomp_dsp::quality::median(&mut []), None);
/// ```
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
