//! Column information from the lines above a table.

mod field;
mod fill;
mod keyed;
mod labelled;
mod positional;

use super::head::{Head, Table};
use super::keys::{self, HeaderEntry};
use super::units;
use crate::recording::text::dialect::{Delimiter, Dialect};
pub use field::Field;
use fill::{fill_axis_unit, fill_from_list, fill_names, fill_time_unit, fill_units};
use labelled::labelled;
use positional::positional;

/// The lines above a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// The columns.
    pub fields: Vec<Field>,
    /// The keys and values.
    pub entries: Vec<HeaderEntry>,
    /// Text of the line with the names.
    pub names: Option<String>,
    /// Number of a line just above the table with more words than there are columns, none of which has a name then.
    pub unassigned: Option<usize>,
}

impl Header {
    /// Gives channels without a unit the maker's default unit.
    pub fn set_default_units(&mut self, unit: &str) {
        for field in &mut self.fields {
            let is_other = field.unit_text.is_some()
                || field.is_named_time()
                || units::is_axis_name(&field.name)
                || units::is_index_name(&field.name);
            if !is_other {
                field.unit = units::read(unit);
                field.unit_text = Some(unit.to_owned());
            }
        }
    }
}

/// A line above the table, split into cells.
struct HeaderRow<'a> {
    line: usize,
    text: &'a str,
    cells: Vec<String>,
}

/// Parses the lines above a table; `used` marks the columns with data in the first rows.
pub fn read(head: &Head, table: &Table, used: &[bool]) -> Header {
    let rows: Vec<HeaderRow> = head.lines[..table.first]
        .iter()
        .enumerate()
        .filter(|(_, line)| line.text.chars().any(char::is_alphanumeric))
        .map(|(line, content)| HeaderRow {
            line,
            text: &content.text,
            cells: match lone_heading(head, table, line) {
                Some(heading) => vec![heading],
                None => split(&content.text, table, used),
            },
        })
        .collect();
    let entries = |without: &[usize]| -> Vec<HeaderEntry> {
        rows.iter()
            // `CH1V,CH2V,t0 =-5e-05, tInc = 1e-09,` names columns and contains further entries.
            .filter(|row| !without.contains(&row.line) || row.text.contains('='))
            .flat_map(|row| keys::entries(head.number(row.line), row.text, table.dialect))
            .collect()
    };
    let keyed = entries_below_keys(head, &rows);
    let entries = |without: &[usize]| -> Vec<HeaderEntry> {
        let mut all = entries(without);
        all.extend(keyed.iter().cloned());
        all
    };
    if let Some((mut fields, names)) = labelled(&rows, used) {
        let entries = entries(&[names]);
        // Next to labels, the unit of the axis may refer to the picture: the rate determines the unit of
        // time.
        fill_units(&mut fields, &entries, used);
        return Header {
            fields,
            entries,
            names: Some(head.lines[names].text.clone()),
            unassigned: None,
        };
    }
    let found = positional(&rows, table, used);
    let unassigned = rows
        .last()
        .filter(|row| found.names.is_none() && row.line + 1 == table.first)
        .filter(|row| is_split_at_words(&row.cells, table) && keys::topic(row.text).is_none())
        .map(|row| head.number(row.line));
    let mut fields = found.fields;
    let mut entries = entries(&found.lines);
    entries.extend(fill_from_list(&mut fields, &rows));
    if found.names.is_none() {
        fill_names(&mut fields, &entries, used);
    }
    fill_units(&mut fields, &entries, used);
    fill_axis_unit(&mut fields, &entries);
    fill_time_unit(&mut fields);
    Header {
        fields,
        entries,
        names: found.names.map(|line| head.lines[line].text.clone()),
        unassigned,
    }
}

/// Keys in one line with their values in the next: `dt:` above `0.001`, `*RATE` above `500 Hz`.
fn entries_below_keys(head: &Head, rows: &[HeaderRow]) -> Vec<HeaderEntry> {
    rows.windows(2)
        .filter(|pair| pair[1].line == pair[0].line + 1)
        .filter_map(|pair| {
            let text = pair[0].text.trim();
            let starred = || text.strip_prefix('*').filter(|key| is_about_axis(key));
            let key = text.strip_suffix(':').or_else(starred)?;
            Some(HeaderEntry {
                line: head.number(pair[0].line),
                key: key.to_owned(),
                values: pair[1].cells.clone(),
                is_number_split: false,
            })
        })
        .collect()
}

/// Whether a key concerns the time axis.
fn is_about_axis(key: &str) -> bool {
    use keys::Topic::{Count, Date, Interval, Rate, Start};
    matches!(
        keys::topic(key),
        Some(Rate | Interval | Start | Date | Count)
    )
}

/// Maximum number of words in the heading of a single column.
const WORDS: usize = 4;

/// The heading of the only column of a table, if a line just above it qualifies: words, none of them a number or a
/// key. With space separators it would be split otherwise.
fn lone_heading(head: &Head, table: &Table, line: usize) -> Option<String> {
    let is_alone = table.width == 1 && table.dialect.delimiter == Delimiter::Spaces;
    let between = &head.lines[line + 1..table.first];
    if !is_alone || between.iter().any(|line| !line.text.trim().is_empty()) {
        return None;
    }
    let text = uncommented(&head.lines[line].text).trim();
    let words: Vec<&str> = text.split_whitespace().collect();
    let is_word =
        |word: &&str| !word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    let is_heading = (2..=WORDS).contains(&words.len())
        && words.iter().all(is_word)
        && !text.contains(['=', ':', '\t'])
        && keys::topic(text).is_none();
    is_heading.then(|| text.to_owned())
}

/// Splits a line above the table like the table, or by other separators if only these give a cell
/// for each column.
fn split(text: &str, table: &Table, used: &[bool]) -> Vec<String> {
    let text = uncommented(text);
    let cells = table.dialect.cells(text);
    let count = |cells: &[String]| cells.iter().filter(|cell| !cell.is_empty()).count();
    let wanted = used.iter().filter(|used| **used).count();
    let is_split = is_split_at_words(&cells, table);
    if count(&cells) >= wanted && cells.len() <= table.width + 1 && !is_split || wanted < 2 {
        return cells;
    }
    if let Some(joined) = in_threes(&cells, table.width) {
        return joined;
    }
    if let Some(joined) = with_their_units(&cells).filter(|cells| cells.len() == table.width) {
        return joined;
    }
    let others = [b'\t', b';', b',', b'|'];
    let mut ways: Vec<Vec<String>> = others
        .into_iter()
        .filter(|mark| table.dialect.delimiter != Delimiter::Byte(*mark))
        .filter(|mark| text.contains(char::from(*mark)))
        .map(|mark| {
            let delimiter = Delimiter::Byte(mark);
            Dialect {
                delimiter,
                ..table.dialect
            }
            .cells(text)
        })
        .collect();
    ways.push(
        text.split("  ")
            .map(str::trim)
            .filter(|cell| !cell.is_empty())
            .map(str::to_owned)
            .collect(),
    );
    if !text.contains(['\t', ';', ',']) {
        ways.push(at_quotes(text));
    }
    ways.into_iter()
        .find(|way| way.len() == table.width)
        .unwrap_or(cells)
}

/// Whether a line above a table that is separated by spaces has more words than the table has columns, so that none of them
/// can be assigned to a column.
fn is_split_at_words(cells: &[String], table: &Table) -> bool {
    table.dialect.delimiter == Delimiter::Spaces && cells.len() > table.width
}

/// Words with the units in brackets that follow them, `Torque [N m]`, if there are any.
fn with_their_units(words: &[String]) -> Option<Vec<String>> {
    let mut cells: Vec<String> = Vec::new();
    let mut closing = None;
    for word in words {
        let opening = [('[', ']'), ('(', ')')]
            .into_iter()
            .find(|(open, _)| word.starts_with(*open));
        closing = closing.or(opening.map(|(_, close)| close));
        match cells.last_mut().filter(|_| closing.is_some()) {
            Some(cell) => *cell = format!("{cell} {word}"),
            None => cells.push(word.clone()),
        }
        closing = closing.filter(|close| !word.ends_with(*close));
    }
    (cells.len() < words.len()).then_some(cells)
}

/// Headings of three cells each, `"Zeit";"t";"s"`: name, symbol and unit, combined.
fn in_threes(cells: &[String], width: usize) -> Option<Vec<String>> {
    let is_unit = |three: &[String]| units::read(&three[2]).is_some();
    let fits = cells.len() == 3 * width && cells.chunks(3).all(is_unit);
    let joined = |three: &[String]| format!("{} {} / {}", three[0], three[1], three[2]);
    fits.then(|| cells.chunks(3).map(joined).collect())
}

/// Headings that each begin with a quoted name: `"Zeit" t / s "Drehmoment" M / Nm`.
fn at_quotes(text: &str) -> Vec<String> {
    let opening = text.match_indices('"').step_by(2).map(|(place, _)| place);
    let mut starts: Vec<usize> = opening.collect();
    starts.push(text.len());
    starts
        .windows(2)
        .map(|pair| text[pair[0]..pair[1]].trim().to_owned())
        .collect()
}

/// Headings may be in a comment: `# time_s,bridge_V`.
fn uncommented(text: &str) -> &str {
    let text = text.trim_start_matches('\u{feff}');
    match text.trim_start().strip_prefix(['#', '%', '!']) {
        Some(rest) => rest.trim_start_matches(['#', '%', '!']).trim_start(),
        // Column headings of CASSY.
        None => after_definition(text).unwrap_or(text),
    }
}

/// The text after `DEF=`, with or without spaces around the sign.
pub(super) fn after_definition(text: &str) -> Option<&str> {
    let rest = text.trim_start().strip_prefix("DEF")?;
    Some(rest.trim_start().strip_prefix('=')?.trim_start_matches(' '))
}
