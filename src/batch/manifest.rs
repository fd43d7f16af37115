//! Provenance of results: a JSON-lines file, appended to durably before the results are renamed.

use std::collections::{HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cli::many::Shard;
use crate::failure::Failure;
use crate::file_name::{self, ShowPath};
use crate::io::json_lines::JsonLines;
use crate::io::{storage, sum};
use crate::outcome::RecordFigures;
use crate::warning::Warning;

/// Name and version of the line format.
pub(crate) const SCHEMA: &str = "torqcomp.manifest/1";
/// Start of every manifest.
pub(super) const BEGINNING: &str = "{\"schema\":\"torqcomp.manifest/";
/// Start and end of the name of a manifest in the folder of results.
const NAME: [&str; 2] = ["torqcomp-manifest", ".jsonl"];

/// What one recording became.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct ManifestEntry {
    /// Name and version of the form of this line.
    pub(super) schema: String,
    /// Version of torqcomp.
    pub(super) version: String,
    #[serde(flatten)]
    pub(super) made_by: MadeBy,
    /// Path of the recording below its root, the folders separated by `/`.
    pub(super) file: String,
    /// Path of the recording as given.
    pub(super) input: String,
    #[serde(flatten)]
    pub(super) made_from: MadeFrom,
    /// The results.
    pub(super) outputs: Vec<OutputSum>,
    /// Exit code that a run over this recording alone has.
    pub(super) exit: u8,
    /// Why the recording failed; `null` if it did not.
    pub(super) error: Option<String>,
    /// Warnings, each with a stable code.
    pub(super) warnings: Vec<NotedWarning>,
    #[serde(flatten)]
    pub(super) figures: RecordFigures,
    /// Processing time, in s.
    pub(super) seconds: f64,
}

/// What a run over many recordings is about to do: the line before those of its recordings.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct RunBegin {
    /// Name and version of the form of this line.
    pub(super) schema: String,
    /// Version of torqcomp.
    pub(super) version: String,
    #[serde(flatten)]
    pub(super) made_by: MadeBy,
    /// Which part of the recordings, as `3/8`; `null` if all.
    pub(super) shard: Option<String>,
    /// All recordings of the job.
    pub(super) all: WholeList,
    /// Recordings of this run, by their paths below their roots.
    pub(super) files: Vec<String>,
}

/// All recordings of a job, without their names: the same of all its parts, if they saw the same recordings.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct WholeList {
    /// Number of recordings.
    pub(super) recordings: usize,
    /// SHA-256 of the paths of the recordings below their roots, sorted, a zero byte after each.
    pub(super) sha256: String,
}

impl WholeList {
    pub(super) fn of<'a>(files: impl Iterator<Item = &'a str>) -> Self {
        let mut files: Vec<&str> = files.collect();
        files.sort_unstable();
        let text: String = files.iter().flat_map(|file| [*file, "\0"]).collect();
        Self {
            recordings: files.len(),
            sha256: sum::of_bytes(text.as_bytes()),
        }
    }
}

/// That a run has come to its end: the line after those of its recordings.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct RunEnd {
    /// Name and version of the form of this line.
    pub(super) schema: String,
    /// Version of torqcomp.
    pub(super) version: String,
    /// Paths of the recordings whose results existed; their lines are from an earlier run.
    pub(super) skipped: Vec<String>,
}

/// A line of a manifest.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum ManifestLine {
    Entry(Box<ManifestEntry>),
    Begin(RunBegin),
    End(RunEnd),
}

impl ManifestLine {
    /// Parses a line; `None` if it is truncated, or of another version.
    pub(super) fn read(line: &[u8]) -> Option<Self> {
        let line: Self = serde_json::from_slice(line).ok()?;
        let schema = match &line {
            Self::Entry(entry) => &entry.schema,
            Self::Begin(run) => &run.schema,
            Self::End(run) => &run.schema,
        };
        (schema == SCHEMA).then_some(line)
    }
}

/// A verb and its options.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct MadeBy {
    /// The verb.
    pub(super) verb: String,
    /// Given options that may affect the result.
    pub(super) options: Vec<String>,
}

/// The content that a result was made from; `None` where it could not be read, or where no stand is needed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct MadeFrom {
    /// SHA-256 of the recording; `null` if it could not be read.
    pub(super) input_sha256: Option<String>,
    /// Path of the stand file; `null` without one.
    pub(super) stand: Option<String>,
    /// SHA-256 of the stand file; `null` without one.
    pub(super) stand_sha256: Option<String>,
}

/// A result.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct OutputSum {
    /// Path of the result below the folder of the results.
    pub(super) file: String,
    /// SHA-256 of the result.
    pub(super) sha256: String,
}

/// A warning as it was said.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema, Deserialize)]
pub(crate) struct NotedWarning {
    /// Stable code of the warning.
    pub(super) code: String,
    /// Human-readable message.
    pub(super) message: String,
}

impl NotedWarning {
    pub(super) fn of(warning: &Warning) -> Self {
        Self {
            code: warning.code.to_owned(),
            message: warning.message.clone(),
        }
    }
}

impl MadeFrom {
    /// Checksums of a recording and of a stand file.
    ///
    /// # Errors
    /// If one of them cannot be read.
    pub(super) fn read(input: &Path, stand: Option<&Path>) -> Result<Self, Failure> {
        let sum = |path: &Path| sum::of_file(path).map_err(|error| Failure::reading(path, &error));
        Ok(Self {
            input_sha256: Some(sum(input)?),
            stand: stand.map(|path| path.shown().to_string()),
            stand_sha256: stand.map(sum).transpose()?,
        })
    }

    /// Whether both have the same content, whatever their names.
    fn is_same(&self, other: &Self) -> bool {
        self.input_sha256 == other.input_sha256 && self.stand_sha256 == other.stand_sha256
    }
}

impl ManifestEntry {
    /// An entry of this version without further information.
    pub(super) fn new(made_by: MadeBy, file: &str, input: &str) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            made_by,
            file: file.to_owned(),
            input: input.to_owned(),
            made_from: MadeFrom::default(),
            outputs: Vec::new(),
            exit: 1,
            error: None,
            warnings: Vec::new(),
            figures: RecordFigures::default(),
            seconds: 0.0,
        }
    }

    /// The difference from another result of the same recording, if any.
    pub(super) fn difference(&self, other: &Self) -> Option<&'static str> {
        let differs = [
            (
                !self.made_from.is_same(&other.made_from),
                "recording or stand",
            ),
            (self.exit != other.exit, "exit code"),
            (self.error != other.error, "reason of the failure"),
            (self.outputs != other.outputs, "result"),
            (self.warnings != other.warnings, "warnings"),
            (self.figures != other.figures, "figures"),
        ];
        let first = differs.into_iter().find(|(differs, _)| *differs);
        first.map(|(_, what)| what)
    }

    fn key(&self) -> (String, String) {
        (self.made_by.verb.clone(), self.file.clone())
    }

    /// Whether the recording failed.
    pub(super) fn has_failed(&self) -> bool {
        !matches!(self.exit, 0 | 3)
    }
}

impl RunBegin {
    pub(super) fn new(
        made_by: MadeBy,
        shard: Option<String>,
        all: WholeList,
        files: Vec<String>,
    ) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            made_by,
            shard,
            all,
            files,
        }
    }
}

impl RunEnd {
    pub(super) fn new(skipped: Vec<String>) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            skipped,
        }
    }
}

/// History of the results in a folder, from manifests.
#[derive(Debug, Default)]
pub(super) struct History {
    /// The last entry for each recording and command; the manifest read last takes precedence.
    last: HashMap<(String, String), ManifestEntry>,
    /// Those of them that are in the manifest read last.
    of_last: HashSet<(String, String)>,
    /// All results ever made, and the recordings they were made from.
    made: HashMap<String, HashSet<String>>,
    /// Number of unreadable lines: truncated, or of another kind.
    pub(super) unread: usize,
}

impl History {
    /// Reads manifests, skipping missing ones.
    ///
    /// # Errors
    /// If an existing one cannot be read.
    pub(super) fn read(manifests: &[PathBuf]) -> Result<Self, Failure> {
        let mut history = Self::default();
        for path in manifests {
            history.of_last.clear();
            match storage::read(path) {
                Ok(bytes) => bytes.split(|b| *b == b'\n').for_each(|l| history.take(l)),
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(Failure::reading(path, &error)),
            }
        }
        Ok(history)
    }

    fn take(&mut self, line: &[u8]) {
        let entry = match ManifestLine::read(line) {
            Some(ManifestLine::Entry(entry)) => entry,
            Some(ManifestLine::Begin(_) | ManifestLine::End(_)) => return,
            None => {
                self.unread += usize::from(!line.is_empty());
                return;
            }
        };
        for output in &entry.outputs {
            let inputs = self.made.entry(output.file.clone()).or_default();
            inputs.insert(entry.input.clone());
        }
        self.of_last.insert(entry.key());
        self.last.insert(entry.key(), *entry);
    }

    /// Whether the manifest read last has an entry for that recording and command.
    pub(super) fn is_in_last(&self, entry: &ManifestEntry) -> bool {
        self.of_last.contains(&entry.key())
    }

    /// Results made by torqcomp, by their paths relative to the folder of results.
    pub(super) fn results(&self) -> impl Iterator<Item = &str> {
        self.made.keys().map(String::as_str)
    }

    /// Whether a result was made from the recording at that path before.
    pub(super) fn made(&self, output: &str, input: &str) -> bool {
        let inputs = self.made.get(output);
        inputs.is_some_and(|inputs| inputs.contains(input))
    }

    /// The entry of a recording whose results need not be made again: they exist unchanged in `folder`, made by the
    /// same version, command and options from the same content, and have the same names.
    pub(super) fn standing(
        &self,
        folder: &Path,
        outputs: &[String],
        wanted: &ManifestEntry,
    ) -> Option<&ManifestEntry> {
        let entry = self.last.get(&wanted.key())?;
        let is_same = !entry.has_failed()
            && entry.version == wanted.version
            && entry.made_by == wanted.made_by
            && entry.made_from.is_same(&wanted.made_from)
            && entry.outputs.len() == outputs.len();
        let is_there = |output: &OutputSum| {
            let sum = sum::of_file(&folder.join(file_name::path_of(&output.file)));
            outputs.contains(&output.file) && sum.is_ok_and(|sum| sum == output.sha256)
        };
        (is_same && entry.outputs.iter().all(is_there)).then_some(entry)
    }
}

/// The manifests in a folder of results.
pub(super) fn in_folder(folder: &Path) -> Vec<PathBuf> {
    let is_one = |path: &PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy());
        name.is_some_and(|name| name.starts_with(NAME[0]) && name.ends_with(NAME[1]))
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(is_one).collect();
    found.sort();
    found
}

/// The default manifest of a folder of results, or of a part of them.
pub(super) fn usual(folder: &Path, shard: Option<Shard>) -> PathBuf {
    let [front, end] = NAME;
    folder.join(match shard {
        Some(Shard { index, of }) => format!("{front}.{index}-of-{of}{end}"),
        None => format!("{front}{end}"),
    })
}

/// Opens a manifest for appending, creating it if necessary.
///
/// # Errors
/// If it cannot be written.
pub(super) fn open(path: &Path, sync: bool) -> Result<JsonLines, Failure> {
    JsonLines::open(path, BEGINNING, sync)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::print;

    #[test]
    fn a_cut_last_line_costs_that_line_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = usual(folder.path(), None);
        let made_by = MadeBy {
            verb: "compensate".to_owned(),
            options: vec!["--band=800".to_owned()],
        };
        let mut entry = ManifestEntry::new(made_by, "a/ü x.csv", "logs/a/ü x.csv");
        entry.exit = 0;
        entry.figures.rms = Some(0.1);
        open(&path, true)
            .unwrap()
            .append(print::json_line(&entry))
            .unwrap();
        let whole = std::fs::read(&path).unwrap();
        assert!(whole.starts_with(BEGINNING.as_bytes()) && whole.ends_with(b"}\n"));
        for cut in 1..whole.len() {
            std::fs::write(&path, [&whole, &whole[..cut]].concat()).unwrap();
            open(&path, false)
                .unwrap()
                .append(print::json_line(&entry))
                .unwrap();
            let history = History::read(std::slice::from_ref(&path)).unwrap();
            // A line that only lacks its line end is complete.
            assert_eq!(history.unread, usize::from(cut < whole.len() - 1), "{cut}");
            let key = ("compensate".to_owned(), "a/ü x.csv".to_owned());
            assert_eq!(history.last[&key], entry);
        }
    }
}
