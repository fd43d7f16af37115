//! Merging of the manifests of several runs of one job, with the problems that prevent it.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::last_run::LastRun;
use super::manifest::{MadeFrom, ManifestEntry};
use super::summary::{self, LISTED};
use crate::cli::many::Shard;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;
use crate::outcome::Outcome;
use crate::print::{Report, plural, some_of};

/// Number of displayed digits of a SHA-256.
const SUM_DIGITS: usize = 12;

/// What several runs of one job made, together.
#[derive(Serialize, JsonSchema)]
pub(crate) struct Merged {
    /// The verb of the job; `null` without a run.
    verb: Option<String>,
    /// Paths of the manifests.
    manifests: Vec<String>,
    /// Number of recordings.
    recordings: usize,
    /// Recordings that failed.
    failed: usize,
    /// Recordings that are in several manifests with the same result, counted once.
    repeated: usize,
    /// Why the runs are not one finished job.
    problems: Vec<MergeProblem>,
    /// Lines of the recordings, in the order of folders and names.
    files: Vec<ManifestEntry>,
}

/// Why the runs are not one job that is done.
#[derive(Serialize, JsonSchema)]
struct MergeProblem {
    /// Stable code of the problem.
    code: &'static str,
    /// Path of the manifest that the problem is about; `null` if it is about all.
    manifest: Option<String>,
    /// Human-readable message.
    message: String,
}

impl MergeProblem {
    fn of(run: &LastRun, code: &'static str, message: String) -> Self {
        Self {
            code,
            manifest: Some(run.manifest.clone()),
            message: format!("{}: {message}", run.manifest),
        }
    }
}

impl Merged {
    /// Reads manifests and merges the last run of each.
    ///
    /// # Errors
    /// If one of them cannot be read.
    pub(crate) fn read(paths: &[PathBuf]) -> Result<Self, Failure> {
        let mut problems = Vec::new();
        let mut runs = Vec::new();
        for path in paths {
            match LastRun::read(path)? {
                Some(run) => runs.push(run),
                None => problems.push(no_run(path.shown().to_string())),
            }
        }
        for run in &runs {
            problems.extend(unfinished(run));
        }
        if let Some((first, others)) = runs.split_first() {
            problems.extend(others.iter().filter_map(|run| other_job(first, run)));
            problems.extend(other_stands(&runs));
            problems.extend(missing_parts(&runs));
        }
        let manifests = paths.iter().map(|path| path.shown().to_string());
        let verb = runs.first().map(|run| run.begin.made_by.verb.clone());
        let joined = Joined::of(runs);
        problems.extend(joined.problems);
        Ok(Self {
            verb,
            manifests: manifests.collect(),
            recordings: joined.files.len(),
            failed: summary::failed(joined.files.iter()),
            repeated: joined.repeated,
            problems,
            files: joined.files,
        })
    }

    /// The table that a single run over all recordings would write.
    ///
    /// # Errors
    /// If a problem prevents merging.
    pub(crate) fn table(&self) -> Result<Vec<u8>, Failure> {
        match self.problems.len() {
            0 => Ok(summary::csv(self.files.iter())),
            count => Err(ErrorCode::ManifestsDiffer.failed(format_args!(
                "the manifests are not one finished job ({}, listed above); no table was written",
                plural(count as u64, "problem")
            ))),
        }
    }

    /// The problems that prevent merging, one per line.
    pub(crate) fn problems(&self) -> String {
        let lines = self.problems.iter();
        lines
            .map(|problem| format!("torqcomp: [{}] {}\n", problem.code, problem.message))
            .collect()
    }

    /// Reports which recordings failed or lost data, and the outcome of a run over all.
    ///
    /// # Errors
    /// If one failed.
    pub(crate) fn ended(&self) -> Result<Outcome, Failure> {
        summary::ended(self.files.iter(), 0)
    }
}

impl Report for Merged {
    const SCHEMA: &'static str = "torqcomp.merge/1";

    fn text(&self) -> String {
        let mut text = format!(
            "{} of {}: {} done",
            plural(self.recordings as u64, "recording"),
            plural(self.manifests.len() as u64, "manifest"),
            self.recordings - self.failed
        );
        if self.failed > 0 {
            text += &format!(", {} failed", self.failed);
        }
        text.push('\n');
        if self.repeated > 0 {
            text += &format!(
                "{} in more than one manifest with the same result, counted once\n",
                plural(self.repeated as u64, "recording")
            );
        }
        text + &summary::warnings(self.files.iter(), "the manifests")
    }
}

fn no_run(manifest: String) -> MergeProblem {
    let message = format!(
        "{manifest}: no run of this version in it: another file, or truncated in its first line; run that part again, \
         and give the manifest that it writes"
    );
    MergeProblem {
        code: "no-run",
        manifest: Some(manifest),
        message,
    }
}

/// Whether a run was interrupted, or ended before its last recording.
fn unfinished(run: &LastRun) -> Option<MergeProblem> {
    let missing = run.not_done.len();
    let which = match missing {
        0 => String::new(),
        _ => format!(" ({})", some_of(&run.not_done, missing, LISTED)),
    };
    let all = plural(run.begin.files.len() as u64, "recording");
    if !run.has_ended {
        let message = format!(
            "its run was cut off, {missing} of {all} not done{which}; run it again with --skip-existing, which \
             continues it, or omit this manifest if another has its recordings"
        );
        return Some(MergeProblem::of(run, "cut-off", message));
    }
    (missing > 0).then(|| {
        let message = format!(
            "{missing} of {all} not started after failures{which}; run it again with --skip-existing and without \
             --fail-fast or --max-failures"
        );
        MergeProblem::of(run, "not-begun", message)
    })
}

/// Difference of a run's job from that of the first.
fn other_job(first: &LastRun, run: &LastRun) -> Option<MergeProblem> {
    let (begin, other) = (&run.begin, &first.begin);
    let differs = |code, what: &str, this: &str, that: &str| {
        let message = format!(
            "the {what} differs from that in {}: {this} instead of {that}; all runs of a job must use the same",
            first.manifest
        );
        Some(MergeProblem::of(run, code, message))
    };
    let options = |options: &[String]| match options.is_empty() {
        true => "none".to_owned(),
        false => options.join(" "),
    };
    if begin.version != other.version {
        let what = "version of torqcomp";
        return differs("other-version", what, &begin.version, &other.version);
    }
    if begin.made_by.verb != other.made_by.verb {
        let (this, that) = (&begin.made_by.verb, &other.made_by.verb);
        return differs("other-verb", "verb", this, that);
    }
    if begin.made_by.options != other.made_by.options {
        let this = options(&begin.made_by.options);
        let that = options(&other.made_by.options);
        return differs("other-options", "set of options", &this, &that);
    }
    if run.shard.map(|shard| shard.of) != first.shard.map(|shard| shard.of) {
        let (this, that) = (run.part(), first.part());
        return differs("other-parts", "division into parts", &this, &that);
    }
    (run.shard.is_some() && begin.all != other.all).then(|| {
        let message = format!(
            "its recordings differ from those of {} ({} instead of {}): some were added, removed or renamed between \
             the runs; run all parts again with --skip-existing",
            first.manifest, begin.all.recordings, other.all.recordings
        );
        MergeProblem::of(run, "other-recordings", message)
    })
}

/// Runs with a stand file of different content than that of the first readable recording.
fn other_stands(runs: &[LastRun]) -> Vec<MergeProblem> {
    let is_read = |entry: &&ManifestEntry| entry.made_from.input_sha256.is_some();
    let mut read = runs
        .iter()
        .flat_map(|run| run.entries.iter().map(move |entry| (run, entry)));
    let Some((first_run, first)) = read.find(|(_, entry)| is_read(entry)) else {
        return Vec::new();
    };
    let wanted = &first.made_from.stand_sha256;
    let other = |run: &LastRun| {
        let mut read = run.entries.iter().filter(is_read);
        let entry = read.find(|entry| entry.made_from.stand_sha256 != *wanted)?;
        let message = format!(
            "{} was made with a different stand file ({}) from {} of {} ({}); run all with the same stand file and \
             --skip-existing",
            entry.file,
            stand_text(&entry.made_from),
            first.file,
            first_run.manifest,
            stand_text(&first.made_from)
        );
        Some(MergeProblem::of(run, "other-stand", message))
    };
    runs.iter().filter_map(other).collect()
}

/// A stand file, for messages.
fn stand_text(made_from: &MadeFrom) -> String {
    match (&made_from.stand, &made_from.stand_sha256) {
        (Some(path), Some(sum)) => {
            let digits: String = sum.chars().take(SUM_DIGITS).collect();
            format!("{path}, SHA-256 {digits}…")
        }
        _ => "no stand file".to_owned(),
    }
}

/// Parts with recordings that no manifest covers.
fn missing_parts(runs: &[LastRun]) -> Option<MergeProblem> {
    let first = runs.first()?;
    let of = first.shard?.of;
    let all = first.begin.all.recordings;
    let mut present: BTreeMap<u32, usize> = BTreeMap::new();
    for run in runs {
        let shard = run.shard.filter(|shard| shard.of == of)?;
        present.insert(shard.index, run.begin.files.len());
    }
    let parts = of as usize - present.len();
    let recordings = all.saturating_sub(present.values().sum());
    // A part may have no recordings.
    if parts == 0 || recordings == 0 {
        return None;
    }
    let missing = (1..=of).filter(|index| !present.contains_key(index));
    let mut missing = missing.map(|index| Shard { index, of }).peekable();
    let next = missing.peek().copied()?;
    Some(MergeProblem {
        code: "missing-parts",
        manifest: None,
        message: format!(
            "no manifest of {}, with {recordings} of {}; run them (--shard {next}), or give their manifests too",
            some_of(missing, parts, LISTED),
            plural(all as u64, "recording")
        ),
    })
}

/// The recordings of all runs, without duplicates.
struct Joined {
    files: Vec<ManifestEntry>,
    repeated: usize,
    problems: Vec<MergeProblem>,
}

impl Joined {
    fn of(runs: Vec<LastRun>) -> Self {
        let mut found: HashMap<String, (usize, ManifestEntry)> = HashMap::new();
        let mut repeated = HashSet::new();
        let mut differing: BTreeMap<(usize, usize), Vec<String>> = BTreeMap::new();
        let names: Vec<String> = runs.iter().map(|run| run.manifest.clone()).collect();
        for (i, run) in runs.into_iter().enumerate() {
            for entry in run.entries {
                match found.entry(entry.file.clone()) {
                    Entry::Vacant(place) => {
                        place.insert((i, entry));
                    }
                    Entry::Occupied(place) => {
                        let (first, other) = place.get();
                        match entry.difference(other) {
                            None => {
                                repeated.insert(entry.file);
                            }
                            Some(what) => differing
                                .entry((*first, i))
                                .or_default()
                                .push(format!("{} ({what})", entry.file)),
                        }
                    }
                }
            }
        }
        let problems = differing
            .into_iter()
            .map(|((first, i), files)| differing_results([&names[first], &names[i]], &files));
        let problems = problems.collect();
        let mut files: Vec<ManifestEntry> = found.into_values().map(|(_, entry)| entry).collect();
        files.sort_by(|a, b| a.file.split('/').cmp(b.file.split('/')));
        Self {
            files,
            repeated: repeated.len(),
            problems,
        }
    }
}

fn differing_results([first, other]: [&String; 2], files: &[String]) -> MergeProblem {
    MergeProblem {
        code: "differing-results",
        manifest: Some(other.clone()),
        message: format!(
            "{other}: the results of {} differ from those in {first}: {}; omit the outdated manifest, or run these \
             recordings again",
            plural(files.len() as u64, "recording"),
            some_of(files, files.len(), LISTED)
        ),
    }
}
