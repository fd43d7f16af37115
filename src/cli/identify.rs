//! The command line of `identify`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::values::{frequency_range, segment};
use super::{OutputArgs, Strictness, Units};
use crate::identify::Motion;
use crate::identify::response::Excitation;
use crate::io::{ChannelChoice, Reading};

/// Arguments of `identify`.
#[derive(Debug, Args)]
pub struct Identify {
    /// The test that was recorded.
    #[command(subcommand)]
    pub test: Test,
}

/// Tests that give constants.
#[derive(Debug, Subcommand)]
pub enum Test {
    /// Frequencies and damping from a free decay after a step or a hit
    Decay(Decay),
    /// Modes from a known input and the measured response
    Response(Response),
    /// Inertia and friction from the motion of a free body under a known torque
    Runup(Runup),
    /// Sensitivity and zero from known loads
    Static(Static),
}

impl Test {
    /// How its records are read.
    pub(crate) fn reading(&self) -> &Reading {
        match self {
            Self::Decay(test) => &test.reading,
            Self::Response(test) => &test.reading,
            Self::Runup(test) => &test.reading,
            Self::Static(test) => &test.table,
        }
    }

    /// What is written, and the records that must not be replaced.
    pub fn target(&self) -> (&Findings, &[PathBuf]) {
        match self {
            Self::Decay(test) => (&test.findings, &test.inputs),
            Self::Response(test) => (&test.findings, &test.inputs),
            Self::Runup(test) => (&test.findings, std::slice::from_ref(&test.input)),
            Self::Static(test) => (&test.findings, std::slice::from_ref(&test.input)),
        }
    }
}

/// Output: the stand file of `-o` is written, or updated if it exists.
#[derive(Debug, Args)]
pub struct Findings {
    /// The stand file.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Stand file [default: that of -o, if it exists]
    #[arg(long, value_name = "FILE", help_heading = "Stand")]
    pub stand: Option<PathBuf>,
    /// Units of printed values
    #[arg(long, value_enum, default_value = "si", help_heading = "Output")]
    pub units: Units,
    /// Print JSON instead of text
    #[arg(long, help_heading = "Report")]
    pub json: bool,
    /// Write an HTML page with the fit, the residual and the constants
    #[arg(long, value_name = "FILE", help_heading = "Report")]
    pub html: Option<PathBuf>,
    /// What makes a warning a failure.
    #[command(flatten)]
    pub strictness: Strictness,
}

/// A constant known from elsewhere; by default, that of the stand file.
#[derive(Debug, Args)]
#[command(next_help_heading = "Stand")]
pub struct Anchors {
    /// Known inertia, from which stiffness and damping follow
    #[arg(long, value_name = "QUANTITY", conflicts_with = "stiffness")]
    pub inertia: Option<String>,
    /// Known stiffness, from which inertia and damping follow
    #[arg(long, value_name = "QUANTITY")]
    pub stiffness: Option<String>,
}

/// Arguments of `identify decay`.
#[derive(Debug, Args)]
pub struct Decay {
    /// Recordings of free decays of one stand, or - for standard input
    #[arg(value_name = "INPUT", required = true)]
    pub inputs: Vec<PathBuf>,
    /// Which channel.
    #[command(flatten)]
    pub choice: ChannelChoice,
    /// Number of modes [default: chosen from the data]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=20), help_heading = "Method")]
    pub modes: Option<u8>,
    /// Frequencies of the modes, in Hz
    #[arg(long, value_name = "FROM..TO", value_parser = frequency_range, allow_hyphen_values = true, help_heading = "Band")]
    pub band: Option<(f64, f64)>,
    /// Known constants.
    #[command(flatten)]
    pub anchors: Anchors,
    /// How the file is read.
    #[command(flatten)]
    pub reading: Reading,
    /// Output.
    #[command(flatten)]
    pub findings: Findings,
}

/// Arguments of `identify response`.
#[derive(Debug, Args)]
pub struct Response {
    /// Recordings of one stand
    #[arg(value_name = "INPUT", required = true)]
    pub inputs: Vec<PathBuf>,
    /// Channel of the excitation (hammer force, exciter force, known torque): its number in inspect, heading or name;
    /// for an MCAP file topic and field, as in '/joint_states.effort[name=motor]', or the field of --topic
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub applied: String,
    /// Unit of the excitation, if its heading does not give it
    #[arg(
        long,
        value_name = "UNIT",
        hide_short_help = true,
        help_heading = "Input"
    )]
    pub applied_unit: Option<String>,
    /// Force or torque per unit of its channel, such as "444.4 N/V" for a hammer of 2.25 mV/N
    #[arg(
        long,
        value_name = "QUANTITY",
        allow_hyphen_values = true,
        hide_short_help = true,
        help_heading = "Input"
    )]
    pub torque_factor: Option<String>,
    /// Radius at which a force acts: torque = force x radius
    #[arg(long, value_name = "QUANTITY", help_heading = "Stand")]
    pub radius: Option<String>,
    /// Channel of the response
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub measured: String,
    /// Unit of the response, if its heading does not give it
    #[arg(
        long,
        value_name = "UNIT",
        hide_short_help = true,
        help_heading = "Input"
    )]
    pub measured_unit: Option<String>,
    /// Quantity of the measured channel [default: from its unit]
    #[arg(long, value_enum, hide_short_help = true, help_heading = "Input")]
    pub measured_as: Option<Motion>,
    /// How the stand was excited [default: detected from the data]
    #[arg(long, value_enum, help_heading = "Stand")]
    pub excitation: Option<Excitation>,
    /// Frequencies to fit, in Hz [default: where the excitation has power]
    #[arg(long, value_name = "FROM..TO", value_parser = frequency_range, allow_hyphen_values = true, help_heading = "Band")]
    pub band: Option<(f64, f64)>,
    /// Number of modes [default: chosen by the error on held-out data]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=40), help_heading = "Method")]
    pub modes: Option<u8>,
    /// Period of a periodic excitation, in samples [default: detected from the data]
    #[arg(
        long,
        value_name = "N",
        hide_short_help = true,
        help_heading = "Method"
    )]
    pub period: Option<usize>,
    /// Length of a segment of noise, in samples [default: from the length of the record]
    #[arg(
        long,
        value_name = "N",
        value_parser = segment,
        hide_short_help = true,
        help_heading = "Method"
    )]
    pub segment: Option<usize>,
    /// Also fit a delay of the measured channel, or an RC low-pass if that explains more
    #[arg(long, hide_short_help = true, help_heading = "Method")]
    pub delay: bool,
    /// Known constants.
    #[command(flatten)]
    pub anchors: Anchors,
    /// How the file is read.
    #[command(flatten)]
    pub reading: Reading,
    /// Output.
    #[command(flatten)]
    pub findings: Findings,
}

/// Arguments of `identify runup`.
#[derive(Debug, Args)]
pub struct Runup {
    /// Recording of the run
    #[arg(value_name = "INPUT")]
    pub input: PathBuf,
    /// Column of the position, speed or acceleration
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub motion: String,
    /// Unit of the motion, if its heading does not give it: rad, rpm, m, m/s^2
    #[arg(long, value_name = "UNIT", help_heading = "Input")]
    pub motion_unit: Option<String>,
    /// Column of the torque or force
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub torque: String,
    /// Unit of the torque or force, if its heading does not give it
    #[arg(long, value_name = "UNIT", help_heading = "Input")]
    pub torque_unit: Option<String>,
    /// Torque or force per unit of its channel, such as "35.15 N/V"
    #[arg(
        long,
        value_name = "QUANTITY",
        allow_hyphen_values = true,
        help_heading = "Input"
    )]
    pub torque_factor: Option<String>,
    /// Radius at which a force drives a rotating body
    #[arg(long, value_name = "QUANTITY", help_heading = "Stand")]
    pub radius: Option<String>,
    /// Let viscous friction differ by direction
    #[arg(long, help_heading = "Method")]
    pub by_direction: bool,
    /// Half-width of the averaging window, in seconds [default: chosen from the data]
    #[arg(
        long,
        value_name = "S",
        allow_hyphen_values = true,
        help_heading = "Method"
    )]
    pub window: Option<f64>,
    /// How the file is read.
    #[command(flatten)]
    pub reading: Reading,
    /// Output.
    #[command(flatten)]
    pub findings: Findings,
}

/// Arguments of `identify static`.
#[derive(Debug, Args)]
pub struct Static {
    /// Table of loads and readings, one row each, in the order in which they were taken
    #[arg(value_name = "INPUT")]
    pub input: PathBuf,
    /// Column of the load
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub load: String,
    /// Unit of the load, if its heading does not give it
    #[arg(long, value_name = "UNIT", help_heading = "Input")]
    pub load_unit: Option<String>,
    /// Radius at which a load given as a force or a mass acts
    #[arg(long, value_name = "QUANTITY", help_heading = "Stand")]
    pub radius: Option<String>,
    /// Local acceleration of gravity, for a load given as a mass
    #[arg(long, value_name = "QUANTITY", help_heading = "Method")]
    pub gravity: Option<String>,
    /// Column of the reading
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub reading: String,
    /// Unit of the reading, if its heading does not give it
    #[arg(long, value_name = "UNIT", help_heading = "Input")]
    pub reading_unit: Option<String>,
    /// Column of the standard uncertainty of each reading, in the unit of the reading
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub std: Option<String>,
    /// Column with the number of the series [default: a new one after each return to no load]
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub series: Option<String>,
    /// Column with the number of the mounting position
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub position: Option<String>,
    /// Degree of the curve
    #[arg(long, value_name = "1|3", default_value = "1", value_parser = degree, help_heading = "Method")]
    pub degree: usize,
    /// How the file is read.
    #[command(flatten)]
    pub table: Reading,
    /// Output.
    #[command(flatten)]
    pub findings: Findings,
}

fn degree(text: &str) -> std::result::Result<usize, String> {
    match text {
        "1" | "linear" => Ok(1),
        "3" | "cubic" => Ok(3),
        _ => Err("expected 1 (linear) or 3 (cubic)".to_owned()),
    }
}
