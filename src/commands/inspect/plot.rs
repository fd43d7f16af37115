//! The picture of the channels.

use std::path::Path;

use crate::failure::Failure;
use crate::io::output::Output;
use crate::quality::{labels, unit_of};
use crate::recording::{Channel, Recording};
use crate::report::inspect::{self, Entry, Report};
use crate::report::panels::{self, Panel, Times};

/// Opens the file for the picture.
pub fn open(path: &Path, force: bool, taken: &[&Path]) -> Result<Output, Failure> {
    let text = path
        .to_str()
        .filter(|text| *text != "-")
        .ok_or_else(|| Failure::usage("--plot needs the name of a file, in UTF-8"))?;
    Output::open(Some(text), force, taken)
}

/// Draws every channel of every file that was read.
pub fn svg(recordings: &[&Recording], report: &Report) -> String {
    let found: Vec<&inspect::File> = report
        .files
        .iter()
        .filter_map(|entry| match entry {
            Entry::Read(file) => Some(file.as_ref()),
            Entry::Failed { .. } => None,
        })
        .collect();
    let several = recordings.len() > 1;
    let panels: Vec<Panel> = recordings
        .iter()
        .zip(found)
        .flat_map(|(recording, found)| {
            let channels = recording.channels.iter().zip(&found.channels);
            let named = channels.zip(labels(&recording.channels));
            named.map(move |((channel, found), label)| {
                let name = match several {
                    true => format!("{}: {label}", recording.source),
                    false => label,
                };
                panel(channel, found, name)
            })
        })
        .collect();
    let title = match recordings {
        [one] => one.source.clone(),
        several => format!("{} files", several.len()),
    };
    panels::svg(&title, &panels)
}

fn panel<'a>(channel: &'a Channel, found: &inspect::Channel, name: String) -> Panel<'a> {
    let axis = &channel.axis;
    let drawn = channel.samples.len();
    let name = match found.samples > drawn {
        true => format!("{name} (the first {drawn} of {} samples)", found.samples),
        false => name,
    };
    let times = match (&axis.stamps_s, axis.rate_hz) {
        (Some(stamps), _) => Times::Stamps(stamps),
        (None, Some(rate_hz)) => Times::Uniform {
            start_s: axis.start_s.unwrap_or(0.0),
            rate_hz,
        },
        (None, None) => Times::Numbers,
    };
    Panel {
        name,
        unit: unit_of(channel).to_owned(),
        samples: &channel.samples,
        times,
        rails: [found.clipped_low, found.clipped_high]
            .into_iter()
            .flatten()
            .collect(),
    }
}
