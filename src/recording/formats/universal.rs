//! Universal files (UFF, UNV) with data sets 58 and 58b, functions over time (SDRC Universal File Format, data set 58).
//!
//! A data set stands between lines `    -1`. Each of 58 is one channel: eleven lines of head and the numbers, as text or (58b) as
//! bytes. Functions over another axis than time are named and left out.

use super::bytes::{Bytes, Number, Order};
use super::{Content, Format, channel, cut, damaged, stamped};
use crate::failure::{ErrorCode, Failure};
use crate::io::{Reading, digits};
use crate::recording::{Channel, TimeAxis};
use crate::unit::NamedUnit;
use crate::warning::Warning;

pub(super) const UNIVERSAL: Format = Format {
    name: "uff",
    called: "a universal file",
    is,
    takes: &[],
    read,
};

/// Longest line.
const LONGEST_LINE: usize = 4096;
/// Lines of the head of a data set 58.
const HEAD_LINES: usize = 11;
/// Kind of an axis of time.
const TIME: i64 = 17;
/// Longest data set of text, in bytes read ahead.
const PIECE: u64 = 1 << 16;

/// Whether the first two lines are `    -1` and the number of a data set.
fn is(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().skip_while(|line| line.trim().is_empty());
    let begins = lines.next().is_some_and(|line| line.trim_end() == "    -1");
    let number = lines.next().unwrap_or_default();
    let number: String = number.chars().take(6).collect();
    begins && number.starts_with("  ") && number.trim().parse::<u32>().is_ok()
}

/// The lines of a file, with bytes between them.
struct Lines<'a> {
    bytes: &'a mut Bytes,
    ahead: Vec<u8>,
    /// Bytes of `ahead` that are used.
    used: usize,
    /// Lines read so far.
    number: usize,
}

impl Lines<'_> {
    /// Reads ahead, so that a byte more is there if the file has one.
    fn fill(&mut self) -> Result<bool, Failure> {
        if self.used > self.ahead.len() / 2 {
            self.ahead.drain(..self.used);
            self.used = 0;
        }
        let more = self.bytes.take(PIECE)?;
        self.ahead.extend_from_slice(&more);
        Ok(!more.is_empty())
    }

    /// The next line without its end; `None` at the end of the file.
    fn next(&mut self) -> Result<Option<String>, Failure> {
        loop {
            let rest = &self.ahead[self.used..];
            let end = memchr::memchr(b'\n', rest);
            if let Some(end) = end.filter(|end| *end <= LONGEST_LINE) {
                let line = String::from_utf8_lossy(&rest[..end]);
                let line = line.trim_end_matches('\r').to_owned();
                self.used += end + 1;
                self.number += 1;
                return Ok(Some(line));
            }
            if rest.len() > LONGEST_LINE {
                return Err(self.wrong("the line is too long for a universal file"));
            }
            if !self.fill()? {
                let rest = &self.ahead[self.used..];
                let line = String::from_utf8_lossy(rest).into_owned();
                self.used = self.ahead.len();
                self.number += 1;
                return Ok(Some(line).filter(|line| !line.trim().is_empty()));
            }
        }
    }

    /// The next bytes, fewer at the end of the file.
    fn bytes(&mut self, count: usize) -> Result<Vec<u8>, Failure> {
        let there = (self.ahead.len() - self.used).min(count);
        let mut bytes = self.ahead[self.used..self.used + there].to_vec();
        self.used += there;
        bytes.extend(self.bytes.take((count - there) as u64)?);
        Ok(bytes)
    }

    fn wrong(&self, what: &str) -> Failure {
        damaged(what, self.bytes.at).line(self.number)
    }
}

/// How the numbers of a data set are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Storage {
    Text,
    Binary(Order, usize),
}

/// The head of a data set 58.
struct Head {
    name: String,
    function: i64,
    /// Kind of number: 2 single, 4 double, 5 and 6 the same of complex ones.
    kind: i64,
    count: usize,
    is_even: bool,
    start: f64,
    step: f64,
    /// Kinds and texts of both axes: abscissa, ordinate.
    axes: [Axis; 2],
}

struct Axis {
    kind: i64,
    label: String,
    unit: String,
}

/// A number in a field of a line.
fn field<T: std::str::FromStr>(line: &str, from: usize, width: usize) -> Option<T> {
    let field: String = line.chars().skip(from).take(width).collect();
    field.trim().parse().ok()
}

/// A text in a field; `NONE` is none.
fn text(line: &str, from: usize, width: usize) -> String {
    let field: String = line.chars().skip(from).take(width).collect();
    match field.trim() {
        "NONE" | "None" | "none" => String::new(),
        text => text.to_owned(),
    }
}

impl Axis {
    fn of(line: &str) -> Self {
        Self {
            kind: field(line, 0, 10).unwrap_or(0),
            label: text(line, 26, 20),
            unit: text(line, 47, 20),
        }
    }
}

impl Head {
    fn read(lines: &mut Lines) -> Result<Option<Self>, Failure> {
        let mut head = Vec::new();
        for _ in 0..HEAD_LINES {
            match lines.next()? {
                Some(line) => head.push(line),
                None => return Ok(None),
            }
        }
        let numbers = &head[6];
        let known = || {
            Some((
                field(numbers, 0, 10)?,
                field(numbers, 10, 10)?,
                field::<i64>(numbers, 20, 10)?,
                field(numbers, 30, 13)?,
                field(numbers, 43, 13)?,
            ))
        };
        let Some((kind, count, spacing, start, step)) = known() else {
            return Err(lines.wrong(
                "the seventh line of a data set 58 has not the numbers that it should have",
            ));
        };
        let [abscissa, ordinate] = [&head[7], &head[8]].map(|line| Axis::of(line));
        Ok(Some(Self {
            name: name(&head, &ordinate),
            function: field(&head[5], 0, 5).unwrap_or(0),
            kind,
            count,
            is_even: spacing == 1,
            start,
            step,
            axes: [abscissa, ordinate],
        }))
    }

    /// Numbers in all, and those of a sample.
    fn numbers(&self) -> (usize, usize) {
        let each = match (self.is_even, self.kind) {
            (true, 5 | 6) => 2,
            (true, _) => 1,
            (false, 5 | 6) => 3,
            (false, _) => 2,
        };
        (self.count.saturating_mul(each), each)
    }

    /// Why it is no channel over time, if it is none.
    fn foreign(&self) -> Option<&'static str> {
        let is_over_time =
            self.axes[0].kind == TIME || (self.axes[0].kind == 0 && self.function == 1);
        match self.kind {
            5 | 6 => Some("complex numbers"),
            2 | 4 if !is_over_time => Some("no function of time"),
            2 | 4 => None,
            _ => Some("numbers of an unknown kind"),
        }
    }

    /// Bytes of the numbers of a data set 58b; its abscissas are single or double as the numbers are.
    fn width(&self) -> Number {
        match self.kind {
            2 | 5 => Number::Float32,
            _ => Number::Float64,
        }
    }
}

/// What a function is called: its first line, else its node and direction, else the label of its axis.
fn name(head: &[String], ordinate: &Axis) -> String {
    let identified = text(&head[0], 0, 80);
    let response = text(&head[5], 31, 10);
    let node: Option<i64> = field(&head[5], 41, 10);
    let direction: Option<i64> = field(&head[5], 51, 4);
    let place = match (node, direction) {
        (Some(node), Some(direction)) if node != 0 => {
            format!("node {node} {}", direction_name(direction))
        }
        _ => String::new(),
    };
    let parts = [identified, response, place];
    let parts: Vec<&str> = parts
        .iter()
        .map(|part| part.trim())
        .filter(|part| !part.is_empty())
        .collect();
    match parts.as_slice() {
        [] => ordinate.label.clone(),
        parts => parts.join(" "),
    }
}

fn direction_name(direction: i64) -> &'static str {
    match direction {
        1 => "+X",
        -1 => "-X",
        2 => "+Y",
        -2 => "-Y",
        3 => "+Z",
        -3 => "-Z",
        4 => "+RX",
        -4 => "-RX",
        5 => "+RY",
        -5 => "-RY",
        6 => "+RZ",
        -6 => "-RZ",
        _ => "",
    }
}

/// The numbers of a line of fixed fields, or between spaces where the fields are not those of the standard.
fn numbers_of(line: &str, widths: &[usize], values: &mut Vec<f64>) -> bool {
    let number = |text: &str| -> Option<f64> {
        // FORTRAN writes double precision with a D.
        text.trim().replace(['D', 'd'], "E").parse().ok()
    };
    let words: Option<Vec<f64>> = line.split_whitespace().map(number).collect();
    if let Some(words) = words {
        values.extend(words);
        return true;
    }
    let mut rest = line;
    for width in widths.iter().cycle() {
        if rest.trim().is_empty() {
            return true;
        }
        let Some((cell, behind)) = rest.split_at_checked((*width).min(rest.len())) else {
            return false;
        };
        match number(cell) {
            Some(value) => values.push(value),
            None => return false,
        }
        rest = behind;
    }
    true
}

fn read(bytes: &mut Bytes, _: &Reading) -> Result<Content, Failure> {
    let mut lines = Lines {
        bytes,
        ahead: Vec::new(),
        used: 0,
        number: 0,
    };
    let mut content = Content::default();
    let mut left_out = Vec::new();
    let mut kinds = Vec::new();
    while let Some(line) = lines.next()? {
        if line.trim() != "-1" {
            continue;
        }
        let Some(mut line) = lines.next()? else { break };
        // Between data sets are two such lines.
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
            let is_whole = data_set(&mut lines, storage, &mut content, &mut left_out)?;
            if !is_whole {
                break;
            }
        } else {
            while lines.next()?.is_some_and(|line| line.trim() != "-1") {}
        }
    }
    if !left_out.is_empty() {
        content.warnings.push(Warning::new(
            "left-out",
            format!("left out: {}", left_out.join(", ")),
        ));
    }
    kinds.dedup();
    content.dialect = format!("universal file, data sets {}", kinds.join(" and "));
    Ok(content)
}

/// How the numbers of a data set are stored, by its line with 58.
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
            return Err(
                lines.wrong("the data set 58b does not say the order of its bytes (1 or 2)")
            );
        }
    };
    if field(line, 13, 6) != Some(2) {
        return Err(Failure::failed(
            ErrorCode::NotARecording,
            "the data set 58b has floating point of DEC VMS or IBM, which torqcomp does not read; write it as IEEE 754",
        )
        .line(lines.number));
    }
    let count = field(line, 31, 12);
    let count =
        count.ok_or_else(|| lines.wrong("the data set 58b does not say how many bytes it has"))?;
    Ok(Storage::Binary(order, count))
}

/// Reads a data set 58; whether it was whole.
fn data_set(
    lines: &mut Lines,
    storage: Storage,
    content: &mut Content,
    left_out: &mut Vec<String>,
) -> Result<bool, Failure> {
    let Some(head) = Head::read(lines)? else {
        content.lost = Some(cut("within the head of a data set"));
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
                return Err(lines.wrong("the data set 58b has fewer bytes than its numbers take"));
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

/// The numbers of a data set of text, as many as the file has of them, and the line behind them.
fn text_values(lines: &mut Lines, wanted: usize, head: &Head) -> Result<Vec<f64>, Failure> {
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
            return Err(Failure::failed(
                ErrorCode::InvalidSample,
                "the line has a text where numbers of a data set 58 are expected; correct it",
            )
            .line(lines.number));
        }
    }
    if values.len() >= wanted {
        // The end of the data set; what it is otherwise is looked at next.
        while lines.next()?.is_some_and(|line| line.trim() != "-1") {}
    }
    Ok(values)
}

/// The rate of the fewest digits whose step is the one that stands there with six: 2.26757E-05 s is 44100 Hz.
fn roundest_rate(step: f64) -> f64 {
    let half = 0.5 * 10.0_f64.powi(step.log10().floor() as i32 - 5);
    let rounded = (1..=6).filter_map(|count| digits::text(1.0 / step, count).parse::<f64>().ok());
    rounded
        .into_iter()
        .find(|rate| (1.0 / rate - step).abs() <= half * (1.0 + 1e-9))
        .unwrap_or(1.0 / step)
}

/// The channel of a data set.
fn made(head: &Head, name: &str, values: &[f64], lines: &Lines) -> Result<Channel, Failure> {
    let [abscissa, ordinate] = &head.axes;
    // The standard has seconds; another unit of time is taken at its word.
    let unit = NamedUnit::parse(&abscissa.unit).filter(NamedUnit::is_time);
    let second = unit.map_or(1.0, |unit| unit.unit.factor());
    let (axis, samples) = if head.is_even {
        let step = head.step * second;
        if !(step > 0.0 && step.is_finite() && head.start.is_finite()) {
            return Err(lines.wrong("the step of the abscissa is not a time greater than zero"));
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
