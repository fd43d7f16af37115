//! One table of numbers with the lines above it: found in the first bytes of a text, then read.

mod content;
mod counts;
mod warnings;

use std::collections::BTreeSet;
use std::sync::Arc;

use super::axes::{AxisPlan, Role, Sources, StampRule};
use super::blocks::{self, TableEnd};
use super::cell::foreign_spelling;
use super::chunks::{Chunks, Piece};
use super::head;
use super::header::{self, Field, Header};
use super::last_line::{LastLine, last_line};
use super::rows::{Column, ColumnKind, RowPlan, Rows, cleaned};
use super::tail::Tail;
use super::{listing, skipped_columns, sparse, summary};
use crate::failure::Failure;
use crate::io::{Reading, names_compensated};
use crate::recording::text::dialect::{Dialect, decode_line};
use crate::recording::{AllSamples, Channel, TimeAxis};
use crate::warning::Warning;
use content::{column_kinds, first_row, named_items};

/// Number of bytes of rows that determine the columns and their time.
pub const FIRST_ROWS: usize = 1 << 16;
/// Minimum number of these rows, for a table with many columns …
const LEAST_ROWS: usize = 16;
/// … unless they are longer than that.
const MOST_BYTES: usize = 1 << 23;

/// Known defaults of a maker's tables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Hints {
    /// Unit of time, if the files never name it.
    pub time_unit: Option<&'static str>,
    /// Unit of the samples, if the files never name it.
    pub unit: Option<&'static str>,
}

/// Layout of a table from its first rows and the lines above them.
#[derive(Debug)]
pub struct Layout {
    /// Its columns, and the keys and values above it.
    pub header: Header,
    /// Parsing of its rows.
    pub plan: RowPlan,
    /// Roles of its columns.
    pub axes: AxisPlan,
    /// Warnings about columns of channels that were skipped.
    pub skipped: Vec<Warning>,
    /// Number of bytes before its first row.
    pub offset: usize,
    /// Line of its first row.
    pub line: usize,
    /// Its first rows.
    pub first_rows: Rows,
    /// Bytes of the first rows.
    pub first_bytes: usize,
    /// Number of zero bytes in the lines above it.
    zeros_above: usize,
    /// Number of rows of each block, if the header announces several.
    pub block_rows: Option<usize>,
    /// Why it cannot be read row by row, if so.
    pub held_whole: Option<&'static str>,
    /// Whether columns with few values keep their empty cells.
    keeps_rows: bool,
}

/// A table after reading.
#[derive(Debug)]
pub struct ReadTable {
    /// Its channels, for each block of rows in which time restarts.
    pub blocks: Vec<Vec<Channel>>,
    /// Its header.
    pub header: Header,
    /// Format of its rows.
    pub dialect: Dialect,
    /// If not all rows were kept: for each channel of the last block, statistics of all of its
    /// samples.
    pub tails: Vec<Option<AllSamples>>,
    /// Warnings.
    pub warnings: Vec<Warning>,
    /// Missing data.
    pub lost: Option<Warning>,
    /// Number of the next line.
    pub next_line: usize,
    /// Whether that line repeats a key of the header.
    pub begins_anew: bool,
}

/// The next bytes up to the end of the first rows, which begin at an offset, and whether there are no more.
fn first_rows(chunks: &mut Chunks, offset: usize) -> Result<(&[u8], bool), Failure> {
    let mut most = FIRST_ROWS;
    while most < MOST_BYTES {
        let (bytes, complete) = chunks.peek(offset + most)?;
        let ends = memchr::memchr_iter(b'\n', &bytes[offset..]);
        if complete || ends.take(LEAST_ROWS).count() == LEAST_ROWS {
            break;
        }
        most *= 2;
    }
    chunks.peek(offset + most)
}

impl Layout {
    /// Finds the next table in a text; `line` is the number of its first line.
    ///
    /// # Errors
    /// If there is no table, or it is ambiguous.
    pub fn find(
        chunks: &mut Chunks,
        line: usize,
        hints: Hints,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let (head, table) = head::find(chunks, line, &reading.dialect)?;
        let has_data: Vec<bool> = column_kinds(&head, &table, table.first)
            .iter()
            .map(|(kind, _)| kind.is_some())
            .collect();
        let mut header = header::read(&head, &table, &has_data);
        let first = first_row(&head, &table, &header);
        let (kinds, clock_texts): (Vec<ColumnKind>, Vec<Option<String>>) =
            column_kinds(&head, &table, first)
                .into_iter()
                .map(|(kind, text)| (kind.unwrap_or(ColumnKind::Numbers), text))
                .unzip();
        listing::refuse_variables(&head, &table, &kinds, &header.fields)?;
        if let Some(unit) = hints.unit {
            header.set_default_units(unit);
        }
        let skipped = skipped_columns::warnings(&head, &table, first, &header, &kinds);
        let plan = RowPlan {
            dialect: table.dialect,
            width: table.width,
            stamps: Some(0),
            keeps_stamp_text: false,
            end: TableEnd::of(&header, &kinds, table.dialect),
            items: named_items(&head, &header, first, table.dialect),
            kinds,
        };
        let mut found = Self {
            axes: AxisPlan::default(),
            skipped,
            offset: head.lines[first].offset,
            line: head.number(first),
            first_rows: Rows::default(),
            first_bytes: 0,
            zeros_above: 0,
            block_rows: None,
            held_whole: None,
            keeps_rows: reading.keeps_rows,
            header,
            plan,
        };
        found.look_at_first_rows(chunks, &clock_texts, hints, reading)?;
        Ok(found)
    }

    /// Parses the first rows and finds the time of the columns from them.
    fn look_at_first_rows(
        &mut self,
        chunks: &mut Chunks,
        clock_texts: &[Option<String>],
        hints: Hints,
        reading: &Reading,
    ) -> Result<(), Failure> {
        let (bytes, complete) = first_rows(chunks, self.offset)?;
        self.zeros_above = memchr::memchr_iter(0, &bytes[..self.offset]).count();
        let text = &bytes[self.offset..];
        let last = memchr::memrchr(b'\n', text).map_or(0, |place| place + 1);
        let text = if complete { text } else { &text[..last] };
        let mut rows = Rows::default();
        rows.begin(self.line, self.plan.kinds.len());
        let end = rows.read(text, &self.plan)?;
        if end < text.len() {
            self.held_whole = Some("there are several tables, or other lines, below each other");
        }
        self.first_bytes = end;
        if summary::leave_out_count(&mut rows, complete).is_some() {
            self.held_whole = Some("its first row may say how many follow");
        }
        self.axes = self.find_axes(&rows, clock_texts, hints, reading)?;
        if complete && summary::leave_out(&mut rows, &self.axes.roles).is_some() {
            self.held_whole = Some("rows of sums follow the samples");
            self.axes = self.find_axes(&rows, clock_texts, hints, reading)?;
        }
        let mut rules = self
            .axes
            .rules
            .iter()
            .filter_map(|rule| rule.stamps.as_ref());
        if !rules.all(StampRule::is_of_one_cell) {
            self.held_whole = Some("its time stands in two columns, or is the sum of steps");
        }
        self.keep_offsets_of_time(&mut rows);
        let mut roles = self.axes.roles.iter();
        self.plan.stamps = roles.position(|role| *role == Role::Time);
        let stamps = self.plan.stamps.map(|place| &rows.columns[place].values);
        if let Some(spelling) = stamps.and_then(|stamps| foreign_spelling(stamps, text)) {
            self.held_whole = Some(spelling);
        }
        if !blocks::restarts(&rows, &self.plan.kinds, &self.axes.roles).is_empty() {
            self.held_whole = Some("time begins anew within it");
        }
        if self
            .channel_places()
            .any(|place| sparse::is_slow(&rows.columns[place]))
        {
            self.held_whole = Some("some of its channels are slower than its rows");
        }
        self.first_rows = rows;
        Ok(())
    }

    /// Keeps the large numbers of channels unchanged.
    fn keep_offsets_of_time(&mut self, rows: &mut Rows) {
        let places = self
            .plan
            .kinds
            .iter_mut()
            .zip(&self.axes.roles)
            .zip(&mut rows.columns);
        for ((kind, _), column) in places.filter(|((_, role), _)| **role != Role::Time) {
            if let ColumnKind::Offset(origin) = *kind {
                *kind = ColumnKind::Numbers;
                column
                    .values
                    .iter_mut()
                    .for_each(|value| *value += origin as f64);
            }
        }
    }

    fn find_axes(
        &self,
        rows: &Rows,
        clock_texts: &[Option<String>],
        hints: Hints,
        reading: &Reading,
    ) -> Result<AxisPlan, Failure> {
        Sources {
            fields: &self.header.fields,
            kinds: &self.plan.kinds,
            clock_texts,
            columns: &rows.columns,
            entries: &self.header.entries,
            decimal: self.plan.dialect.decimal,
            default_time_unit: hints.time_unit,
            reading,
        }
        .find()
    }

    /// The columns of the channels.
    pub fn channel_places(&self) -> impl Iterator<Item = usize> {
        let roles = self.axes.roles.iter().enumerate();
        roles.filter_map(|(place, role)| matches!(role, Role::Channel(_)).then_some(place))
    }

    /// Reads the whole table, keeping about `most` numbers of it.
    ///
    /// # Errors
    /// Those of the input, and rows of very different lengths.
    pub fn read(self, chunks: &mut Chunks, most: usize) -> Result<ReadTable, Failure> {
        chunks.skip(self.offset);
        let mut rows = Rows::default();
        rows.begin(self.line, self.plan.kinds.len());
        let (mut piece, mut lost, mut begins_anew) = (Vec::new(), None, false);
        let mut tail: Option<Tail> = None;
        let most_rows = most / self.plan.kinds.len().max(1);
        loop {
            let kind = chunks.next(&mut piece)?;
            if tail.is_none() && rows.count > most_rows && !piece.is_empty() {
                tail = Some(Tail::behind(&rows, &self));
            }
            let line = tail.as_ref().map_or(rows.line, Tail::line);
            if kind == Piece::Unended {
                lost = self.look_at_last_line(&mut piece, line);
            }
            let end = match &mut tail {
                Some(tail) => tail.read(&piece, &self.plan)?,
                None => rows.read(&piece, &self.plan)?,
            };
            if end < piece.len() {
                let next = decode_line(piece[end..].split(|b| *b == b'\n').next().unwrap_or(&[]));
                begins_anew = self.plan.end.begins_anew(next.trim_end_matches('\r'));
                chunks.put_back(&piece[end..]);
                break;
            }
            if kind != Piece::Lines {
                break;
            }
        }
        Ok(ReadTable {
            lost,
            next_line: tail.as_ref().map_or(rows.line, Tail::line),
            begins_anew,
            ..self.part_of(rows, tail)
        })
    }

    /// Channels of parsed rows, with warnings.
    fn part_of(self, mut rows: Rows, tail: Option<Tail>) -> ReadTable {
        let mut skipped: Vec<Warning> = Vec::new();
        match &tail {
            // Rows above and below the samples are detected from all of them.
            None => {
                skipped.extend(summary::leave_out_count(&mut rows, true));
                skipped.extend(summary::leave_out(&mut rows, &self.axes.roles));
            }
            Some(tail) => rows.notes.join(tail.notes(), 0),
        }
        let longest = rows.columns.iter().map(|column| column.values.len()).max();
        let mut warnings = self.warnings(&rows.notes, longest.unwrap_or(0));
        warnings.extend(skipped);
        let (count, last): (usize, &dyn Fn(usize) -> Option<f64>) = match &tail {
            Some(tail) => (tail.count(), &|place| tail.last(place)),
            None => (rows.count, &|place| {
                rows.columns[place].values.last().copied()
            }),
        };
        warnings.extend(self.axes.of_last_row(count, last));
        let starts = match self.block_rows {
            Some(size) => (size..rows.count).step_by(size).collect(),
            None => blocks::restarts(&rows, &self.plan.kinds, &self.axes.roles),
        };
        let further: Vec<Rows> = starts
            .iter()
            .rev()
            .map(|row| rows.split_off(*row))
            .collect();
        let blocks: Vec<Vec<Channel>> = std::iter::once(rows)
            .chain(further.into_iter().rev())
            .map(|rows| self.channels(rows))
            .collect();
        let last = blocks.last().map_or(&[][..], Vec::as_slice);
        let tails = tail.map_or_else(Vec::new, |tail| tail.of_channels(&self, last));
        ReadTable {
            tails,
            blocks,
            dialect: self.plan.dialect,
            header: self.header,
            warnings,
            lost: None,
            next_line: 0,
            begins_anew: false,
        }
    }

    /// The channels of rows.
    pub fn channels(&self, mut rows: Rows) -> Vec<Channel> {
        self.fill_stamps(&mut rows);
        let mut channels: Vec<Channel> = Vec::new();
        let stamps = self.stamp_places();
        let mut last: Option<(usize, TimeAxis)> = None;
        for (place, role) in self.axes.roles.iter().enumerate() {
            let Role::Channel(rule) = *role else {
                continue;
            };
            // Channels with the same time share their stamps.
            let axis = match &last {
                Some((other, axis)) if self.axes.rules[*other] == self.axes.rules[rule] => {
                    axis.clone()
                }
                _ => self.axes.rules[rule].axis(&rows.columns),
            };
            last = Some((rule, axis.clone()));
            let column = match stamps.contains(&place) {
                true => rows.columns[place].clone(),
                false => std::mem::take(&mut rows.columns[place]),
            };
            let made = if self.keeps_rows {
                with_all_rows
            } else {
                channel
            };
            channels.push(made(&self.header.fields[place], column, axis));
        }
        channels
    }

    /// Fills columns of stamps that end before their channels do.
    fn fill_stamps(&self, rows: &mut Rows) {
        for (place, role) in self.axes.roles.iter().enumerate() {
            let Role::Channel(rule) = *role else { continue };
            if let Some(stamps) = &self.axes.rules[rule].stamps {
                rows.fill_up_to(stamps.place, rows.columns[place].values.len());
            }
        }
    }

    /// The columns that stamps are made of.
    fn stamp_places(&self) -> BTreeSet<usize> {
        let rules = self.axes.rules.iter();
        let stamps = rules.filter_map(|rule| rule.stamps.as_ref());
        let places = stamps.flat_map(|rule| {
            let parts = rule.parts.map(|parts| parts.place);
            std::iter::once(rule.place).chain(parts)
        });
        places.collect()
    }

    /// Judges a last line without a line end, and removes it if the file was truncated within it.
    fn look_at_last_line(&self, piece: &mut Vec<u8>, first: usize) -> Option<Warning> {
        let judged = LastLine::of(piece, first == 1, &self.plan);
        let line = first + memchr::memchr_iter(b'\n', piece).count();
        let text = cleaned(last_line(piece)).0;
        if judged == LastLine::Cut {
            piece.truncate(piece.len() - last_line(piece).len());
        }
        judged.warning(&format!("line {line}"), &text)
    }
}

impl ReadTable {
    /// Number of values kept.
    pub fn numbers(&self) -> usize {
        let channels = self.blocks.iter().flatten();
        channels.map(|channel| channel.samples.len()).sum()
    }
}

/// A channel from a column, without the empty cells if it is slower than the rows.
pub fn channel(field: &Field, mut column: Column, mut axis: TimeAxis) -> Channel {
    sparse::thin(&mut column, &mut axis);
    with_all_rows(field, column, axis)
}

/// A channel from all cells of a column.
fn with_all_rows(field: &Field, column: Column, mut axis: TimeAxis) -> Channel {
    if let Some(stamps) = &axis.stamps_s
        && stamps.len() > column.values.len()
    {
        axis.stamps_s = Some(Arc::new(stamps[..column.values.len()].to_vec()));
    }
    Channel {
        name: field.name.clone(),
        heading: field.heading.clone(),
        unit: field.unit.clone(),
        unit_text: field.unit_text.clone(),
        samples: column.values,
        holes: column.holes,
        axis,
        is_compensated: names_compensated(&field.heading),
        ..Channel::default()
    }
}
