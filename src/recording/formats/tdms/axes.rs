//! Channels of a TDMS file, and their time axes.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use torqcomp_decimal::digits;
use torqcomp_dsp::quality::rate::contradiction;

use super::objects::{Properties, Property, TdmsObject, TdmsObjects};
use super::scales;
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::recording::formats::{Content, NAMED, channel, names_left_out, plausible_rate, stamped};
use crate::recording::moment::{Moment, date_and_time};
use crate::recording::text::{ClockOrigin, is_time_name};
use crate::recording::{TimeAxis, without_rounding};
use crate::unit::NamedUnit;
use crate::warning::{Warning, WarningCode};

/// Maximum number of file properties reported.
const TOLD: usize = 50;

/// A channel of numbers, or of times only.
struct ScaledChannel {
    object: TdmsObject,
    values: Vec<f64>,
}

impl ScaledChannel {
    fn len(&self) -> usize {
        self.values.len().max(self.object.times_ns.len())
    }

    fn group(&self) -> &str {
        &self.object.path[0]
    }

    fn name(&self) -> String {
        self.object.path.join("/")
    }

    fn is_times(&self) -> bool {
        self.values.is_empty()
    }

    /// Whether its values can be the times of other channels.
    fn is_time(&self) -> bool {
        self.is_times()
            || is_time_name(&self.object.path[1])
                && self.values.windows(2).all(|pair| pair[1] >= pair[0])
    }
}

/// Converts objects with samples to channels.
///
/// # Errors
/// If options for the time do not apply.
pub(super) fn channels(
    objects: TdmsObjects,
    reading: &Reading,
    content: &mut Content,
) -> Result<(), Failure> {
    content.details = details(&objects);
    let (found, mut left_out) = scaled(objects);
    let starts = found.iter().filter_map(|f| f.object.time("wf_start_time"));
    let first_ns = starts.min();
    let times = GroupTimes::of(&found, reading)?;
    let (mut axes, mut used) = (HashMap::new(), HashSet::new());
    let mut made = Vec::new();
    for one in &found {
        let of_header = of_waveform(&one.object, first_ns);
        let Some(place) = times.place(&found, one) else {
            made.push(of_header);
            continue;
        };
        let of_header = of_header.filter(|_| reading.time_column.is_none());
        let known = axes.get(&place).cloned();
        let of_stamps = known.map_or_else(|| of_times(&found[place], reading), Ok);
        if let Ok(stamps) = &of_stamps {
            axes.insert(place, stamps.clone());
        }
        made.push(Some(match (of_header, of_stamps) {
            // Then it is just another channel.
            (Some(header), Err(_)) => header,
            (Some(header), Ok(stamps)) if !contradict(&header, &stamps, one.len()) => header,
            (of_header, of_stamps) => {
                used.insert(place);
                TimeAxis {
                    header_rate_hz: of_header.and_then(|header| header.rate_hz),
                    ..of_stamps?
                }
            }
        }));
    }
    for (place, (one, axis)) in found.into_iter().zip(made).enumerate() {
        if used.contains(&place) {
            continue;
        }
        let name = one.name();
        if one.is_times() {
            left_out.push(format!("\"{name}\" (time stamps of no other channel)"));
            continue;
        }
        content.warnings.extend(doubts(&one.object, &name));
        let unit = ["unit_string", "NI_UnitDescription"];
        let unit = unit.into_iter().find_map(|key| one.object.text(key));
        let axis = axis.unwrap_or_default();
        content
            .channels
            .push(channel(&name, unit, one.values, axis));
    }
    content.warnings.extend(names_left_out(&left_out));
    Ok(())
}

/// Whether the rate in the header of a channel is not that of its times. LabVIEW states a step of 1 s for channels without
/// one.
fn contradict(header: &TimeAxis, stamps: &TimeAxis, count: usize) -> bool {
    let rates = header.rate_hz.zip(stamps.rate_hz);
    rates.is_some_and(|(stated, stamped)| contradiction(stated, stamped, count).is_some())
}

/// Channels with scaled values, and the names of those without.
fn scaled(objects: TdmsObjects) -> (Vec<ScaledChannel>, Vec<String>) {
    let (mut file, mut groups) = (Properties::new(), HashMap::new());
    for object in &objects.all {
        match object.path.as_slice() {
            [] => file.clone_from(&object.properties),
            [group] => drop(groups.insert(group.clone(), object.properties.clone())),
            _ => {}
        }
    }
    let (none, mut found, mut left_out) = (Properties::new(), Vec::new(), Vec::new());
    for mut object in objects.all {
        let [group, _] = object.path.as_slice() else {
            continue;
        };
        let name = object.path.join("/");
        if let Some(why) = object.left_out {
            left_out.push(format!("\"{name}\" ({why})"));
            continue;
        }
        if object.len() == 0 {
            continue;
        }
        let series = std::mem::take(&mut object.series);
        let levels = [
            &object.properties,
            groups.get(group).unwrap_or(&none),
            &file,
        ];
        match scales::scaled(series, levels) {
            Ok(values) => found.push(ScaledChannel { object, values }),
            Err(why) => left_out.push(format!("\"{name}\" ({why})")),
        }
    }
    (found, left_out)
}

/// Channels that contain the times of others, by group.
struct GroupTimes {
    of_group: HashMap<String, Vec<usize>>,
}

impl GroupTimes {
    fn of(found: &[ScaledChannel], reading: &Reading) -> Result<Self, Failure> {
        let mut of_group: HashMap<String, Vec<usize>> = HashMap::new();
        for (place, one) in found.iter().enumerate() {
            let is = match &reading.time_column {
                Some(wanted) => one.object.path[1] == *wanted || one.name() == *wanted,
                None => one.is_time(),
            };
            if is {
                let group = one.group().to_owned();
                of_group.entry(group).or_default().push(place);
            }
        }
        if let (Some(wanted), true) = (&reading.time_column, of_group.is_empty()) {
            let names: Vec<String> = found.iter().take(NAMED).map(ScaledChannel::name).collect();
            return Err(ErrorCode::ChannelNotFound.failed(format_args!(
                "there is no channel \"{wanted}\" for --time-column; the channels are {}",
                names.join(", ")
            )));
        }
        Ok(Self { of_group })
    }

    /// Index of the only channel of the same group and length that contains times for a channel.
    fn place(&self, found: &[ScaledChannel], one: &ScaledChannel) -> Option<usize> {
        let places = self.of_group.get(one.group())?;
        let mut fitting = places.iter().filter(|place| {
            let times = &found[**place];
            times.len() == one.len() && !std::ptr::eq(times, one)
        });
        match (fitting.next(), fitting.next()) {
            (Some(place), None) if !places.iter().any(|p| std::ptr::eq(&found[*p], one)) => {
                Some(*place)
            }
            _ => None,
        }
    }
}

/// Doubts about the time axis of a channel.
fn doubts(object: &TdmsObject, name: &str) -> Option<Warning> {
    if let Some(unit) = other_dimension(object) {
        let message = format!(
            "\"{name}\": the horizontal axis is in {unit}, not time: the samples have no rate"
        );
        return Some(WarningCode::NoTimeAxis.warning(message));
    }
    match object.changed? {
        "wf_increment" => Some(WarningCode::NoTimeAxis.warning(format!(
            "\"{name}\": wf_increment changes within the file: the samples have no rate; save each part in a \
             separate file"
        ))),
        changed => Some(WarningCode::Restarted.warning(format!(
            "\"{name}\": {changed} changes within the file: the recording was restarted, but the samples are timed \
             as if it had not been; save each part in a separate file if the times matter"
        ))),
    }
}

/// Unit of the horizontal axis, if it is not time.
fn other_dimension(object: &TdmsObject) -> Option<&str> {
    match object.time_unit_s() {
        Some(_) => None,
        None => object.text("wf_xunit_string"),
    }
}

/// The axis given by waveform properties; times are relative to the first start in the file.
fn of_waveform(object: &TdmsObject, first_ns: Option<i64>) -> Option<TimeAxis> {
    let unit_s = object.time_unit_s()?;
    if object.changed == Some("wf_increment") {
        return None;
    }
    let step_s = unit_s * object.number("wf_increment").filter(|step| *step > 0.0)?;
    let rate_hz = plausible_rate(without_rounding(1.0 / step_s))?;
    let offset = object.number("wf_start_offset").filter(|s| s.is_finite());
    let offset_s = offset.map(|offset| unit_s * offset);
    let start_ns = object.time("wf_start_time");
    let later_s = start_ns.map(|ns| ns.wrapping_sub(first_ns.unwrap_or(ns)) as f64 * 1e-9);
    let start_s = match (later_s, offset_s) {
        (None, None) => None,
        (later, offset) => Some(later.unwrap_or(0.0) + offset.unwrap_or(0.0)),
    };
    let mut axis = TimeAxis::of_header("wf_increment", rate_hz, start_s);
    let origin_ns = first_ns.filter(|_| start_ns.is_some());
    axis.clock = origin_ns.map(ClockOrigin::utc);
    axis.start_text = origin_ns.and_then(|origin_ns| {
        let after_s = start_s.unwrap_or(0.0);
        Moment { origin_ns, after_s }.date()
    });
    Some(axis)
}

/// The axis given by a channel of times.
fn of_times(times: &ScaledChannel, reading: &Reading) -> Result<TimeAxis, Failure> {
    let name = times.name();
    if let (Some(first_ns), true) = (times.object.times_ns.first(), times.is_times()) {
        let all = times.object.times_ns.iter();
        let stamps = all.map(|ns| ns.wrapping_sub(*first_ns) as f64 * 1e-9);
        let mut axis = TimeAxis::of_stamps(&name, Arc::new(stamps.collect()));
        axis.clock = Some(ClockOrigin::utc(*first_ns));
        axis.start_text = date_and_time(*first_ns);
        return Ok(axis);
    }
    let of_name = times.object.path[1].rsplit_once('_').map(|(_, unit)| unit);
    let known = |text: &str| NamedUnit::parse(text).filter(NamedUnit::is_time);
    let unit = match &reading.time_unit {
        Some(given) => Some(known(given).ok_or_else(|| {
            ErrorCode::InvalidValue
                .usage("--time-unit is not a unit of time; expected s, ms, us or min")
        })?),
        None => {
            (times.object.text("unit_string").and_then(known)).or_else(|| of_name.and_then(known))
        }
    };
    let second = unit.map_or(1.0, |unit| unit.unit.factor());
    Ok(stamped(
        &name,
        times.values.iter().map(|t| t * second).collect(),
    ))
}

/// Properties of the file.
fn details(objects: &TdmsObjects) -> Vec<(String, String)> {
    let file = objects.all.iter().find(|object| object.path.is_empty());
    let properties = file.into_iter().flat_map(|file| &file.properties);
    let of_people = properties.filter(|(key, _)| !key.starts_with("NI_"));
    let told = of_people.filter_map(|(key, value)| {
        let text = match value {
            Property::Text(text) if text.trim().is_empty() => return None,
            Property::Text(text) => text.trim().to_owned(),
            Property::Number(value) => digits::text(*value, 12),
            Property::Time(ns) => date_and_time(*ns)?,
        };
        Some((key.clone(), text))
    });
    told.take(TOLD).collect()
}
