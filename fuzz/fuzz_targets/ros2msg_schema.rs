//! Arbitrary text as a message definition, in every language: every listed field can be selected.
#![no_main]

use libfuzzer_sys::fuzz_target;
use torqcomp::io::mcap::path;
use torqcomp::io::mcap::route::Route;
use torqcomp::io::mcap::schema::leaves::leaves;
use torqcomp::io::mcap::schema::ros2msg::{self, Generation};
use torqcomp::io::mcap::schema::{protobuf, ros2idl};
use torqcomp::io::mcap::time::Stamp;

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, rest)) = bytes.split_first() else {
        return;
    };
    let text = String::from_utf8_lossy(rest);
    let schema = match kind % 4 {
        0 => ros2msg::read("p/msg/M", &text, Generation::Ros2),
        1 => ros2msg::read("p/M", &text, Generation::Ros1),
        2 => ros2idl::read("p/msg/M", &text),
        _ => protobuf::read("p.M", rest),
    };
    let Ok(schema) = schema else {
        return;
    };
    let _ = Stamp::find(&schema);
    let (found, _) = leaves(&schema);
    for leaf in found.iter().take(20) {
        if let Ok(parts) = path::parse(&leaf.first_item()) {
            let _ = Route::find(&schema, &parts);
        }
    }
});
