//! Identical files with different names.

use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use crate::file_name::{ShowPath, is_dash};
use crate::io::storage::Stored;
use crate::warning::{Warning, WarningCode};

/// Number of bytes compared at a time.
const PIECE: usize = 1 << 16;

/// The warnings about files with the same bytes, and the numbers of those that differ from all
/// before them. Standard input is different from all.
pub fn files(names: &[PathBuf]) -> (Vec<Warning>, Vec<usize>) {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let group = groups
            .iter_mut()
            .find(|group| is_same(&names[group[0]], name).unwrap_or(false));
        match group {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    let warnings = groups
        .iter()
        .filter(|group| group.len() > 1)
        .map(|group| {
            let others = group[1..].iter().map(|i| names[*i].shown().to_string());
            let others: Vec<String> = others.collect();
            WarningCode::IdenticalFiles.warning(format!(
                "{} and {} are identical, byte for byte: one record under several names",
                names[group[0]].shown(),
                others.join(", ")
            ))
        })
        .collect();
    (warnings, groups.iter().map(|group| group[0]).collect())
}

fn is_same(a: &Path, b: &Path) -> io::Result<bool> {
    if is_dash(a) || is_dash(b) {
        return Ok(false);
    }
    let (a, b) = (Stored::open(a)?, Stored::open(b)?);
    let (of_a, of_b) = (a.metadata()?, b.metadata()?);
    if !of_a.is_file() || !of_b.is_file() || of_a.len() != of_b.len() {
        return Ok(false);
    }
    let (mut a, mut b) = (BufReader::new(a), BufReader::new(b));
    let (mut from_a, mut from_b) = (vec![0; PIECE], vec![0; PIECE]);
    let mut left = of_a.len();
    while left > 0 {
        let piece = usize::try_from(left).unwrap_or(PIECE).min(PIECE);
        a.read_exact(&mut from_a[..piece])?;
        b.read_exact(&mut from_b[..piece])?;
        if from_a[..piece] != from_b[..piece] {
            return Ok(false);
        }
        left -= piece as u64;
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_files_are_grouped_and_others_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| -> PathBuf {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        };
        let long = vec![7; 3 * PIECE + 5];
        let mut other = long.clone();
        other[2 * PIECE] = 8;
        let names = [
            write("a", &long),
            write("b", &other),
            write("c", &long),
            write("d", b""),
            write("e", b""),
            "missing".into(),
            "-".into(),
            "-".into(),
        ];
        let (warnings, firsts) = files(&names);
        assert_eq!(firsts, [0, 1, 3, 5, 6, 7]);
        assert_eq!(warnings.len(), 2);
        assert!(warnings[0].message.contains(names[2].to_str().unwrap()));
    }
}
