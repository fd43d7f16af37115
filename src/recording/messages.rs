//! Numbers in the messages of an MCAP file as channels of a recording, wholly in memory.

use std::sync::Arc;

use super::choice::{self, Label, by_name};
use super::moment::Moment;
use super::text::ClockOrigin;
use super::{Channel, Recording, TimeAxis};
use crate::failure::Failure;
use crate::io::mcap::{
    self, FieldChoice, SelectedSignal, SignalSummary, TimeOptions, time::TimeUsed,
};
use crate::io::{ChannelChoice, Input, Reading};
use crate::unit::NamedUnit;
use crate::warning::{Warning, WarningCode};

/// The selected numbers in the given order, or the only one in the file. Their stamps are relative to the first
/// sample of the first one.
///
/// # Errors
/// If the file cannot be read, or a number is missing; the message lists the available ones.
pub(super) fn read(
    input: &Input,
    choices: &[ChannelChoice],
    reading: &Reading,
) -> Result<Recording, Failure> {
    let (held, results) = read_chosen(input, choices, reading)?;
    let mut recording = Recording::empty("mcap", input.name());
    let origin_ns = held
        .iter()
        .find_map(|(times_ns, _)| times_ns.first().copied());
    for ((choice, result), (times_ns, samples)) in choices.iter().zip(results).zip(held) {
        let (selected, summary) = result?;
        let described = describe(&selected);
        if !recording.dialect.contains(&described) {
            let joint = if recording.dialect.is_empty() {
                "MCAP,"
            } else {
                ";"
            };
            recording.dialect += &format!("{joint} {described}");
        }
        let (lost, warnings) = losses(summary);
        match recording.lost {
            None => recording.lost = lost,
            Some(_) => recording.warnings.extend(lost),
        }
        recording.warnings.extend(warnings);
        let seconds = |time_ns: &i64| time_ns.wrapping_sub(origin_ns.unwrap_or(0)) as f64 * 1e-9;
        let stamps_s = times_ns.iter().map(seconds).collect();
        let heading = clock(&selected.time);
        let mut axis =
            TimeAxis::of_stamps_after(origin_ns.unwrap_or(0), &heading, Arc::new(stamps_s));
        axis.clock = origin_ns.map(ClockOrigin::utc);
        axis.start_text = axis.start.and_then(Moment::date);
        recording.channels.push(Channel {
            samples,
            ..channel(choice, &selected, axis)
        });
    }
    if let Some(range) = &reading.range {
        recording.keep(range).map_err(|f| f.at(input.name()))?;
    }
    Ok(recording)
}

/// The channel of a number, without its samples.
pub(super) fn channel(choice: &ChannelChoice, of: &SelectedSignal, axis: TimeAxis) -> Channel {
    Channel {
        heading: choice.channel.clone().unwrap_or_else(|| name(of)),
        name: name(of),
        unit: unit(of),
        unit_text: of.unit.as_ref().map(|found| found.unit.clone()),
        axis,
        is_compensated: of.is_compensated,
        ..Channel::default()
    }
}

/// Times and values of a number.
type Held = (Vec<i64>, Vec<f64>);
/// Further information about a number.
type ReadNumber = Result<(SelectedSignal, SignalSummary), Failure>;

/// The selected numbers with their times and further information. A name without an exact match is searched for as part
/// of one.
fn read_chosen(
    input: &Input,
    choices: &[ChannelChoice],
    reading: &Reading,
) -> Result<(Vec<Held>, Vec<ReadNumber>), Failure> {
    let mut fields: Vec<FieldChoice> = choices.iter().map(|c| field(c, reading)).collect();
    let options = times(reading);
    let read = |fields: &[FieldChoice]| {
        let mut held: Vec<Held> = vec![Held::default(); choices.len()];
        let results = mcap::read_fields(input, fields, &options, |number, times_ns, values| {
            held[number].0.extend_from_slice(times_ns);
            held[number].1.extend_from_slice(values);
        })?;
        Ok((held, results))
    };
    let (held, results) = read(&fields)?;
    let mut is_other = false;
    for ((field, choice), result) in fields.iter_mut().zip(choices).zip(&results) {
        if result.is_err()
            && let Some(found) = by_part(input, field, choice.flags.channel)?
        {
            *field = found;
            is_other = true;
        }
    }
    match is_other {
        true => read(&fields),
        false => Ok((held, results)),
    }
}

/// Topic and field of a selection. If a topic is given, a channel is named by the field alone.
pub(super) fn field(choice: &ChannelChoice, reading: &Reading) -> FieldChoice {
    let topic = reading.topic.clone();
    match (&topic, &choice.field, &choice.signal, &choice.channel) {
        (Some(_), None, None, Some(field)) => FieldChoice {
            topic,
            field: Some(field.clone()),
            signal: None,
        },
        (_, field, signal, channel) => FieldChoice {
            topic,
            field: field.clone(),
            signal: signal.clone().or_else(|| channel.clone()),
        },
    }
}

/// The number whose name matches a selection ignoring case, or the only one that contains it; `None` if there is none,
/// or the file can only be read once.
pub(super) fn by_part(
    input: &Input,
    choice: &FieldChoice,
    flag: &str,
) -> Result<Option<FieldChoice>, Failure> {
    let (Input::File(_), Some(wanted)) = (input, choice.signal.as_ref().or(choice.field.as_ref()))
    else {
        return Ok(None);
    };
    let inventory = mcap::Inventory::scan(input)?;
    let topics = inventory.channels.iter();
    let topics = topics.filter(|c| choice.topic.as_ref().is_none_or(|topic| c.topic == *topic));
    let mut numbers: Vec<[String; 2]> = topics
        .flat_map(mcap::inventory::ChannelReport::choosable)
        .collect();
    // A topic can have several channels.
    numbers.sort();
    numbers.dedup();
    let names: Vec<String> = numbers
        .iter()
        .map(|[topic, field]| format!("{topic}.{field}"))
        .collect();
    let labels: Vec<Label> = names
        .iter()
        .map(|name| Label {
            heading: name,
            name,
            segment: None,
        })
        .collect();
    let place = match by_name(&labels, wanted, flag)? {
        Some(place) => Some(place),
        None => choice::by_part(&labels, wanted)?,
    };
    Ok(place.map(|place| FieldChoice {
        topic: Some(numbers[place][0].clone()),
        field: Some(numbers[place][1].clone()),
        signal: None,
    }))
}

/// Which time of the messages to use.
pub(crate) fn times(reading: &Reading) -> TimeOptions {
    TimeOptions {
        time: reading.time,
        spacing: reading.spacing.clone(),
    }
}

/// Topic and field combined.
pub(super) fn name(chosen: &SelectedSignal) -> String {
    match chosen.field.as_str() {
        "" => chosen.topic.clone(),
        field => format!("{}.{field}", chosen.topic),
    }
}

/// Description of the time used.
pub(super) fn clock(used: &TimeUsed) -> String {
    match &used.field {
        Some(field) => field.clone(),
        None => format!("{} time", used.choice.name()),
    }
}

/// `cdr sensor_msgs/msg/JointState, time: header.stamp (the messages carry their own time stamp)`.
pub(super) fn describe(chosen: &SelectedSignal) -> String {
    let kind = format!("{} {}", chosen.encoding, chosen.schema);
    format!(
        "{}, time: {} ({})",
        // JSON may come without a schema.
        kind.trim_end(),
        clock(&chosen.time),
        chosen.time.why
    )
}

/// The unit given by the file, if known.
pub(super) fn unit(chosen: &SelectedSignal) -> Option<NamedUnit> {
    NamedUnit::parse(&chosen.unit.as_ref()?.unit)
}

/// Losses of a number, and further warnings.
pub(super) fn losses(summary: SignalSummary) -> (Option<Warning>, Vec<Warning>) {
    let mut warnings = summary.warnings;
    let lost = summary.is_lossy.then(|| {
        let first = (!warnings.is_empty()).then(|| warnings.remove(0));
        first.unwrap_or_else(|| WarningCode::McapLost.warning("messages were lost"))
    });
    (lost, warnings)
}
