//! Formatting of numbers, columns and documents for output.

use std::fmt;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_decimal::digits;
use unicode_width::UnicodeWidthStr;

/// A JSON document, indented, with a line end.
///
/// # Panics
/// Never: all keys of the reports are strings, and no part fails to serialise.
pub fn json(report: &impl Serialize) -> String {
    escaped(serde_json::to_string_pretty(report))
}

/// The same on one line.
pub(crate) fn json_line(entry: &impl Serialize) -> String {
    escaped(serde_json::to_string(entry))
}

fn escaped(text: serde_json::Result<String>) -> String {
    let text = text.expect("reports are plain data");
    let mut text = written_out(text, |c| format!("\\u{:04x}", u32::from(c)));
    text.push('\n');
    text
}

/// Result of a verb, printed as text for people or as a JSON document.
pub(crate) trait Report: Serialize + Sized {
    /// Name and version of the document.
    const SCHEMA: &'static str;

    /// The report for people.
    fn text(&self) -> String;

    /// The report in the requested form.
    fn document(&self, as_json: bool) -> String {
        match as_json {
            true => document(Self::SCHEMA, self),
            false => visible(self.text()),
        }
    }
}

/// A JSON document, headed by its schema and the version of torqcomp.
pub(crate) fn document<R: Serialize>(schema: &'static str, report: &R) -> String {
    json(&Document {
        schema,
        version: env!("CARGO_PKG_VERSION"),
        report,
    })
}

/// How every JSON document begins.
#[derive(Serialize, JsonSchema)]
pub(crate) struct Document<'a, R> {
    /// Name and version of the form of this document.
    schema: &'static str,
    /// Version of torqcomp.
    version: &'static str,
    #[serde(flatten)]
    report: &'a R,
}

/// Prints a message to standard error. A closed standard error is not a failure.
pub fn say(text: &str) {
    if text.is_empty() {
        return;
    }
    clear_line();
    let text = visible(text.to_owned());
    say_line(&text);
}

/// Prints a text to standard error unchanged.
pub(crate) fn say_line(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Whether the terminal shows a temporary line.
static IS_LINE_SHOWN: AtomicBool = AtomicBool::new(false);

/// Shows a temporary line on the terminal in place of the previous one, until the next message.
pub(crate) fn show_line(text: String) {
    IS_LINE_SHOWN.store(true, Ordering::Relaxed);
    say_line(&format!("\r{}\x1b[K", visible(text)));
}

/// Erases the temporary line.
pub(crate) fn clear_line() {
    if IS_LINE_SHOWN.swap(false, Ordering::Relaxed) {
        say_line("\r\x1b[K");
    }
}

/// Whether notes are suppressed.
static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// Suppresses or enables notes.
pub(crate) fn set_quiet(is_quiet: bool) {
    IS_QUIET.store(is_quiet, Ordering::Relaxed);
}

/// Prints a note, which `--quiet` suppresses.
pub(crate) fn note(text: &str) {
    if !IS_QUIET.load(Ordering::Relaxed) {
        say(text);
    }
}

/// A text with its control characters escaped: names from a file can neither control a terminal nor break a page.
///
/// ```
/// use torqcomp::print::visible;
/// assert_eq!(visible("a\tb\n".to_owned()), "a\tb\n");
/// assert_eq!(visible("\x1b[2Jtorque".to_owned()), "\\u{1b}[2Jtorque");
/// assert_eq!(visible("\u{202e}mN".to_owned()), "\\u{202e}mN");
/// ```
pub fn visible(text: String) -> String {
    written_out(text, |c| c.escape_unicode().to_string())
}

fn written_out(text: String, written: impl Fn(char) -> String) -> String {
    // Control characters, those that change the text direction, and those not allowed in XML.
    let is_hidden = |c: char| {
        c.is_control() && !matches!(c, '\n' | '\t')
            || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{fffe}' | '\u{ffff}')
    };
    if !text.contains(is_hidden) {
        return text;
    }
    let shown = |c: char| match is_hidden(c) {
        true => written(c),
        false => c.to_string(),
    };
    text.chars().map(shown).collect()
}

/// Relative amount from which percentages are hard to read.
const LARGE_RELATIVE: f64 = 10.0;

/// A number for people: six significant digits.
pub fn short(value: f64) -> String {
    digits::text(value, 6)
}

/// A number for people with the given number of significant digits.
pub fn rounded(value: f64, digits: u32) -> String {
    digits::text(value, digits)
}

/// A relative amount for people with the given number of significant digits: in percent, or from ten on as a factor.
///
/// ```
/// use torqcomp::print::relative;
/// assert_eq!(relative(0.01234, 2), "1.2 %");
/// assert_eq!(relative(-0.5, 2), "-50 %");
/// assert_eq!(relative(230_000.0, 2), "230000 times");
/// ```
pub fn relative(ratio: f64, digits: u32) -> String {
    match ratio.abs() < LARGE_RELATIVE {
        true => format!("{} %", rounded(100.0 * ratio, digits)),
        false => format!("{} times", rounded(ratio, digits)),
    }
}

/// A value with its standard uncertainty of two significant digits, rounded to the same digit
/// (GUM, JCGM 100:2008, 7.2.6). Values far from one get a common power of ten.
///
/// ```
/// use torqcomp::print::with_std;
/// assert_eq!(with_std(20.5781, 0.297), "20.58 ± 0.30");
/// assert_eq!(with_std(0.00704812, 1.03e-5), "0.007048 ± 0.000010");
/// assert_eq!(with_std(81234.0, 996.0), "81200 ± 1000");
/// assert_eq!(with_std(-1.99982e-7, 1.7e-11), "(-1.99982 ± 0.00017)e-7");
/// ```
pub fn with_std(value: f64, std: f64) -> String {
    let [value, std] = value_and_std(value, std);
    match (value.split_once('e'), std.split_once('e')) {
        (Some((value, power)), Some((std, _))) => format!("({value} ± {std})e{power}"),
        _ => format!("{value} ± {std}"),
    }
}

/// The value and its uncertainty as two texts, for columns.
pub fn value_and_std(value: f64, std: f64) -> [String; 2] {
    if !(value.is_finite() && std.is_finite() && std > 0.0) {
        return [rounded(value, 6), rounded(std, 2)];
    }
    // Exponent of the second digit of the uncertainty after rounding to two.
    let exponent = |std: f64| std.log10().floor() as i32 - 1;
    let first = exponent(std);
    let last = exponent((std / 10_f64.powi(first)).round() * 10_f64.powi(first) * (1.0 + 1e-9));
    let largest = value.abs().max(std).log10().floor() as i32;
    let power = if !(-3..=8).contains(&largest) {
        largest
    } else {
        0
    };
    let decimals = (power - last).max(0) as usize;
    let step = 10_f64.powi((last - power).max(0));
    let scale = 10_f64.powi(-power);
    let text = |number: f64| {
        let scaled = number * scale;
        // The formatter rounds decimals; digits before the point are rounded here.
        let shown = if decimals > 0 {
            scaled
        } else {
            (scaled / step).round() * step
        };
        match power {
            0 => format!("{shown:.decimals$}"),
            _ => format!("{shown:.decimals$}e{power}"),
        }
    };
    [text(value), text(std)]
}

/// A count with its noun, in the plural (s or es) unless the count is one.
///
/// ```
/// use torqcomp::print::plural;
/// assert_eq!(plural(1, "mode"), "1 mode");
/// assert_eq!(plural(2, "stretch"), "2 stretches");
/// ```
pub fn plural<N: fmt::Display + PartialEq + From<u8>>(count: N, noun: &str) -> String {
    if count == N::from(1) {
        return format!("1 {noun}");
    }
    let ending = if noun.ends_with("ch") { "es" } else { "s" };
    format!("{count} {noun}{ending}")
}

/// `a, b or c`.
pub(crate) fn list(items: impl IntoIterator<Item = String>) -> String {
    enumeration(&items.into_iter().collect::<Vec<_>>(), "or")
}

/// The first `most` of `count` items, and the number of further ones: `a, b and 7 more`.
pub(crate) fn some_of<T: ToString>(
    items: impl IntoIterator<Item = T>,
    count: usize,
    most: usize,
) -> String {
    let first = items.into_iter().take(most);
    let first: Vec<String> = first.map(|item| item.to_string()).collect();
    match count.saturating_sub(most) {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

/// `a, b and c`, with the given word before the last item.
pub(crate) fn enumeration<T: AsRef<str>>(items: &[T], word: &str) -> String {
    let items: Vec<&str> = items.iter().map(T::as_ref).collect();
    match items.as_slice() {
        [] => "none".to_owned(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} {word} {last}", first.join(", ")),
    }
}

/// A unit for people, also if the file gives none.
pub fn unit_or_as_recorded(unit: &str) -> &str {
    match unit {
        "" => "as recorded",
        unit => unit,
    }
}

/// The unit of one quantity over another: `V/N`, `V/(N m)`.
pub fn unit_of_quotient((over, under): (&str, &str)) -> String {
    let one = |unit: &str| if unit.is_empty() { "1" } else { unit }.to_owned();
    let under = match under.contains([' ', '/']) {
        true => format!("({under})"),
        false => one(under),
    };
    format!("{}/{under}", one(over))
}

/// Rows of cells as aligned columns, the first aligned left, the others right.
pub fn columns(rows: &[Vec<String>]) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |i: usize| {
        rows.iter()
            .filter_map(|row| row.get(i))
            .map(|cell| cell.width())
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
            .map(|(i, (cell, width))| {
                let rest = " ".repeat(width.saturating_sub(cell.width()));
                match i {
                    0 => format!("{cell}{rest}"),
                    _ => format!("  {rest}{cell}"),
                }
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
