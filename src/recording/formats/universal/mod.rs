//! Universal files (UFF, UNV) with data sets 58 and 58b, functions over time (SDRC Universal File Format, data set 58).
//!
//! A data set is enclosed by lines `    -1`. Each data set 58 is one channel: eleven header lines and the numbers, as
//! text or (58b) as bytes. Functions of anything other than time are listed and left out.

mod head;
mod lines;

use std::collections::{HashMap, HashSet};

use self::head::{DatasetHead, field};
use self::lines::{Lines, numbers_of};
use torqcomp_decimal::digits;

use super::bytes::{Bytes, Order};
use super::{Content, Format, channel, cut, names_left_out, stamped};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::recording::{Channel, TimeAxis};
use crate::unit::NamedUnit;

pub(super) const UNIVERSAL: Format = Format {
    name: "uff",
    called: "a universal file",
    is,
    takes: &[],
    read,
};

/// Whether the first two lines are `    -1` and the number of a data set.
fn is(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().skip_while(|line| line.trim().is_empty());
    let begins = lines.next().is_some_and(|line| line.trim_end() == "    -1");
    let number = lines.next().unwrap_or_default();
    let number: String = number.chars().take(6).collect();
    begins && number.starts_with("  ") && number.trim().parse::<u32>().is_ok()
}

/// Storage of the numbers of a data set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Storage {
    Text,
    Binary(Order, usize),
}

fn read(bytes: &mut Bytes, _: &Reading) -> Result<Content, Failure> {
    let mut lines = Lines {
        bytes,
        ahead: Vec::new(),
        used: 0,
        number: 0,
    };
    let mut content = Content::default();
    let (mut left_out, mut labels) = (Vec::new(), Vec::new());
    let mut kinds = Vec::new();
    while let Some(line) = lines.next()? {
        if line.trim() != "-1" {
            continue;
        }
        let Some(mut line) = lines.next()? else { break };
        // Two such lines separate data sets.
        while line.trim() == "-1" {
            line = lines.next()?.unwrap_or_default();
        }
        let number: String = line.chars().take(6).collect();
        if number.trim() == "58" {
            let storage = storage(&line, &lines)?;
            kinds.push(if storage == Storage::Text {
                "58"
            } else {
                "58b"
            });
            let others = (&mut left_out, &mut labels);
            let is_whole = data_set(&mut lines, storage, &mut content, others)?;
            if !is_whole {
                break;
            }
        } else {
            while lines.next()?.is_some_and(|line| line.trim() != "-1") {}
        }
    }
    content.warnings.extend(names_left_out(&left_out));
    tell_apart(&mut content.channels, &labels);
    kinds.dedup();
    content.dialect = format!("universal file, data sets {}", kinds.join(" and "));
    Ok(content)
}

/// Adds the labels of their ordinates to names that several functions have, if the labels differ.
fn tell_apart(channels: &mut [Channel], labels: &[String]) {
    let mut labels_of: HashMap<String, HashSet<&str>> = HashMap::new();
    for (channel, label) in channels.iter().zip(labels) {
        labels_of
            .entry(channel.name.clone())
            .or_default()
            .insert(label);
    }
    for (channel, label) in channels.iter_mut().zip(labels) {
        if !label.is_empty() && labels_of[&channel.name].len() > 1 {
            channel.name = format!("{} {label}", channel.name);
            channel.heading.clone_from(&channel.name);
        }
    }
}

/// Storage of the numbers of a data set, from its line with 58.
fn storage(line: &str, lines: &Lines) -> Result<Storage, Failure> {
    if !line
        .chars()
        .nth(6)
        .is_some_and(|c| c.eq_ignore_ascii_case(&'b'))
    {
        return Ok(Storage::Text);
    }
    let order = match field(line, 7, 6) {
        Some(1) => Order::Little,
        Some(2) => Order::Big,
        _ => {
            return Err(lines.wrong("the data set 58b does not give its byte order (1 or 2)"));
        }
    };
    if field(line, 13, 6) != Some(2) {
        return Err(ErrorCode::NotARecording.failed(
            "the data set 58b has DEC VMS or IBM floating-point numbers, which are not supported; write it as IEEE 754",
        )
        .line(lines.number));
    }
    let count = field(line, 31, 12);
    let count =
        count.ok_or_else(|| lines.wrong("the data set 58b does not give its number of bytes"))?;
    Ok(Storage::Binary(order, count))
}

/// Reads a data set 58, with the names of those that are no channels, and the labels of those that are; returns whether
/// it was complete.
fn data_set(
    lines: &mut Lines,
    storage: Storage,
    content: &mut Content,
    (left_out, labels): (&mut Vec<String>, &mut Vec<String>),
) -> Result<bool, Failure> {
    let Some(head) = DatasetHead::read(lines)? else {
        content.lost = Some(cut("within the header of a data set"));
        return Ok(false);
    };
    let (wanted, each) = head.numbers();
    let foreign = head.foreign();
    let (values, is_whole) = match storage {
        Storage::Text => {
            let values = text_values(lines, wanted, &head)?;
            let is_whole = values.len() >= wanted;
            (values, is_whole)
        }
        Storage::Binary(order, count) => {
            let stored = lines.bytes(count)?;
            let is_whole = stored.len() == count;
            let needed = wanted.saturating_mul(head.width().width());
            if is_whole && count < needed && foreign.is_none() {
                return Err(lines.wrong("the data set 58b has fewer bytes than its numbers need"));
            }
            while is_whole && lines.next()?.is_some_and(|line| line.trim() != "-1") {}
            (head.width().all(&stored, order), is_whole)
        }
    };
    let there = values.len().min(wanted);
    let name = match head.name.as_str() {
        "" => format!("function {}", content.channels.len() + left_out.len() + 1),
        name => name.to_owned(),
    };
    match foreign {
        Some(why) => left_out.push(format!("\"{name}\" ({why})")),
        None => {
            let channel = made(&head, &name, &values[..there - there % each], lines)?;
            content.channels.push(channel);
            labels.push(head.axes[1].label.clone());
        }
    }
    if !is_whole {
        content.lost = Some(cut(&format!(
            "\"{name}\" has {} of {} samples",
            there / each,
            head.count
        )));
    }
    Ok(is_whole)
}

/// The numbers of a text data set, as many as the file contains, and the line after them.
fn text_values(lines: &mut Lines, wanted: usize, head: &DatasetHead) -> Result<Vec<f64>, Failure> {
    let widths: &[usize] = match (head.kind, head.is_even) {
        (2 | 5, _) => &[13],
        (4, false) => &[13, 20],
        (6, false) => &[13, 20, 20],
        _ => &[20],
    };
    let mut values = Vec::new();
    while values.len() < wanted {
        let Some(line) = lines.next()? else { break };
        if line.trim() == "-1" {
            break;
        }
        if !numbers_of(&line, widths, &mut values) {
            return Err(ErrorCode::InvalidSample
                .failed("text where numbers of a data set 58 are expected; correct the line")
                .line(lines.number));
        }
    }
    if values.len() >= wanted {
        // Skips to the end of the data set; its type is checked next.
        while lines.next()?.is_some_and(|line| line.trim() != "-1") {}
    }
    Ok(values)
}

/// The rate with the fewest digits whose step equals the stated one to six digits: 2.26757E-05 s is 44100 Hz.
fn roundest_rate(step: f64) -> f64 {
    let half = 0.5 * 10.0_f64.powi(step.log10().floor() as i32 - 5);
    let rounded = (1..=6).filter_map(|count| digits::text(1.0 / step, count).parse::<f64>().ok());
    rounded
        .into_iter()
        .find(|rate| (1.0 / rate - step).abs() <= half * (1.0 + 1e-9))
        .unwrap_or(1.0 / step)
}

/// The channel of a data set.
fn made(head: &DatasetHead, name: &str, values: &[f64], lines: &Lines) -> Result<Channel, Failure> {
    let [abscissa, ordinate] = &head.axes;
    // The standard prescribes seconds; another unit of time is accepted as written.
    let unit = NamedUnit::parse(&abscissa.unit).filter(NamedUnit::is_time);
    let second = unit.map_or(1.0, |unit| unit.unit.factor());
    let (axis, samples) = if head.is_even {
        let step = head.step * second;
        if !(step > 0.0 && step.is_finite() && head.start.is_finite()) {
            return Err(lines.wrong("the abscissa increment is not a positive time"));
        }
        let start = head.start * second;
        let rate_hz = roundest_rate(step);
        (
            TimeAxis::of_header("abscissa increment", rate_hz, Some(start)),
            values.to_vec(),
        )
    } else {
        let pairs = values.chunks_exact(2);
        let heading = match abscissa.label.as_str() {
            "" => "abscissa",
            label => label,
        };
        let stamps = pairs.clone().map(|pair| pair[0] * second).collect();
        (
            stamped(heading, stamps),
            pairs.map(|pair| pair[1]).collect(),
        )
    };
    Ok(channel(name, Some(&ordinate.unit), samples, axis))
}
