//! Signals of an MCAP file as the channels of a recording, each as a whole in memory.

use std::sync::Arc;

use super::{Axis, Channel, Recording};
use crate::failure::Failure;
use crate::io::Input;
use crate::io::csv::NamedUnit;
use crate::io::mcap::{self, Selection, Source, source::Chosen, time::TimeUsed};

/// The signals that are named as `--signal` names them, or the only one in the file for `None`. Their
/// stamps are counted from the first sample of the first one.
///
/// # Errors
/// If the file cannot be read, or a signal is not in it: then with what is there.
pub fn read(place: &Input, wanted: &[Option<&str>]) -> Result<Recording, Failure> {
    if *place == Input::Stdin && wanted.len() > 1 {
        return Err(Failure::usage(
            "several signals of an MCAP file are read one after the other, which standard input does \
             not allow; give the name of the file",
        ));
    }
    let mut recording = Recording::empty("mcap", place.name());
    let mut origin_ns = None;
    for signal in wanted {
        let read = one(place, *signal, &mut origin_ns, &mut recording)?;
        recording.channels.push(read);
    }
    Ok(recording)
}

fn one(
    place: &Input,
    signal: Option<&str>,
    origin_ns: &mut Option<i64>,
    recording: &mut Recording,
) -> Result<Channel, Failure> {
    let selection = Selection {
        signal: signal.map(str::to_owned),
        ..Selection::default()
    };
    let mut source = Source::open(place, &selection, &mcap::Options::default())?;
    let (mut times_ns, mut values) = (Vec::new(), Vec::new());
    let (mut stamps_s, mut samples) = (Vec::new(), Vec::new());
    while source.next(&mut times_ns, &mut values)? {
        let origin = *origin_ns.get_or_insert(times_ns[0]);
        let seconds = |time_ns: &i64| time_ns.wrapping_sub(origin) as f64 * 1e-9;
        stamps_s.extend(times_ns.iter().map(seconds));
        samples.append(&mut values);
    }
    let chosen = source.chosen().clone();
    let described = describe(&chosen);
    if !recording.dialect.contains(&described) {
        let joint = if recording.dialect.is_empty() {
            "MCAP"
        } else {
            ";"
        };
        recording.dialect += &format!("{joint} {described}");
    }
    let summary = source.finish();
    let mut warnings = summary.warnings;
    if summary.is_lossy && recording.lost.is_none() && !warnings.is_empty() {
        recording.lost = Some(warnings.remove(0));
    }
    recording.warnings.extend(warnings);
    Ok(channel(signal, &chosen, samples, stamps_s, *origin_ns))
}

fn describe(chosen: &Chosen) -> String {
    let TimeUsed { choice, field, why } = &chosen.time;
    let time = field
        .clone()
        .unwrap_or_else(|| format!("{} time", choice.name()));
    format!(
        "{} {}, time: {time} ({why})",
        chosen.encoding, chosen.schema
    )
}

fn channel(
    signal: Option<&str>,
    chosen: &Chosen,
    samples: Vec<f64>,
    stamps_s: Vec<f64>,
    origin_ns: Option<i64>,
) -> Channel {
    let name = if chosen.field.is_empty() {
        chosen.topic.clone()
    } else {
        format!("{}.{}", chosen.topic, chosen.field)
    };
    let unit_text = chosen.unit.as_ref().map(|found| found.unit.clone());
    let mut axis = Axis::of_stamps("stamps of the messages", Arc::new(stamps_s));
    axis.start_text = origin_ns.map(|ns| format!("{ns} ns"));
    Channel {
        heading: signal.unwrap_or(&name).to_owned(),
        name,
        unit: unit_text.as_deref().and_then(NamedUnit::parse),
        unit_text,
        samples,
        holes: Vec::new(),
        axis,
        segment: None,
    }
}
