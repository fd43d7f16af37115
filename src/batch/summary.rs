//! Results for all recordings: a text table, a CSV file, a JSON document, and the outcome of the run.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::manifest::{ManifestEntry, NotedWarning};
use super::plan::BatchPlan;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;
use crate::io::output::{self, Output};
use crate::io::storage::Stored;
use crate::outcome::Outcome;
use crate::print::{self, plural, rounded, some_of};
use crate::progress::{Amount, rate};

/// Headings of the CSV file.
const HEADINGS: [&str; 12] = [
    "file",
    "exit",
    "samples",
    "rate_hz",
    "band_hz",
    "unit",
    "rms",
    "peak",
    "noise_rms",
    "warnings",
    "codes",
    "error",
];
/// Significant digits in the CSV file.
const DIGITS: u32 = 12;
/// Maximum number of files of one kind that are listed.
pub(super) const LISTED: usize = 10;

/// Name and version of the document of a run.
pub(crate) const SCHEMA: &str = "torqcomp.batch/1";

/// Status of a recording that was worked on, well or not.
const MADE: &str = "made";
/// Status of a recording whose results were there.
const SKIPPED: &str = "skipped";

/// What became of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct Treated {
    /// `made` (processed, successfully or not), or `skipped`: the results existed.
    status: &'static str,
    #[serde(flatten)]
    pub(super) entry: ManifestEntry,
}

impl Treated {
    pub(super) fn made(entry: ManifestEntry) -> Self {
        let status = MADE;
        Self { status, entry }
    }

    pub(super) fn skipped(entry: ManifestEntry) -> Self {
        let status = SKIPPED;
        Self { status, entry }
    }

    pub(super) fn is_skipped(&self) -> bool {
        self.status == SKIPPED
    }
}

/// Start of the table of a run.
pub(super) fn beginning() -> String {
    HEADINGS.join(",")
}

/// Whether a file is the table of a run.
pub(super) fn is_one(path: &Path) -> bool {
    let beginning = beginning();
    let mut head = Vec::new();
    let read = Stored::open(path)
        .and_then(|file| file.take(beginning.len() as u64).read_to_end(&mut head));
    read.is_ok() && head == beginning.as_bytes()
}

/// Results for all recordings.
pub(super) struct BatchResult<'a> {
    pub(super) plan: &'a BatchPlan<'a>,
    /// In the order of the recordings; `None` for those that were not started.
    pub(super) treated: Vec<Option<Treated>>,
    pub(super) seconds: f64,
}

/// A run over many recordings.
#[derive(Serialize, JsonSchema)]
pub(crate) struct BatchReport<'a> {
    /// The verb.
    verb: &'a str,
    /// Folder of the results.
    output: String,
    /// Path of the manifest.
    manifest: String,
    /// Number of recordings.
    recordings: usize,
    /// Recordings processed successfully.
    made: usize,
    /// Recordings whose results existed.
    skipped: usize,
    /// Recordings that failed.
    failed: usize,
    /// Recordings not started, after failures.
    not_begun: usize,
    /// Time that the run took, in s.
    seconds: f64,
    /// Files in folders whose content is not a recording.
    left_out: &'a [String],
    /// Lines of the recordings that were started, with the result of each.
    files: Vec<&'a Treated>,
}

impl BatchResult<'_> {
    /// Writes the tables and returns the outcome of the run.
    ///
    /// # Errors
    /// If a recording failed, or a table cannot be written.
    pub(super) fn conclude(&self, summary: Option<Output>) -> Result<Outcome, Failure> {
        if let Some(mut summary) = summary {
            summary.write(&csv(self.entries()))?;
            summary.finish()?;
        }
        let task = self.plan.task;
        if task.as_json {
            output::print(&print::document(SCHEMA, &self.report()))?;
        } else {
            print::note(&self.text());
        }
        ended(self.entries(), self.not_begun())
    }

    fn entries(&self) -> impl Iterator<Item = &ManifestEntry> + Clone {
        self.treated.iter().flatten().map(|treated| &treated.entry)
    }

    fn skipped(&self) -> usize {
        let treated = self.treated.iter().flatten();
        treated.filter(|treated| treated.is_skipped()).count()
    }

    fn not_begun(&self) -> usize {
        self.treated
            .iter()
            .filter(|treated| treated.is_none())
            .count()
    }

    fn report(&self) -> BatchReport<'_> {
        let count = self.treated.len();
        let (skipped, failed, not_begun) =
            (self.skipped(), failed(self.entries()), self.not_begun());
        BatchReport {
            verb: self.plan.task.verb,
            output: self.plan.folder.shown().to_string(),
            manifest: self.plan.manifest.shown().to_string(),
            recordings: count,
            made: count - skipped - failed - not_begun,
            skipped,
            failed,
            not_begun,
            seconds: self.seconds,
            left_out: &self.plan.left_out,
            files: self.treated.iter().flatten().collect(),
        }
    }

    /// The table, and information common to all recordings.
    fn text(&self) -> String {
        let headings = [
            "file", "samples", "rate/Hz", "band/Hz", "rms", "peak", "noise", "unit", "warnings",
            "time/s",
        ];
        let mut rows = vec![headings.map(str::to_owned).to_vec()];
        rows.extend(self.treated.iter().flatten().map(row));
        let mut text = print::columns(&rows);
        text += &self.totals();
        text += &warnings(self.entries(), &self.plan.manifest.shown().to_string());
        let left_out = &self.plan.left_out;
        if !left_out.is_empty() {
            let names = some_of(left_out, left_out.len(), LISTED);
            text += &format!("skipped, not recordings judging by their content: {names}\n");
        }
        if self.plan.history.unread > 0 {
            let lines = plural(self.plan.history.unread as u64, "line");
            text += &format!(
                "{lines} of the manifest cannot be read and are ignored: truncated, or of another version\n"
            );
        }
        text
    }

    fn totals(&self) -> String {
        let report = self.report();
        let mut parts = vec![format!("{} done", report.made)];
        let others = [
            (report.skipped, "skipped (unchanged)"),
            (report.failed, "failed"),
            (report.not_begun, "not begun"),
        ];
        let others = others.into_iter().filter(|(count, _)| *count > 0);
        parts.extend(others.map(|(count, what)| format!("{count} {what}")));
        let is_made = |treated: &Option<Treated>| treated.as_ref().is_some_and(|t| !t.is_skipped());
        let files = self.plan.files.iter().zip(&self.treated);
        let bytes = files
            .filter(|(_, t)| is_made(t))
            .map(|(file, _)| file.bytes);
        let amount = Amount {
            count: (report.recordings - report.skipped - report.not_begun) as u64,
            bytes: bytes.sum(),
        };
        format!(
            "{} into {}: {}; {} s ({})\n",
            plural(report.recordings as u64, "recording"),
            report.output,
            parts.join(", "),
            rounded(self.seconds, 3),
            rate(amount, self.seconds.max(1e-3))
        )
    }
}

/// Number of failed recordings.
pub(super) fn failed<'a>(entries: impl Iterator<Item = &'a ManifestEntry>) -> usize {
    entries.filter(|entry| entry.has_failed()).count()
}

/// Reports which recordings failed or lost data, and the resulting outcome of a run.
///
/// # Errors
/// If one failed.
pub(super) fn ended<'a>(
    entries: impl Iterator<Item = &'a ManifestEntry> + Clone,
    not_begun: usize,
) -> Result<Outcome, Failure> {
    print::say(&failures(entries.clone()));
    let failed = failed(entries.clone());
    if failed > 0 {
        let count = entries.count() + not_begun;
        let others = match not_begun {
            _ if failed == count => String::new(),
            0 => "; the others are done".to_owned(),
            count => format!(", {count} were not started"),
        };
        return Err(ErrorCode::RecordingsFailed.failed(format_args!(
            "{failed} of {} failed{others}",
            plural(count as u64, "recording")
        )));
    }
    match entries.into_iter().any(|entry| entry.exit != 0) {
        true => Ok(Outcome::WithLoss),
        false => Ok(Outcome::Done),
    }
}

/// Number of recordings concerned by each warning; `place` says where the full texts are.
pub(super) fn warnings<'a>(
    entries: impl Iterator<Item = &'a ManifestEntry>,
    place: &str,
) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for entry in entries {
        for code in codes(&entry.warnings) {
            *counts.entry(code).or_default() += 1;
        }
    }
    if counts.is_empty() {
        return String::new();
    }
    let each = counts
        .iter()
        .map(|(code, count)| format!("{code} in {count}"));
    let each: Vec<String> = each.collect();
    format!(
        "warnings: {} (their messages are in {place})\n",
        each.join(", ")
    )
}

/// The recordings that failed or lost data, and why.
fn failures<'a>(entries: impl Iterator<Item = &'a ManifestEntry>) -> String {
    let line = |entry: &ManifestEntry| {
        let (word, input) = (word(entry.exit), &entry.input);
        let why = entry.error.as_deref();
        let why = why.unwrap_or("data were lost, or there was a warning and --strict was given");
        match why.starts_with(input) {
            true => format!("torqcomp: {word}: {why}\n"),
            false => format!("torqcomp: {word}: {input}: {why}\n"),
        }
    };
    entries.filter(|entry| entry.exit != 0).map(line).collect()
}

/// The outcome of a recording, as a word.
fn word(exit: u8) -> &'static str {
    match exit {
        0 => "done",
        3 => "incomplete",
        _ => "failed",
    }
}

/// The distinct codes of warnings, in order.
fn codes(warnings: &[NotedWarning]) -> Vec<&str> {
    let mut codes: Vec<&str> = Vec::new();
    for warning in warnings {
        if !codes.contains(&warning.code.as_str()) {
            codes.push(&warning.code);
        }
    }
    codes
}

/// A row of the text table; unknown values are `-`.
fn row(treated: &Treated) -> Vec<String> {
    let entry = &treated.entry;
    let figures = &entry.figures;
    let text = |value: Option<f64>, digits| {
        value.map_or_else(|| "-".to_owned(), |value| rounded(value, digits))
    };
    let samples = figures.samples.map(|samples| samples.to_string());
    vec![
        entry.file.clone(),
        samples.unwrap_or_else(|| "-".to_owned()),
        text(figures.rate_hz, 6),
        text(figures.band_hz, 4),
        text(figures.rms, 4),
        text(figures.peak, 4),
        text(figures.noise_rms, 3),
        figures.unit.clone().unwrap_or_else(|| "-".to_owned()),
        entry.warnings.len().to_string(),
        match treated.status {
            SKIPPED => SKIPPED.to_owned(),
            _ if entry.has_failed() => "failed".to_owned(),
            _ => rounded(entry.seconds, 2),
        },
    ]
}

/// The table as CSV, in the order of folders and names. It contains no times, so that the same recordings give the same
/// bytes, whether in one run or merged from several.
pub(super) fn csv<'a>(entries: impl Iterator<Item = &'a ManifestEntry>) -> Vec<u8> {
    let mut entries: Vec<&ManifestEntry> = entries.collect();
    entries.sort_by(|a, b| a.file.split('/').cmp(b.file.split('/')));
    let mut rows = csv::Writer::from_writer(Vec::new());
    let written = "a table in memory can be written";
    rows.write_record(HEADINGS).expect(written);
    for entry in entries {
        let figures = &entry.figures;
        // As in a manifest, non-finite values are unknown.
        let text = |value: Option<f64>| {
            let value = value.filter(|v| v.is_finite());
            value.map_or_else(String::new, |v| rounded(v, DIGITS))
        };
        let cells = [
            entry.file.clone(),
            entry.exit.to_string(),
            figures.samples.map_or_else(String::new, |n| n.to_string()),
            text(figures.rate_hz),
            text(figures.band_hz),
            figures.unit.clone().unwrap_or_default(),
            text(figures.rms),
            text(figures.peak),
            text(figures.noise_rms),
            entry.warnings.len().to_string(),
            codes(&entry.warnings).join(" "),
            entry.error.clone().unwrap_or_default(),
        ];
        rows.write_record(&cells).expect(written);
    }
    rows.into_inner().expect(written)
}
