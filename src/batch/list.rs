//! The recordings that are meant: paths, folders, patterns and lists of paths.

use std::collections::HashSet;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use super::content;
use crate::failure::{ErrorCode, Failure};
use crate::io::Input;

/// A recording to read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FoundFile {
    /// Its path as given, or below the folder as given.
    pub(super) path: String,
    /// Its path below its root, the folders separated by `/`: the same in its results.
    pub(super) relative: String,
    /// Why it cannot be read, if that is known already.
    pub(super) problem: Option<Failure>,
}

/// All recordings that are meant, in the order given; those of a folder in the order of their names.
#[derive(Debug, Default)]
pub(super) struct Listing {
    pub(super) files: Vec<FoundFile>,
    /// Files of folders that are no recordings by their content.
    pub(super) left_out: Vec<String>,
}

/// Letters that make a path a pattern, unless a file has that name.
const PATTERN: [char; 3] = ['*', '?', '['];

/// Whether a path names a folder, or files by a pattern.
pub(super) fn is_several(input: &str) -> bool {
    input != "-" && (Path::new(input).is_dir() || is_pattern(input))
}

fn is_pattern(input: &str) -> bool {
    input.contains(PATTERN) && std::fs::symlink_metadata(input).is_err()
}

impl Listing {
    /// Adds what an argument of the command line means; `is_ours` are the files and folders (with their real paths) that
    /// no recording is looked for in.
    ///
    /// # Errors
    /// If nothing is meant by it.
    pub(super) fn add(
        &mut self,
        input: &str,
        is_ours: &dyn Fn(&Path) -> bool,
    ) -> Result<(), Failure> {
        if input == "-" {
            return Err(Failure::usage(
                ErrorCode::MissingArgument,
                "standard input is one recording and has no name; name files, or give --files-from - for a list of \
                 paths",
            ));
        }
        let path = Path::new(input);
        if path.is_dir() {
            let before = self.files.len();
            self.add_folder(path, is_ours);
            if self.files.len() == before {
                return Err(self.nothing_in(input));
            }
        } else if is_pattern(input) {
            self.add_pattern(input)?;
        } else {
            let name = path.file_name().map(|name| name.to_string_lossy());
            self.push(input, name.unwrap_or_default().into_owned());
        }
        Ok(())
    }

    /// Adds the paths of a list. Below the results they have the folders that the list gives.
    ///
    /// # Errors
    /// If the list cannot be read.
    pub(super) fn add_listed(&mut self, list: &str, by_zero: bool) -> Result<(), Failure> {
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
            let path = std::str::from_utf8(line).map_err(|_| {
                Failure::failed(
                    ErrorCode::CannotRead,
                    format_args!("path {} is not UTF-8; rename the file", i + 1),
                )
                .at(input.name())
            })?;
            if path.is_empty() {
                continue;
            }
            let parts = Path::new(path).components().filter_map(|part| match part {
                Component::Normal(name) => Some(name.to_string_lossy()),
                _ => None,
            });
            let relative = parts.collect::<Vec<_>>().join("/");
            self.push(path, relative);
        }
        Ok(())
    }

    /// Leaves out what is named twice.
    pub(super) fn without_repetitions(mut self) -> Self {
        let mut seen = HashSet::new();
        self.files
            .retain(|file| seen.insert((file.path.clone(), file.relative.clone())));
        self
    }

    fn push(&mut self, path: &str, relative: String) {
        self.files.push(FoundFile {
            path: path.to_owned(),
            relative,
            problem: None,
        });
    }

    fn nothing_in(&self, folder: &str) -> Failure {
        let rest = match self.left_out.len() {
            0 => "it has no files except hidden ones and results".to_owned(),
            count => format!(
                "none of its files ({count}) begins as a table of numbers or an MCAP file does"
            ),
        };
        Failure::failed(
            ErrorCode::NotFound,
            format_args!("no recordings found: {rest}; check the path"),
        )
        .at(folder)
    }

    /// Adds the files that a pattern matches; hidden ones only if it names their point.
    fn add_pattern(&mut self, pattern: &str) -> Result<(), Failure> {
        let options = glob::MatchOptions {
            case_sensitive: true,
            require_literal_separator: true,
            require_literal_leading_dot: true,
        };
        let matches = glob::glob_with(pattern, options).map_err(|error| {
            Failure::usage(ErrorCode::InvalidValue, format_args!("no pattern: {error}")).at(pattern)
        })?;
        let is_fixed = |part: &Component| !part.as_os_str().to_string_lossy().contains(PATTERN);
        let root: PathBuf = Path::new(pattern)
            .components()
            .take_while(is_fixed)
            .collect();
        let before = self.files.len();
        for found in matches {
            match found {
                Ok(path) if path.is_dir() => {}
                Ok(path) => self.add_below(&root, &path),
                Err(error) => {
                    self.add_problem(error.path(), Failure::reading(error.path(), error.error()))
                }
            }
        }
        match self.files.len() == before {
            true => Err(
                Failure::failed(ErrorCode::NotFound, "matches no file; check the pattern")
                    .at(pattern),
            ),
            false => Ok(()),
        }
    }

    /// Adds the recordings in a folder and those in it. Links to folders are not followed.
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
                false => self.left_out.push(file.display().to_string()),
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
        let entries = match std::fs::read_dir(folder) {
            Ok(entries) => entries.flatten(),
            Err(error) => {
                self.add_problem(folder, Failure::reading(folder, &error));
                return;
            }
        };
        let mut names: Vec<_> = entries.map(|entry| entry.file_name()).collect();
        names.sort();
        for name in names {
            let (path, real) = (folder.join(&name), real.join(&name));
            let is_hidden = name.as_encoded_bytes().starts_with(b".");
            if is_hidden || is_ours(&real) {
                continue;
            }
            let is_link = path.is_symlink();
            if path.is_dir() {
                if !is_link {
                    self.walk(&path, &real, is_ours, files);
                }
            } else {
                files.push(path);
            }
        }
    }

    /// Adds a file by its path below a root.
    fn add_below(&mut self, root: &Path, path: &Path) {
        let below = path.strip_prefix(root).unwrap_or(path);
        let parts: Option<Vec<&str>> = below.iter().map(|part| part.to_str()).collect();
        match (path.to_str(), parts) {
            (Some(text), Some(parts)) => self.push(text, parts.join("/")),
            _ => self.add_problem(
                path,
                Failure::failed(
                    ErrorCode::CannotRead,
                    "the name is not UTF-8; rename the file",
                )
                .at(path.display()),
            ),
        }
    }

    fn add_problem(&mut self, path: &Path, problem: Failure) {
        let path = path.display().to_string();
        self.files.push(FoundFile {
            relative: path.clone(),
            path,
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
        listing.add(text, &|path| path == ours).unwrap();
        assert_eq!(found(&listing), ["a b/broken.csv", "a b/ü/y.csv", "x.csv"]);
        assert_eq!(listing.left_out, [format!("{text}/a b/README.md")]);

        let mut listing = Listing::default();
        let pattern = format!("{text}/**/[x-y].c?v");
        listing.add(&pattern, &|_| false).unwrap();
        assert_eq!(found(&listing), ["a b/ü/y.csv", "x.csv"]);
        let none = listing.add(&format!("{text}/*.dat"), &|_| false);
        assert!(none.unwrap_err().to_string().contains("matches no file"));

        let list = root.join("list");
        std::fs::write(&list, "runs/a b.csv\0./../c\nd.csv\0\0").unwrap();
        let mut listing = Listing::default();
        listing.add_listed(list.to_str().unwrap(), true).unwrap();
        assert_eq!(found(&listing), ["runs/a b.csv", "c\nd.csv"]);
    }
}
