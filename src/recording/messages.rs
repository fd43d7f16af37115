//! Signals of an MCAP file as the channels of a recording, each as a whole in memory.

use std::sync::Arc;

use super::{Axis, Channel, Recording};
use crate::failure::Failure;
use crate::io::Input;
use crate::io::csv::NamedUnit;
use crate::io::mcap::{self, FieldChoice, SelectedSignal, TimeOptions, time::TimeUsed};

/// The signals that are named as `--signal` names them, or the only one in the file for `None`. Their
/// stamps are counted from the first sample of the first one.
///
/// # Errors
/// If the file cannot be read, or a signal is not in it: then with what is there.
pub fn read(place: &Input, wanted: &[Option<&str>]) -> Result<Recording, Failure> {
    let choice = |signal: &Option<&str>| FieldChoice {
        signal: signal.map(str::to_owned),
        ..FieldChoice::default()
    };
    let choices: Vec<_> = wanted.iter().map(choice).collect();
    let mut held = vec![(Vec::new(), Vec::new()); wanted.len()];
    let options = TimeOptions::default();
    let results = mcap::read_fields(place, &choices, &options, |signal, times_ns, values| {
        held[signal].0.extend_from_slice(times_ns);
        held[signal].1.extend_from_slice(values);
    })?;
    let mut recording = Recording::empty("mcap", place.name());
    let origin_ns = held
        .iter()
        .find_map(|(times_ns, _)| times_ns.first().copied());
    for ((signal, result), (times_ns, samples)) in wanted.iter().zip(results).zip(held) {
        let (selected, summary) = result?;
        describe(&selected, &mut recording.dialect);
        let mut warnings = summary.warnings;
        if summary.is_lossy && recording.lost.is_none() && !warnings.is_empty() {
            recording.lost = Some(warnings.remove(0));
        }
        recording.warnings.extend(warnings);
        let seconds = |time_ns: &i64| time_ns.wrapping_sub(origin_ns.unwrap_or(0)) as f64 * 1e-9;
        let stamps_s = times_ns.iter().map(seconds).collect();
        let channel = channel(*signal, &selected, samples, stamps_s, origin_ns);
        recording.channels.push(channel);
    }
    Ok(recording)
}

/// Adds what a signal's messages are to the description of a file, unless it is in it.
fn describe(selected: &SelectedSignal, dialect: &mut String) {
    let TimeUsed { choice, field, why } = &selected.time;
    let time = field
        .clone()
        .unwrap_or_else(|| format!("{} time", choice.name()));
    let described = format!(
        "{} {}, time: {time} ({why})",
        selected.encoding, selected.schema
    );
    if !dialect.contains(&described) {
        let joint = if dialect.is_empty() { "MCAP" } else { ";" };
        *dialect += &format!("{joint} {described}");
    }
}

fn channel(
    signal: Option<&str>,
    chosen: &SelectedSignal,
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
