//! What files hold and what is wrong with them.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::quality::mains::MainsLine;
use torqcomp_dsp::quality::steps::Event;

use crate::io::mcap::Inventory;
use crate::outcome::RecordFigures;
use crate::recording::Segment;
use crate::warning::Warning;

/// What recordings hold and what is wrong with them: one file itself, several in `files`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(into = "InspectDocument")]
#[schemars(from = "InspectDocument")]
pub(in crate::commands) struct InspectReport {
    /// One entry for each file, in the order given.
    pub(super) files: Vec<Inspected>,
    /// What comparing the files with each other shows.
    pub(super) warnings: Vec<ChannelWarning>,
}

/// A file, or why it could not be read.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Inspected {
    Read(Box<InspectedFile>),
    /// A file that cannot be read.
    Failed {
        /// Path of the recording.
        file: String,
        /// Why it cannot be read.
        error: String,
    },
}

/// A file.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct InspectedFile {
    /// Path of the recording.
    pub(super) file: String,
    /// `csv` for any text, `mcap`, `wav`, `uff` (universal file), `mat` (MATLAB 5), `tdms` (LabVIEW).
    pub(super) format: &'static str,
    /// How the recording is written.
    pub(super) dialect: String,
    /// Other entries in the header of the recording.
    pub(super) details: Vec<Detail>,
    /// Segments of the recording, if it has several.
    pub(super) segments: Vec<Segment>,
    /// The channels, in their order.
    pub(super) channels: Vec<InspectedChannel>,
    /// What is wrong with the recording.
    pub(super) warnings: Vec<ChannelWarning>,
    /// Whether declared or started data are missing.
    pub(super) data_lost: bool,
    /// Everything in an MCAP file: topics, encodings, attachments, metadata, chunks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) mcap: Option<Inventory>,
}

/// A pair of key and value out of a file's header.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct Detail {
    /// Name in the header of the recording.
    pub(super) key: String,
    /// Text beside the name.
    pub(super) value: String,
}

/// A warning and the channels that it is about.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct ChannelWarning {
    /// What is wrong.
    #[serde(flatten)]
    pub(super) warning: Warning,
    /// Names of the channels that the warning is about; none if it is about the file.
    pub(super) channels: Vec<String>,
}

/// A channel. `null` is what cannot be known.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub(super) struct InspectedChannel {
    /// Name without the unit.
    pub(super) name: String,
    /// Heading as written.
    pub(super) heading: String,
    /// Number of the segment, from 1; `null` if there is only one.
    pub(super) segment: Option<usize>,
    /// Unit as written, also that of the values of the channel; `null` if not given.
    pub(super) unit: Option<String>,
    /// Whether torqcomp knows the unit, so that values can be converted.
    pub(super) unit_known: bool,
    /// Number of samples, missing ones included.
    pub(super) samples: usize,
    /// Sampling rate, in Hz; `null` if unknown.
    pub(super) rate_hz: Option<f64>,
    /// Standard uncertainty of the rate by the time stamps, in Hz; `null` if the rate does not come from stamps.
    pub(super) rate_std_hz: Option<f64>,
    /// Where the rate comes from.
    pub(super) rate_from: String,
    /// Rate given in the header, used or not, in Hz.
    pub(super) header_rate_hz: Option<f64>,
    /// Time of the first sample on the file's own axis, in `start_unit`.
    pub(super) start: Option<f64>,
    /// Time of the first sample in ns since 1970; `null` if the clock does not count from then.
    pub(super) start_ns: Option<i64>,
    /// Unit of `start`: always s.
    pub(super) start_unit: &'static str,
    /// Date and time of the first sample, or those in the header: in ISO 8601 where unambiguous, otherwise as written.
    pub(super) start_time: Option<String>,
    /// Time from the first sample to the last, in s.
    pub(super) duration_s: Option<f64>,
    /// Assumption about the time axis.
    pub(super) assumed: Option<String>,
    /// Standard deviation of the steps between stamps, over the usual step; `null` without stamps.
    pub(super) jitter: Option<f64>,
    /// Largest deviation of such a step, over the usual step.
    pub(super) jitter_peak: Option<f64>,
    /// Rounding of the stamps, in s, where only that makes them uneven.
    pub(super) stamps_rounded_to_s: Option<f64>,
    /// Number of gaps in the stamps; `null` without stamps.
    pub(super) gaps: Option<usize>,
    /// Samples missing in the gaps.
    pub(super) missing_samples: Option<f64>,
    /// The first hundred gaps.
    pub(super) gap_list: Vec<Event>,
    /// Stamps equal to the previous one; `null` without stamps.
    pub(super) repeated_stamps: Option<usize>,
    /// Steps backwards in time; `null` without stamps.
    pub(super) backwards: Option<usize>,
    /// Forward jumps of the clock; `null` without stamps.
    pub(super) clock_jumps: Option<usize>,
    /// Smallest sample, in `unit`.
    pub(super) smallest: Option<f64>,
    /// Largest sample, in `unit`.
    pub(super) largest: Option<f64>,
    /// Mean of the samples, in `unit`.
    pub(super) mean: Option<f64>,
    /// Rms of the samples without their mean, in `unit`.
    pub(super) rms: Option<f64>,
    /// Fraction of samples that repeat the previous one; 1 for a constant channel.
    pub(super) repeated: Option<f64>,
    /// Whether that is more than the resolution explains; `null` if unknown.
    pub(super) repeated_unexplained: Option<bool>,
    /// Samples for which each value is held, if constant.
    pub(super) hold: Option<usize>,
    /// Samples at a value where the signal is clipped.
    pub(super) clipped: Option<usize>,
    /// Lowest value, if the signal is clipped at it, in `unit`.
    pub(super) clipped_low: Option<f64>,
    /// Highest value, if the signal is clipped at it, in `unit`.
    pub(super) clipped_high: Option<f64>,
    /// Samples in which the channel is stuck.
    pub(super) stuck: Option<usize>,
    /// Whether all samples are the same.
    pub(super) constant: Option<bool>,
    /// Samples that are missing or not finite.
    pub(super) non_finite: Option<usize>,
    /// Quantisation step, in `unit`; `null` if too fine to detect.
    pub(super) resolution: Option<f64>,
    /// Bits of the range in steps of `resolution`.
    pub(super) resolution_bits: Option<f64>,
    /// Lines at multiples of the mains frequency.
    pub(super) mains: Vec<MainsLine>,
}

/// The document: one file itself, or several.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum InspectDocument {
    One(Inspected),
    Several {
        /// The files, in the order given.
        files: Vec<Inspected>,
        /// What comparing the files with each other shows.
        warnings: Vec<ChannelWarning>,
    },
}

impl From<InspectReport> for InspectDocument {
    fn from(mut report: InspectReport) -> Self {
        match report.files.len() {
            1 => Self::One(report.files.remove(0)),
            _ => Self::Several {
                files: report.files,
                warnings: report.warnings,
            },
        }
    }
}

impl InspectReport {
    /// All warnings.
    pub(super) fn all_warnings(&self) -> impl Iterator<Item = &ChannelWarning> {
        let of_files = self.files.iter().flat_map(|entry| match entry {
            Inspected::Read(file) => file.warnings.as_slice(),
            Inspected::Failed { .. } => &[],
        });
        of_files.chain(&self.warnings)
    }

    /// Figures of the longest channel; those that have a unit only if there is no other channel.
    pub(super) fn figures(&self) -> RecordFigures {
        let [Inspected::Read(file)] = self.files.as_slice() else {
            return RecordFigures::default();
        };
        let longest = file.channels.iter().max_by_key(|c| c.samples);
        let only = match file.channels.as_slice() {
            [only] => Some(only),
            _ => None,
        };
        let peak = |c: &InspectedChannel| Some(c.largest?.max(-c.smallest?));
        RecordFigures {
            samples: longest.map(|c| c.samples),
            rate_hz: longest.and_then(|c| c.rate_hz),
            unit: only.and_then(|c| c.unit.clone()),
            rms: only.and_then(|c| c.rms),
            peak: only.and_then(peak),
            ..RecordFigures::default()
        }
    }

    /// Whether data of a file were lost.
    pub(super) fn is_lossy(&self) -> bool {
        let mut files = self.files.iter();
        files.any(|entry| matches!(entry, Inspected::Read(file) if file.data_lost))
    }
}
