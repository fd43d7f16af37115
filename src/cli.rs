//! The command line.

pub mod diagnose;
mod help;
pub mod identify;
pub mod init;
pub(crate) mod many;
mod messages;
mod pages;
pub mod simulate;
mod values;
mod wrong;

use std::path::{Path, PathBuf};

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use torqcomp_decimal::Digits;
use torqcomp_model::UnitSystem;

use crate::failure::Failure;
use crate::file_name;
use crate::io::output::{Output, Policy};
use crate::io::{ChannelChoice, Reading, frequency, positive_frequency};

pub use diagnose::Diagnose;
pub(crate) use help::command;
pub(crate) use help::parse;
pub use many::{BatchOptions, Merge};
pub use messages::{Messages, ProgressMode};
pub use pages::{Completions, Man, Schema};
pub use simulate::Simulate;
pub use values::{BandOption, Orders};
use values::{band, digits, orders, percent, result_file, svg_file, time_range, warning_code};
pub(crate) use wrong::{is_json_asked, log_asked, wrong_usage};

/// Version, commit and target of this build.
const BUILD: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    " (",
    env!("TORQCOMP_ORIGIN"),
    ", ",
    env!("TORQCOMP_TARGET"),
    ")"
);

/// True torque from the records of a reaction-torque stand.
///
/// The beam and the stator of a stand ring; torqcomp divides the stand's response out of a record.
/// Results go to standard output or -o, messages to standard error.
///
/// Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done, but data were lost (or --strict was given
/// and there was a warning).
#[derive(Debug, Parser)]
#[command(name = "torqcomp", version, long_version = BUILD, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
    /// What is said meanwhile.
    #[command(flatten)]
    pub messages: Messages,
    /// The options given that a result may depend on, as `--name=value`.
    #[arg(skip)]
    pub options: Vec<String>,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Write a commented stand file from the data you have
    Init(Box<init::Init>),
    /// Convert a recorded signal to the applied torque
    Compensate(Compensate),
    /// Fit magnitude and phase of component torques at a fundamental and its orders
    Harmonics(Harmonics),
    /// Tabulate the inverse transfer function over frequency
    Table(Table),
    /// Calculate stand constants from the drawing and compare them with the measured ones
    Predict(Predict),
    /// Write one channel of a recording as plain rows of time and value
    Extract(Extract),
    /// List the channels of recordings and their problems
    Inspect(Inspect),
    /// Identify stand constants from records, with their uncertainties
    Identify(identify::Identify),
    /// Simulate the stand's response to a given input
    Simulate(Simulate),
    /// Find effects missing from a stand model, with the error before and after
    Diagnose(Diagnose),
    /// Join the manifests of several runs over many recordings into one table
    Merge(Merge),
    /// Print a command-line completion script for a shell
    Completions(Completions),
    /// Print the manual page of the program or of a verb
    Man(Man),
    /// Print the JSON Schema of a document that --json prints
    Schema(Schema),
}

impl Verb {
    /// How its records are read, if it reads any.
    pub(crate) fn reading(&self) -> Option<&Reading> {
        match self {
            Self::Compensate(args) => Some(&args.record.reading),
            Self::Harmonics(args) => Some(&args.record.reading),
            Self::Extract(args) => Some(&args.record.reading),
            Self::Inspect(args) => Some(&args.reading),
            Self::Identify(args) => Some(args.test.reading()),
            Self::Simulate(args) => Some(&args.reading),
            Self::Diagnose(args) => Some(&args.reading),
            Self::Init(_)
            | Self::Table(_)
            | Self::Predict(_)
            | Self::Merge(_)
            | Self::Completions(_)
            | Self::Man(_)
            | Self::Schema(_) => None,
        }
    }
}

/// Units that results are printed in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Units {
    /// N m, N, m
    Si,
    /// ft lbf, lbf, in
    Us,
}

impl From<Units> for UnitSystem {
    fn from(units: Units) -> Self {
        match units {
            Units::Si => Self::Si,
            Units::Us => Self::Us,
        }
    }
}

/// Formats of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Comma-separated text
    Csv,
    /// A copy of the input MCAP file with the torque as an additional channel
    Mcap,
}

/// One channel of a recording, or of each of many.
#[derive(Debug, Clone, Args)]
pub struct OneChannel {
    /// Recording to read (CSV, TSV, a recorder's text export, or MCAP), or - for standard input; several, folders and
    /// patterns such as 'logs/**/*.csv' with -o FOLDER/
    #[arg(value_name = "INPUT", required_unless_present = "files_from")]
    pub inputs: Vec<PathBuf>,
    /// Which channel.
    #[command(flatten)]
    pub choice: ChannelChoice,
    /// How it is read.
    #[command(flatten)]
    pub reading: Reading,
    /// Of many recordings, how.
    #[command(flatten)]
    pub many: BatchOptions,
}

impl OneChannel {
    /// The one recording that is read.
    pub fn input(&self) -> &Path {
        &self.inputs[0]
    }
}

/// Where a result goes.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// File to write, or - for standard output
    #[arg(short, long, value_name = "OUT", value_parser = PathBufValueParser::new().try_map(result_file))]
    pub output: Option<PathBuf>,
    /// Replace the output if it exists
    #[arg(long)]
    pub force: bool,
    /// Do not sync outputs to the disk: faster, but a power cut may leave empty files
    #[arg(long, hide_short_help = true)]
    pub no_sync: bool,
}

impl OutputArgs {
    /// Opens the output; `inputs` are the files that it must not replace.
    pub(crate) fn open(&self, inputs: &[&Path]) -> Result<Output, Failure> {
        let place = self.output.as_deref();
        Output::open(place, self.policy(), inputs)
    }

    /// Opens another output of the same run, if one is asked for.
    pub(crate) fn open_beside(
        &self,
        place: Option<&Path>,
        taken: &[&Path],
    ) -> Result<Option<Output>, Failure> {
        let first = self.output.as_deref();
        let taken: Vec<&Path> = taken.iter().copied().chain(first).collect();
        let open = |place| Output::open(Some(place), self.policy(), &taken);
        place.map(open).transpose()
    }

    pub(crate) fn policy(&self) -> Policy {
        Policy {
            replace: self.force,
            sync: !self.no_sync,
        }
    }

    pub(crate) fn is_stdout(&self) -> bool {
        self.output.as_deref().is_none_or(file_name::is_dash)
    }
}

/// How a verb works on.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Method")]
pub struct Work {
    /// Threads to use [default: one for each core, at most 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256), hide_short_help = true)]
    pub threads: Option<u16>,
}

impl Work {
    /// Threads to use.
    pub fn thread_count(&self) -> usize {
        self.threads
            .map_or_else(crate::parallel::threads, usize::from)
    }
}

/// Which warnings end a verb with code 3.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Report")]
pub struct Strictness {
    /// Exit with code 3 if there are warnings
    #[arg(long)]
    pub strict: bool,
    /// Code of a warning that --strict ignores; may be given several times
    #[arg(long, value_name = "CODE", value_parser = warning_code, hide_short_help = true)]
    pub allow: Vec<String>,
}

impl Strictness {
    /// Whether warnings with these codes are too many.
    pub fn refuses<'a>(&self, mut codes: impl Iterator<Item = &'a str>) -> bool {
        self.strict && codes.any(|code| self.allow.iter().all(|allowed| allowed != code))
    }
}

/// Arguments of `compensate`.
#[derive(Debug, Clone, Args)]
pub struct Compensate {
    /// The recording.
    #[command(flatten)]
    pub record: OneChannel,
    /// The result.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Stand file
    #[arg(long, value_name = "FILE", help_heading = "Stand")]
    pub stand: PathBuf,
    /// Compensate up to this frequency, or "rated" for 2400 Hz [default: chosen for the least expected error from the
    /// record's spectrum, its noise and the stand]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = band, help_heading = "Band")]
    pub band: Option<BandOption>,
    /// Units of the result
    #[arg(long, value_enum, default_value = "si", help_heading = "Output")]
    pub units: Units,
    /// Format of the result [default: mcap if the output file ends in .mcap, else csv]
    #[arg(long, value_enum, help_heading = "Output")]
    pub format: Option<Format>,
    /// Topic of the result in an MCAP file [default: /torqcomp/compensated_torque]
    #[arg(
        long,
        value_name = "TOPIC",
        hide_short_help = true,
        help_heading = "Output"
    )]
    pub output_topic: Option<String>,
    /// Significant digits of the result, 1 to 15, or "shortest" for the fewest that restore every bit
    #[arg(long, value_name = "N", default_value = "12", value_parser = digits, hide_short_help = true,
        help_heading = "Output")]
    pub digits: Digits,
    /// Add the recorded torque, before compensation, as a third column
    #[arg(long, hide_short_help = true, help_heading = "Output")]
    pub with_recorded: bool,
    /// Process the record as a whole in memory instead of as a stream
    #[arg(long, hide_short_help = true, help_heading = "Method")]
    pub whole_record: bool,
    /// Plot the recorded and the compensated torque to an SVG file
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(svg_file),
        help_heading = "Report")]
    pub plot: Option<PathBuf>,
    /// Time range to plot, in seconds
    #[arg(long, value_name = "FROM..TO", value_parser = time_range, requires = "plot", hide_short_help = true,
        help_heading = "Report")]
    pub plot_range: Option<(f64, f64)>,
    /// Write an HTML report with charts, band, noise and uncertainty
    #[arg(long, value_name = "FILE", help_heading = "Report")]
    pub html: Option<PathBuf>,
    /// Print a report as JSON (the samples then need -o FILE)
    #[arg(long, help_heading = "Report")]
    pub json: bool,
    /// What makes a warning a failure.
    #[command(flatten)]
    pub strictness: Strictness,
    /// How it works.
    #[command(flatten)]
    pub work: Work,
}

/// Arguments of `extract`.
#[derive(Debug, Clone, Args)]
pub struct Extract {
    /// The recording.
    #[command(flatten)]
    pub record: OneChannel,
    /// The result.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Significant digits, 1 to 15, or "shortest" for the fewest that restore every bit
    #[arg(long, value_name = "N", default_value = "shortest", value_parser = digits, hide_short_help = true,
        help_heading = "Output")]
    pub digits: Digits,
    /// What makes a warning a failure.
    #[command(flatten)]
    pub strictness: Strictness,
}

/// How far around the given fundamental `harmonics --refine` searches, in percent.
pub const REFINE_SPAN: f64 = 2.0;

/// Arguments of `harmonics`.
#[derive(Debug, Clone, Args)]
pub struct Harmonics {
    /// The recording.
    #[command(flatten)]
    pub record: OneChannel,
    /// The result.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Stand file; not needed for a result of compensate
    #[arg(long, value_name = "FILE", help_heading = "Stand")]
    pub stand: Option<PathBuf>,
    /// Fundamental frequency
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = positive_frequency,
        help_heading = "Method")]
    pub fundamental: f64,
    /// Orders of the fundamental: ranges and single orders, as in 1-20 or 0.5,1,2
    #[arg(long, value_name = "LIST", default_value = "1-20", value_parser = orders, help_heading = "Method")]
    pub orders: Orders,
    /// Estimate the fundamental from the data, near the given one
    #[arg(long, help_heading = "Method")]
    pub refine: bool,
    /// Search range around the given fundamental, in percent
    #[arg(long, value_name = "PERCENT", default_value_t = REFINE_SPAN, requires = "refine",
        allow_negative_numbers = true, value_parser = percent, help_heading = "Method")]
    pub refine_span: f64,
    /// Units of the result
    #[arg(long, value_enum, default_value = "si", help_heading = "Output")]
    pub units: Units,
    /// Print JSON instead of a table
    #[arg(long, help_heading = "Report")]
    pub json: bool,
    /// What makes a warning a failure.
    #[command(flatten)]
    pub strictness: Strictness,
}

/// Arguments of `table`.
#[derive(Debug, Args)]
pub struct Table {
    /// The result.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Stand file
    #[arg(long, value_name = "FILE", help_heading = "Stand")]
    pub stand: PathBuf,
    /// First frequency
    #[arg(long, value_name = "HZ", default_value = "0", allow_negative_numbers = true, value_parser = frequency,
        help_heading = "Method")]
    pub from: f64,
    /// Last frequency
    #[arg(long, value_name = "HZ", default_value = "2500", allow_negative_numbers = true, value_parser = frequency,
        help_heading = "Method")]
    pub to: f64,
    /// Frequency step
    #[arg(long, value_name = "HZ", default_value = "10", allow_negative_numbers = true,
        value_parser = positive_frequency, help_heading = "Method")]
    pub step: f64,
    /// Add standard uncertainties, propagated from those of the stand's constants and effects; a cell is empty if its
    /// uncertainty is unknown
    #[arg(long, help_heading = "Method")]
    pub uncertainty: bool,
    /// Print JSON instead of CSV
    #[arg(long, help_heading = "Report")]
    pub json: bool,
}

/// Arguments of `predict`.
#[derive(Debug, Args)]
pub struct Predict {
    /// The result.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Stand file
    #[arg(long, value_name = "FILE", help_heading = "Stand")]
    pub stand: PathBuf,
    /// Units of the result
    #[arg(long, value_enum, default_value = "si", help_heading = "Output")]
    pub units: Units,
    /// Print JSON instead of a table
    #[arg(long, help_heading = "Report")]
    pub json: bool,
}

/// Arguments of `inspect`.
#[derive(Debug, Clone, Args)]
pub struct Inspect {
    /// Recordings to inspect, folders and patterns such as 'logs/**/*.csv', or - for standard input; several are compared
    /// with each other, or reported one by one with -o FOLDER/
    #[arg(value_name = "FILE", required_unless_present = "files_from")]
    pub files: Vec<PathBuf>,
    /// The result.
    #[command(flatten)]
    pub result: OutputArgs,
    /// How the files are read.
    #[command(flatten)]
    pub reading: Reading,
    /// Of many recordings, how.
    #[command(flatten)]
    pub many: BatchOptions,
    /// Plot the channels to an SVG file
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(svg_file),
        help_heading = "Report")]
    pub plot: Option<PathBuf>,
    /// Print JSON instead of a table
    #[arg(long, help_heading = "Report")]
    pub json: bool,
    /// What makes a warning a failure.
    #[command(flatten)]
    pub strictness: Strictness,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
    }
}
