//! The command line of `simulate`.

use std::path::PathBuf;

use clap::Args;

use super::{Result, TimeAxis, digits};
use crate::io::digits::Digits;

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub struct Simulate {
    /// Recording with the applied quantity, or - for standard input
    #[arg(value_name = "INPUT")]
    pub input: String,
    /// The result.
    #[command(flatten)]
    pub result: Result,
    /// Stand file
    #[arg(long, value_name = "FILE")]
    pub stand: PathBuf,
    /// Column with the applied quantity, or the signal of an MCAP file, as '/joint_states.effort[name=motor]'
    #[arg(long, value_name = "COL")]
    pub applied: Option<String>,
    /// Column with the measured quantity: the motion then starts as it tells, instead of at rest
    #[arg(long, value_name = "COL")]
    pub start_from: Option<String>,
    /// Unit of the applied quantity, if its heading does not say
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<String>,
    /// The time axis.
    #[command(flatten)]
    pub axis: TimeAxis,
    /// Significant digits of the result, 1 to 15, or "shortest" for as many as bring back every bit
    #[arg(long, value_name = "N", default_value = "12", value_parser = digits)]
    pub digits: Digits,
    /// Say nothing on standard error but warnings
    #[arg(short, long)]
    pub quiet: bool,
}
