//! Arguments of `init`.

use clap::{Args, ValueEnum};

use super::OutputArgs;

fn named_std(text: &str) -> Result<(String, String), String> {
    let (flag, std) = text.split_once('=').unwrap_or_default();
    match (
        flag.trim().trim_start_matches('-').replace('_', "-"),
        std.trim(),
    ) {
        (flag, std) if !flag.is_empty() && !std.is_empty() => Ok((flag, std.to_owned())),
        _ => Err("expected FLAG=QUANTITY, such as \"sensitivity=0.0005 mV/V\"".to_owned()),
    }
}

/// What a stand file is made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum InitFrom {
    /// A torque transducer with a data sheet or certificate
    Transducer,
    /// A bridge that was calibrated with weights
    Bridge,
    /// Gages on a beam, from its drawing
    Drawing,
    /// Not known yet
    Unknown,
}

/// Arguments of `init`.
///
/// Asks for what is not given when it runs on a terminal; in a script the flags say it.
#[derive(Debug, Args)]
#[command(next_help_heading = "Stand")]
pub struct Init {
    /// What there is to start from
    #[arg(long, value_enum, help_heading = "Method")]
    pub from: Option<InitFrom>,
    /// Name of the stand
    #[arg(long, value_name = "TEXT")]
    pub name: Option<String>,
    /// Natural frequency, such as "590 Hz"
    #[arg(long, value_name = "QUANTITY")]
    pub natural_frequency: Option<String>,
    /// Damping ratio, such as 0.02
    #[arg(long, value_name = "NUMBER")]
    pub damping_ratio: Option<String>,
    /// Transducer: change of its output from no load to the rated torque, such as "2 mV/V", "10 V", "8 mA"
    #[arg(long, value_name = "QUANTITY", allow_hyphen_values = true)]
    pub sensitivity: Option<String>,
    /// Transducer: rated torque, such as "50 N m"
    #[arg(long, value_name = "QUANTITY")]
    pub rated_torque: Option<String>,
    /// Bridge: torque per ratio, such as "25 N m/(mV/V)"
    #[arg(
        long,
        value_name = "QUANTITY",
        allow_hyphen_values = true,
        conflicts_with = "torque_per_volt"
    )]
    pub torque_per_ratio: Option<String>,
    /// Bridge: torque per recorded volt, such as "12.5 N m/V"
    #[arg(long, value_name = "QUANTITY", allow_hyphen_values = true)]
    pub torque_per_volt: Option<String>,
    /// Drawing: width of the beam, across the force
    #[arg(long, value_name = "QUANTITY")]
    pub width: Option<String>,
    /// Drawing: depth of the beam, along the force
    #[arg(long, value_name = "QUANTITY")]
    pub depth: Option<String>,
    /// Drawing: length of the beam, from the clamp to the stator
    #[arg(long, value_name = "QUANTITY")]
    pub length: Option<String>,
    /// Drawing: elastic modulus, such as "200 GPa"
    #[arg(long, value_name = "QUANTITY")]
    pub elastic_modulus: Option<String>,
    /// Drawing: radius at which the beam meets the stator
    #[arg(long, value_name = "QUANTITY")]
    pub radius: Option<String>,
    /// Drawing: distance of the gage from the clamp
    #[arg(long, value_name = "QUANTITY")]
    pub gage_position: Option<String>,
    /// Drawing: gage factor, such as 2.05
    #[arg(long, value_name = "NUMBER")]
    pub gage_factor: Option<String>,
    /// Drawing: resistance of a gage, such as "350 ohm"
    #[arg(long, value_name = "QUANTITY")]
    pub gage_resistance: Option<String>,
    /// Drawing: quarter, half, half-opposite or full
    #[arg(long, value_name = "WORD")]
    pub layout: Option<String>,
    /// Supply of the bridge, for a record in volts, such as "5 V"
    #[arg(long, value_name = "QUANTITY")]
    pub excitation: Option<String>,
    /// Recorded volts per bridge volt, for a record in volts, such as 200
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    pub gain: Option<String>,
    /// Record at no load, such as "12 mA"
    #[arg(long, value_name = "QUANTITY", allow_hyphen_values = true)]
    pub zero: Option<String>,
    /// Standard uncertainty of one of the values above, named by its flag, such as "sensitivity=0.0005 mV/V";
    /// repeatable. For a limit within which all values are equally likely, give the limit divided by 1.73
    #[arg(long, value_name = "FLAG=QUANTITY", value_parser = named_std, help_heading = "Input")]
    pub std: Vec<(String, String)>,
    /// Output.
    #[command(flatten)]
    pub result: OutputArgs,
}
