//! Faults of a channel, detected while its blocks pass in order.

use torqcomp_decimal::digits;

use super::TimeAxis;
use super::block::{Block, BlockSource};
use super::joined::JoinedBreaks;
use super::stamps::IrregularStep;
use super::stream::ChannelStream;
use super::text::{ChannelPlan, Layout, LineNotes, Problem, Rows, is_end_of_data};
use crate::failure::{ErrorCode, ErrorPlace, Failure, RowKind};
use crate::print::plural;
use crate::warning::{Warning, WarningCode};

/// Minimum reported relative difference of the mean rate from that of the first rows.
const RATE_DRIFT: f64 = 1e-4;

/// Examines the blocks in order, for faults that a single one cannot show.
#[derive(Debug)]
pub(crate) struct StreamValidator {
    source: String,
    /// What a row is called: `line`, `message`.
    row_kind: RowKind,
    /// For a text, the format of its rows.
    text: Option<TextLines>,
    time: TimeAxis,
    /// Number of lines before the next block.
    lines: usize,
    samples: usize,
    first_stamp: Option<f64>,
    last_stamp: Option<f64>,
    /// An empty line at the end of the blocks so far, without stamps.
    empty_line: Option<usize>,
    lost: Option<Warning>,
    warnings: Vec<Warning>,
    /// Breaks in stamps that a given rate ignores.
    joined: JoinedBreaks,
    /// Whether irregular stamps only cause a warning.
    any_steps: bool,
}

/// Format of the rows of a text, and the state of its lines so far.
#[derive(Debug)]
pub(super) struct TextLines {
    pub(super) plan: ChannelPlan,
    layout: Layout,
    notes: LineNotes,
    /// Whether a line marked the end of the data.
    ended: bool,
    /// The last rows so far, if the last one is needed.
    last_rows: Vec<u8>,
}

/// Number of last rows that are kept, as the last line may be another one.
const LAST_ROWS: usize = 3;

impl TextLines {
    /// The lines of a table.
    pub(super) fn new(plan: ChannelPlan, layout: Layout) -> Self {
        Self {
            plan,
            layout,
            notes: LineNotes::default(),
            ended: false,
            last_rows: Vec::new(),
        }
    }

    /// Keeps the last rows of a block, if they are needed.
    fn keep_last_rows(&mut self, text: &[u8]) {
        if self.layout.axes.needs_last_row() && text.iter().any(u8::is_ascii_digit) {
            let mut ends = memchr::memrchr_iter(b'\n', text.trim_ascii_end());
            let from = ends.nth(LAST_ROWS - 1).map_or(0, |end| end + 1);
            self.last_rows.clear();
            self.last_rows.extend_from_slice(&text[from..]);
        }
    }

    /// Warnings that the last row shows.
    fn of_last_row(&self, rows: usize) -> Vec<Warning> {
        let mut last = Rows::default();
        last.begin(0, self.layout.plan.kinds.len());
        let read = last.read(&self.last_rows, &self.layout.plan);
        let value = |place: usize| {
            let values = &last.columns[place].values;
            values
                .last()
                .copied()
                .filter(|_| values.len() == last.count)
        };
        match read {
            Ok(_) if last.count > 0 => self.layout.axes.of_last_row(rows, &value),
            _ => Vec::new(),
        }
    }
}

/// Summary of a whole stream.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StreamSummary {
    /// Losses, if any.
    pub(crate) lost: Option<Warning>,
    /// Further warnings.
    pub(crate) warnings: Vec<Warning>,
}

impl StreamSummary {
    /// Losses, and further warnings.
    pub(crate) fn all_warnings(&self) -> Vec<Warning> {
        self.lost.iter().chain(&self.warnings).cloned().collect()
    }
}

impl StreamValidator {
    /// The blocks of a stream, and what examines them.
    pub(super) fn of(stream: ChannelStream) -> (Box<dyn BlockSource>, Self) {
        let lines = stream.text.as_ref().map(|text| text.layout.line - 1);
        let validator = Self {
            source: stream.source,
            row_kind: stream.blocks.row_kind(),
            text: stream.text,
            time: stream.channel.axis,
            lines: lines.unwrap_or(0),
            samples: 0,
            first_stamp: None,
            last_stamp: None,
            empty_line: None,
            lost: None,
            warnings: stream.warnings,
            joined: JoinedBreaks::default(),
            any_steps: stream.any_steps,
        };
        (stream.blocks, validator)
    }

    /// Examines the next block.
    ///
    /// # Errors
    /// The first row that cannot be read, and the first stamp that is not uniform, with its line.
    pub(crate) fn accept(&mut self, block: &mut Block) -> Result<(), Failure> {
        if self.text.as_ref().is_some_and(|text| text.ended) {
            block.rows.clear();
            return Ok(());
        }
        self.pass_periods(block);
        if let Some(grid) = &self.time.beside {
            self.joined.look(grid, self.last_stamp, &block.rows.times);
        }
        if let Some(found) = self.irregular_step(block) {
            let line = self.line_of_row(block, found.row);
            if self.any_steps {
                self.say_irregular(line, &found);
            } else {
                return Err(self.irregular(line, &found));
            }
        }
        if let Some(text) = &mut self.text {
            text.keep_last_rows(&block.text);
            self.look_at_lines(block)?;
            self.lines += block.rows.lines;
        } else {
            self.lines += block.rows.values.len();
        }
        let rows = &block.rows;
        self.samples += rows.values.len();
        self.first_stamp = self.first_stamp.or(rows.times.first().copied());
        self.last_stamp = rows.times.last().copied().or(self.last_stamp);
        Ok(())
    }

    /// Adds the days or hours that passed before a block to the times of a clock without a date.
    fn pass_periods(&self, block: &mut Block) {
        let period_s = self.text.as_ref().and_then(|text| text.plan.period_s);
        if let (Some(last), Some(period_s)) = (self.last_stamp, period_s) {
            let passed_s = super::text::periods_between(last, &block.rows.times, period_s);
            block
                .rows
                .times
                .iter_mut()
                .for_each(|time| *time += passed_s);
            if let Some(found) = &mut block.irregular {
                found.before += passed_s;
                found.after += passed_s;
            }
        }
    }

    /// Warns once about irregular stamps.
    fn say_irregular(&mut self, line: usize, found: &IrregularStep) {
        if !self
            .warnings
            .iter()
            .any(|w| w.code == WarningCode::IrregularStamps.name())
        {
            let place = ErrorPlace::of_row(&self.source, self.row_kind, line);
            let message = format!("{place}: {}", self.explain(found));
            self.warnings
                .push(WarningCode::IrregularStamps.warning(message));
        }
    }

    /// Examines faults that only lines of text can have.
    fn look_at_lines(&mut self, block: &Block) -> Result<(), Failure> {
        let rows = &block.rows;
        if let Some(text) = &mut self.text {
            text.notes.join(&rows.notes, self.lines);
        }
        if let Some(line) = self.empty_line
            && !rows.values.is_empty()
        {
            return Err(self.bad_cell(line, self.value_cell(), ""));
        }
        if let Some(line) = rows.empty_at {
            self.empty_line = self.empty_line.or(Some(self.lines + line + 1));
        }
        if let Some(problem) = rows.problem {
            return Err(self.bad_row(block, problem));
        }
        if rows.ends {
            return self.end(block);
        }
        if let Some((judged, text)) = &block.last_line {
            let lines = memchr::memchr_iter(b'\n', &block.text).count();
            let place = format!("{}, line {}", self.source, self.lines + lines + 1);
            self.lost = judged.warning(&place, text);
        }
        Ok(())
    }

    /// Ends the data before a line that is not a row, unless another table begins there.
    fn end(&mut self, block: &Block) -> Result<(), Failure> {
        let line = nth_line(&block.text, block.rows.lines);
        if !is_end_of_data(&line) {
            return Err(self.at(
                self.lines + block.rows.lines + 1,
                ErrorCode::SeveralTables,
                "another table begins here; split the file there",
            ));
        }
        self.text.iter_mut().for_each(|text| text.ended = true);
        Ok(())
    }

    /// Ends the stream; `blocks` provided its blocks.
    ///
    /// # Errors
    /// If it had fewer than two samples.
    pub(crate) fn finish(mut self, blocks: &mut dyn BlockSource) -> Result<StreamSummary, Failure> {
        let (lost, warnings) = blocks.finish();
        if self.samples < 2 {
            let why = lost.map_or(String::new(), |lost| format!(": {}", lost.message));
            return Err(ErrorCode::TooFewSamples
                .failed(format_args!(
                    "{} of numbers; a record has at least two{why}",
                    plural(self.samples, "row")
                ))
                .at(&self.source));
        }
        self.lost = self.lost.or(lost);
        self.warnings.extend(warnings);
        if let Some(text) = &self.text {
            let more = text.layout.warnings(&text.notes, self.samples);
            self.warnings.extend(more);
            self.warnings.extend(text.of_last_row(self.samples));
        }
        if let Some(grid) = &self.time.beside {
            let joined = self.joined.warning(&self.source, grid);
            self.warnings.extend(joined);
        }
        if let Some(grid) = self.time.grid.as_ref().filter(|grid| !grid.resampled)
            && let Some((first, last)) = self.first_stamp.zip(self.last_stamp)
        {
            let rounded = grid.rounded_warning(&self.source, last - first);
            self.warnings.extend(rounded);
            let (steps, rounding) = ((last - first) / grid.step, grid.quantum / grid.step);
            self.look_at_drift(steps, rounding);
        }
        Ok(StreamSummary {
            lost: self.lost,
            warnings: self.warnings,
        })
    }

    /// A failure at a row of the last accepted block.
    pub(crate) fn failure_at_row(&self, block: &Block, row: usize, message: &str) -> Failure {
        let before = match &self.text {
            Some(_) => block.rows.lines,
            None => block.rows.values.len(),
        };
        self.at(
            self.line_of_row(block, row) - before,
            ErrorCode::InvalidSample,
            message,
        )
    }

    fn at(&self, line: usize, code: ErrorCode, message: impl std::fmt::Display) -> Failure {
        let place = ErrorPlace::of_row(&self.source, self.row_kind, line);
        code.failed(message).with(|known| *known = place)
    }

    fn irregular(&self, line: usize, found: &IrregularStep) -> Failure {
        let failure = self.at(line, ErrorCode::IrregularTime, self.explain(found));
        let grid = self.time.grid.as_ref();
        failure.with(|place| place.time_s = grid.map(|grid| grid.time_s(found.after)))
    }

    /// Line, from 1, of a row of the next block.
    fn line_of_row(&self, block: &Block, row: usize) -> usize {
        let within = match &self.text {
            Some(text) => text.plan.line_of_row(&block.text, row),
            None => row,
        };
        self.lines + within + 1
    }

    fn value_cell(&self) -> usize {
        self.text.as_ref().map_or(0, |text| text.plan.value_cell())
    }

    fn explain(&self, found: &IrregularStep) -> String {
        let grid = self.time.grid.as_ref();
        grid.map_or_else(String::new, |grid| grid.explain(found))
    }

    fn irregular_step(&self, block: &Block) -> Option<IrregularStep> {
        let first = block.rows.times.get(..1)?;
        let grid = self.time.grid.as_ref()?;
        grid.first_irregular(self.last_stamp, first)
            .or(block.irregular)
    }

    /// Failure for an unreadable row.
    fn bad_row(&self, block: &Block, problem: Problem) -> Failure {
        let line = self.lines + problem.line + 1;
        let text = nth_line(&block.text, problem.line);
        self.bad_cell(line, problem.cell, &text)
    }

    fn bad_cell(&self, line: usize, cell: usize, text: &str) -> Failure {
        let failure = self.at(line, ErrorCode::InvalidSample, self.describe(cell, text));
        failure.with(|place| place.column = Some(cell + 1))
    }

    fn describe(&self, cell: usize, line: &str) -> String {
        let text = self.text.as_ref();
        text.map_or_else(String::new, |text| text.plan.describe(line, cell))
    }

    /// Warns if the mean rate differs from the one given before all was read: `steps` are those between the first
    /// and the last stamp, with an error of up to `rounding` of one.
    fn look_at_drift(&mut self, steps: f64, rounding: f64) {
        let samples = (self.samples - 1) as f64;
        let Some(rate_hz) = self.time.rate_hz else {
            return;
        };
        if (samples - steps).abs() > RATE_DRIFT * samples + rounding {
            self.warnings.push(WarningCode::RateDrift.warning(format!(
                "{}: the rate of the first rows is {} Hz, that of the whole record {} Hz on average; the rate of \
                 the first rows was used",
                self.source,
                digits::text(rate_hz, 7),
                digits::text(rate_hz * samples / steps, 7)
            )));
        }
    }
}

/// A line of a piece, by its number from 0.
fn nth_line(text: &[u8], line: usize) -> String {
    let line = text.split(|byte| *byte == b'\n').nth(line);
    String::from_utf8_lossy(line.unwrap_or_default()).into_owned()
}
