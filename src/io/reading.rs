//! Options for reading a recording, where its file is ambiguous.

use clap::{Args, ValueEnum};

use super::mcap::TimeChoice;
use torqcomp_model::Kind;

use crate::unit::NamedUnit;

/// Separation of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// By one such byte.
    Byte(u8),
    /// By any number of spaces or tabs.
    Spaces,
    /// Not at all: one column.
    None,
}

/// How a recording is read, the same for every verb.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Input")]
pub struct Reading {
    /// Marks of a table.
    #[command(flatten)]
    pub dialect: DialectOverride,
    /// Column with the time stamps
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    pub time_column: Option<String>,
    /// Unit of the time stamps, if their heading does not give it: s, ms, us, min
    #[arg(long, value_name = "UNIT", hide_short_help = true)]
    pub time_unit: Option<String>,
    /// Sampling rate, where there are no time stamps or they are wrong; with --resample, the rate
    /// to interpolate to
    #[arg(long = "rate", value_name = "HZ", allow_negative_numbers = true, value_parser = positive_frequency)]
    pub rate_hz: Option<f64>,
    /// Interpolate where the time stamps are not uniform, instead of refusing
    #[arg(long)]
    pub resample: bool,
    /// Full scale of a WAV file, with its unit, as in "10 V"
    #[arg(long, value_name = "QUANTITY", value_parser = full_scale, hide_short_help = true)]
    pub full_scale: Option<FullScale>,
    /// Part of the record to use: seconds on its time axis (0.5..2), times of day or dates; either end may be left out
    #[arg(long, value_name = "FROM..TO", value_parser = time_range, allow_hyphen_values = true)]
    pub range: Option<TimeRange>,
    /// How to fill missing samples: empty cells, and gaps of whole steps between the time stamps [default: refuse]
    #[arg(long, value_name = "HOW", value_enum)]
    pub fill: Option<Fill>,
    /// Topic of an MCAP file (/joint_states); its fields are the channels
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// Clock for message times: header (their own stamp), log or publish [default: header if there is one, else log]
    #[arg(long, value_name = "CLOCK", value_parser = clock, hide_short_help = true)]
    pub time: Option<TimeChoice>,
    /// Field with the sample spacing, for messages with many samples
    #[arg(long, value_name = "FIELD", hide_short_help = true)]
    pub spacing: Option<String>,
    /// Largest metadata, schema and channel records read from an MCAP file, in MiB [default: 64]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1024), hide_short_help = true)]
    pub longest_metadata: Option<u64>,
    /// Whether stamps may be irregular, because they are only handed on.
    #[arg(skip)]
    pub any_steps: bool,
    /// Whether rows are no samples in time, so that a column with few values is no slower channel.
    #[arg(skip)]
    pub keeps_rows: bool,
}

/// The ends of a time range as written; their meaning depends on the record's time axis.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeRange {
    /// Its first time.
    pub from: Option<String>,
    /// Its last time.
    pub to: Option<String>,
}

/// Meaning of a full-scale sample.
#[derive(Debug, Clone, PartialEq)]
pub struct FullScale {
    /// Its value in the unit.
    pub value: f64,
    /// The unit.
    pub unit: NamedUnit,
}

/// What stands in for samples that are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Fill {
    /// A straight line between the neighbours
    Linear,
    /// The last preceding value
    Hold,
    /// Do not fill: such records are refused
    Refuse,
}

/// Marks of a table, given by the user instead of found in the file.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Input")]
pub struct DialectOverride {
    /// Cell separator: , ; | tab space none
    #[arg(long, value_name = "MARK", value_parser = delimiter, hide_short_help = true)]
    pub delimiter: Option<Delimiter>,
    /// Decimal mark: . or ,
    #[arg(long, value_name = "MARK", value_parser = decimal, hide_short_help = true)]
    pub decimal: Option<u8>,
}

impl Reading {
    /// Whether part of the record is read, or something is added to it: both need the whole record in memory.
    pub(crate) fn is_partial(&self) -> bool {
        self.range.is_some() || self.fill.is_some_and(|fill| fill != Fill::Refuse)
    }

    /// Whether samples before a time are left out.
    pub(crate) fn starts_later(&self) -> bool {
        let range = self.range.as_ref();
        range.is_some_and(|range| range.from.is_some())
    }
}

/// Which channel of a recording is read, and its unit if the file does not say or is wrong.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Input")]
pub struct ChannelChoice {
    /// Channel to read: its number in inspect, its heading, its name, or a unique part of it
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,
    /// Field of the messages of --topic.
    #[arg(
        long,
        value_name = "FIELD",
        requires = "topic",
        help = "Field of the messages of --topic: effort[0], 'effort[name=motor]', 'data[:]'; not needed if it has a \
            single number"
    )]
    pub field: Option<String>,
    /// Topic and field in one.
    #[arg(
        long,
        value_name = "PATH",
        conflicts_with = "topic",
        help = "Topic and field of an MCAP file in one, as in '/joint_states.effort[name=motor]'",
        hide_short_help = true
    )]
    pub signal: Option<String>,
    /// Unit of the signal, if its heading does not give it: V, mV, "N m", "ft lbf", ustrain
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<String>,
    /// Flags of the verb that give channel and unit.
    #[arg(skip = Flags::default())]
    pub flags: Flags,
}

/// The options of a command that select a channel and give its unit, for messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Flags {
    /// Option for the channel.
    pub channel: &'static str,
    /// Option for its unit; `None` if there is none.
    pub unit: Option<&'static str>,
}

impl Default for Flags {
    fn default() -> Self {
        Self {
            channel: "--channel",
            unit: Some("--unit"),
        }
    }
}

impl Default for ChannelChoice {
    fn default() -> Self {
        Self::of(Flags::default(), None, None)
    }
}

impl ChannelChoice {
    /// Channel and unit given by a command's own options.
    pub fn of(flags: Flags, channel: Option<&str>, unit: Option<&str>) -> Self {
        Self {
            channel: channel.map(str::to_owned),
            field: None,
            signal: None,
            unit: unit.map(str::to_owned),
            flags,
        }
    }

    /// The channel named by an option of the command, with its unit if given by another option.
    pub fn named([channel, unit]: [&'static str; 2], name: &str, unit_text: Option<&str>) -> Self {
        let flags = Flags {
            channel,
            unit: Some(unit),
        };
        Self::of(flags, Some(name), unit_text)
    }

    /// The channels named by `--applied` and `--measured`, each with its unit if given.
    pub fn applied_and_measured(names: [&str; 2], units: [Option<&str>; 2]) -> [Self; 2] {
        [
            Self::named(["--applied", "--applied-unit"], names[0], units[0]),
            Self::measured_alone(names[1], units[1]),
        ]
    }

    /// The channel named by `--measured`, with its unit if given.
    pub fn measured_alone(name: &str, unit: Option<&str>) -> Self {
        Self::named(["--measured", "--measured-unit"], name, unit)
    }
}

/// A frequency: a number of Hz, or a number with a unit.
pub(crate) fn frequency(text: &str) -> Result<f64, String> {
    let value = match text.trim().parse::<f64>() {
        Ok(value) => value,
        Err(_) => Kind::Frequency
            .parse(text)
            .map_err(|e| without_hertz(text).unwrap_or_else(|| e.to_string()))?,
    };
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err("expected a frequency in Hz, such as 2400 or \"2.4 kHz\"".to_owned())
    }
}

/// What is missing from a frequency such as `10k`.
fn without_hertz(text: &str) -> Option<String> {
    let text = text.trim();
    let (prefix, number) = [("k", ['k', 'K']), ("M", ['M', 'M'])]
        .iter()
        .find_map(|(prefix, letters)| Some((*prefix, text.strip_suffix(letters)?.trim())))?;
    let is_number = number.parse::<f64>().is_ok();
    is_number.then(|| format!("the unit is missing; write \"{number} {prefix}Hz\""))
}

/// A positive frequency that is plausible for a clock, so that the times of its samples are finite.
pub(crate) fn positive_frequency(text: &str) -> Result<f64, String> {
    match frequency(text)? {
        0.0 => Err("expected a frequency greater than zero".to_owned()),
        value if (1e-12..=1e15).contains(&value) => Ok(value),
        _ => Err("expected a frequency between 1e-12 and 1e15 Hz".to_owned()),
    }
}

fn full_scale(text: &str) -> Result<FullScale, String> {
    let text = text.trim();
    let is_number = |c: char| c.is_ascii_digit() || "+-.".contains(c);
    let end = text.find(|c| !is_number(c)).unwrap_or(text.len());
    // The letter in 1e3 belongs to the number.
    let power = text[end..].strip_prefix(['e', 'E']).map_or(0, |rest| {
        let digits = rest.find(|c| !is_number(c)).unwrap_or(rest.len());
        if digits > 0 { digits + 1 } else { 0 }
    });
    let (number, unit) = text.split_at(end + power);
    let value = number.parse::<f64>().ok();
    let value = value.filter(|value| *value > 0.0 && value.is_finite());
    match (value, NamedUnit::parse(unit)) {
        (Some(value), Some(unit)) => Ok(FullScale { value, unit }),
        _ => Err("expected a number greater than zero with its unit, such as \"10 V\"".to_owned()),
    }
}

fn time_range(text: &str) -> Result<TimeRange, String> {
    let end = |text: &str| Some(text.trim().to_owned()).filter(|text| !text.is_empty());
    let (from, to) = text.split_once("..").unwrap_or_default();
    match (end(from), end(to)) {
        (None, None) => Err(
            "expected FROM..TO, in seconds (0.5..2), as times of day (14:30:00..14:31:00) or as dates with times; \
             either end may be left out"
                .to_owned(),
        ),
        (from, to) => Ok(TimeRange { from, to }),
    }
}

fn clock(text: &str) -> Result<TimeChoice, String> {
    TimeChoice::parse(text).ok_or_else(|| "expected log, publish or header".to_owned())
}

fn delimiter(text: &str) -> Result<Delimiter, String> {
    match text {
        "tab" | "\t" | "\\t" => Ok(Delimiter::Byte(b'\t')),
        "space" | "spaces" | " " => Ok(Delimiter::Spaces),
        "none" => Ok(Delimiter::None),
        _ => match text.as_bytes() {
            [byte] if byte.is_ascii_punctuation() && !b".+-\"".contains(byte) => {
                Ok(Delimiter::Byte(*byte))
            }
            _ => Err("expected one of , ; | tab space none".to_owned()),
        },
    }
}

fn decimal(text: &str) -> Result<u8, String> {
    match text {
        "." | "point" => Ok(b'.'),
        "," | "comma" => Ok(b','),
        _ => Err("expected . or ,".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_people_write_them() {
        assert_eq!(frequency("2400"), Ok(2400.0));
        assert_eq!(frequency("2.4 kHz"), Ok(2400.0));
        assert!(frequency("-1").is_err() && frequency("nan").is_err() && frequency("2 V").is_err());
        let full = full_scale(" 2.5e-1 mV").unwrap();
        assert_eq!((full.value, full.unit.text.as_str()), (0.25, "mV"));
        assert_eq!(full_scale("10V").unwrap().value, 10.0);
        for wrong in [
            "10",
            "V",
            "-1 V",
            "0 V",
            "1e400 V",
            "10 furlongs",
            "",
            "1e V",
        ] {
            assert!(full_scale(wrong).is_err(), "{wrong}");
        }
        assert_eq!(delimiter("tab"), Ok(Delimiter::Byte(b'\t')));
        assert!(delimiter("ab").is_err());
    }
}
