//! SHA-256 of files and texts.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use sha2::{Digest, Sha256};

use super::storage::{Stored, from_start};

/// Number of bytes read at a time.
const PIECE: usize = 1 << 16;

/// SHA-256 of a file, as 64 hexadecimal digits.
pub(crate) fn of_file(path: &Path) -> io::Result<String> {
    of_rest(Stored::open(path)?)
}

/// SHA-256 of an open file from its start.
pub(super) fn of_open(file: &File) -> io::Result<String> {
    of_rest(from_start(file)?)
}

fn of_rest(mut file: impl Read) -> io::Result<String> {
    let mut piece = vec![0; PIECE];
    let mut sum = Sha256::new();
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(hexadecimal(&sum.finalize())),
            count => sum.update(&piece[..count]),
        }
    }
}

/// SHA-256 of bytes, as 64 hexadecimal digits.
pub(crate) fn of_bytes(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// The first eight bytes of the SHA-256 of a text, as a number.
pub(crate) fn number_of(text: &str) -> u64 {
    let sum = Sha256::digest(text.as_bytes());
    sum[..8]
        .iter()
        .fold(0, |number, byte| number << 8 | u64::from(*byte))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_standard() {
        // FIPS 180-2, B.1 and B.3: "abc", and a million times "a".
        assert_eq!(
            of_bytes(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
        assert_eq!(number_of("abc"), 0xba78_16bf_8f01_cfea);
        let mut long = tempfile::NamedTempFile::new().unwrap();
        io::Write::write_all(&mut long, &vec![b'a'; 1_000_000]).unwrap();
        assert_eq!(
            of_file(long.path()).unwrap(),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"
        );
    }
}
