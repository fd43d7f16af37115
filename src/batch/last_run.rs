//! The last run in a manifest.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::manifest::{ManifestEntry, ManifestLine, RunBegin};
use crate::cli::many::{self, Shard};
use crate::failure::Failure;
use crate::file_name::ShowPath;
use crate::io::storage;

/// Results for the recordings of a manifest's last run.
pub(super) struct LastRun {
    pub(super) manifest: String,
    pub(super) begin: RunBegin,
    pub(super) shard: Option<Shard>,
    /// Those that were processed or skipped, in the order of the run.
    pub(super) entries: Vec<ManifestEntry>,
    /// Those that were not.
    pub(super) not_done: Vec<String>,
    /// Whether it was completed.
    pub(super) has_ended: bool,
}

/// The lines of a manifest while it is read.
#[derive(Default)]
struct ManifestLines {
    /// The last entry for each command and recording.
    last: HashMap<(String, String), ManifestEntry>,
    begin: Option<RunBegin>,
    /// Recordings processed or skipped by the most recent run.
    done: HashSet<String>,
    has_ended: bool,
}

impl LastRun {
    /// Reads a manifest; `None` if no run is in it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(super) fn read(path: &Path) -> Result<Option<Self>, Failure> {
        let bytes = storage::read(path).map_err(|error| Failure::reading(path, &error))?;
        let mut lines = ManifestLines::default();
        for line in bytes.split(|byte| *byte == b'\n') {
            lines.take(line);
        }
        Ok(lines.run(path.shown().to_string()))
    }

    /// Its description: its part, or that it has none.
    pub(super) fn part(&self) -> String {
        match self.shard {
            Some(shard) => format!("part {shard}"),
            None => "no part".to_owned(),
        }
    }
}

impl ManifestLines {
    fn take(&mut self, line: &[u8]) {
        match ManifestLine::read(line) {
            Some(ManifestLine::Entry(entry)) => {
                self.done.insert(entry.file.clone());
                let key = (entry.made_by.verb.clone(), entry.file.clone());
                self.last.insert(key, *entry);
            }
            Some(ManifestLine::Begin(begin)) => {
                self.begin = Some(begin);
                self.done.clear();
                self.has_ended = false;
            }
            Some(ManifestLine::End(end)) => {
                self.done.extend(end.skipped);
                self.has_ended = true;
            }
            // Truncated by a kill: its recording has no other line, and counts as not done.
            None => {}
        }
    }

    fn run(mut self, manifest: String) -> Option<LastRun> {
        let begin = self.begin?;
        let shard = begin.shard.as_deref().map(many::shard).transpose().ok()?;
        let mut entries = Vec::new();
        let mut not_done = Vec::new();
        for file in &begin.files {
            let key = (begin.made_by.verb.clone(), file.clone());
            let is_done = self.done.contains(file);
            match self.last.remove(&key).filter(|_| is_done) {
                Some(entry) => entries.push(entry),
                None => not_done.push(file.clone()),
            }
        }
        Some(LastRun {
            manifest,
            begin,
            shard,
            entries,
            not_done,
            has_ended: self.has_ended,
        })
    }
}
