//! Kinds of failure.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use super::{Failure, Fault};

/// Kind of a failure: a stable name, whatever the words of the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ErrorCode {
    /// There is no such verb or option.
    UnknownArgument,
    /// An argument that is needed is not given.
    MissingArgument,
    /// The value of an argument cannot be read or is out of its range.
    InvalidValue,
    /// Arguments exclude each other or do not apply here.
    ConflictingArguments,
    /// There is no such file or folder, or it contains nothing suitable.
    NotFound,
    /// The system refuses to read a file.
    CannotRead,
    /// The system refuses to write a file, or its format cannot store the result.
    CannotWrite,
    /// The disk is full.
    DiskFull,
    /// The output exists and may not be replaced without --force.
    OutputExists,
    /// The numbers need more memory or scratch space than available.
    NotEnoughRoom,
    /// The file is not a recording: neither a table of numbers over time nor an MCAP file with numbers.
    NotARecording,
    /// The text is ambiguous, and an option must resolve it.
    TextUnclear,
    /// The file contains several tables and must be split.
    SeveralTables,
    /// The file is damaged or ends too early.
    DamagedFile,
    /// There is no channel, topic or field of that name.
    ChannelNotFound,
    /// Several channels could be meant.
    ChannelUnclear,
    /// The unit is missing, unknown or has two meanings.
    UnitUnclear,
    /// The unit is known, but unsuitable here.
    UnitUnsuitable,
    /// The sampling rate or the time axis is unknown.
    TimeUnknown,
    /// Time stamps are not uniform: gaps, jitter, backward steps, or a clock that jumped.
    IrregularTime,
    /// The requested range contains no samples.
    RangeEmpty,
    /// A cell or sample is not a number, or cannot be a measurement.
    InvalidSample,
    /// The record is too short.
    TooFewSamples,
    /// The record is too long, or has too much in it, for this method.
    TooManySamples,
    /// Records or channels that belong together differ in rate, unit, length or content.
    RecordsDiffer,
    /// The channel is already compensated.
    AlreadyCompensated,
    /// The record does not show the required behaviour, or its channels are wrong.
    UnsuitableRecord,
    /// The data do not determine the requested quantity.
    NotIdentifiable,
    /// The stand file cannot be read, or it contradicts itself or the record.
    InvalidStand,
    /// The stand file lacks data needed here.
    IncompleteStand,
    /// Effects of the stand cannot be inverted, or not together.
    NotInvertible,
    /// Some of many recordings failed.
    RecordingsFailed,
    /// The manifests are not one finished job.
    ManifestsDiffer,
    /// A fault of torqcomp itself.
    InternalError,
}

impl ErrorCode {
    /// A failure of the work.
    pub fn failed(self, message: impl fmt::Display) -> Failure {
        Failure::Failed(Fault::new(self, message))
    }

    /// A wrong command line.
    pub fn usage(self, message: impl fmt::Display) -> Failure {
        Failure::Usage(Fault::new(self, message))
    }
}
