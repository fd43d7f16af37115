//! One table of numbers with the lines above it, as channels.

use super::axes::{Axes, Role, Sources};
use super::blocks;
use super::cell::Cell;
use super::head::{self, Head, Table};
use super::header::{self, Header};
use super::keys::{Entry, Topic};
use super::rows::{self, Rows, Wanted};
use super::summary;
use crate::failure::Failure;
use crate::io::csv::{Dialect, Options, is_skipped};
use crate::recording::Channel;
use crate::warning::Warning;

/// Rows that tell what a column holds.
const SAMPLE: usize = 400;

/// What is known beforehand of a maker's tables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Hints {
    /// Unit of time where the files never name it.
    pub time_unit: Option<&'static str>,
    /// Unit of the samples where the files never name it.
    pub unit: Option<&'static str>,
}

/// A table as read.
#[derive(Debug)]
pub struct Part {
    /// Its channels, for each block of rows in which time begins anew.
    pub blocks: Vec<Vec<Channel>>,
    /// How it is written.
    pub dialect: Dialect,
    /// Keys and values above it.
    pub entries: Vec<Entry>,
    /// What should be known.
    pub warnings: Vec<Warning>,
    /// What is missing.
    pub lost: Option<Warning>,
    /// Byte after its last row.
    pub end: usize,
    /// Number of the line there.
    pub next_line: usize,
    /// Whether a line there repeats a key of the head.
    pub begins_anew: bool,
}

/// Reads the table that follows an offset, up to the end or to a line that `stop` tells.
///
/// # Errors
/// If there is no table, or it leaves open how it is to be read.
pub fn read(
    text: &[u8],
    from: usize,
    number: usize,
    hints: Hints,
    options: &Options,
    stop: &dyn Fn(&str) -> bool,
) -> Result<Part, Failure> {
    let (head, table) = head::find(text, from, number, &options.dialect)?;
    read_at(text, &head, &table, hints, options, stop)
}

/// The same where the table has been found.
///
/// # Errors
/// See [`read`].
pub fn read_at(
    text: &[u8],
    head: &Head,
    table: &Table,
    hints: Hints,
    options: &Options,
    stop: &dyn Fn(&str) -> bool,
) -> Result<Part, Failure> {
    let wanted = wanted(head, table);
    let used: Vec<bool> = wanted.iter().map(|kind| kind.is_some()).collect();
    let mut header = header::read(head, table, &used);
    let first = first_row(head, table, &header);
    let wanted: Vec<Wanted> = wanted_from(head, table, first)
        .into_iter()
        .map(|kind| kind.unwrap_or(Wanted::Numbers))
        .collect();
    super::listing::refuse_variables(head, table, &wanted)?;
    let names = header.names.clone();
    let mut entries = header.entries.clone();
    if let Some(names) = &names {
        entries.extend(super::keys::entries(0, names, table.dialect));
    }
    let is_named = wanted.first() == Some(&Wanted::Nothing);
    let begins_anew = |line: &str| !is_named && blocks::begins_anew(line, &entries, table.dialect);
    let is_next = |line: &str| {
        stop(line) || head::is_end(line) || names.as_deref() == Some(line) || begins_anew(line)
    };
    let offset = head.lines[first].offset;
    let number = head.number(first);
    let mut rows = rows::read(text, offset, number, table.dialect, &wanted, &is_next)?;
    let lost = drop_cut_row(text, table.dialect, &mut rows);
    if let Some(unit) = hints.unit {
        default_units(&mut header, unit);
    }
    let next = crate::io::csv::decode_line(super::line_at(text, rows.end));
    Ok(Part {
        end: rows.end,
        next_line: number + rows.lines,
        begins_anew: begins_anew(next.trim_end_matches('\r')),
        lost,
        ..part_of(header, rows, table.dialect, hints, options)?
    })
}

/// Channels of rows as read, and what should be known of them.
fn part_of(
    header: Header,
    mut rows: Rows,
    dialect: Dialect,
    hints: Hints,
    options: &Options,
) -> Result<Part, Failure> {
    let find = |rows: &Rows| {
        Sources {
            fields: &header.fields,
            columns: &rows.columns,
            entries: &header.entries,
            decimal: dialect.decimal,
            default_time_unit: hints.time_unit,
            options,
        }
        .find()
    };
    let count = summary::leave_out_count(&mut rows);
    let mut axes = find(&rows)?;
    let summary = summary::leave_out(&mut rows, &axes.roles);
    if summary.is_some() {
        axes = find(&rows)?;
    }
    let mut warnings = warnings(&header, &rows, &axes, dialect);
    warnings.extend(count.into_iter().chain(summary));
    let starts = blocks::restarts(&rows, &axes.roles);
    let mut further: Vec<Rows> = starts
        .iter()
        .rev()
        .map(|row| rows.split_off(*row))
        .collect();
    if !further.is_empty() {
        axes = find(&rows)?;
    }
    let mut blocks = vec![channels(&header, rows, &axes)];
    while let Some(rows) = further.pop() {
        let axes = find(&rows)?;
        blocks.push(channels(&header, rows, &axes));
    }
    Ok(Part {
        blocks,
        dialect,
        entries: header.entries,
        warnings,
        lost: None,
        end: 0,
        next_line: 0,
        begins_anew: false,
    })
}

/// What should be known of a table.
fn warnings(header: &Header, rows: &Rows, axes: &Axes, dialect: Dialect) -> Vec<Warning> {
    let longest = rows.columns.iter().map(|column| column.values.len()).max();
    let differs = count_differs(&header.entries, longest.unwrap_or(0), dialect);
    let mut warnings = odd_lines(rows);
    warnings.extend(assumptions(axes));
    warnings.extend(axes.warnings.iter().cloned());
    warnings.extend(differs);
    warnings
}

/// What each column holds in the first rows; `None` if nothing.
pub fn wanted(head: &Head, table: &Table) -> Vec<Option<Wanted>> {
    wanted_from(head, table, table.first)
}

fn wanted_from(head: &Head, table: &Table, first: usize) -> Vec<Option<Wanted>> {
    #[derive(Clone, Copy, Default)]
    struct Counts {
        numbers: usize,
        ticks: usize,
        clocks: usize,
        texts: usize,
    }
    let mut counts = vec![Counts::default(); table.width];
    let rows = head.lines[first..]
        .iter()
        .filter(|line| !is_skipped(&line.text))
        .take(SAMPLE);
    for line in rows {
        let cells = table.dialect.cells(&line.text);
        for (count, cell) in counts.iter_mut().zip(&cells) {
            match Cell::read(cell, table.dialect.decimal) {
                Cell::Number(_) | Cell::Grouped(_) | Cell::NonFinite => {
                    count.numbers += 1;
                    let is_long = cell.len() > 12 && cell.parse::<i64>().is_ok();
                    count.ticks += usize::from(is_long);
                }
                Cell::Clock(_) => count.clocks += 1,
                Cell::Text => count.texts += 1,
                Cell::Empty => {}
            }
        }
    }
    counts
        .into_iter()
        .map(|count| match count {
            Counts {
                numbers: 0,
                clocks: 0,
                texts: 0,
                ..
            } => None,
            c if c.texts > c.numbers + c.clocks => Some(Wanted::Nothing),
            c if c.clocks > c.numbers => Some(Wanted::Clock),
            c if c.ticks == c.numbers => Some(Wanted::Ticks),
            _ => Some(Wanted::Numbers),
        })
        .collect()
}

/// The first row: a row with something wrong in it may stand between the headings and the first good
/// one; it belongs to the table, so that what is wrong is seen.
pub fn first_row(head: &Head, table: &Table, header: &Header) -> usize {
    let Some(names) = &header.names else {
        return table.first;
    };
    let from = head.lines[..table.first]
        .iter()
        .rposition(|line| line.text == *names);
    let from = from.map_or(table.first, |line| line + 1);
    (from..table.first)
        .rev()
        .filter(|line| !is_skipped(&head.lines[*line].text))
        .take_while(|line| {
            let cells = table.dialect.cells(&head.lines[*line].text);
            let read: Vec<Cell> = cells
                .iter()
                .map(|cell| Cell::read(cell, table.dialect.decimal))
                .collect();
            let numbers = read.iter().filter(|cell| cell.is_number()).count();
            numbers > 0
                && read.len() >= table.width
                && !cells[0].is_empty()
                && read[0] != Cell::Text
                && !head::is_numbering(&cells)
        })
        .last()
        .unwrap_or(table.first)
}

/// Takes the last row away if the file ends within it: without a line end, with fewer cells than the
/// rows before.
fn drop_cut_row(text: &[u8], dialect: Dialect, rows: &mut Rows) -> Option<Warning> {
    if rows.end != text.len() || text.last().is_none_or(|byte| *byte == b'\n') || rows.count < 2 {
        return None;
    }
    let line_at = |end: usize| memchr::memrchr(b'\n', &text[..end]).map_or(0, |place| place + 1);
    let last = line_at(text.len());
    let before = line_at(last.saturating_sub(1));
    let cells = |bytes: &[u8]| dialect.cells(&crate::io::csv::decode_line(bytes)).len();
    if cells(&text[last..]) >= cells(&text[before..last.max(1) - 1]) {
        return None;
    }
    rows.truncate(rows.count - 1);
    Some(Warning::new(
        "truncated-last-line",
        "the file ends within its last line; that line was left out",
    ))
}

fn default_units(header: &mut Header, unit: &str) {
    for field in &mut header.fields {
        let is_other = field.unit_text.is_some()
            || field.is_named_time()
            || super::units::is_axis_name(&field.name)
            || super::units::is_index_name(&field.name);
        if !is_other {
            field.unit = super::units::read(unit);
            field.unit_text = Some(unit.to_owned());
        }
    }
}

/// The channels of a table.
fn channels(header: &Header, rows: Rows, axes: &Axes) -> Vec<Channel> {
    let mut channels = Vec::new();
    for ((field, column), role) in header.fields.iter().zip(rows.columns).zip(&axes.roles) {
        let Role::Channel(axis) = role else {
            continue;
        };
        channels.push(super::makers::channel(
            field,
            column,
            axes.axes[*axis].clone(),
            None,
        ));
    }
    channels
}

fn odd_lines(rows: &Rows) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some((line, text)) = rows.odd.first() {
        // A last word such as EOF is no fault.
        let is_footer = rows.odd_count == 1 && !text.chars().any(|c| c.is_ascii_digit());
        if !is_footer {
            warnings.push(Warning::new(
                "lines-skipped",
                format!(
                    "{} line(s) among the rows are no rows and were left out; the first is line \
                     {line}: \"{text}\"",
                    rows.odd_count
                ),
            ));
        }
    }
    if let Some(line) = rows.too_wide {
        warnings.push(Warning::new(
            "extra-cells",
            format!("line {line} has more cells than there are columns; they were left out"),
        ));
    }
    warnings
}

fn assumptions(axes: &Axes) -> Vec<Warning> {
    let mut said: Vec<&String> = axes
        .axes
        .iter()
        .filter_map(|a| a.assumed.as_ref())
        .collect();
    said.dedup();
    said.into_iter()
        .map(|text| {
            Warning::new(
                "time-assumed",
                format!("{text}; confirm it with --time-column and --time-unit, or give --rate HZ"),
            )
        })
        .collect()
}

/// A warning if the head announces another number of samples than there are rows.
fn count_differs(entries: &[Entry], rows: usize, dialect: Dialect) -> Option<Warning> {
    let entry = entries
        .iter()
        .find(|entry| entry.topic() == Some(Topic::Count))?;
    let (said, _) = super::keys::quantity(entry.value()?, dialect.decimal)?;
    let is_count = said.fract() == 0.0 && said >= 2.0;
    (is_count && said != rows as f64).then(|| {
        Warning::new(
            "sample-count",
            format!(
                "the head says \"{}\" {said}, but there are {rows} rows",
                entry.key
            ),
        )
    })
}
