//! Plan of the results of each recording, made before anything is written.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::BatchTask;
use super::list::{FoundFile, Listing};
use super::manifest::{self, History, MadeBy, MadeFrom, ManifestEntry, RunBegin, WholeList};
use crate::failure::{ErrorCode, Failure};
use crate::file_name::{self, ShowPath, is_dash};
use crate::io::output::end_of_links;
use crate::parallel::cores;

/// Question if several recordings have no folder for their results.
pub(crate) const NEED_FOLDER: &str =
    "the results of several recordings need a folder; give -o FOLDER/";

/// Everything decided before the first recording is read.
pub(super) struct BatchPlan<'a> {
    pub(super) task: &'a BatchTask<'a>,
    /// Folder of the results.
    pub(super) folder: PathBuf,
    pub(super) manifest: PathBuf,
    pub(super) history: History,
    pub(super) made_by: MadeBy,
    /// All recordings, of which `files` may be a part.
    pub(super) all: WholeList,
    pub(super) files: Vec<BatchFile>,
    /// Files of folders that are not recordings by their content.
    pub(super) left_out: Vec<String>,
}

/// A recording and the names of its results relative to their folder: the main result, then the
/// additional ones.
pub(super) struct BatchFile {
    pub(super) found: FoundFile,
    pub(super) outputs: Vec<String>,
    pub(super) bytes: u64,
}

impl<'a> BatchPlan<'a> {
    /// # Errors
    /// If no folder is given for the results, or two recordings would have the same result.
    pub(super) fn new(task: &'a BatchTask<'a>, options: &[String]) -> Result<Self, Failure> {
        let folder = folder(task)?;
        let manifest = match &task.many.manifest {
            Some(path) => path.clone(),
            None => manifest::usual(&folder, task.many.shard),
        };
        let mut manifests = manifest::in_folder(&folder);
        // Its own takes precedence.
        manifests.retain(|other| *other != manifest);
        manifests.push(manifest.clone());
        let history = History::read(&manifests)?;
        let mut plan = Self {
            task,
            folder,
            manifest,
            history,
            made_by: MadeBy {
                verb: task.verb.to_owned(),
                options: options
                    .iter()
                    .filter(|option| task.makes_json || !option.starts_with("--json="))
                    .cloned()
                    .collect(),
            },
            all: WholeList::of(std::iter::empty()),
            files: Vec::new(),
            left_out: Vec::new(),
        };
        let Listing { files, left_out } = plan.list()?;
        plan.left_out = left_out;
        let files = files.into_iter();
        plan.files = files
            .map(|found| plan.assign(found))
            .collect::<Result<_, Failure>>()?;
        plan.check_names()?;
        plan.all = WholeList::of(plan.files.iter().map(|file| file.found.relative.as_str()));
        if let Some(shard) = task.many.shard {
            plan.files.retain(|file| shard.takes(&file.found.relative));
        }
        Ok(plan)
    }

    /// The selected recordings.
    fn list(&self) -> Result<Listing, Failure> {
        let task = self.task;
        let results = self.history.results().map(|name| self.result(name));
        let single = [
            Some(self.manifest.as_path()),
            task.many.summary.as_deref(),
            task.stand,
        ];
        let single = single.into_iter().flatten().map(Path::to_owned);
        let ours: HashSet<PathBuf> = results
            .chain(single)
            .map(|path| end_of_links(&path))
            .collect();
        let folder = self.folder.canonicalize().ok();
        let is_ours = |path: &Path| folder.as_deref() == Some(path) || ours.contains(path);
        let mut listing = Listing::default();
        for input in task.inputs {
            listing.add(input, &is_ours)?;
        }
        if let Some(list) = &task.many.files_from {
            listing.add_listed(list, task.many.null)?;
        }
        Ok(listing.without_repetitions())
    }

    /// Assigns names to the results of a recording.
    fn assign(&self, found: FoundFile) -> Result<BatchFile, Failure> {
        let task = self.task;
        let name = task.many.name.as_deref().unwrap_or(task.name);
        let beside = task.beside.iter().map(|(option, path)| {
            crate::cli::many::template(&path.shown().to_string()).map_err(|expected| {
                ErrorCode::ConflictingArguments.usage(format_args!(
                    "{option} {}: with several recordings each has its own, in the folder of -o: {expected}",
                    path.shown()
                ))
            })
        });
        let beside = beside.collect::<Result<Vec<String>, Failure>>()?;
        let names = std::iter::once(name).chain(beside.iter().map(String::as_str));
        Ok(BatchFile {
            outputs: names.map(|name| named(name, &found.relative)).collect(),
            bytes: std::fs::metadata(&found.path).map_or(0, |meta| meta.len()),
            found,
        })
    }

    /// Rejects two recordings with the same result, and a result that would replace a recording.
    fn check_names(&self) -> Result<(), Failure> {
        let mut owners: HashMap<&str, &Path> = HashMap::new();
        let path = |file: &'_ BatchFile| file.found.path.clone();
        let real = |file| (end_of_links(&path(file)), path(file));
        let inputs: HashMap<PathBuf, PathBuf> = self.files.iter().map(real).collect();
        for file in &self.files {
            for output in &file.outputs {
                let path = &file.found.path;
                if let Some(other) = owners.insert(output, path) {
                    return Err(ErrorCode::ConflictingArguments.usage(format_args!(
                        "{} and {} would both become {output}; give --name '{{name}}…' if their extensions differ, \
                         or a folder that contains both, so that its tree is kept",
                        other.shown(),
                        path.shown()
                    )));
                }
                if let Some(input) = inputs.get(&end_of_links(&self.result(output))) {
                    return Err(ErrorCode::ConflictingArguments.usage(format_args!(
                        "the result of {} would overwrite the recording {}; give another --name, or another folder \
                         with -o",
                        path.shown(),
                        input.shown()
                    )));
                }
            }
        }
        Ok(())
    }

    /// The first line of the manifest.
    pub(super) fn begin(&self) -> RunBegin {
        let files = self.files.iter().map(|file| file.found.relative.clone());
        let shard = self.task.many.shard.map(|shard| shard.to_string());
        RunBegin::new(
            self.made_by.clone(),
            shard,
            self.all.clone(),
            files.collect(),
        )
    }

    /// The known part of the entry of a recording.
    pub(super) fn entry(&self, file: &BatchFile) -> ManifestEntry {
        let FoundFile { path, relative, .. } = &file.found;
        ManifestEntry::new(self.made_by.clone(), relative, &path.shown().to_string())
    }

    /// The entry of results that need not be made again, if they may be reused.
    pub(super) fn standing(
        &self,
        file: &BatchFile,
        wanted: &ManifestEntry,
    ) -> Option<&ManifestEntry> {
        let history = self.task.many.skip_existing.then_some(&self.history)?;
        history.standing(&self.folder, &file.outputs, wanted)
    }

    /// Whether existing results are replaced: with `--force`, or if a previous run made them from this recording.
    pub(super) fn may_replace(&self, file: &BatchFile) -> bool {
        let input = file.found.path.shown().to_string();
        let is_known =
            |output: &String| self.history.made(output, &input) || !self.result(output).exists();
        let is_ours = self.task.many.skip_existing && file.outputs.iter().all(is_known);
        self.task.result.force || is_ours
    }

    /// The path of a result.
    pub(super) fn result(&self, output: &str) -> PathBuf {
        self.folder.join(file_name::path_of(output))
    }

    /// The planned action for a recording, as a word.
    pub(super) fn intent(&self, file: &BatchFile) -> &'static str {
        let mut wanted = self.entry(file);
        let read = match &file.found.problem {
            Some(problem) => Err(problem.clone()),
            None => MadeFrom::read(&file.found.path, self.task.stand),
        };
        let Ok(made_from) = read else {
            return "fail (unreadable)";
        };
        wanted.made_from = made_from;
        let exists = |output: &String| self.result(output).exists();
        if self.standing(file, &wanted).is_some() {
            "skip"
        } else if !file.outputs.iter().any(exists) {
            "make"
        } else if self.may_replace(file) {
            "replace"
        } else {
            "fail (exists)"
        }
    }

    /// Number of recordings processed at a time.
    pub(super) fn workers(&self) -> usize {
        let allowed = match self.task.many.jobs {
            Some(jobs) => usize::from(jobs),
            None => cores(),
        };
        allowed.min(self.files.len()).max(1)
    }

    /// Number of threads for each of them.
    pub(super) fn threads(&self) -> usize {
        (cores() / self.workers()).max(1)
    }
}

/// The folder of the results.
fn folder(task: &BatchTask) -> Result<PathBuf, Failure> {
    let Some(path) = task.result.output.as_deref().filter(|path| !is_dash(path)) else {
        return Err(ErrorCode::MissingArgument.usage(NEED_FOLDER));
    };
    let is_file = match std::fs::metadata(path) {
        Ok(meta) => !meta.is_dir(),
        Err(_) => !file_name::ends_with_separator(path) && path.extension().is_some(),
    };
    match is_file {
        true => Err(ErrorCode::MissingArgument.usage(format_args!(
            "{NEED_FOLDER} ({} names a file)",
            path.shown()
        ))),
        false => Ok(path.to_owned()),
    }
}

/// The path of a recording's result according to a template.
fn named(template: &str, relative: &str) -> String {
    let (folder, name) = match relative.rsplit_once('/') {
        Some((folder, name)) => (format!("{folder}/"), name),
        None => (String::new(), relative),
    };
    let (stem, ext) = match name.rsplit_once('.') {
        Some((stem, ext)) if !stem.is_empty() => (stem, ext),
        _ => (name, ""),
    };
    // Braces in the name of a recording are not placeholders.
    let mut parts = template.split('{');
    let mut text = folder + parts.next().unwrap_or_default();
    for part in parts {
        let (placeholder, rest) = part.split_once('}').unwrap_or(("", part));
        text.push_str(match placeholder {
            "stem" => stem,
            "ext" => ext,
            _ => name,
        });
        text.push_str(rest);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::named;

    #[test]
    fn results_are_named_after_their_recordings() {
        assert_eq!(
            named("{stem}.torque.csv", "a b/ü.x.csv"),
            "a b/ü.x.torque.csv"
        );
        assert_eq!(
            named("{name}.{ext}-{stem}", "{ext}.dat"),
            "{ext}.dat.dat-{ext}"
        );
        assert_eq!(named("{stem}.t{ext}", "run"), "run.t");
        assert_eq!(named("{stem}.csv", "a/.run"), "a/.run.csv");
    }
}
