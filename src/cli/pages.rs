//! Arguments of the verbs that write what an installed program brings along.

use clap::Args;
use clap_complete::Shell;

use super::OutputArgs;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct Completions {
    /// Shell to generate the script for
    #[arg(value_enum)]
    pub shell: Shell,
    /// The script.
    #[command(flatten)]
    pub result: OutputArgs,
}

/// Arguments of `man`.
///
/// Without a verb, the page of the whole program; with -o FOLDER/ (the slash counts), its page and those of all verbs, each in
/// a file of its own.
#[derive(Debug, Args)]
pub struct Man {
    /// Verb, with its test if it has several
    #[arg(value_name = "VERB")]
    pub verb: Vec<String>,
    /// The page.
    #[command(flatten)]
    pub result: OutputArgs,
}

/// Arguments of `schema`.
///
/// Without a document, the list of them.
#[derive(Debug, Args)]
pub struct Schema {
    /// Verb, or batch (many recordings), error, manifest, log or progress
    #[arg(value_name = "DOCUMENT")]
    pub document: Option<String>,
    /// The schema.
    #[command(flatten)]
    pub result: OutputArgs,
}
