//! What is said while a verb works, the same for every verb.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// Messages on standard error, and their record.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Report")]
pub struct Messages {
    /// Print only warnings and errors to standard error
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Show progress on standard error [default: auto]
    #[arg(
        long,
        value_enum,
        value_name = "WHEN",
        global = true,
        hide_short_help = true
    )]
    pub progress: Option<ProgressMode>,
    /// Append a JSON line to a file for the start, each warning, each failure and the end of the run
    #[arg(long, value_name = "FILE", global = true, hide_short_help = true)]
    pub log: Option<PathBuf>,
}

/// When and how progress is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressMode {
    /// On a terminal, after two seconds
    Auto,
    /// Never
    Never,
    /// A JSON line at most every half second, for programs
    Json,
}
