//! Arbitrary bytes as an MCAP file: listing, reading as a signal and copying must be safe.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use torqcomp::io::Input;
use torqcomp::io::mcap::{FieldChoice, Inventory, SignalReader, TimeOptions};

fn stream(bytes: &[u8]) -> Box<Cursor<Vec<u8>>> {
    Box::new(Cursor::new(bytes.to_vec()))
}

fuzz_target!(|bytes: &[u8]| {
    let Ok(inventory) = Inventory::read("fuzz".to_owned(), stream(bytes)) else {
        return;
    };
    for channel in inventory.channels.iter().take(4) {
        for field in channel.leaves.iter().take(4) {
            let choice = FieldChoice {
                topic: Some(channel.topic.clone()),
                field: Some(field.path.replace("[]", "[:]")),
                signal: None,
            };
            let options = TimeOptions::default();
            let reader = SignalReader::with_stream(&Input::Stdin, stream(bytes), &choice, &options);
            let Ok(mut reader) = reader else {
                continue;
            };
            let (mut times, mut values) = (Vec::new(), Vec::new());
            while reader.next(&mut times, &mut values).unwrap_or(false) {
                assert!(times.is_sorted() && times.len() == values.len());
            }
            let _ = reader.finish();
        }
    }
});
