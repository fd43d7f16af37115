//! Recognition of exports that the general reader handles.

use super::{Maker, Rule};
use crate::recording::text::head::Head;
use crate::recording::text::header::after_definition;
use crate::recording::text::table::Hints;
use crate::recording::text::vocabulary::words;

/// Those not recognised by a list of words.
pub const ALL: &[Rule] = &[
    (
        Maker {
            hints: Hints {
                time_unit: Some("ms"),
                unit: None,
            },
            ..Maker::plain("TwinCAT Scope")
        },
        |head| {
            let starts = ["Starttime of export", "SymbolComment", "SampleTime[ms]"];
            head.any(|line| starts.iter().any(|start| line.starts_with(start)))
        },
    ),
    (Maker::plain("PicoScope"), is_pico_scope),
    (Maker::plain("LabVIEW waveform table"), |head| {
        head.starts(0, "waveform\t") || head.starts(0, "channel names:")
    }),
    (Maker::plain("ABB drive monitor"), |head| {
        head.starts(0, "Time [s]\t") && head.lines[0].text.trim_end().ends_with("h)")
    }),
    (Maker::plain("CASSY Lab"), |head| {
        head.starts(0, "MIN") && head.any(|line| after_definition(line).is_some())
    }),
];

/// Units of time and of channels in brackets below the names, followed by an empty line.
fn is_pico_scope(head: &Head) -> bool {
    let times = ["(s)", "(ms)", "(us)", "(\u{b5}s)", "(ns)"];
    let [_, units, empty, ..] = head.lines.as_slice() else {
        return false;
    };
    let units = units.text.trim();
    times.iter().any(|unit| units.starts_with(unit))
        && units.ends_with(')')
        && empty.text.trim().is_empty()
}

/// The maker recognised by a list of words.
pub fn listed(head: &Head) -> Option<Maker> {
    let is_so = |sign: &str| match sign.split_once(' ') {
        Some(("first", start)) => head.starts(0, start),
        Some(("second", start)) => head.starts(1, start),
        Some(("any", start)) => head.any(|line| super::super::head::starts(line, start)),
        Some(("holds", part)) => {
            let part = part.to_lowercase();
            head.any(|line| line.to_lowercase().contains(&part))
        }
        _ => false,
    };
    let found = words("makers")
        .iter()
        .find(|word| word.text.split(" & ").all(is_so))?;
    Some(Maker::plain(found.meaning))
}
