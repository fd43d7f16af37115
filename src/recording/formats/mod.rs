//! Recordings other than text tables and MCAP, recognised by their first bytes: one file per format.
//!
//! Each reader converts a file sequentially into channels with names, units, rates and samples. To add one, write its
//! file and a line in `FORMATS`.

mod bag;
mod bytes;
mod matlab;
mod tdms;
mod universal;
mod wave;

use std::io::Read;
use std::sync::Arc;

use self::bytes::Bytes;
use super::text::is_time_name;
use super::{Channel, Hole, HoleKind, Recording, TimeAxis};
use crate::failure::{ErrorCode, Failure};
use crate::io::{ChannelChoice, Reading, names_compensated};
use crate::print::some_of;
use crate::unit::{NamedUnit, OF_FULL_SCALE};
use crate::warning::{Warning, WarningCode};

/// Maximum number of channels listed in a warning.
const NAMED: usize = 10;

/// Warning about channels that were left out, each with the reason.
fn names_left_out(left_out: &[String]) -> Option<Warning> {
    let names = some_of(left_out, left_out.len(), NAMED);
    let message = format!("left out: {names}");
    (!left_out.is_empty()).then(|| WarningCode::LeftOut.warning(message))
}

/// A format.
pub(crate) struct Format {
    /// As in the key `format` of a report.
    name: &'static str,
    /// Name for messages, with an article: `a WAV file`.
    called: &'static str,
    /// Whether a file with these first bytes has this format.
    is: fn(&[u8]) -> bool,
    /// Accepted options in addition to those of any recording.
    takes: &'static [&'static str],
    read: fn(&mut Bytes, &Reading) -> Result<Content, Failure>,
}

/// All formats.
const FORMATS: [&Format; 5] = [
    &wave::WAVE,
    &universal::UNIVERSAL,
    &matlab::MATLAB,
    &tdms::TDMS,
    &bag::BAG,
];

/// The format of a file with these first bytes, if it is one of these.
pub(crate) fn of(head: &[u8]) -> Option<&'static Format> {
    FORMATS.into_iter().find(|format| (format.is)(head))
}

/// Whether a file with these first bytes is a readable recording, rather than one rejected with advice.
pub(crate) fn is_recording(head: &[u8]) -> bool {
    of(head).is_some_and(|format| format.name != bag::BAG.name)
}

/// Rejects a unit for fractions of full scale, as it does not define the scale.
///
/// # Errors
/// If a unit is given.
pub(super) fn refuse_unit_of_fraction(
    channel: &Channel,
    choice: &ChannelChoice,
) -> Result<(), Failure> {
    if channel.unit_text.as_deref() != Some(OF_FULL_SCALE) {
        return Ok(());
    }
    let (Some(unit), Some(flag)) = (&choice.unit, choice.flags.unit) else {
        return Ok(());
    };
    Err(ErrorCode::ConflictingArguments.usage(format_args!(
        "the samples are fractions of full scale, so {flag} {unit} alone does not define them; give full scale \
         with its unit, as --full-scale \"10 {unit}\""
    )))
}

/// Content of a file.
#[derive(Default)]
struct Content {
    /// Description of the encoding, for messages.
    dialect: String,
    /// Further header entries, as pairs of key and value.
    details: Vec<(String, String)>,
    channels: Vec<Channel>,
    warnings: Vec<Warning>,
    /// Announced but missing data.
    lost: Option<Warning>,
}

impl Format {
    /// Reads a file; `source` is its name for messages.
    ///
    /// # Errors
    /// If it cannot be read, or contains no channel.
    pub(super) fn read(
        &self,
        source: &str,
        bytes: Box<dyn Read + Send>,
        reading: &Reading,
    ) -> Result<Recording, Failure> {
        self.refuse_others(reading)?;
        let content = (self.read)(&mut Bytes::new(bytes), reading);
        let content = content.map_err(|failure| failure.at(source))?;
        if content.channels.is_empty() {
            let why = content.warnings.iter().chain(&content.lost);
            let why: String = why.map(|w| format!(": {}", w.message)).collect();
            return Err(ErrorCode::NotARecording.failed(format_args!(
                "there is no channel with samples over time{why}; export one, if need be as text with a time column"
            ))
            .at(source));
        }
        Ok(Recording {
            dialect: content.dialect,
            details: content.details,
            channels: content.channels,
            warnings: content.warnings,
            lost: content.lost,
            ..Recording::empty(self.name, source.to_owned())
        })
    }

    /// Rejects options for other formats.
    fn refuse_others(&self, reading: &Reading) -> Result<(), Failure> {
        let given = [
            ("--delimiter", reading.dialect.delimiter.is_some()),
            ("--decimal", reading.dialect.decimal.is_some()),
            ("--time-column", reading.time_column.is_some()),
            ("--time-unit", reading.time_unit.is_some()),
            ("--full-scale", reading.full_scale.is_some()),
        ];
        let others = given.map(|(flag, is_given)| (flag, is_given && !self.takes.contains(&flag)));
        super::refuse(&others, &format!("the input is {}", self.called))
    }
}

/// A channel of these formats.
fn channel(name: &str, unit_text: Option<&str>, samples: Vec<f64>, axis: TimeAxis) -> Channel {
    let mut samples = samples;
    let mut holes = Vec::new();
    for (index, sample) in samples.iter_mut().enumerate() {
        if !sample.is_finite() {
            *sample = f64::NAN;
            holes.push(Hole {
                index,
                line: 0,
                what: HoleKind::NonFinite,
            });
        }
    }
    let unit_text = unit_text.map(str::trim).filter(|text| !text.is_empty());
    Channel {
        name: name.to_owned(),
        heading: name.to_owned(),
        unit: unit_text.and_then(NamedUnit::parse),
        unit_text: unit_text.map(str::to_owned),
        samples,
        holes,
        axis,
        is_compensated: names_compensated(name),
        ..Channel::default()
    }
}

/// The axis of stamps in seconds, if all are finite.
fn stamped(heading: &str, stamps_s: Vec<f64>) -> TimeAxis {
    let mut axis = TimeAxis::of_stamps(heading, Arc::new(stamps_s));
    let stamps = axis.stamps_s.iter().flat_map(|stamps| stamps.iter());
    let holes = stamps.enumerate().filter(|(_, stamp)| !stamp.is_finite());
    axis.holes = holes
        .map(|(index, _)| Hole {
            index,
            line: 0,
            what: HoleKind::NonFinite,
        })
        .collect();
    axis
}

/// A stated rate, if it is plausible for a clock.
fn plausible_rate(rate_hz: f64) -> Option<f64> {
    (1e-12..=1e15).contains(&rate_hz).then_some(rate_hz)
}

/// Warning about a file that ends before its announced length.
fn cut(what: &str) -> Warning {
    WarningCode::FileCut.warning(format!(
        "the file ends early: {what}; copy it again if the original is longer"
    ))
}

/// Failure for a file with inconsistent content.
fn damaged(what: impl std::fmt::Display, at: u64) -> Failure {
    ErrorCode::DamagedFile
        .failed(format_args!("{what}; copy or export the file again"))
        .with(|place| place.byte = Some(at))
}
