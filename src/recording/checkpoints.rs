//! Stamps farther on in a file, read in advance: they give the rate of the whole record rather than of its first
//! rows, so that it does not depend on whether a command streams.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use torqcomp_dsp::quality::rounding::uniform_line;

use super::axis::SampleStep;
use crate::failure::Failure;
use crate::io::Input;
use crate::io::storage::Stored;
use crate::recording::text::{ChannelPlan, ChannelRows};

/// Number of bytes read at each checkpoint; the first one is this far after the head.
const PIECE: u64 = 1 << 12;
/// Largest distance of a stamp from the grid, in steps, at which steps can still be counted.
const COUNTABLE: f64 = 0.25;

/// Step of stamps that begin with `first` and are about `step` apart, refined with stamps farther and farther on: each
/// is a whole number of steps away, which the present estimate is accurate enough to determine. All together are then
/// the stamps of one line, if they deviate from it by their rounding only. `None` if steps cannot be counted.
///
/// A step of 1.01 that is found with 101 stamps is 1.0099 when the stamp after 10 100 steps is known to be 10 200:
/// 10 200 / 1.01 = 10 099.01.
pub(super) fn sharpened(
    found: SampleStep,
    first: &[f64],
    later: &[f64],
    origin: f64,
) -> Option<SampleStep> {
    let (mut step, start) = (found.step, *first.first()?);
    if later.is_empty() {
        return Some(found);
    }
    let resolution = |last: f64| 2.0 * f64::EPSILON * (origin.abs() + last.abs());
    let rows = first.iter().copied().enumerate();
    // If several rows share a coarsely rounded stamp, it does not determine their indices.
    let is_line = uniform_line(rows.clone(), resolution(first[first.len() - 1])).is_some();
    let place = |stamp: f64| ((stamp - start) / step).round().max(0.0) as usize;
    let known = rows.map(|(row, stamp)| (if is_line { row } else { place(stamp) }, stamp));
    let mut known: Vec<(usize, f64)> = known.collect();
    for stamp in later {
        let steps = (stamp - start) / step;
        let count = steps.round();
        if count < 1.0 || (steps - count).abs() > COUNTABLE {
            return None;
        }
        step = (stamp - start) / count;
        if known.last().is_some_and(|(i, _)| *i < count as usize) {
            known.push((count as usize, *stamp));
        }
    }
    let last = known.last()?.1;
    let ends = known[..first.len()].iter().chain(known.last());
    let line = uniform_line(known.iter().copied(), resolution(last))
        // If only the end is known, the intermediate ones are rounded differently.
        .or_else(|| uniform_line(ends.copied(), resolution(last)));
    Some(match line {
        Some(line) => SampleStep::of_line(&line, last - start),
        // The jitter of both ends matters less over a longer time.
        None => SampleStep {
            step,
            relative_std: found
                .relative_std
                .map(|std| std * (first[first.len() - 1] - start) / (last - start)),
        },
    })
}

/// A stamp farther on.
pub(super) struct Checkpoint {
    pub(super) stamp: f64,
    /// Those of the rows around it, in order.
    pub(super) around: Vec<f64>,
}

/// Stamps of a text at distances that double, and the last one. `from` is the byte after the head, if they are needed.
/// Empty if the file cannot be seeked, or a row cannot be parsed on its own.
///
/// # Errors
/// If the file cannot be read.
pub(super) fn of_text(
    input: &Input,
    from: Option<u64>,
    plan: &ChannelPlan,
) -> Result<Vec<Checkpoint>, Failure> {
    match (input.plain_file(), from) {
        (Some(path), Some(from)) => {
            of_file(path, from, plan).map_err(|error| input.unreadable(&error))
        }
        _ => Ok(Vec::new()),
    }
}

fn of_file(path: &Path, from: u64, plan: &ChannelPlan) -> io::Result<Vec<Checkpoint>> {
    // Opening a pipe a second time would wait for a second writer.
    let meta = std::fs::metadata(path)?;
    if !meta.is_file() {
        return Ok(Vec::new());
    }
    let (mut file, length) = (Stored::open(path)?, meta.len());
    let mut stamps = Vec::new();
    let mut at = from.max(PIECE);
    while at + 2 * PIECE < length {
        match stamp_behind(&mut file, at, plan, false)? {
            Some(stamp) => stamps.push(stamp),
            None => return Ok(Vec::new()),
        }
        at *= 2;
    }
    if length > from {
        let at = length.saturating_sub(PIECE).max(from);
        stamps.extend(stamp_behind(&mut file, at, plan, true)?);
    }
    Ok(stamps)
}

/// Stamp of the first whole line after a byte, or of the last one.
fn stamp_behind(
    file: &mut Stored<File>,
    at: u64,
    plan: &ChannelPlan,
    last: bool,
) -> io::Result<Option<Checkpoint>> {
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    file.take(PIECE).read_to_end(&mut bytes)?;
    // The text before the first line end, and after the last, may be incomplete.
    let ends = (
        memchr::memchr(b'\n', &bytes),
        memchr::memrchr(b'\n', &bytes),
    );
    let (Some(start), Some(end)) = ends else {
        return Ok(None);
    };
    let mut rows = ChannelRows::default();
    rows.read(&bytes[start + 1..=end.max(start)], plan);
    let stamp = match last {
        true => rows.times.last(),
        false => rows.times.first(),
    };
    let stamp = stamp.copied();
    Ok(stamp.map(|stamp| Checkpoint {
        stamp,
        around: rows.times,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_counted_as_far_as_they_are_known() {
        // 1.01 per step in the head; in truth 10 200 are 10 099 steps.
        let first = [0.0, 1.01];
        let about = |step| SampleStep {
            step,
            relative_std: None,
        };
        let step = sharpened(about(1.01), &first, &[101.0, 1010.0, 10_200.0], 0.0)
            .unwrap()
            .step;
        assert!((step - 10_200.0 / 10_099.0).abs() < 1e-12, "{step}");
        assert_eq!(sharpened(about(1.0), &[0.0], &[100.4], 0.0), None);
        assert_eq!(sharpened(about(1.0), &[0.0], &[], 0.0), Some(about(1.0)));
    }
}
