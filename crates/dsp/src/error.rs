//! What can go wrong when a record is processed.

use thiserror::Error;

/// Errors of the signal functions in this crate.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A rate, frequency or length that must be positive and finite is not.
    #[error("{name} is {value}, expected a positive finite number")]
    NotPositive {
        /// Which quantity.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// The sampling rate cannot carry the requested band.
    #[error(
        "at a rate of {sample_rate_hz} Hz the record contains frequencies below {nyquist_hz} Hz, but the requested \
         band ends at {band_hz} Hz: record at a higher rate, or request a band of at most {highest_band_hz} Hz"
    )]
    RateTooLow {
        /// Rate of the record.
        sample_rate_hz: f64,
        /// Half the rate.
        nyquist_hz: f64,
        /// The band that was asked for.
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
        /// Where it happened.
        frequency_hz: f64,
    },
    /// The inverse filter would have to be longer than is sensible.
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
        /// The band that was asked for.
        band_hz: f64,
        /// Rate of the record.
        sample_rate_hz: f64,
    },
    /// The record has too few samples for what was asked.
    #[error("the record has {got} samples, {what} needs at least {expected}: use a longer record")]
    TooShort {
        /// What needed more.
        what: &'static str,
        /// Samples needed.
        expected: usize,
        /// Samples at hand.
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
    /// Two component frequencies are too close for the length of the record.
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
        /// Length that would do.
        needed_s: f64,
    },
    /// A component lies at or above half the sampling rate.
    #[error(
        "a component at {frequency_hz} Hz cannot be observed at a rate of {sample_rate_hz} Hz: request orders below \
         {nyquist_hz} Hz"
    )]
    AboveNyquist {
        /// The component.
        frequency_hz: f64,
        /// Rate of the record.
        sample_rate_hz: f64,
        /// Half of it.
        nyquist_hz: f64,
    },
    /// No frequency near the given one fits the record.
    #[error(
        "the fundamental could not be refined from {start_hz} Hz: {why}; give it more precisely, or do not refine it"
    )]
    NotRefined {
        /// Where the search began.
        start_hz: f64,
        /// What went wrong.
        why: &'static str,
    },
    /// Samples that were kept can no longer be read.
    #[error("the samples cannot be read again: {why}")]
    Unreadable {
        /// What went wrong.
        why: String,
    },
    /// A gap in the time stamps is too long to be bridged.
    #[error(
        "a gap of {gap_s} s, {steps} steps long, ends at {time_s} s: too long to interpolate; split the record there"
    )]
    GapTooLong {
        /// Stamp after the gap.
        time_s: f64,
        /// Length of the gap.
        gap_s: f64,
        /// The same in steps of the grid.
        steps: f64,
    },
    /// Time stamps that do not increase cannot be resampled.
    #[error("time stamp {index} ({time_s} s) is not later than the previous one ({previous_s} s)")]
    TimeNotIncreasing {
        /// Index of the later stamp.
        index: usize,
        /// The later stamp.
        time_s: f64,
        /// The stamp before it.
        previous_s: f64,
    },
}
