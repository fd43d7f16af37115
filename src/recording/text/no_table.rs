//! Why a text has no table of numbers, and how to convert the usual ones.

use serde_json::Value;

use super::cells_with_units::unit_of_cell;
use super::head::Head;

/// An opening brace.
const BRACE: u8 = 0x7b;
/// Number of characters of a line that are shown.
const SHOWN: usize = 60;

/// The reason, for the lines of a text.
pub(super) fn why(head: &Head) -> String {
    let filled = || head.lines.iter().map(|line| line.text.trim());
    let mut filled = filled().filter(|text| !text.is_empty());
    let Some(first) = filled.next() else {
        return if head.complete {
            "the file is empty; expected rows of numbers".to_owned()
        } else {
            "the first line does not end within eight megabytes; expected rows of numbers"
                .to_owned()
        };
    };
    let second = filled.next().unwrap_or_default();
    let found = of_json(first, second)
        .or_else(|| of_labels(first, second))
        .or_else(|| of_units(head));
    found.unwrap_or_else(|| {
        format!(
            "no table of numbers found (the first line reads \"{}\"); expected at least two rows \
             of numbers, with or without headings above. Say how the cells are separated with \
             --delimiter and --decimal if they are unusual",
            shown(first)
        )
    })
}

fn shown(text: &str) -> String {
    text.chars().take(SHOWN).collect()
}

/// For a JSON object in each line, or an array of them.
fn of_json(first: &str, second: &str) -> Option<String> {
    let is_array = first.starts_with('[');
    let record = first.trim_start_matches('[').trim();
    let record = match record.is_empty() {
        true => second,
        false => record,
    };
    let complete = record.trim_end_matches([',', ']']);
    let object = serde_json::from_str::<Value>(complete).ok();
    let keys = object.as_ref().and_then(Value::as_object).map(|object| {
        let numbers = object.iter().filter(|(_, value)| value.is_number());
        let keys: Vec<String> = numbers.map(|(key, _)| format!(".\"{key}\"")).collect();
        keys.join(", ")
    });
    let is_open = |text: &str| text.bytes().next() == Some(BRACE);
    if keys.is_none() && !is_open(first) && !(is_array && is_open(second)) {
        return None;
    }
    let (what, each) = match is_array {
        true => ("JSON", ".[] | "),
        false => ("JSON, one object in each line", ""),
    };
    let keys = keys.filter(|keys| !keys.is_empty());
    let keys = keys.unwrap_or_else(|| ".time, .torque".to_owned());
    Some(format!(
        "the file is {what}, not a table; convert it to CSV, for example with jq -r '{each}[{keys}] | @csv', and write the \
         names of the columns above it, with their units"
    ))
}

/// For `label:value` pairs, as for the plotter of the Arduino IDE.
fn of_labels(first: &str, second: &str) -> Option<String> {
    let is_pair = |cell: &str| {
        let pair = cell.split_once([':', '=']);
        pair.is_some_and(|(label, value)| {
            label.chars().any(char::is_alphabetic) && value.trim().parse::<f64>().is_ok()
        })
    };
    let are_pairs = |line: &str| {
        let mut cells = line
            .split([',', ';', '\t', ' '])
            .filter(|cell| !cell.is_empty());
        !line.is_empty() && cells.all(is_pair)
    };
    (are_pairs(first) && are_pairs(second)).then(|| {
        format!(
            "the cells are pairs of label and value, \"{}\"; remove the labels, for example with sed \
             's/[A-Za-z_]*[:=]//g', and write them as names of the columns above the numbers, with their units",
            shown(first)
        )
    })
}

/// For units beside the numbers.
fn of_units(head: &Head) -> Option<String> {
    let is_separator = |c: char| matches!(c, ',' | ';' | '\t');
    let has_unit = |text: &&str| {
        let mut cells = text.split(is_separator);
        cells.any(|cell| unit_of_cell(cell, b'.').is_some())
    };
    let mut lines = head.lines.iter().map(|line| line.text.as_str());
    let line = lines.find(has_unit)?;
    Some(format!(
        "no table of numbers found: \"{}\" holds units beside its numbers; only plain numbers are read. Take the units off \
         the cells, bring each column to one unit, and write that in its heading: \"torque [N m]\"",
        shown(line.trim())
    ))
}
