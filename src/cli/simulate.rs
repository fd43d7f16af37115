//! The command line of `simulate`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use torqcomp_decimal::Digits;
use torqcomp_model::simulate;

use super::{BatchOptions, OutputArgs, Strictness, digits};
use crate::io::Reading;

/// Arguments of `simulate`.
#[derive(Debug, Clone, Args)]
pub struct Simulate {
    /// Recording with the applied quantity, or - for standard input; several, folders and patterns such as
    /// 'logs/**/*.csv' with -o FOLDER/
    #[arg(value_name = "INPUT", required_unless_present = "files_from")]
    pub inputs: Vec<PathBuf>,
    /// The result.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Stand file
    #[arg(long, value_name = "FILE", help_heading = "Stand")]
    pub stand: PathBuf,
    /// Channel with the applied quantity: its number in inspect, heading or name; for an MCAP file topic and field, as
    /// in '/joint_states.effort[name=motor]', or the field of --topic
    #[arg(long, value_name = "COL", help_heading = "Input")]
    pub applied: Option<String>,
    /// Behaviour of the applied quantity between its samples
    #[arg(
        long,
        value_enum,
        default_value = "band-limited",
        help_heading = "Method"
    )]
    pub between: Between,
    /// The recording is one period of the applied quantity, or a whole number of them: give the steady-state response
    /// to its repetition. Without it, the stand is at rest and without load before the first sample
    #[arg(long, help_heading = "Method")]
    pub periodic: bool,
    /// Unit of the applied quantity, if its heading does not give it
    #[arg(long, value_name = "UNIT", help_heading = "Input")]
    pub unit: Option<String>,
    /// How the recording is read.
    #[command(flatten)]
    pub reading: Reading,
    /// Of many recordings, how.
    #[command(flatten)]
    pub many: BatchOptions,
    /// Significant digits of the result, 1 to 15, or "shortest" for the fewest that restore every bit
    #[arg(long, value_name = "N", default_value = "12", value_parser = digits, hide_short_help = true,
        help_heading = "Output")]
    pub digits: Digits,
    /// Print a JSON report to standard output; the record then needs -o
    #[arg(long, help_heading = "Report")]
    pub json: bool,
    /// What makes a warning a failure.
    #[command(flatten)]
    pub strictness: Strictness,
}

impl Simulate {
    /// The one recording that is read.
    pub fn input(&self) -> &Path {
        &self.inputs[0]
    }
}

/// Courses of a quantity between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Between {
    /// Nothing above half the sampling rate: recorded through an anti-aliasing filter
    BandLimited,
    /// Straight lines
    StraightLines,
    /// Each sample held until the next one, as by a D/A converter
    Held,
}

impl From<Between> for simulate::Between {
    fn from(between: Between) -> Self {
        match between {
            Between::BandLimited => Self::BandLimited,
            Between::StraightLines => Self::StraightLines,
            Between::Held => Self::Held,
        }
    }
}
