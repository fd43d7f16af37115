//! LabVIEW measurement files (`.lvm`): a file header, then segments, each with its own header with
//! rate, start and unit of each channel. National Instruments, "Specification for the LabVIEW
//! Measurement File".

use std::sync::Arc;

use torqcomp_decimal::number;

use super::{Maker, Rule};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::recording::moment::Moment;
use crate::recording::text::Clock;
use crate::recording::text::chunks::Chunks;
use crate::recording::text::dialect::{Delimiter, Dialect};
use crate::recording::text::header::Field;
use crate::recording::text::rows::{self, Column};
use crate::recording::text::table::channel;
use crate::recording::without_rounding;
use crate::recording::{Channel, Recording, Segment, TimeAxis};
use crate::warning::{Warning, WarningCode};

const END: &str = "***End_of_Header***";

/// The rule.
pub const ALL: &[Rule] = &[
    (Maker::of_seconds("LabVIEW LVM").with_reader(read), |head| {
        // The file header may be missing.
        let is_segment = || head.starts(0, "Channels") && head.any(|line| line.starts_with(END));
        head.starts(0, "LabVIEW Measurement") || is_segment()
    }),
];

/// Location of the sample times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LvmStamps {
    No,
    One,
    Multi,
}

/// Content of the file header.
struct File {
    dialect: Dialect,
    stamps: LvmStamps,
    details: Vec<(String, String)>,
}

/// Content of a segment header, one value per channel.
#[derive(Default)]
struct LvmHeader {
    channels: usize,
    samples: Vec<String>,
    dates: Vec<String>,
    times: Vec<String>,
    units: Vec<String>,
    dimensions: Vec<String>,
    starts: Vec<String>,
    steps: Vec<String>,
}

fn read(chunks: &mut Chunks, reading: &Reading) -> Result<Recording, Failure> {
    let text = chunks.take_all()?;
    let mut lines = Cursor {
        text: &text,
        at: 0,
        number: 1,
    };
    let file = file_header(&mut lines, reading);
    let mut recording = Recording::empty("csv", String::new());
    recording.dialect = file.dialect.describe();
    recording.details.clone_from(&file.details);
    while lines.skip_to("Channels") {
        let place = recording.segments.len();
        let header = segment_header(&mut lines, &file);
        let names = lines.next().unwrap_or_default();
        let mut segment = Segment {
            name: format!("segment {}", place + 1),
            start_s: None,
            start_text: joined(&header.dates, &header.times, 0)
                .map(|text| Clock::iso_or_as_written(&text)),
        };
        let channels =
            segment_channels(&mut lines, &file, &header, &names, reading, &mut recording)?;
        segment.start_s = channels
            .first()
            .and_then(|channel| channel.axis.start)
            .map(Moment::seconds);
        recording.channels.extend(channels);
        recording.segments.push(segment);
    }
    if recording.segments.len() < 2 {
        recording.segments.clear();
        recording
            .channels
            .iter_mut()
            .for_each(|channel| channel.segment = None);
    }
    if recording.channels.is_empty() {
        return Err(ErrorCode::DamagedFile.failed(
            "the LabVIEW file ends before its first sample; expected a segment with channels",
        ));
    }
    Ok(recording)
}

/// A cursor over the lines of a text.
struct Cursor<'a> {
    text: &'a [u8],
    at: usize,
    number: usize,
}

impl Cursor<'_> {
    fn next(&mut self) -> Option<String> {
        if self.at >= self.text.len() {
            return None;
        }
        let end =
            memchr::memchr(b'\n', &self.text[self.at..]).map_or(self.text.len(), |p| self.at + p);
        let line = crate::recording::text::dialect::decode_line(&self.text[self.at..end]);
        self.at = end + 1;
        self.number += 1;
        Some(line.trim_end_matches('\r').to_owned())
    }

    /// Decimal mark of the numbers in the first segment header, if the file does not give it: `X0`
    /// is written with decimals.
    fn decimal(&self, separator: u8) -> u8 {
        let rest = &self.text[self.at.min(self.text.len())..];
        let head = &rest[..rest.len().min(1 << 14)];
        let start = memchr::memmem::find(head, b"\nX0").map_or(0, |place| place + 1);
        let line = head[start..]
            .split(|byte| *byte == b'\n')
            .next()
            .unwrap_or_default();
        if separator != b',' && start > 0 && line.contains(&b',') {
            b','
        } else {
            b'.'
        }
    }

    /// Advances to the next line that begins with `start`, without consuming it.
    fn skip_to(&mut self, start: &str) -> bool {
        loop {
            let (at, number) = (self.at, self.number);
            match self.next() {
                Some(line) if line.starts_with(start) => {
                    (self.at, self.number) = (at, number);
                    return true;
                }
                Some(_) => {}
                None => return false,
            }
        }
    }
}

fn file_header(lines: &mut Cursor, reading: &Reading) -> File {
    let mut separator = b'\t';
    let mut decimal = None;
    let mut stamps = LvmStamps::No;
    let mut details = Vec::new();
    let start = (lines.at, lines.number);
    while let Some(line) = lines.next() {
        if line.starts_with(END) {
            break;
        }
        if line.starts_with("Channels") {
            (lines.at, lines.number) = start;
            break;
        }
        let Some((key, value)) = line.split_once(['\t', ',', ';']) else {
            continue;
        };
        let value = value.trim_end_matches(['\t', ';']);
        match key {
            "Separator" if value.starts_with("Comma") => separator = b',',
            "Separator" if value.starts_with("Semicolon") => separator = b';',
            "Decimal_Separator" => decimal = value.bytes().next(),
            "X_Columns" if value.starts_with("One") => stamps = LvmStamps::One,
            "X_Columns" if value.starts_with("Multi") => stamps = LvmStamps::Multi,
            _ => {}
        }
        let value = value.trim_end_matches(',').trim();
        if !value.is_empty() {
            details.push((key.to_owned(), value.to_owned()));
        }
    }
    let dialect = Dialect {
        delimiter: reading
            .dialect
            .delimiter
            .unwrap_or(Delimiter::Byte(separator)),
        decimal: reading
            .dialect
            .decimal
            .or(decimal)
            .unwrap_or_else(|| lines.decimal(separator)),
    };
    File {
        dialect,
        stamps,
        details,
    }
}

fn segment_header(lines: &mut Cursor, file: &File) -> LvmHeader {
    let mut header = LvmHeader::default();
    while let Some(line) = lines.next() {
        if line.starts_with(END) {
            break;
        }
        let mut cells = file.dialect.cells(&line).into_iter();
        let key = cells.next().unwrap_or_default();
        // With a time column for each channel, the values are above the channels only; otherwise an
        // empty cell means a channel without a value.
        let values: Vec<String> = match file.stamps {
            LvmStamps::Multi => cells.filter(|cell| !cell.is_empty()).collect(),
            LvmStamps::No | LvmStamps::One => cells.collect(),
        };
        match key.as_str() {
            "Channels" => {
                header.channels = values.first().and_then(|v| v.parse().ok()).unwrap_or(0);
            }
            "Samples" => header.samples = values,
            "Date" => header.dates = values,
            "Time" => header.times = values,
            "Y_Unit_Label" => header.units = values,
            "X_Dimension" => header.dimensions = values,
            "X0" => header.starts = values,
            "Delta_X" => header.steps = values,
            _ => {}
        }
    }
    header
}

/// The value of a channel, if any.
fn of(values: &[String], place: usize) -> Option<&str> {
    let value = values.get(place).map(String::as_str);
    value.filter(|value| !value.is_empty())
}

/// Date and time of a channel.
fn joined(dates: &[String], times: &[String], place: usize) -> Option<String> {
    match (of(dates, place), of(times, place)) {
        (Some(date), Some(time)) => Some(format!("{date} {time}")),
        (date, time) => date.or(time).map(str::to_owned),
    }
}

fn segment_channels(
    lines: &mut Cursor,
    file: &File,
    header: &LvmHeader,
    names: &str,
    reading: &Reading,
    recording: &mut Recording,
) -> Result<Vec<Channel>, Failure> {
    let names = file.dialect.cells(names);
    let count = count(file, header, &names);
    let columns = columns(lines, file, count)?;
    let segment = recording.segments.len();
    let mut channels = Vec::new();
    if let Some((axis, warning)) = columns.first().and_then(|x| no_time(file, header, x)) {
        channels.extend(axis.map(|axis| Channel {
            segment: Some(segment),
            ..axis
        }));
        if !recording.warnings.contains(&warning) {
            recording.warnings.push(warning);
        }
    }
    for place in 0..count {
        let (time, value) = match file.stamps {
            LvmStamps::Multi => (2 * place, 2 * place + 1),
            LvmStamps::No | LvmStamps::One => (0, 1 + place),
        };
        let unit = of(&header.units, place);
        let field = of(&names, value).map_or_else(
            || Field::new(&format!("channel {}", place + 1), unit),
            |heading| Field::new(heading, unit),
        );
        let axis = axis(file, header, place, &columns[time], reading);
        let column = columns[value].clone();
        if let Some(missing) = missing(header, place, &field, &column) {
            recording.lost = recording.lost.take().or(Some(missing));
        }
        channels.push(Channel {
            segment: Some(segment),
            ..channel(&field, column, axis)
        });
    }
    Ok(channels)
}

/// Number of channels: there may be more names than the header counts, excluding the comments.
fn count(file: &File, header: &LvmHeader, names: &[String]) -> usize {
    let named = names
        .iter()
        .skip(1)
        .filter(|name| !name.is_empty() && *name != "Comment")
        .count();
    match file.stamps {
        LvmStamps::Multi if named > 1 => header.channels.max(1).min(named),
        _ => header.channels.max(1).min(named.max(1)),
    }
}

/// Reads the columns of a segment; a remark may be in the column after the last channel.
fn columns(lines: &mut Cursor, file: &File, count: usize) -> Result<Vec<Column>, Failure> {
    let numbers = match file.stamps {
        LvmStamps::Multi => 0..2 * count,
        LvmStamps::No | LvmStamps::One => 0..1 + count,
    };
    let text = &lines.text[lines.at.min(lines.text.len())..];
    let marks = &["Channels", "***"];
    let (read, end) = rows::of_numbers(text, lines.number, file.dialect, numbers, marks)?;
    lines.at += end;
    lines.number = read.line;
    Ok(read.columns)
}

fn axis(
    file: &File,
    header: &LvmHeader,
    place: usize,
    times: &Column,
    reading: &Reading,
) -> TimeAxis {
    let number = |values: &[String]| {
        // A single value for all channels is the first one.
        let text = of(values, place).or_else(|| of(values, 0))?;
        number::cell(text, file.dialect.decimal)
    };
    let start_s = number(&header.starts);
    let header_hz = number(&header.steps)
        .filter(|step| *step > 0.0)
        .map(|step| without_rounding(1.0 / step));
    let is_time = other_dimension(header, place).is_none();
    let mut axis = if !is_time {
        TimeAxis::default()
    } else if file.stamps != LvmStamps::No || !times.values.is_empty() {
        TimeAxis::of_stamps("X_Value", Arc::new(times.values.clone()))
    } else {
        header_hz.map_or_else(TimeAxis::default, |hz| {
            TimeAxis::of_header("Delta_X", hz, start_s)
        })
    };
    axis.header_rate_hz = header_hz.filter(|_| is_time);
    axis.start_text = joined(&header.dates, &header.times, place)
        .or_else(|| joined(&header.dates, &header.times, 0));
    axis.prefer_given(reading.rate_hz);
    axis
}

/// Quantity of a channel's horizontal axis, if it is not time: `Frequency`.
fn other_dimension(header: &LvmHeader, place: usize) -> Option<&str> {
    of(&header.dimensions, place).filter(|dimension| !dimension.starts_with("Time"))
}

/// The horizontal axis as a channel, with a warning, if it is not time.
fn no_time(file: &File, header: &LvmHeader, values: &Column) -> Option<(Option<Channel>, Warning)> {
    let dimension = other_dimension(header, 0)?;
    let is_there = file.stamps == LvmStamps::One && !values.values.is_empty();
    let field = Field::new(dimension, None);
    let axis = is_there.then(|| channel(&field, values.clone(), TimeAxis::default()));
    let warning = WarningCode::NoTimeAxis.warning(format!(
        "the header says that the horizontal axis is {dimension}, not time: the samples have no rate"
    ));
    Some((axis, warning))
}

/// A warning if the header announces more samples than there are.
fn missing(header: &LvmHeader, place: usize, field: &Field, column: &Column) -> Option<Warning> {
    let said: usize = of(&header.samples, place)?.parse().ok()?;
    (said > column.values.len()).then(|| {
        WarningCode::SamplesMissing.warning(format!(
            "channel \"{}\": the header gives {said} samples, but there are {}",
            field.name,
            column.values.len()
        ))
    })
}
