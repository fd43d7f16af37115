//! What the verbs report, as plain data: one struct for each, written as text or as JSON.

pub mod chart;
pub mod compensate;
pub mod diagnose;
pub mod diagnose_page;
pub mod harmonics;
pub mod identify;
pub mod inspect;
pub mod page;
pub mod panels;
pub mod predict;
pub mod svg;

use serde::Serialize;

use crate::io::digits;

/// Something that a user should know, with a code that scripts can rely on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Warning {
    /// Stable code.
    pub code: &'static str,
    /// For people.
    pub message: String,
}

impl Warning {
    /// A warning.
    #[must_use]
    pub fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }
}

/// A JSON document, indented, with a line end.
///
/// # Panics
/// Never: the reports have string keys and no failing parts.
#[must_use]
pub fn json(report: &impl Serialize) -> String {
    let mut text = serde_json::to_string_pretty(report).expect("reports are plain data");
    text.push('\n');
    text
}

/// Says something to a person on standard error. Nobody may be there to read it: that is no failure.
pub fn say(text: &str) {
    use std::io::Write;
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// A number for people: six significant digits.
#[must_use]
pub fn short(value: f64) -> String {
    digits::text(value, 6)
}

/// A number for people with that many significant digits.
#[must_use]
pub fn rounded(value: f64, digits: u32) -> String {
    digits::text(value, digits)
}

/// Rows of cells as columns of equal width, the first to the left, the others to the right.
#[must_use]
pub fn columns(rows: &[Vec<String>]) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |i: usize| {
        rows.iter()
            .filter_map(|row| row.get(i))
            .map(|cell| cell.chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..count).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let line: String = row
            .iter()
            .zip(&widths)
            .enumerate()
            .map(|(i, (cell, width))| match i {
                0 => format!("{cell:<width$}"),
                _ => format!("  {cell:>width$}"),
            })
            .collect();
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let row = |a: &str, b: &str| vec![a.to_owned(), b.to_owned()];
        let text = columns(&[row("name", "value"), row("µ", "1.25")]);
        assert_eq!(text, "name  value\nµ      1.25\n");
    }
}
