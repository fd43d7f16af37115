//! Arbitrary definition and message: `definition 0xff message`. A number is found or rejected.
#![no_main]

use std::sync::Arc;

use libfuzzer_sys::fuzz_target;
use torqcomp::io::mcap::decode::{Decoder, Encoding, Reading, Targets};
use torqcomp::io::mcap::path;
use torqcomp::io::mcap::route::Route;
use torqcomp::io::mcap::schema::leaves::leaves;
use torqcomp::io::mcap::schema::ros2msg::{self, Generation};
use torqcomp::io::mcap::time::Stamp;

fuzz_target!(|bytes: &[u8]| {
    let Some(end) = bytes.iter().position(|byte| *byte == 0xff) else {
        return;
    };
    let (text, message) = (String::from_utf8_lossy(&bytes[..end]), &bytes[end + 1..]);
    for (generation, encoding) in [
        (Generation::Ros2, Encoding::Cdr),
        (Generation::Ros1, Encoding::Ros1),
    ] {
        let Ok(schema) = ros2msg::read("p/msg/M", &text, generation) else {
            continue;
        };
        let schema = Arc::new(schema);
        for leaf in leaves(&schema).0.iter().take(8) {
            for item in ["[0]", "[-1]", "[:]", "[name=a]"] {
                let parts = path::parse(&leaf.with_items(item));
                let Ok(value) = parts.and_then(|parts| Route::find(&schema, &parts)) else {
                    continue;
                };
                let targets = Targets {
                    value,
                    stamp: Stamp::find(&schema),
                    spacing: None,
                };
                let mut reading = Reading::default();
                let mut decoder = Decoder::new(encoding, &schema, targets);
                let _ = decoder.read(message, &mut reading);
                assert!(reading.values.len() <= message.len());
            }
        }
    }
});
