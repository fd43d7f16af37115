//! What a recorder stored: its channels, each with its own samples, unit and time axis.
//!
//! Whatever the format and dialect of a file, this is what comes out of it. Nothing is repaired:
//! samples and stamps are as read, cells that hold no number are `NaN` and listed with their lines.

mod axis;
mod messages;
mod part;
mod select;
pub mod text;

use serde::Serialize;

use crate::failure::Failure;
use crate::io::Input;
use crate::io::csv::{NamedUnit, Options};
use crate::warning::Warning;

pub use axis::{Axis, RateFrom, typical_step};
pub use select::Selection;

/// A file's content.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name of the file, for people.
    pub source: String,
    /// `csv` for any text, `mcap`.
    pub format: &'static str,
    /// How it is written, for people: `LabVIEW LVM, tab-separated, decimal point, 3 segments`.
    pub dialect: String,
    /// What the head of the file says besides, as pairs of key and value.
    pub details: Vec<(String, String)>,
    /// All channels, in the order of the file; of several segments, those of the first one first.
    pub channels: Vec<Channel>,
    /// The segments, if the file has more than one.
    pub segments: Vec<Segment>,
    /// What a user should know about how it was read.
    pub warnings: Vec<Warning>,
    /// What was announced or begun, but is not there.
    pub lost: Option<Warning>,
}

impl Recording {
    /// Nothing yet, of a format.
    #[must_use]
    pub fn empty(format: &'static str, source: String) -> Self {
        Self {
            source,
            format,
            dialect: String::new(),
            details: Vec::new(),
            channels: Vec::new(),
            segments: Vec::new(),
            warnings: Vec::new(),
            lost: None,
        }
    }
}

/// A part of a file that was recorded on its own: after a trigger, or after a pause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Segment {
    /// Its name, for people: `segment 2`.
    pub name: String,
    /// Its start after that of the first segment, in seconds, if the file says.
    pub start_s: Option<f64>,
    /// Its date and time as written.
    #[serde(rename = "start_time")]
    pub start_text: Option<String>,
}

/// One channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Its name, without the unit.
    pub name: String,
    /// Its heading as written, or `column N`.
    pub heading: String,
    /// Its unit, if it is known to torqcomp.
    pub unit: Option<NamedUnit>,
    /// Its unit as written, known or not.
    pub unit_text: Option<String>,
    /// Samples as written; `NaN` where there was no number.
    pub samples: Vec<f64>,
    /// The cells that held no number, in order.
    pub holes: Vec<Hole>,
    /// How its samples lie in time.
    pub axis: Axis,
    /// The segment it belongs to, from 0, if there are several.
    pub segment: Option<usize>,
}

/// A cell among the samples that holds no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hole {
    /// Its place among the samples, from 0.
    pub index: usize,
    /// Its line in the file, from 1 (0 where there are no lines).
    pub line: usize,
    /// What stands there.
    pub what: HoleKind,
}

/// What stands in place of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HoleKind {
    /// The row ends before the cell.
    Missing,
    /// Nothing.
    Empty,
    /// NaN, infinity, overflow.
    NonFinite,
    /// A text.
    Text,
}

/// Reads a recording of any format and dialect as a whole into memory: the text, and eight bytes for
/// each number in it. Of an MCAP file that is the signal that the options name as their channel, or the
/// only one.
///
/// # Errors
/// If the file cannot be read, is no recording, or leaves open how it is to be read.
pub fn read(place: &Input, options: &Options) -> Result<Recording, Failure> {
    read_channels(place, std::slice::from_ref(options))
}

/// The same, for several channels: all of a text, and of an MCAP file the signals that are named, such as
/// `/joint_states.effort[0]`. How a text is read is told by the first of the options.
///
/// # Errors
/// See [`read`].
pub fn read_channels(place: &Input, wanted: &[Options]) -> Result<Recording, Failure> {
    let name = place.name();
    let options = wanted.first().cloned().unwrap_or_default();
    if place.is_mcap()? {
        refuse_for_messages(&options)?;
        let signals: Vec<Option<&str>> = wanted.iter().map(|o| o.channel.as_deref()).collect();
        return messages::read(place, &signals);
    }
    let (bytes, _) = part::first(place, u64::MAX)?;
    text::read(&name, bytes, &options).map_err(|failure| failure.at(&name))
}

/// Reads a text as [`read`] does, but no more than so many bytes of it, in whole lines; what was left out
/// is among the warnings.
///
/// # Errors
/// See [`read`].
pub fn read_first(place: &Input, options: &Options, most: u64) -> Result<Recording, Failure> {
    let name = place.name();
    let (bytes, left_out) = part::first(place, most)?;
    let mut recording = text::read(&name, bytes, options).map_err(|failure| failure.at(&name))?;
    recording.warnings.extend(left_out);
    Ok(recording)
}

/// Refuses what only tables have.
fn refuse_for_messages(options: &Options) -> Result<(), Failure> {
    let told = [
        ("--time-column", options.time_column.is_some()),
        ("--time-unit", options.time_unit.is_some()),
        ("--delimiter", options.told.delimiter.is_some()),
        ("--decimal", options.told.decimal.is_some()),
    ];
    match told.iter().find(|(_, is_told)| *is_told) {
        Some((flag, _)) => Err(Failure::usage(format_args!(
            "{flag} does not apply: the input is an MCAP file, whose messages have time stamps; choose \
             a signal as /joint_states.effort[0]"
        ))),
        None => Ok(()),
    }
}
