//! Arbitrary bytes as a recorder's text file: its dialect is detected or rejected, nothing else happens.
#![no_main]

use libfuzzer_sys::fuzz_target;
use torqcomp::io::Reading;
use torqcomp::recording::text;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(recording) = text::read("fuzz", bytes.to_vec(), &Reading::default()) {
        assert!(!recording.channels.is_empty());
    }
});
