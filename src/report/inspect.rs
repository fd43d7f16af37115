//! The report of `inspect`: what a file holds and what is wrong with it.

use serde::Serialize;

use crate::io::mcap::Inventory;
use crate::print::{columns, rounded, short};

/// Schema of the JSON document.
pub const SCHEMA: &str = "torqcomp.inspect/1";
/// Lines of the head that are shown, and characters of each.
const MOST_DETAILS: usize = 12;
const LINE_WIDTH: usize = 100;
/// Characters of a unit that the table shows.
const UNIT_WIDTH: usize = 24;
/// Characters of a name that the table shows.
const NAME_WIDTH: usize = 44;

/// Everything that was found in the files.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// One entry for each file, in the order given.
    pub files: Vec<Entry>,
    /// What comparing the files with each other shows.
    pub warnings: Vec<Said>,
}

/// A file that was read, or why it was not.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Entry {
    /// It was read.
    Read(Box<File>),
    /// It could not be read.
    Failed {
        /// The file.
        file: String,
        /// Why.
        error: String,
    },
}

/// A file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct File {
    /// Name of the file.
    pub file: String,
    /// `csv` for any text, `mcap`.
    pub format: &'static str,
    /// How it is written.
    pub dialect: String,
    /// What its head says besides.
    pub details: Vec<Detail>,
    /// Its parts, if it has several.
    pub segments: Vec<Segment>,
    /// Its channels, in their order.
    pub channels: Vec<Channel>,
    /// What is wrong with it.
    pub warnings: Vec<Said>,
    /// Whether something that was announced or begun is not there.
    pub data_lost: bool,
    /// Everything in an MCAP file: topics, encodings, attachments, metadata, chunks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mcap: Option<Inventory>,
}

/// A pair of key and value out of a file's head.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Detail {
    /// Key.
    pub key: String,
    /// Value.
    pub value: String,
}

/// A part of a file that was recorded on its own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Segment {
    /// Its name.
    pub name: String,
    /// Start after the first one.
    pub start_s: Option<f64>,
    /// Date and time of its start, as written.
    pub start_time: Option<String>,
}

/// A warning and the channels that it is about.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Said {
    /// Stable code.
    pub code: &'static str,
    /// For people.
    pub message: String,
    /// Names of the channels; none if it is about the file.
    pub channels: Vec<String>,
}

/// A channel. `null` is what cannot be known.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Channel {
    /// Name without the unit.
    pub name: String,
    /// Heading as written.
    pub heading: String,
    /// Number of the segment, from 1, if there are several.
    pub segment: Option<usize>,
    /// Unit as written; that of the values below.
    pub unit: Option<String>,
    /// Whether torqcomp knows the unit, so that values can be converted.
    pub unit_known: bool,
    /// Number of samples, missing ones included.
    pub samples: usize,
    /// Sampling rate.
    pub rate_hz: Option<f64>,
    /// Where the rate comes from.
    pub rate_from: String,
    /// Rate that the head of the file gives, used or not.
    pub header_rate_hz: Option<f64>,
    /// Time of the first sample on the file's own axis, in `start_unit`.
    pub start: Option<f64>,
    /// Unit of `start`: always s.
    pub start_unit: &'static str,
    /// Date and time of the first sample, as written.
    pub start_time: Option<String>,
    /// From the first sample to the last.
    pub duration_s: Option<f64>,
    /// What was taken for granted about the time axis.
    pub assumed: Option<String>,
    /// Standard deviation of the steps between stamps, over the usual step; `null` without stamps.
    pub jitter: Option<f64>,
    /// Largest deviation of such a step, over the usual step.
    pub jitter_peak: Option<f64>,
    /// Multiples that the stamps are rounded to, where that alone makes them uneven.
    pub stamps_rounded_to_s: Option<f64>,
    /// Number of gaps in the stamps; `null` without stamps.
    pub gaps: Option<usize>,
    /// Samples that the gaps leave out.
    pub missing_samples: Option<f64>,
    /// The first hundred gaps.
    pub gap_list: Vec<Gap>,
    /// Stamps equal to the one before; `null` without stamps.
    pub repeated_stamps: Option<usize>,
    /// Steps backwards in time; `null` without stamps.
    pub backwards: Option<usize>,
    /// Forward jumps of the clock; `null` without stamps.
    pub clock_jumps: Option<usize>,
    /// Smallest sample.
    pub smallest: Option<f64>,
    /// Largest sample.
    pub largest: Option<f64>,
    /// Mean of the samples.
    pub mean: Option<f64>,
    /// Rms of the samples without their mean.
    pub rms: Option<f64>,
    /// Samples that repeat the one before, over all; 1 for a constant channel.
    pub repeated: Option<f64>,
    /// Whether that is more than the resolution explains; `null` if it cannot be told.
    pub repeated_unexplained: Option<bool>,
    /// Samples that every value is held for, if it is one number.
    pub hold: Option<usize>,
    /// Samples at a value where the signal is cut off.
    pub clipped: Option<usize>,
    /// Lowest value, if the signal is cut off there.
    pub clipped_low: Option<f64>,
    /// Highest value, if the signal is cut off there.
    pub clipped_high: Option<f64>,
    /// Samples in which the channel stands still.
    pub stuck: Option<usize>,
    /// Whether all samples are the same.
    pub constant: Option<bool>,
    /// Samples that are missing or no finite numbers.
    pub non_finite: Option<usize>,
    /// Step of the values; `null` if it is too fine to be seen.
    pub resolution: Option<f64>,
    /// Bits that the range takes in steps of `resolution`.
    pub resolution_bits: Option<f64>,
    /// Lines at multiples of the mains frequency.
    pub mains: Vec<MainsLine>,
}

/// A gap in the stamps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gap {
    /// Stamp before it.
    pub after_s: f64,
    /// Its length.
    pub length_s: f64,
}

/// A line at a multiple of the mains frequency.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MainsLine {
    /// Frequency.
    pub frequency_hz: f64,
    /// Peak value, in the unit of the channel.
    pub amplitude: f64,
    /// Power over that of the highest line beside it.
    pub prominence: f64,
}

#[derive(Serialize)]
struct Single<'a> {
    schema: &'static str,
    version: &'static str,
    #[serde(flatten)]
    file: &'a Entry,
}

#[derive(Serialize)]
struct Several<'a> {
    schema: &'static str,
    version: &'static str,
    files: &'a [Entry],
    warnings: &'a [Said],
}

impl Report {
    /// As JSON: one file at the top, or several in a list.
    #[must_use]
    pub fn json(&self) -> String {
        let (schema, version) = (SCHEMA, env!("CARGO_PKG_VERSION"));
        match self.files.as_slice() {
            [file] => crate::print::json(&Single {
                schema,
                version,
                file,
            }),
            files => crate::print::json(&Several {
                schema,
                version,
                files,
                warnings: &self.warnings,
            }),
        }
    }

    /// For people.
    #[must_use]
    pub fn text(&self) -> String {
        let files = self.files.iter().filter_map(|entry| match entry {
            Entry::Read(file) => Some(file.text()),
            Entry::Failed { .. } => None,
        });
        let mut text = files.collect::<Vec<_>>().join("\n");
        if self.files.len() > 1 && !text.is_empty() {
            text.push_str("\nbetween the files: ");
            text.push_str(&said(&self.warnings, "nothing was found twice"));
        }
        text
    }

    /// All warnings.
    pub fn all_warnings(&self) -> impl Iterator<Item = &Said> {
        let of_files = self.files.iter().flat_map(|entry| match entry {
            Entry::Read(file) => file.warnings.as_slice(),
            Entry::Failed { .. } => &[],
        });
        of_files.chain(&self.warnings)
    }

    /// Whether data of a file were lost.
    #[must_use]
    pub fn is_lossy(&self) -> bool {
        let mut files = self.files.iter();
        files.any(|entry| matches!(entry, Entry::Read(file) if file.data_lost))
    }
}

fn said(warnings: &[Said], none: &str) -> String {
    if warnings.is_empty() {
        return format!("{none}\n");
    }
    let mut text = match warnings.len() {
        1 => "1 warning\n".to_owned(),
        count => format!("{count} warnings\n"),
    };
    for warning in warnings {
        let message = wrapped(&format!("[{}] {}", warning.code, warning.message));
        text.push_str(&message);
    }
    text
}

/// Lines of at most 100 characters, the first indented by two, the others by six.
fn wrapped(text: &str) -> String {
    let mut out = String::from(" ");
    let mut column = 1;
    for word in text.split(' ') {
        let length = word.chars().count();
        if column + 1 + length > LINE_WIDTH && column > 6 {
            out.push_str("\n     ");
            column = 5;
        }
        out.push(' ');
        out.push_str(word);
        column += 1 + length;
    }
    out.push('\n');
    out
}

impl File {
    fn text(&self) -> String {
        let mut text = format!("{}\n{}: {}\n", self.file, self.format, self.dialect);
        for detail in self.details.iter().take(MOST_DETAILS) {
            let line = format!("  {}: {}", detail.key, detail.value);
            text.push_str(&shortened(&line, LINE_WIDTH));
            text.push('\n');
        }
        if self.details.len() > MOST_DETAILS {
            let more = self.details.len() - MOST_DETAILS;
            text.push_str(&format!(
                "  … and {more} more in the head (--json has all)\n"
            ));
        }
        for segment in &self.segments {
            let start = segment
                .start_s
                .map_or_else(String::new, |s| format!(", {} s after the first", short(s)));
            let time = segment
                .start_time
                .as_ref()
                .map_or_else(String::new, |t| format!(", {t}"));
            text.push_str(&format!("  {}{start}{time}\n", segment.name));
        }
        text.push('\n');
        let head = [
            "channel", "unit", "samples", "rate Hz", "start s", "length s", "smallest", "largest",
            "mean", "rms",
        ];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(
            self.channels
                .iter()
                .enumerate()
                .map(|(i, c)| c.cells(i + 1)),
        );
        text.push_str(&columns(&rows));
        text.push_str(&self.time());
        text.push('\n');
        text.push_str(&said(&self.warnings, "nothing wrong was found"));
        text
    }

    /// Where the rates come from: one line for each time axis.
    fn time(&self) -> String {
        let mut axes: Vec<(String, Vec<usize>)> = Vec::new();
        for (i, channel) in self.channels.iter().enumerate() {
            let axis = channel.axis();
            match axes.iter_mut().find(|(other, _)| *other == axis) {
                Some((_, numbers)) => numbers.push(i + 1),
                None => axes.push((axis, vec![i + 1])),
            }
        }
        let several = axes.len() > 1;
        axes.iter()
            .map(|(axis, numbers)| {
                let of = if several {
                    format!(" of {}", ranges(numbers))
                } else {
                    String::new()
                };
                format!("time axis{of}: {axis}\n")
            })
            .collect()
    }
}

/// The beginning of a text that is too long.
fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let mut short: String = text.chars().take(most - 1).collect();
    short.push('…');
    short
}

/// A name, its middle left out if it is too long: both ends tell more.
fn middle_left_out(name: &str) -> String {
    let count = name.chars().count();
    if count <= NAME_WIDTH {
        return name.to_owned();
    }
    let half = NAME_WIDTH / 2;
    let head: String = name.chars().take(half - 1).collect();
    let tail: String = name.chars().skip(count - half).collect();
    format!("{head}…{tail}")
}

/// `1-3, 5`.
fn ranges(numbers: &[usize]) -> String {
    let mut parts: Vec<(usize, usize)> = Vec::new();
    for &number in numbers {
        match parts.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => parts.push((number, number)),
        }
    }
    let part = |&(first, last): &(usize, usize)| match last - first {
        0 => first.to_string(),
        1 => format!("{first}, {last}"),
        _ => format!("{first}-{last}"),
    };
    parts.iter().map(part).collect::<Vec<_>>().join(", ")
}

impl Channel {
    fn cells(&self, number: usize) -> Vec<String> {
        let value =
            |value: Option<f64>, digits| value.map_or_else(String::new, |v| rounded(v, digits));
        let mut name = self.name.clone();
        if let Some(segment) = self.segment {
            name.push_str(&format!(" (segment {segment})"));
        }
        vec![
            format!("{number:>2}  {}", middle_left_out(&name)),
            shortened(self.unit.as_deref().unwrap_or("not given"), UNIT_WIDTH),
            self.samples.to_string(),
            self.rate_hz
                .map_or_else(|| "unknown".to_owned(), |rate_hz| rounded(rate_hz, 7)),
            // Seconds since 1970 have ten digits before the point.
            value(
                self.start,
                if self.start.is_some_and(|s| s.abs() > 1e6) {
                    13
                } else {
                    6
                },
            ),
            value(self.duration_s, 6),
            value(self.smallest, 5),
            value(self.largest, 5),
            value(self.mean, 5),
            value(self.rms, 4),
        ]
    }

    /// The time axis in words.
    fn axis(&self) -> String {
        let mut text = match self.rate_hz {
            Some(rate_hz) => format!("{} Hz, {}", rounded(rate_hz, 7), self.rate_from),
            None => "none; the rate is unknown".to_owned(),
        };
        if let Some(start_time) = &self.start_time {
            text.push_str(&format!("; starts {start_time}"));
        }
        if let Some(jitter) = self.jitter.filter(|j| *j > 1e-6) {
            text.push_str(&format!(
                "; steps scatter by {} %",
                rounded(100.0 * jitter, 2)
            ));
        }
        if let Some(assumed) = &self.assumed {
            text.push_str(&format!("; assumed: {assumed}"));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_channels_are_put_together() {
        assert_eq!(ranges(&[1, 2, 3, 5, 7, 8]), "1-3, 5, 7, 8");
    }

    #[test]
    fn long_messages_are_wrapped_and_keep_every_word() {
        let text = "word ".repeat(60);
        let out = wrapped(text.trim());
        assert!(out.lines().all(|line| line.chars().count() <= 100));
        assert_eq!(out.split_whitespace().count(), 60);
        assert!(
            out.lines()
                .nth(1)
                .is_some_and(|line| line.starts_with("      word"))
        );
    }
}
