//! Header of a data set 58.

use super::super::bytes::Number;
use super::lines::Lines;
use crate::failure::Failure;

/// Number of header lines.
const HEAD_LINES: usize = 11;
/// Axis type for time.
const TIME: i64 = 17;

/// Header of a data set 58.
pub(super) struct DatasetHead {
    pub(super) name: String,
    pub(super) function: i64,
    /// Data type: 2 single, 4 double, 5 and 6 the same for complex numbers.
    pub(super) kind: i64,
    pub(super) count: usize,
    pub(super) is_even: bool,
    pub(super) start: f64,
    pub(super) step: f64,
    /// Type and text of both axes: abscissa, ordinate.
    pub(super) axes: [Abscissa; 2],
}

pub(super) struct Abscissa {
    pub(super) kind: i64,
    pub(super) label: String,
    pub(super) unit: String,
}

/// A number in a field of a line.
pub(super) fn field<T: std::str::FromStr>(line: &str, from: usize, width: usize) -> Option<T> {
    let field: String = line.chars().skip(from).take(width).collect();
    field.trim().parse().ok()
}

/// A text in a field; `NONE` means empty.
pub(super) fn text(line: &str, from: usize, width: usize) -> String {
    let field: String = line.chars().skip(from).take(width).collect();
    match field.trim() {
        "NONE" | "None" | "none" => String::new(),
        text => text.to_owned(),
    }
}

impl Abscissa {
    pub(super) fn of(line: &str) -> Self {
        Self {
            kind: field(line, 0, 10).unwrap_or(0),
            label: text(line, 26, 20),
            unit: text(line, 47, 20),
        }
    }
}

impl DatasetHead {
    pub(super) fn read(lines: &mut Lines) -> Result<Option<Self>, Failure> {
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
            return Err(lines
                .wrong("the seventh line of a data set 58 does not contain the required numbers"));
        };
        let [abscissa, ordinate] = [&head[7], &head[8]].map(|line| Abscissa::of(line));
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

    /// Total number of values, and values per sample.
    pub(super) fn numbers(&self) -> (usize, usize) {
        let each = match (self.is_even, self.kind) {
            (true, 5 | 6) => 2,
            (true, _) => 1,
            (false, 5 | 6) => 3,
            (false, _) => 2,
        };
        (self.count.saturating_mul(each), each)
    }

    /// Why it is not a function of time, if so.
    pub(super) fn foreign(&self) -> Option<&'static str> {
        let is_over_time =
            self.axes[0].kind == TIME || (self.axes[0].kind == 0 && self.function == 1);
        match self.kind {
            5 | 6 => Some("complex numbers"),
            2 | 4 if !is_over_time => Some("not a function of time"),
            2 | 4 => None,
            _ => Some("unknown number type"),
        }
    }

    /// Number type of a data set 58b; its abscissas are single or double like the values.
    pub(super) fn width(&self) -> Number {
        match self.kind {
            2 | 5 => Number::Float32,
            _ => Number::Float64,
        }
    }
}

/// Name of a function: its first line, otherwise node and direction, otherwise the label of its axis.
pub(super) fn name(head: &[String], ordinate: &Abscissa) -> String {
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

pub(super) fn direction_name(direction: i64) -> &'static str {
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
