//! Errors of signal processing.

use thiserror::Error;

/// Errors of the signal functions in this crate.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A rate, frequency or length that must be positive and finite is not.
    #[error("{name} is {value}, expected a positive finite number")]
    NotPositive {
        /// Name of the quantity.
        name: &'static str,
        /// The value.
        value: f64,
    },
    /// The sampling rate is too low for the requested band.
    #[error(
        "at a rate of {sample_rate_hz} Hz the record contains frequencies below {nyquist_hz} Hz, but the requested \
         band ends at {band_hz} Hz: record at a higher rate, or request a band of at most {highest_band_hz} Hz"
    )]
    RateTooLow {
        /// Rate of the record.
        sample_rate_hz: f64,
        /// Nyquist frequency.
        nyquist_hz: f64,
        /// The requested band.
        band_hz: f64,
        /// The highest band that this rate allows.
        highest_band_hz: f64,
    },
    /// The stand's inverse response is infinite or undefined at a frequency inside the band.
    #[error(
        "the inverse response is not finite at {frequency_hz} Hz: the stand passes nothing there, \
         so nothing can be recovered; end the band below it"
    )]
    InverseNotFinite {
        /// The frequency.
        frequency_hz: f64,
    },
    /// The inverse filter would be too long.
    #[error(
        "the inverse filter does not decay within {samples} samples ({seconds} s): the band of {band_hz} Hz is very \
         narrow for a rate of {sample_rate_hz} Hz, or the inverse response rings or grows too steeply; try another \
         band"
    )]
    FilterTooLong {
        /// Longest length tried, in samples.
        samples: usize,
        /// The same in seconds.
        seconds: f64,
        /// The requested band.
        band_hz: f64,
        /// Rate of the record.
        sample_rate_hz: f64,
    },
    /// Too few samples.
    #[error("the record has {got} samples, {what} needs at least {expected}: use a longer record")]
    TooShort {
        /// What needs more samples.
        what: &'static str,
        /// Samples needed.
        expected: usize,
        /// Samples available.
        got: usize,
    },
    /// A sample is NaN or infinite.
    #[error("sample {index} is {value}: remove or repair it before processing")]
    NonFinite {
        /// Index of the sample, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// Two components that cannot be resolved within the length of the record.
    #[error(
        "components {first_hz} Hz and {second_hz} Hz cannot be resolved in {seconds} s: record at least {needed_s} s, \
         or request fewer orders"
    )]
    NotSeparable {
        /// Lower frequency.
        first_hz: f64,
        /// Higher frequency.
        second_hz: f64,
        /// Length of the record.
        seconds: f64,
        /// Required length of the record.
        needed_s: f64,
    },
    /// A component at or above the Nyquist frequency.
    #[error(
        "a component at {frequency_hz} Hz cannot be observed at a rate of {sample_rate_hz} Hz: request orders below \
         {nyquist_hz} Hz"
    )]
    AboveNyquist {
        /// Frequency of the component.
        frequency_hz: f64,
        /// Rate of the record.
        sample_rate_hz: f64,
        /// Nyquist frequency.
        nyquist_hz: f64,
    },
    /// No frequency near the given one fits the record.
    #[error(
        "the fundamental could not be refined from {start_hz} Hz: {why}; give it more precisely, or do not refine it"
    )]
    NotRefined {
        /// Start frequency of the search.
        start_hz: f64,
        /// The reason.
        why: &'static str,
    },
    /// Stored samples can no longer be read.
    #[error("the samples cannot be read again: {why}")]
    Unreadable {
        /// The reason.
        why: String,
    },
    /// A gap in the time stamps is too long to interpolate.
    #[error(
        "a gap of {gap_s} s, {steps} steps long, ends at {time_s} s: too long to interpolate; split the record there"
    )]
    GapTooLong {
        /// Stamp after the gap.
        time_s: f64,
        /// Length of the gap.
        gap_s: f64,
        /// Length in steps of the grid.
        steps: f64,
    },
    /// Time stamps that are not increasing.
    #[error("time stamp {index} ({time_s} s) is not later than the previous one ({previous_s} s)")]
    TimeNotIncreasing {
        /// Index of the later stamp.
        index: usize,
        /// The later stamp.
        time_s: f64,
        /// The preceding stamp.
        previous_s: f64,
    },
}
