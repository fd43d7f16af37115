//! What is wrong with a channel, found while its blocks pass in order.

use super::TimeAxis;
use super::block::{Block, BlockSource};
use super::stamps::IrregularStep;
use crate::failure::Failure;
use crate::io::csv::{Defect, Problem, RowPlan, Rows};
use crate::warning::Warning;

/// Code of the warning that stamps are irregular.
const IRREGULAR: &str = "irregular-stamps";
/// Difference of the mean rate from that of the first rows that is worth a warning.
const RATE_DRIFT: f64 = 1e-4;

/// Looks at the blocks in order: at what one alone cannot know.
#[derive(Debug)]
pub(crate) struct StreamValidator {
    source: String,
    /// What a row is called: `line`, `message`.
    row_name: &'static str,
    /// Of a text, how it is written.
    text: Option<TextRows>,
    time: TimeAxis,
    /// Lines before the next block.
    lines: usize,
    samples: usize,
    first_stamp: Option<f64>,
    last_stamp: Option<f64>,
    /// An empty line at the end of the blockes so far, without stamps.
    empty_line: Option<usize>,
    lost: Option<Warning>,
    warnings: Vec<Warning>,
    /// Whether irregular stamps are only said.
    any_steps: bool,
}

/// How the rows of a text are written, as far as messages need it.
#[derive(Debug, Clone)]
pub(super) struct TextRows {
    /// Which cells are wanted.
    pub(super) plan: RowPlan,
    /// Headings.
    pub(super) columns: Vec<String>,
    /// Fewest characters of a value in the head.
    pub(super) shortest_value: usize,
    /// Lines above the first row.
    pub(super) lines_before: usize,
}

/// What a whole stream held.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StreamSummary {
    /// What was lost, if anything.
    pub(crate) lost: Option<Warning>,
    /// What else should be known.
    pub(crate) warnings: Vec<Warning>,
}

impl StreamValidator {
    pub(super) fn new(
        source: String,
        row_name: &'static str,
        text: Option<TextRows>,
        time: TimeAxis,
        warnings: Vec<Warning>,
        any_steps: bool,
    ) -> Self {
        Self {
            source,
            row_name,
            lines: text.as_ref().map_or(0, |text| text.lines_before),
            text,
            time,
            samples: 0,
            first_stamp: None,
            last_stamp: None,
            empty_line: None,
            lost: None,
            warnings,
            any_steps,
        }
    }

    /// Takes the next block.
    ///
    /// # Errors
    /// The first row that cannot be read, and the first stamp that is not uniform, with its line.
    pub(crate) fn accept(&mut self, block: &mut Block) -> Result<(), Failure> {
        if let Some(found) = self.irregular_step(block) {
            let line = self.line_of_row(block, found.row);
            let is_last = found.row + 1 == block.rows.times.len();
            if self.any_steps {
                self.say_irregular(line, &found);
            } else if !(block.unended && is_last && block.rows.problem.is_none()) {
                return Err(self.at(line, self.explain(&found)));
            } else {
                self.drop_cut_stamp(block, line);
            }
        }
        if self.text.is_some() {
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

    /// The file was cut within its last stamp.
    fn drop_cut_stamp(&mut self, block: &mut Block, line: usize) {
        block.rows.times.pop();
        block.rows.time_text.pop();
        block.rows.values.pop();
        let start = memchr::memrchr(b'\n', &block.text).map_or(0, |place| place + 1);
        let text = String::from_utf8_lossy(&block.text[start..]).into_owned();
        self.lose_last_line(line, &text);
    }

    /// Says once that the stamps are irregular.
    fn say_irregular(&mut self, line: usize, found: &IrregularStep) {
        if !self.warnings.iter().any(|w| w.code == IRREGULAR) {
            let (source, name) = (&self.source, self.row_name);
            let what = self.explain(found);
            let message = format!("{source}, {name} {line}: {what}");
            self.warnings.push(Warning::new(IRREGULAR, message));
        }
    }

    /// What only lines of text can have wrong with them.
    fn look_at_lines(&mut self, block: &Block) -> Result<(), Failure> {
        let rows = &block.rows;
        if let Some(line) = self.empty_line
            && !rows.values.is_empty()
        {
            let what = self.describe(self.value_cell(), &Defect::Empty, "");
            return Err(self.at(line, what));
        }
        if let Some(line) = rows.empty_at {
            self.empty_line = self.empty_line.or(Some(self.lines + line + 1));
        }
        if let Some(problem) = &rows.problem {
            self.bad_row(block, problem)?;
        } else if block.unended {
            self.look_at_unended_line(block);
        }
        Ok(())
    }

    /// Ends the stream; `blocks` gave its blocks.
    ///
    /// # Errors
    /// If it held fewer than two samples.
    pub(crate) fn finish(mut self, blocks: &mut dyn BlockSource) -> Result<StreamSummary, Failure> {
        let (lost, warnings) = blocks.finish();
        if self.samples < 2 {
            let why = lost.map_or(String::new(), |lost| format!(": {}", lost.message));
            return Err(Failure::failed(format_args!(
                "{}: {} row(s) of numbers; a record has at least two{why}",
                self.source, self.samples
            )));
        }
        self.lost = self.lost.or(lost);
        self.warnings.extend(warnings);
        if let Some(grid) = self.time.grid.as_ref().filter(|grid| !grid.resampled)
            && let Some((first, last)) = self.first_stamp.zip(self.last_stamp)
        {
            let (steps, rounding) = ((last - first) / grid.step, grid.quantum / grid.step);
            self.look_at_drift(steps, rounding);
        }
        Ok(StreamSummary {
            lost: self.lost,
            warnings: self.warnings,
        })
    }

    /// A failure at a row of the block that was accepted last.
    pub(crate) fn failure_at_row(&self, block: &Block, row: usize, message: &str) -> Failure {
        let before = match &self.text {
            Some(_) => block.rows.lines,
            None => block.rows.values.len(),
        };
        self.at(self.line_of_row(block, row) - before, message)
    }

    fn at(&self, line: usize, message: impl std::fmt::Display) -> Failure {
        let (source, name) = (&self.source, self.row_name);
        Failure::failed(format_args!("{source}, {name} {line}: {message}"))
    }

    /// Line, from 1, of a row of the next block.
    fn line_of_row(&self, block: &Block, row: usize) -> usize {
        let within = match &self.text {
            Some(text) => line_of_row(&block.text, &text.plan, row),
            None => row,
        };
        self.lines + within + 1
    }

    fn value_cell(&self) -> usize {
        self.text.as_ref().map_or(0, |text| text.plan.value)
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

    /// A row that cannot be read is an error, unless the file was cut there.
    fn bad_row(&mut self, block: &Block, problem: &Problem) -> Result<(), Failure> {
        let line = self.lines + problem.line + 1;
        let text = String::from_utf8_lossy(&block.text[problem.offset..]);
        let is_last = block.unended && !text.contains('\n');
        if is_last {
            self.lines += 1;
            self.lose_last_line(line, &text);
            return Ok(());
        }
        Err(self.at(
            line,
            self.describe(
                problem.cell,
                &problem.what,
                text.lines().next().unwrap_or(""),
            ),
        ))
    }

    fn lose_last_line(&mut self, line: usize, text: &str) {
        self.lost = Some(Warning::new(
            "truncated-last-line",
            format!(
                "{}, line {line}: the file ends in the middle of this line (\"{}\"); it was left \
                 out, everything before it was used",
                self.source,
                shorten(text)
            ),
        ));
    }

    fn describe(&self, cell: usize, what: &Defect, line: &str) -> String {
        let column = cell + 1;
        let headings = self.text.as_ref().map(|text| &text.columns);
        let name = headings
            .and_then(|headings| headings.get(cell))
            .map_or("", String::as_str);
        let decimal = self
            .text
            .as_ref()
            .map_or(b'.', |text| text.plan.dialect.decimal);
        match what {
            Defect::Missing => format!(
                "column {column} (\"{name}\") is missing: the line \"{}\" has too few cells; \
                 complete or remove it",
                shorten(line)
            ),
            Defect::Empty => format!(
                "column {column} (\"{name}\") is empty; fill in the value or remove the line, and \
                 use --resample to bridge the gap"
            ),
            Defect::NonFinite(text) => format!(
                "column {column} (\"{name}\") reads \"{text}\", which is not a finite number; \
                 remove the line, and use --resample to bridge the gap"
            ),
            Defect::NotANumber(text) => format!(
                "column {column} (\"{name}\") reads \"{}\", expected a number{}; correct or remove \
                 the line",
                shorten(text),
                other_mark(text, decimal)
            ),
        }
    }

    /// A last line without a line feed may have been cut within its last number.
    fn look_at_unended_line(&mut self, block: &Block) {
        let Some(rows) = &self.text else {
            return;
        };
        let start = memchr::memrchr(b'\n', &block.text).map_or(0, |place| place + 1);
        let text = String::from_utf8_lossy(&block.text[start..]);
        let cells = rows.plan.dialect.cells(&text);
        let is_last = cells.len() == rows.plan.value + 1;
        let length = cells.get(rows.plan.value).map_or(0, String::len);
        if is_last && length > 0 && length < rows.shortest_value {
            self.warnings.push(Warning::new(
                "unended-last-line",
                format!(
                    "{}: the last line has no line end and its value \"{}\" is shorter than usual; \
                     if the file was cut there, do not trust the last sample",
                    self.source, cells[rows.plan.value]
                ),
            ));
        }
    }

    /// Says so if the mean rate is not that which was told before all was read: `steps` are those between the first
    /// and the last stamp, off by up to `rounding` of one.
    fn look_at_drift(&mut self, steps: f64, rounding: f64) {
        let samples = (self.samples - 1) as f64;
        let Some(rate_hz) = self.time.rate_hz else {
            return;
        };
        if (samples - steps).abs() > RATE_DRIFT * samples + rounding {
            self.warnings.push(Warning::new(
                "rate-drift",
                format!(
                    "{}: the first rows are {} Hz apart, the whole record {} Hz on average; the \
                     rate of the first rows was used",
                    self.source,
                    crate::io::digits::text(rate_hz, 7),
                    crate::io::digits::text(rate_hz * samples / steps, 7)
                ),
            ));
        }
    }
}

/// Line, from 0, that a row of a piece stands on.
fn line_of_row(text: &[u8], plan: &RowPlan, row: usize) -> usize {
    let mut before = 0;
    let mut rows = Rows::default();
    for (line, bytes) in text.split_inclusive(|byte| *byte == b'\n').enumerate() {
        rows.read(bytes, plan);
        before += rows.values.len();
        if before > row {
            return line;
        }
    }
    0
}

fn shorten(text: &str) -> String {
    let text = text.trim();
    if text.chars().count() <= 60 {
        text.to_owned()
    } else {
        text.chars().take(57).chain("...".chars()).collect()
    }
}

/// A hint if the number would do with the other decimal mark.
fn other_mark(text: &str, decimal: u8) -> &'static str {
    let other = if decimal == b'.' { b',' } else { b'.' };
    match crate::io::number::cell(text, other) {
        Some(_) if decimal == b'.' => " with a decimal point (see --decimal)",
        Some(_) => " with a decimal comma (see --decimal)",
        None => "",
    }
}
