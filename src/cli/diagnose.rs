//! The command line of `diagnose`.

use std::path::PathBuf;

use clap::Args;

use super::{OutputArgs, Strictness, Work};
use crate::io::Reading;

/// Arguments of `diagnose`.
#[derive(Debug, Args)]
#[command(mut_arg("output", |output| output.help("Write the refined stand file, for simulate and compensate")))]
pub struct Diagnose {
    /// Stand file [default: fit a plain second-order stand]
    #[arg(long, value_name = "FILE", help_heading = "Stand")]
    pub stand: Option<PathBuf>,
    /// Record to fit; may be given several times
    #[arg(long, value_name = "FILE", required_unless_present_any = ["decay", "holdout_decay", "running"],
        help_heading = "Input")]
    pub train: Vec<PathBuf>,
    /// Hold-out record; may be given several times [default: the last 30 % of each training record]
    #[arg(long, value_name = "FILE", requires = "train", help_heading = "Input")]
    pub holdout: Vec<PathBuf>,
    /// Record of a free decay to fit, with the measured quantity alone: after hits or the release of a load; may be
    /// given several times
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    pub decay: Vec<PathBuf>,
    /// Hold-out record of a free decay; may be given several times [default: without --train, the last decay]
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    pub holdout_decay: Vec<PathBuf>,
    /// Known loads applied slowly, a table or a record with the applied and the measured quantity: they determine the
    /// gain, which a free decay does not, and check the effects; may be given several times
    #[arg(long = "static", value_name = "FILE", help_heading = "Input")]
    pub static_loads: Vec<PathBuf>,
    /// Record of the measured quantity alone while the machine runs: it shows the stand's resonance in use and the lines
    /// of a steady speed, and checks the result; may be given several times
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    pub running: Vec<PathBuf>,
    /// Channel with the applied quantity: its number in inspect, heading or name; for an MCAP file topic and field, as
    /// in '/joint_states.effort[name=motor]', or the field of --topic
    #[arg(long, value_name = "COL", required_unless_present_any = ["decay", "holdout_decay", "running"],
        help_heading = "Input")]
    pub applied: Option<String>,
    /// Channel with the measured quantity
    #[arg(long, value_name = "COL", help_heading = "Input")]
    pub measured: String,
    /// Unit of the applied quantity, if its heading does not give it
    #[arg(
        long,
        value_name = "UNIT",
        hide_short_help = true,
        help_heading = "Input"
    )]
    pub applied_unit: Option<String>,
    /// Unit of the measured quantity, if its heading does not give it
    #[arg(
        long,
        value_name = "UNIT",
        hide_short_help = true,
        help_heading = "Input"
    )]
    pub measured_unit: Option<String>,
    /// How the records are read.
    #[command(flatten)]
    pub reading: Reading,
    /// Write an HTML report with charts of records, models and residuals
    #[arg(long, value_name = "FILE", help_heading = "Report")]
    pub html: Option<PathBuf>,
    /// List all candidates in the text, not only the best five
    #[arg(long, help_heading = "Report")]
    pub all: bool,
    /// The refined stand file.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Print JSON instead of text
    #[arg(long, help_heading = "Report")]
    pub json: bool,
    /// What makes a warning a failure.
    #[command(flatten)]
    pub strictness: Strictness,
    /// How it works.
    #[command(flatten)]
    pub work: Work,
}

impl Diagnose {
    /// The training files.
    pub fn training_files(&self) -> Vec<PathBuf> {
        [self.train.as_slice(), &self.decay].concat()
    }

    /// The hold-out files.
    pub fn held_out_files(&self) -> Vec<PathBuf> {
        [self.holdout.as_slice(), &self.holdout_decay].concat()
    }

    /// All records.
    pub fn records(&self) -> Vec<PathBuf> {
        [
            self.training_files(),
            self.held_out_files(),
            self.static_loads.clone(),
            self.running.clone(),
        ]
        .concat()
    }
}
