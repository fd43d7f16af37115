#![no_main]

use libfuzzer_sys::fuzz_target;
use torqcomp::io::Reading;
use torqcomp::recording::read_other_format;

// Arbitrary bytes as a WAV, universal, MATLAB or TDMS file: a result or an error, no panic, memory bounded by input.
fuzz_target!(|bytes: &[u8]| {
    if let Some(Ok(recording)) = read_other_format("fuzz", bytes, &Reading::default()) {
        assert!(!recording.channels.is_empty());
        for channel in &recording.channels {
            assert!(channel.samples.iter().all(|v| !v.is_infinite()));
        }
    }
});
