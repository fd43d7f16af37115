//! Selection of recordings: paths, folders, patterns and lists of paths.

use std::collections::HashSet;
use std::ffi::{OsStr, OsString};
use std::io::{self, ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

use super::content;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::{self, ShowPath, is_dash};
use crate::io::Input;

/// A recording to read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FoundFile {
    /// Its path as given, or below the folder as given.
    pub(super) path: PathBuf,
    /// Its path relative to its root, with `/` between folders; its results have the same.
    pub(super) relative: String,
    /// Why it cannot be read, if already known.
    pub(super) problem: Option<Failure>,
}

/// All selected recordings, in the given order; those of a folder in the order of their names.
#[derive(Debug, Default)]
pub(super) struct Listing {
    pub(super) files: Vec<FoundFile>,
    /// Files of folders that are not recordings by their content.
    pub(super) left_out: Vec<String>,
}

/// Characters that make a path a pattern, unless a file has that name.
const PATTERN: [char; 3] = ['*', '?', '['];

/// Whether a path names a folder, or files by a pattern.
pub(super) fn is_several(input: &Path) -> bool {
    !is_dash(input) && (input.is_dir() || is_pattern(input))
}

fn is_pattern(input: &Path) -> bool {
    input.shown().to_string().contains(PATTERN) && std::fs::symlink_metadata(input).is_err()
}

/// Rules for matching names with a pattern.
const OPTIONS: glob::MatchOptions = glob::MatchOptions {
    case_sensitive: true,
    require_literal_separator: true,
    require_literal_leading_dot: true,
};

/// A component of a pattern, between separators.
enum PatternPart<'a> {
    /// A name, a root, `.` or `..`.
    Fixed(&'a OsStr),
    /// `**`: any number of folders.
    AnyFolders,
    /// Matching names.
    Names(glob::Pattern),
}

impl<'a> PatternPart<'a> {
    fn of(part: Component<'a>) -> Result<Self, glob::PatternError> {
        let text = part.as_os_str().to_string_lossy();
        Ok(match text.as_ref() {
            "**" => Self::AnyFolders,
            text if text.contains(PATTERN) => Self::Names(glob::Pattern::new(text)?),
            _ => Self::Fixed(part.as_os_str()),
        })
    }
}

/// The names in a folder, sorted.
fn names_in(folder: &Path) -> io::Result<Vec<OsString>> {
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let entries = std::fs::read_dir(folder)?.flatten();
    let mut names: Vec<OsString> = entries.map(|entry| entry.file_name()).collect();
    names.sort();
    Ok(names)
}

fn is_hidden(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(b".")
}

/// Whether recordings are searched for in a folder. Links to folders are not followed.
fn is_folder_to_enter(name: &OsStr, path: &Path) -> bool {
    !is_hidden(name) && path.is_dir() && !path.is_symlink()
}

impl Listing {
    /// Adds the recordings that a command-line argument refers to; `is_ours` identifies the files and folders (by their
    /// real paths) that are excluded.
    ///
    /// # Errors
    /// If it refers to none.
    pub(super) fn add(
        &mut self,
        input: &Path,
        is_ours: &dyn Fn(&Path) -> bool,
    ) -> Result<(), Failure> {
        if is_dash(input) {
            return Err(ErrorCode::MissingArgument.usage(
                "standard input is one recording and has no name; name files, or give --files-from - for a list of \
                 paths",
            ));
        }
        if input.is_dir() {
            let before = self.files.len();
            self.add_folder(input, is_ours);
            if self.files.len() == before {
                return Err(self.nothing_in(input));
            }
        } else if is_pattern(input) {
            self.add_pattern(input)?;
        } else {
            let name = input.file_name().unwrap_or_default();
            self.push(input, name.shown().to_string());
        }
        Ok(())
    }

    /// Adds the paths of a list. Their results have the same relative folders as in the list.
    ///
    /// # Errors
    /// If the list cannot be read.
    pub(super) fn add_listed(&mut self, list: &Path, by_zero: bool) -> Result<(), Failure> {
        let input = Input::of(list);
        let mut bytes = Vec::new();
        let read = input.open()?.read_to_end(&mut bytes);
        read.map_err(|error| input.unreadable(&error))?;
        let end = if by_zero { b'\0' } else { b'\n' };
        for (i, line) in bytes.split(|byte| *byte == end).enumerate() {
            let line = match by_zero {
                true => line,
                false => line.strip_suffix(b"\r").unwrap_or(line),
            };
            if line.is_empty() {
                continue;
            }
            let path = file_name::path_of_bytes(line).ok_or_else(|| {
                ErrorCode::CannotRead
                    .failed(format_args!("path {} is not UTF-8; rename the file", i + 1))
                    .at(input.name())
            })?;
            self.push(&path, file_name::with_slashes(&path));
        }
        Ok(())
    }

    /// Removes duplicates.
    pub(super) fn without_repetitions(mut self) -> Self {
        let mut seen = HashSet::new();
        self.files
            .retain(|file| seen.insert((file.path.clone(), file.relative.clone())));
        self
    }

    fn push(&mut self, path: &Path, relative: String) {
        self.files.push(FoundFile {
            path: path.to_owned(),
            relative,
            problem: None,
        });
    }

    fn nothing_in(&self, folder: &Path) -> Failure {
        let rest = match self.left_out.len() {
            0 => "it contains only hidden files and results".to_owned(),
            count => format!(
                "none of its files ({count}) starts like a table of numbers or an MCAP file"
            ),
        };
        ErrorCode::NotFound
            .failed(format_args!("no recordings found: {rest}; check the path"))
            .at(folder.shown())
    }

    /// Adds the files that match a pattern; hidden ones only if it contains their leading dot.
    fn add_pattern(&mut self, pattern: &Path) -> Result<(), Failure> {
        let parts: Result<Vec<_>, _> = pattern.components().map(PatternPart::of).collect();
        let parts = parts.map_err(|error| {
            ErrorCode::InvalidValue
                .usage(format_args!("no pattern: {error}"))
                .at(pattern.shown())
        })?;
        let is_fixed = |part: &PatternPart| matches!(part, PatternPart::Fixed(_));
        let fixed = parts.iter().take_while(|part| is_fixed(part)).count();
        let root: PathBuf = pattern.components().take(fixed).collect();
        let before = self.files.len();
        self.add_matching(&root, &root, &parts[fixed..]);
        self.files[before..].sort_by(|a, b| a.path.cmp(&b.path));
        match self.files.len() == before {
            true => Err(ErrorCode::NotFound
                .failed("matches no file; check the pattern")
                .at(pattern.shown())),
            false => Ok(()),
        }
    }

    /// Adds the files in a folder that match the rest of a pattern.
    fn add_matching(&mut self, root: &Path, folder: &Path, parts: &[PatternPart]) {
        let Some((part, rest)) = parts.split_first() else {
            if !folder.is_dir() {
                self.add_below(root, folder);
            }
            return;
        };
        if let PatternPart::Fixed(name) = part {
            let path = folder.join(name);
            if path.symlink_metadata().is_ok() {
                self.add_matching(root, &path, rest);
            }
            return;
        }
        if matches!(part, PatternPart::AnyFolders) {
            self.add_matching(root, folder, rest);
        }
        let names = match names_in(folder) {
            Ok(names) => names,
            // Nothing matches below a file, or below a nonexistent path.
            Err(error)
                if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) =>
            {
                return;
            }
            Err(error) => return self.add_problem(folder, Failure::reading(folder, &error)),
        };
        for name in names {
            let path = folder.join(&name);
            match part {
                PatternPart::Names(pattern)
                    if pattern.matches_with(&name.to_string_lossy(), OPTIONS) =>
                {
                    self.add_matching(root, &path, rest);
                }
                PatternPart::AnyFolders if is_folder_to_enter(&name, &path) => {
                    self.add_matching(root, &path, parts);
                }
                _ => {}
            }
        }
    }

    /// Adds the recordings in a folder and its subfolders.
    fn add_folder(&mut self, root: &Path, is_ours: &dyn Fn(&Path) -> bool) {
        let mut files = Vec::new();
        let real = root.canonicalize().unwrap_or_else(|_| root.to_owned());
        self.walk(root, &real, is_ours, &mut files);
        let looks: Vec<bool> = files
            .iter()
            .map(|file| content::is_recording(file))
            .collect();
        let ending = |path: &PathBuf| path.extension().map(|end| end.to_ascii_lowercase());
        let of_recordings = files.iter().zip(&looks).filter(|(_, looks)| **looks);
        let endings: HashSet<_> = of_recordings.map(|(file, _)| ending(file)).collect();
        for file in &files {
            match endings.contains(&ending(file)) {
                true => self.add_below(root, file),
                false => self.left_out.push(file.shown().to_string()),
            }
        }
    }

    fn walk(
        &mut self,
        folder: &Path,
        real: &Path,
        is_ours: &dyn Fn(&Path) -> bool,
        files: &mut Vec<PathBuf>,
    ) {
        let names = match names_in(folder) {
            Ok(names) => names,
            Err(error) => return self.add_problem(folder, Failure::reading(folder, &error)),
        };
        for name in names {
            let (path, real) = (folder.join(&name), real.join(&name));
            if is_hidden(&name) || is_ours(&real) {
                continue;
            }
            if is_folder_to_enter(&name, &path) {
                self.walk(&path, &real, is_ours, files);
            } else if !path.is_dir() {
                files.push(path);
            }
        }
    }

    /// Adds a file by its path relative to a root.
    fn add_below(&mut self, root: &Path, path: &Path) {
        let below = path.strip_prefix(root).unwrap_or(path);
        self.push(path, file_name::with_slashes(below));
    }

    fn add_problem(&mut self, path: &Path, problem: Failure) {
        self.files.push(FoundFile {
            relative: path.shown().to_string(),
            path: path.to_owned(),
            problem: Some(problem),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: &str = "time_s,V\n0,1\n1,2\n2,3\n";

    fn found(listing: &Listing) -> Vec<&str> {
        listing.files.iter().map(|f| f.relative.as_str()).collect()
    }

    #[test]
    fn folders_patterns_and_lists_name_recordings() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir_all(root.join("a b/ü")).unwrap();
        for (name, text) in [
            ("x.csv", ROWS),
            ("a b/ü/y.csv", ROWS),
            ("a b/broken.csv", "nothing\n"),
            ("a b/README.md", "# Runs\n\nOf Monday\n"),
            (".hidden.csv", ROWS),
            ("ours.csv", ROWS),
        ] {
            std::fs::write(root.join(name), text).unwrap();
        }
        let ours = root.canonicalize().unwrap().join("ours.csv");
        let mut listing = Listing::default();
        let text = root.to_str().unwrap();
        listing.add(root, &|path| path == ours).unwrap();
        assert_eq!(found(&listing), ["a b/broken.csv", "a b/ü/y.csv", "x.csv"]);
        assert_eq!(listing.left_out, [format!("{text}/a b/README.md")]);

        let mut listing = Listing::default();
        let pattern = format!("{text}/**/[x-y].c?v");
        listing.add(Path::new(&pattern), &|_| false).unwrap();
        assert_eq!(found(&listing), ["a b/ü/y.csv", "x.csv"]);
        let none = listing.add(&root.join("*.dat"), &|_| false);
        assert!(none.unwrap_err().to_string().contains("matches no file"));

        let list = root.join("list");
        std::fs::write(&list, "runs/a b.csv\0./../c\nd.csv\0\0").unwrap();
        let mut listing = Listing::default();
        listing.add_listed(&list, true).unwrap();
        assert_eq!(found(&listing), ["runs/a b.csv", "c\nd.csv"]);
    }
}
