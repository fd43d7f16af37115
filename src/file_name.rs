//! File names as text. On Unix they are bytes, not necessarily UTF-8.

use std::fmt;
use std::path::{Component, Path, PathBuf};

/// A path as text, which [`path_of`] converts back: `\xE4` is a byte that is not UTF-8. A backslash before
/// such a sequence in the name itself is `\x5C`.
pub(crate) struct Shown<'a>(&'a Path);

/// Paths with a text form.
pub(crate) trait ShowPath {
    /// The text of the path.
    fn shown(&self) -> Shown<'_>;
}

impl<P: AsRef<Path> + ?Sized> ShowPath for P {
    fn shown(&self) -> Shown<'_> {
        Shown(self.as_ref())
    }
}

#[cfg(unix)]
impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = self.0.as_os_str().as_encoded_bytes();
        for chunk in bytes.utf8_chunks() {
            let mut rest = chunk.valid();
            while let Some(at) = rest.find('\\') {
                let (front, behind) = rest.split_at(at);
                f.write_str(front)?;
                let is_like_byte = byte_of(behind.as_bytes()).is_some();
                f.write_str(if is_like_byte { r"\x5C" } else { r"\" })?;
                rest = &behind[1..];
            }
            f.write_str(rest)?;
            for byte in chunk.invalid() {
                write!(f, r"\x{byte:02X}")?;
            }
        }
        Ok(())
    }
}

#[cfg(not(unix))]
impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.display().fmt(f)
    }
}

/// The byte denoted by `\xE4` at the beginning of a text.
#[cfg(unix)]
fn byte_of(text: &[u8]) -> Option<u8> {
    let [b'\\', b'x', high, low, ..] = text else {
        return None;
    };
    let digit = |byte: u8| char::from(byte).to_digit(16);
    u8::try_from(digit(*high)? * 16 + digit(*low)?).ok()
}

/// The path whose text is given.
#[cfg(unix)]
pub(crate) fn path_of(text: &str) -> PathBuf {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, behind @ ..] = rest {
        match byte_of(rest) {
            Some(byte) => {
                bytes.push(byte);
                rest = &rest[4..];
            }
            None => {
                bytes.push(*first);
                rest = behind;
            }
        }
    }
    path_of_bytes(&bytes).unwrap_or_default()
}

/// The path whose text is given.
#[cfg(not(unix))]
pub(crate) fn path_of(text: &str) -> PathBuf {
    PathBuf::from(text)
}

/// The path that a file names by these bytes; `None` if the system has no such names.
#[cfg(unix)]
pub(crate) fn path_of_bytes(bytes: &[u8]) -> Option<PathBuf> {
    use std::os::unix::ffi::OsStrExt;
    Some(PathBuf::from(std::ffi::OsStr::from_bytes(bytes)))
}

/// The path that a file names by these bytes; `None` if the system has no such names.
#[cfg(not(unix))]
pub(crate) fn path_of_bytes(bytes: &[u8]) -> Option<PathBuf> {
    std::str::from_utf8(bytes).ok().map(PathBuf::from)
}

/// Text of the names in a path, separated by `/` on every system.
pub(crate) fn with_slashes(path: &Path) -> String {
    let names = path.components().filter_map(|part| match part {
        Component::Normal(name) => Some(name.shown().to_string()),
        _ => None,
    });
    names.collect::<Vec<_>>().join("/")
}

/// Whether a path ends like that of a folder.
pub(crate) fn ends_with_separator(path: &Path) -> bool {
    let last = path.as_os_str().as_encoded_bytes().last();
    last.is_some_and(|byte| std::path::is_separator(char::from(*byte)))
}

/// Whether a path is `-`: standard input or output.
pub(crate) fn is_dash(path: &Path) -> bool {
    path == Path::new("-")
}

/// Paths as text, separated by commas.
pub(crate) fn list(paths: &[PathBuf]) -> String {
    texts(paths).join(", ")
}

/// Text of each path.
pub(crate) fn texts(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|path| path.shown().to_string()).collect()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn any_name_comes_back_from_its_text() {
        let cases: [(&[u8], &str); 7] = [
            (b"plain/run 1.csv", "plain/run 1.csv"),
            ("Messung ü.csv".as_bytes(), "Messung ü.csv"),
            (b"Messung \xfc.csv", r"Messung \xFC.csv"),
            (b"\xe4\xf6\xfc", r"\xE4\xF6\xFC"),
            (br"a\xE4", r"a\x5CxE4"),
            (br"a\b\xZZ\", r"a\b\xZZ\"),
            (br"\x5C", r"\x5Cx5C"),
        ];
        for (bytes, text) in cases {
            let path = path_of_bytes(bytes).unwrap();
            assert_eq!(path.shown().to_string(), text);
            assert_eq!(path_of(text), path);
        }
    }

    #[test]
    fn no_two_names_have_the_same_text() {
        // Names of up to four of the bytes that matter in a text.
        let alphabet = [b'\\', b'x', b'E', b'4', b'5', b'C', 0xE4, b'/'];
        let mut texts = std::collections::HashMap::new();
        let mut names: Vec<Vec<u8>> = vec![Vec::new()];
        for _ in 0..5 {
            let longer = names.iter().flat_map(|name| {
                let with = |letter: &u8| [name.as_slice(), &[*letter]].concat();
                alphabet.iter().map(with).collect::<Vec<_>>()
            });
            names = longer.collect();
            for name in &names {
                let path = path_of_bytes(name).unwrap();
                let text = path.shown().to_string();
                assert_eq!(path_of(&text).as_os_str().as_encoded_bytes(), name);
                let other = texts.insert(text, name.clone());
                assert!(other.is_none(), "{name:?} and {other:?}");
            }
        }
    }
}
