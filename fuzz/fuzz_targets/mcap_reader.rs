//! Any bytes as an MCAP file: listed, read as a signal and copied without harm.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use torqcomp::io::Input;
use torqcomp::io::mcap::record::frames::Frames;
use torqcomp::io::mcap::record::input::CountedInput;
use torqcomp::io::mcap::{Inventory, Options, Selection, Source};

fn frames(bytes: &[u8]) -> Option<Frames> {
    let input = CountedInput::new(Box::new(Cursor::new(bytes.to_vec())));
    Frames::new("fuzz".to_owned(), input).ok()
}

fuzz_target!(|bytes: &[u8]| {
    let Some(inventory) = frames(bytes).and_then(|frames| Inventory::read(frames).ok()) else {
        return;
    };
    for channel in inventory.channels.iter().take(4) {
        for field in channel.leaves.iter().take(4) {
            let selection = Selection {
                topic: Some(channel.topic.clone()),
                field: Some(field.path.replace("[]", "[:]")),
                signal: None,
            };
            let (Ok(wanted), Some(frames)) = (selection.check(), frames(bytes)) else {
                continue;
            };
            let Ok(mut source) = Source::read(&Input::Stdin, frames, &wanted, &Options::default())
            else {
                continue;
            };
            let (mut times, mut values) = (Vec::new(), Vec::new());
            while source.next(&mut times, &mut values).unwrap_or(false) {
                assert!(times.is_sorted() && times.len() == values.len());
            }
            let _ = source.finish();
        }
    }
});
