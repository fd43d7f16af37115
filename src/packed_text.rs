//! Long texts of the program, which `build.rs` compresses.

use std::io::Read;

use flate2::read::DeflateDecoder;

/// The compressed text of a file, by its name.
macro_rules! packed {
    ($name:literal) => {
        include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".z"))
    };
}
pub(crate) use packed;

/// The text.
pub(crate) fn unpack(packed: &[u8]) -> String {
    let mut text = String::new();
    DeflateDecoder::new(packed)
        .read_to_string(&mut text)
        .expect("build.rs packed a text");
    text
}
