//! Text recordings: from bytes to channels, whatever the dialect.
//!
//! `decode` converts the bytes to lines and `chunks` splits them into pieces; `makers` recognises
//! makers' formats; `head` finds the table and `header` parses the lines above it, with the help of
//! `keys` and `units`; `axes` finds the time; `rows` parses the numbers. The first rows determine all of
//! that: then the table is read as a whole, or one channel of it piece by piece (`stream`).

mod axes;
mod axis_names;
mod blocks;
mod cell;
mod cells_with_units;
mod chunks;
mod clock;
mod commas;
mod decode;
mod dialect;
mod display_scale;
mod encoding;
mod head;
mod header;
mod heading;
mod keys;
mod last_line;
mod listing;
mod makers;
mod no_table;
mod row_template;
mod rows;
mod skipped_columns;
mod sparse;
mod stream;
mod summary;
mod table;
mod tail;
mod thousands;
mod units;
mod upward;
mod vocabulary;

use std::io::{Cursor, Read};

use torqcomp_decimal::number;

use super::{AllSamples, Recording, Segment};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::recording::text::dialect::decode_line;
use crate::warning::Warning;

pub use axis_names::is_time_name;
pub use chunks::{Chunks, LONGEST_LINE, Piece, too_long_a_line};
pub use clock::periods_between;
pub use clock::{Clock, ClockOrigin};
use decode::Decoding;
pub use decode::refuse_binary;
use head::Head;
pub use head::is_end as is_end_of_data;
use keys::HeaderEntry;
pub use last_line::{LastLine, last_line};
use makers::Maker;
use rows::ColumnKind;
pub use rows::{LineNotes, RowPlan, Rows};
pub(in crate::recording) use skipped_columns::is_about_one as is_of_skipped_column;
pub use stream::{BRIDGE, ChannelPlan, ChannelRows, Problem, StampColumn, StampUse, TextStream};
pub use table::Layout;
use table::{FIRST_ROWS, Hints, ReadTable};
pub(in crate::recording) use vocabulary::meaning;

/// Number of bytes for detecting the encoding.
const FOR_ENCODING: u64 = 1 << 16;
/// Number of bytes for recognising a maker.
const FOR_MAKER: usize = 1 << 14;
/// Minimum number of values in a single line that are the samples of one channel.
const ONE_LINE: usize = 32;
/// Maximum number of tables in sequence.
const MOST_TABLES: usize = 1000;
/// Maximum number of details kept.
const DETAILS: usize = 100;

/// An open text with its first table found.
pub struct TextFile {
    /// Information from its first rows and the lines above them: channels without samples. Without
    /// channels if a maker's reader needs the whole text.
    pub recording: Recording,
    /// Why it has to be read as a whole, if so.
    pub held_whole: Option<&'static str>,
    chunks: Chunks,
    /// Description of its maker and encoding.
    words: Vec<&'static str>,
    /// Whether its bytes differ from those of the file.
    is_decoded: bool,
    maker: Option<Maker>,
    /// `None` if a maker's reader finds it.
    layout: Option<Layout>,
    reading: Reading,
}

impl TextFile {
    /// Opens a text and analyses its first rows; `source` is its name for messages.
    ///
    /// # Errors
    /// If it is not a recording, or is ambiguous.
    pub fn open(
        source: &str,
        mut input: Box<dyn Read + Send>,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let mut bytes = Vec::new();
        let mut head = (&mut input).take(FOR_ENCODING);
        let read = head.read_to_end(&mut bytes);
        read.map_err(|error| Failure::unreadable(&error))?;
        let decoding = Decoding::of(&bytes)?;
        let mut chunks = Chunks::new(decoding.reader(bytes, input));
        let one_line = one_line(&mut chunks, reading)?;
        let (text, complete) = chunks.peek(FOR_MAKER)?;
        let maker = makers::recognise(&Head::of(text, complete, 1));
        let mut held_whole = one_line.then_some("all its samples stand in one line");
        let mut recording = Recording::empty("csv", source.to_owned());
        let layout = match maker.filter(|maker| maker.read.is_some()) {
            Some(_) => {
                held_whole = Some("its maker writes more than one table of samples");
                None
            }
            None => {
                let hints = maker.map_or(Hints::default(), |maker| maker.hints);
                let layout = Layout::find(&mut chunks, 1, hints, reading)?;
                held_whole = held_whole.or(layout.held_whole);
                recording.channels = layout.channels(layout.first_rows.clone());
                recording.details = details(&layout.header.entries);
                Some(layout)
            }
        };
        recording.warnings = decoding.warnings;
        let mut words: Vec<&'static str> = maker.iter().map(|maker| maker.name).collect();
        let is_decoded = !decoding.oddities.is_empty();
        words.extend(decoding.oddities);
        let mut file = Self {
            recording,
            held_whole,
            chunks,
            words,
            is_decoded,
            maker,
            layout,
            reading: reading.clone(),
        };
        let Some(layout) = &file.layout else {
            return Ok(file);
        };
        file.recording.warnings.extend(layout.skipped.clone());
        file.recording.dialect = file.describe(&layout.plan.dialect.describe());
        for channel in &mut file.recording.channels {
            channel.samples.clear();
            channel.holes.clear();
        }
        match file.recording.channels.is_empty() {
            true => Err(no_channel(&file.recording.warnings)),
            false => Ok(file),
        }
    }

    /// Description of its format, for messages.
    fn describe(&self, table: &str) -> String {
        let words = self.words.iter().copied().chain([table]);
        words.collect::<Vec<&str>>().join(", ")
    }

    /// Reads all of it.
    ///
    /// # Errors
    /// If it cannot be read, or is ambiguous.
    pub fn read(self) -> Result<Recording, Failure> {
        self.read_first(usize::MAX).map(|(recording, _)| recording)
    }

    /// Estimated number of values in a text of this many bytes, from its first rows; 0 if unknown.
    pub fn numbers_in(&self, bytes: u64) -> u64 {
        self.layout.as_ref().map_or(0, |layout| {
            let rows = layout.first_rows.count as u64;
            let is_read = |kind: &&ColumnKind| **kind != ColumnKind::Nothing;
            let columns = layout.plan.kinds.iter().filter(is_read).count() as u64;
            bytes / (layout.first_bytes as u64 / rows.max(1)).max(1) * columns
        })
    }

    /// Reads it, keeping about `most` numbers of a long table; also returns statistics of all samples of its channels.
    ///
    /// # Errors
    /// If it cannot be read, or is ambiguous.
    pub fn read_first(
        mut self,
        most: usize,
    ) -> Result<(Recording, Vec<Option<AllSamples>>), Failure> {
        let reader = self.maker.and_then(|maker| maker.read);
        let (mut read, tails) = match (self.layout.take(), reader) {
            (Some(layout), _) => {
                let hints = self.maker.map_or(Hints::default(), |maker| maker.hints);
                let parts = tables(&mut self.chunks, layout, (hints, most), &self.reading)?;
                recording_of(parts)
            }
            (None, Some(read)) => {
                let mut read = read(&mut self.chunks, &self.reading)?;
                read.lost = read.lost.or_else(|| self.chunks.unended_line());
                (read, Vec::new())
            }
            (None, None) => return Err(no_channel(&[])),
        };
        if read.channels.is_empty() {
            return Err(no_channel(&read.warnings));
        }
        read.dialect = self.describe(&read.dialect);
        if read.segments.len() > 1 {
            read.dialect += &format!(", {} segments", read.segments.len());
        }
        read.source = self.recording.source;
        read.warnings.splice(0..0, self.recording.warnings);
        Ok((read, tails))
    }

    /// Streams one of its channels, by index, unless it is held as a whole.
    pub fn stream(self, channel: usize, stamp_use: StampUse) -> TextStream {
        let layout = self.layout.expect("a text that streams has one table");
        let place = layout.channel_places().nth(channel).unwrap_or(0);
        TextStream::new(self.chunks, layout, place, stamp_use, self.is_decoded)
    }
}

fn no_channel(warnings: &[Warning]) -> Failure {
    let skipped = warnings.iter().find(|w| is_of_skipped_column(w));
    let why = skipped.map_or_else(String::new, |w| format!(". {}", w.message));
    ErrorCode::NotARecording.failed(format_args!(
        "there is no column besides the time; expected one with the signal{why}"
    ))
}

/// Reads a text file of any dialect; `source` is its name for messages.
///
/// # Errors
/// If it is not a recording, or is ambiguous.
pub fn read(source: &str, bytes: Vec<u8>, reading: &Reading) -> Result<Recording, Failure> {
    TextFile::open(source, Box::new(Cursor::new(bytes)), reading)?.read()
}

/// A table, or several in sequence under the same headings, as a recording.
fn general(
    chunks: &mut Chunks,
    first: Layout,
    hints: Hints,
    reading: &Reading,
) -> Result<Recording, Failure> {
    let parts = tables(chunks, first, (hints, usize::MAX), reading)?;
    Ok(recording_of(parts).0)
}

/// A table, or several in sequence under the same headings, limited to about `most` numbers in total.
fn tables(
    chunks: &mut Chunks,
    first: Layout,
    (hints, mut most): (Hints, usize),
    reading: &Reading,
) -> Result<Vec<ReadTable>, Failure> {
    let mut parts: Vec<ReadTable> = Vec::new();
    let mut next = Ok(first);
    // What follows the last table need not be one.
    while let Ok(layout) = next {
        let part = layout.read(chunks, most)?;
        let (number, begins_anew) = (part.next_line, part.begins_anew);
        most = most.saturating_sub(part.numbers());
        parts.push(part);
        let (rest, _) = chunks.peek(FIRST_ROWS)?;
        let line = decode_line(rest.split(|byte| *byte == b'\n').next().unwrap_or(&[]));
        if rest.is_empty() || head::is_end(&line) {
            break;
        }
        if parts.len() > MOST_TABLES {
            return Err(ErrorCode::SeveralTables
                .failed(format_args!(
                    "there are more than {MOST_TABLES} tables below each other; split the \
                     file"
                ))
                .line(number));
        }
        next = Layout::find(chunks, number, hints, reading);
        if let Err(failure) = &next
            && begins_anew
        {
            return Err(ErrorCode::SeveralTables
                .failed(format_args!(
                    "a block of its own begins here, and cannot be read: {failure}; split \
                     the file"
                ))
                .line(number));
        }
    }
    Ok(parts)
}

/// Splits a text that is a single line of numbers into one line per number: some oscilloscopes write
/// samples like that.
fn one_line(chunks: &mut Chunks, reading: &Reading) -> Result<bool, Failure> {
    let mut complete = false;
    for most in [FIRST_ROWS, LONGEST_LINE] {
        let text;
        (text, complete) = chunks.peek(most)?;
        if text.trim_ascii().contains(&b'\n') || reading.dialect.delimiter.is_some() {
            return Ok(false);
        }
        if complete {
            break;
        }
    }
    if !complete {
        return Err(too_long_a_line());
    }
    let text = chunks.take_all()?;
    let column = in_lines(&text, reading.dialect.decimal.unwrap_or(b'.'));
    let is_found = column.is_some();
    *chunks = Chunks::new(Box::new(Cursor::new(column.unwrap_or(text))));
    Ok(is_found)
}

fn in_lines(text: &[u8], decimal: u8) -> Option<Vec<u8>> {
    let line = text.trim_ascii();
    let mark = *[b'\t', b';', b',', b' ']
        .iter()
        .find(|mark| line.contains(mark))?;
    let cells = line.split(|byte| *byte == mark);
    let numbers = cells.clone().filter(|cell| !cell.is_empty()).all(|cell| {
        std::str::from_utf8(cell).is_ok_and(|cell| number::cell(cell, decimal).is_some())
    });
    let is_one_line = !line.contains(&b'\n') && cells.count() >= ONE_LINE;
    (numbers && is_one_line).then(|| {
        let bytes = line
            .iter()
            .map(|byte| if *byte == mark { b'\n' } else { *byte });
        bytes.chain([b'\n']).collect()
    })
}

/// Combines tables as the segments of a recording.
fn recording_of(parts: Vec<ReadTable>) -> (Recording, Vec<Option<AllSamples>>) {
    let mut tails = Vec::new();
    let blocks: usize = parts.iter().map(|part| part.blocks.len()).sum();
    let mut recording = Recording::empty("csv", String::new());
    for (place, part) in parts.into_iter().enumerate() {
        if place == 0 {
            recording.details = details(&part.header.entries);
            recording.dialect = part.dialect.describe();
        }
        for channels in part.blocks {
            let segment = recording.segments.len();
            if blocks > 1 {
                recording.segments.push(Segment {
                    name: format!("segment {}", segment + 1),
                    start_s: None,
                    start_text: keys::date_text(&part.header.entries)
                        .map(|text| Clock::iso_or_as_written(&text)),
                });
            }
            for mut channel in channels {
                channel.segment = (blocks > 1).then_some(segment);
                recording.channels.push(channel);
            }
        }
        // Samples not kept belong to the last block.
        tails.resize(recording.channels.len() - part.tails.len(), None);
        tails.extend(part.tails);
        recording.warnings.extend(part.warnings);
        recording.lost = recording.lost.or(part.lost);
    }
    (recording, tails)
}

/// Keys and values for the report.
fn details(entries: &[HeaderEntry]) -> Vec<(String, String)> {
    entries
        .iter()
        .filter(|entry| entry.value().is_some())
        .take(DETAILS)
        .map(|entry| {
            let values: Vec<&str> = entry
                .values
                .iter()
                .map(String::as_str)
                .filter(|v| !v.is_empty())
                .collect();
            (entry.key.clone(), values.join(", "))
        })
        .collect()
}

#[cfg(test)]
mod tests;
