//! The options of a verb that takes many recordings, one at a time.

use std::fmt;
use std::path::PathBuf;

use clap::Args;

use super::OutputArgs;
use super::values::result_file;
use crate::io::sum;

/// Many recordings, each read by itself.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Many recordings")]
pub struct BatchOptions {
    /// Also process the recordings listed in a file, one path per line (- for standard input)
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub files_from: Option<PathBuf>,
    /// Paths of --files-from end with a zero byte instead of a newline
    #[arg(short = '0', long, requires = "files_from", hide_short_help = true)]
    pub null: bool,
    /// Names of the results in the folder of -o: {stem} and {ext} are the recording's name before and after its last
    /// dot, {name} is all of it
    #[arg(long, value_name = "TEMPLATE", value_parser = template, hide_short_help = true)]
    pub name: Option<String>,
    /// Skip recordings whose results exist and, by the manifest, were made from the same recording, stand, options and
    /// version; outdated results are replaced
    #[arg(long, hide_short_help = true)]
    pub skip_existing: bool,
    /// List of inputs and results, a JSON line for each recording [default: torqcomp-manifest.jsonl in the folder of
    /// -o]
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub manifest: Option<PathBuf>,
    /// Write a CSV table with a row for each recording
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub summary: Option<PathBuf>,
    /// Recordings processed in parallel [default: SLURM_CPUS_PER_TASK, else the cores that this process may use]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024),
        hide_short_help = true)]
    pub jobs: Option<u16>,
    /// Start no further recording after the first failure
    #[arg(long, conflicts_with = "max_failures", hide_short_help = true)]
    pub fail_fast: bool,
    /// Start no further recording after N failures
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), hide_short_help = true)]
    pub max_failures: Option<u32>,
    /// Process only the I-th of N parts of the recordings, I from 1; each stays in its part when others are added
    #[arg(long, value_name = "I/N", value_parser = shard, hide_short_help = true)]
    pub shard: Option<Shard>,
    /// List what would be done, but write nothing
    #[arg(long, hide_short_help = true)]
    pub dry_run: bool,
}

impl BatchOptions {
    /// Whether one of these options is given.
    pub fn is_asked(&self) -> bool {
        self.files_from.is_some()
            || self.name.is_some()
            || self.skip_existing
            || self.manifest.is_some()
            || self.summary.is_some()
            || self.jobs.is_some()
            || self.fail_fast
            || self.max_failures.is_some()
            || self.shard.is_some()
            || self.dry_run
    }

    /// Number of failures after which no further recording is started.
    pub fn most_failures(&self) -> Option<u32> {
        match self.fail_fast {
            true => Some(1),
            false => self.max_failures,
        }
    }
}

/// Arguments of `merge`.
///
/// The last run of each manifest counts. The table is written only if the runs are one job (same verb, options, stand and
/// version) with nothing missing; a recording in several manifests must have the same result in each.
#[derive(Debug, Args)]
pub struct Merge {
    /// Manifests of the runs, folders with manifests, or patterns such as 'out/*.jsonl'
    #[arg(value_name = "MANIFEST", required = true)]
    pub manifests: Vec<PathBuf>,
    /// The table.
    #[command(flatten)]
    pub result: OutputArgs,
    /// Print a report as JSON (the table then needs -o FILE)
    #[arg(long, help_heading = "Report")]
    pub json: bool,
}

/// A part of many recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 1.
    pub index: u32,
    /// How many parts there are.
    pub of: u32,
}

impl Shard {
    /// Whether a recording with this path below its root is in the part: the first eight bytes of the path's SHA-256,
    /// as a number, modulo N is I − 1.
    pub(crate) fn takes(self, relative: &str) -> bool {
        sum::number_of(relative) % u64::from(self.of) == u64::from(self.index - 1)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

/// A part, as in `3/8`.
pub(crate) fn shard(text: &str) -> Result<Shard, String> {
    let parts = text.split_once('/');
    let numbers = parts.and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match numbers {
        Some((index, of)) if (1..=of).contains(&index) => Ok(Shard { index, of }),
        _ => Err("expected a part of all, from 1/N to N/N, such as 3/8".to_owned()),
    }
}

/// Placeholders for parts of the recording's name in the name of a result.
const PLACEHOLDERS: [&str; 3] = ["{stem}", "{ext}", "{name}"];

/// A file-name template.
pub(crate) fn template(text: &str) -> Result<String, String> {
    let mut rest = text.to_owned();
    for placeholder in PLACEHOLDERS {
        rest = rest.replace(placeholder, "");
    }
    if rest.contains(['{', '}']) {
        return Err("expected {stem}, {ext} or {name} in braces, and no other".to_owned());
    }
    if rest.contains(['/', '\\']) {
        return Err(
            "expected a name without a folder: the folders are those of the recordings".to_owned(),
        );
    }
    result_file(PathBuf::from(text))?;
    match text.contains("{stem}") || text.contains("{name}") {
        true => Ok(text.to_owned()),
        false => Err(
            "expected {stem} or {name} in it, so that each recording has its own result".to_owned(),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_counted_from_one() {
        assert_eq!(shard("3/8").unwrap(), Shard { index: 3, of: 8 });
        assert!(shard("0/8").is_err() && shard("9/8").is_err() && shard("3").is_err());
        // The first bytes of the SHA-256 of "abc" (FIPS 180-2, B.1) are 0xba7816bf8f01cfea: even, and 2 modulo 7.
        assert!(shard("3/7").unwrap().takes("abc") && !shard("2/7").unwrap().takes("abc"));
        assert!(shard("1/2").unwrap().takes("abc"));
    }

    #[test]
    fn templates_name_each_recording() {
        assert_eq!(template("{stem}.torque.csv").unwrap(), "{stem}.torque.csv");
        assert!(template("torque.csv").unwrap_err().contains("{stem}"));
        assert!(template("{stam}.csv").unwrap_err().contains("braces"));
        assert!(template("a/{stem}.csv").unwrap_err().contains("folder"));
        assert!(
            template("{stem}.parquet")
                .unwrap_err()
                .contains("{stem}.csv")
        );
        assert!(template("{ext}").is_err());
    }
}
