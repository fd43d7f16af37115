//! How recordings are read, for verbs that read all their channels.

use clap::Args;

use super::{decimal, delimiter, positive_frequency};
use crate::io::csv::{Delimiter, Options, Told};

/// Where the time axis comes from.
#[derive(Debug, Args)]
pub struct TimeAxis {
    /// Column with the time stamps
    #[arg(long, value_name = "NAME")]
    pub time_column: Option<String>,
    /// Unit of the time stamps, if their heading does not say: s, ms, us, min
    #[arg(long, value_name = "UNIT")]
    pub time_unit: Option<String>,
    /// Sampling rate, where there are no time stamps or they are wrong
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = positive_frequency)]
    pub rate: Option<f64>,
}

impl TimeAxis {
    /// The options for one channel.
    #[must_use]
    pub fn options(&self, channel: Option<&str>, unit: Option<&str>) -> Options {
        Options {
            channel: channel.map(str::to_owned),
            unit: unit.map(str::to_owned),
            time_column: self.time_column.clone(),
            time_unit: self.time_unit.clone(),
            rate_hz: self.rate,
            ..Options::default()
        }
    }
}

/// Marks of a table, where the file is not to tell them.
#[derive(Debug, Args)]
pub struct Marks {
    /// What separates the cells: , ; | tab space none
    #[arg(long, value_name = "MARK", value_parser = delimiter)]
    pub delimiter: Option<Delimiter>,
    /// Decimal mark: . or ,
    #[arg(long, value_name = "MARK", value_parser = decimal)]
    pub decimal: Option<u8>,
}

impl Marks {
    /// What is told about a table.
    #[must_use]
    pub fn told(&self) -> Told {
        Told {
            delimiter: self.delimiter,
            decimal: self.decimal,
        }
    }
}

/// How tables are read, whatever their channels.
#[derive(Debug, Args)]
pub struct Reading {
    /// The time axis.
    #[command(flatten)]
    pub axis: TimeAxis,
    /// The marks.
    #[command(flatten)]
    pub marks: Marks,
}

impl Reading {
    /// The options for one channel.
    #[must_use]
    pub fn options(&self, channel: Option<&str>, unit: Option<&str>) -> Options {
        Options {
            told: self.marks.told(),
            ..self.axis.options(channel, unit)
        }
    }
}
