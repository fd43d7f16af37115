//! Batch processing: which recordings are selected, where their results go, and the provenance of the results.
//!
//! Each recording is processed as by a separate run. Before its results are renamed, a manifest line with their SHA-256
//! is synced: a killed run can be resumed, and every existing result has a line.

mod content;
mod last_run;
mod list;
mod manifest;
mod merge;
mod plan;
mod summary;

use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

#[cfg(test)]
pub(crate) use self::manifest::ManifestLine;
pub(crate) use self::manifest::SCHEMA as MANIFEST_SCHEMA;
pub(crate) use self::merge::Merged;
#[cfg(test)]
pub(crate) use self::summary::BatchReport;
pub(crate) use self::summary::SCHEMA as BATCH_SCHEMA;

use self::list::Listing;
use self::manifest::{MadeFrom, ManifestEntry, NotedWarning, OutputSum, RunEnd};
pub(crate) use self::plan::NEED_FOLDER;
use self::plan::{BatchFile, BatchPlan};
use self::summary::{BatchResult, Treated};
use crate::cli::{BatchOptions, OutputArgs};
use crate::failure::{ErrorCode, Failure};
use crate::file_name::{self, ShowPath};
use crate::io::json_lines::JsonLines;
use crate::io::output::{self, Output, end_of_links};
use crate::outcome::{Made, Outcome};
use crate::progress::{Amount, Progress, Task};
use crate::{log, parallel, print};

/// A command applied to many recordings.
pub(crate) struct BatchTask<'a> {
    pub(crate) verb: &'static str,
    pub(crate) inputs: &'a [PathBuf],
    pub(crate) many: &'a BatchOptions,
    pub(crate) result: &'a OutputArgs,
    /// Default template of the names of its results.
    pub(crate) name: &'static str,
    /// Options for additional outputs, with their templates.
    pub(crate) beside: Vec<(&'static str, &'a Path)>,
    pub(crate) stand: Option<&'a Path>,
    /// Whether the table is printed as a JSON document.
    pub(crate) as_json: bool,
    /// Whether `--json` is the format of the results, too.
    pub(crate) makes_json: bool,
}

/// Processing of one of them.
pub(crate) struct OneRun<'a> {
    pub(crate) input: &'a Path,
    /// The main result, then the additional ones.
    pub(crate) outputs: &'a [PathBuf],
    /// Whether existing files are replaced.
    pub(crate) replace: bool,
    /// Default number of threads.
    pub(crate) threads: usize,
}

/// The command, for one recording.
type OnOne<'a> = dyn Fn(&OneRun) -> Result<Made, Failure> + Sync + 'a;

/// Whether these arguments request many recordings, each processed separately.
pub(crate) fn is_asked(inputs: &[PathBuf], many: &BatchOptions, result: &OutputArgs) -> bool {
    let output = result.output.as_deref();
    many.is_asked()
        || output.is_some_and(file_name::ends_with_separator)
        || (output.is_some_and(Path::is_dir) && is_several(inputs))
}

/// Whether these are, or may be, several recordings.
pub(crate) fn is_several(inputs: &[PathBuf]) -> bool {
    inputs.len() > 1 || inputs.iter().any(|input| list::is_several(input))
}

/// Paths with folders and patterns replaced by the recordings that they refer to.
///
/// # Errors
/// If one of them refers to none.
pub(crate) fn expand(inputs: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut paths = Vec::new();
    for input in inputs {
        if list::is_several(input) {
            let mut listing = Listing::default();
            listing.add(input, &|_| false)?;
            paths.extend(listing.files.into_iter().map(|file| file.path));
        } else {
            paths.push(input.clone());
        }
    }
    Ok(paths)
}

/// Paths of manifests, with folders and patterns replaced by theirs, without duplicates.
///
/// # Errors
/// If a folder or pattern has none.
pub(crate) fn manifests(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            found.extend(expand(std::slice::from_ref(path))?);
            continue;
        }
        let inside = manifest::in_folder(path);
        if inside.is_empty() {
            return Err(ErrorCode::NotFound
                .failed(
                    "no manifest in this folder; name the manifests, or the folder of the results",
                )
                .at(path.shown()));
        }
        found.extend(inside);
    }
    let mut seen = HashSet::new();
    found.retain(|path| seen.insert(end_of_links(path)));
    Ok(found)
}

/// Runs a command on many recordings; `options` are those that its results may depend on.
///
/// # Errors
/// If the run could not start, or some recordings failed.
pub(crate) fn run(
    task: &BatchTask,
    options: &[String],
    on_one: &OnOne,
) -> Result<Outcome, Failure> {
    let begun = Instant::now();
    let plan = BatchPlan::new(task, options)?;
    if task.many.dry_run {
        output::print(&print::visible(dry_run(&plan)))?;
        return Ok(Outcome::Done);
    }
    output::make_folder(&plan.folder)?;
    let summary = open_summary(task)?;
    let bytes = plan.files.iter().map(|file| file.bytes).sum();
    let all = Amount {
        count: plan.files.len() as u64,
        bytes,
    };
    let manifest = manifest::open(&plan.manifest, task.result.policy().sync)?;
    manifest.append(print::json_line(&plan.begin()))?;
    let running = Running {
        on_one,
        manifest,
        shared: Mutex::new(Shared {
            progress: Progress::new(Task::Recordings),
            done: Amount::default(),
            failures: 0,
            broken: None,
        }),
        plan: &plan,
        all,
    };
    let treat = |i: usize| running.treat(&plan.files[i]);
    let treated = parallel::parallel(plan.files.len(), plan.workers(), treat);
    running.end(&treated)?;
    BatchResult {
        plan: &plan,
        treated,
        seconds: begun.elapsed().as_secs_f64(),
    }
    .conclude(summary)
}

/// What would be done, one line per recording.
fn dry_run(plan: &BatchPlan) -> String {
    let line = |file: &BatchFile| {
        let outputs: Vec<PathBuf> = file.outputs.iter().map(|o| plan.result(o)).collect();
        let to = file_name::list(&outputs);
        format!(
            "{}: {} -> {to}\n",
            plan.intent(file),
            file.found.path.shown()
        )
    };
    plan.files.iter().map(line).collect()
}

/// Opens the table of all recordings. With `--skip-existing`, that of a previous run is replaced.
fn open_summary(task: &BatchTask) -> Result<Option<Output>, Failure> {
    let Some(path) = task.many.summary.as_deref() else {
        return Ok(None);
    };
    let mut policy = task.result.policy();
    policy.replace |= task.many.skip_existing && summary::is_one(path);
    let taken: Vec<&Path> = task.stand.into_iter().collect();
    Output::open(Some(path), policy, &taken).map(Some)
}

/// State of the running work.
struct Running<'a> {
    plan: &'a BatchPlan<'a>,
    on_one: &'a OnOne<'a>,
    manifest: JsonLines,
    shared: Mutex<Shared>,
    all: Amount,
}

/// State shared by the workers.
struct Shared {
    progress: Progress,
    done: Amount,
    failures: u32,
    /// Reason to stop everything.
    broken: Option<Failure>,
}

impl Running<'_> {
    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether no further recording is started.
    fn is_over(&self) -> bool {
        let shared = self.lock();
        let most = self.plan.task.many.most_failures();
        shared.broken.is_some() || most.is_some_and(|most| shared.failures >= most)
    }

    /// Records in the manifest that the run has ended.
    fn end(&self, treated: &[Option<Treated>]) -> Result<(), Failure> {
        let mut shared = self.lock();
        if let Some(failure) = shared.broken.take() {
            return Err(failure);
        }
        let skipped = treated.iter().flatten().filter(|t| t.is_skipped());
        let skipped = skipped.map(|treated| treated.entry.file.clone());
        let end = RunEnd::new(skipped.collect());
        self.manifest.append(print::json_line(&end))
    }

    /// Processes a recording; `None` if it is not started.
    fn treat(&self, file: &BatchFile) -> Option<Treated> {
        if self.is_over() {
            return None;
        }
        let begun = Instant::now();
        let mut entry = self.plan.entry(file);
        let treated = match self.make(file, &mut entry, begun) {
            Ok(treated) => treated,
            Err(failure) => {
                log::failure(&failure.clone().at(file.found.path.shown()));
                entry.outputs.clear();
                entry.exit = failure.exit_code().max(1);
                entry.error = Some(failure.to_string());
                entry.seconds = begun.elapsed().as_secs_f64();
                self.note(&entry);
                Treated::made(entry)
            }
        };
        let mut shared = self.lock();
        shared.failures += u32::from(treated.entry.has_failed());
        shared.done.count += 1;
        shared.done.bytes += file.bytes;
        shared.progress.report(shared.done, Some(self.all));
        Some(treated)
    }

    /// Makes the results of a recording, unless they exist.
    fn make(
        &self,
        file: &BatchFile,
        entry: &mut ManifestEntry,
        begun: Instant,
    ) -> Result<Treated, Failure> {
        let plan = self.plan;
        if let Some(problem) = &file.found.problem {
            return Err(problem.clone());
        }
        entry.made_from = MadeFrom::read(&file.found.path, plan.task.stand)?;
        if let Some(standing) = plan.standing(file, entry) {
            // Each manifest describes its last run completely.
            if !plan.history.is_in_last(standing) {
                self.note(standing);
            }
            return Ok(Treated::skipped(standing.clone()));
        }
        let outputs: Vec<PathBuf> = file.outputs.iter().map(|o| plan.result(o)).collect();
        outputs
            .iter()
            .filter_map(|path| path.parent())
            .try_for_each(output::make_folder)?;
        let one = OneRun {
            input: &file.found.path,
            outputs: &outputs,
            replace: plan.may_replace(file),
            threads: plan.threads(),
        };
        let made = catch_unwind(AssertUnwindSafe(|| (self.on_one)(&one)));
        let made = made.unwrap_or_else(|_| Err(internal_error(one.input)))?;
        log::warnings(Some(&entry.input), &made.warnings);
        entry.exit = made.outcome.exit_code();
        entry.warnings = made.warnings.iter().map(NotedWarning::of).collect();
        entry.figures = made.figures.clone();
        entry.outputs = sums(&made.outputs, &plan.folder)?;
        entry.seconds = begun.elapsed().as_secs_f64();
        if self.note(entry) {
            made.publish_silently()?;
        }
        Ok(Treated::made(entry.clone()))
    }

    /// Appends a line to the manifest; returns whether that succeeded. Without it, no result is
    /// renamed.
    fn note(&self, entry: &ManifestEntry) -> bool {
        let shared = self.lock();
        let added = match shared.broken {
            None => self.manifest.add(print::json_line(&entry)),
            Some(_) => return false,
        };
        // The others append theirs while this one is synced.
        drop(shared);
        let settled = added.and_then(|()| self.manifest.settle());
        let mut shared = self.lock();
        if let Err(failure) = settled {
            shared.broken.get_or_insert(failure);
        }
        shared.broken.is_none()
    }
}

/// The results with their checksums, by their paths relative to the folder.
fn sums(outputs: &[Output], folder: &Path) -> Result<Vec<OutputSum>, Failure> {
    let each = outputs.iter().map(|output| {
        let unreadable = |error| Failure::reading(output.place(), &error);
        let below = output.place().strip_prefix(folder);
        let sum = output.sum().map_err(unreadable)?;
        Ok(sum.map(|sha256| OutputSum {
            file: file_name::with_slashes(below.unwrap_or(output.place())),
            sha256,
        }))
    });
    let known: Vec<Option<OutputSum>> = each.collect::<Result<_, Failure>>()?;
    Ok(known.into_iter().flatten().collect())
}

fn internal_error(input: &Path) -> Failure {
    ErrorCode::InternalError
        .failed("internal error, as said above; please report it with this recording")
        .at(input.shown())
}
