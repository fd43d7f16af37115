//! Columns of a channel that were skipped because most of their cells are not plain numbers.

use super::cell::Cell;
use super::cells_with_units::unit_of_cell;
use super::head::{Head, Table};
use super::header::{Field, Header};
use super::last_line::shortened;
use super::rows::ColumnKind;
use super::stream::other_mark;
use crate::recording::text::dialect::is_skipped;
use crate::warning::{Warning, WarningCode};

/// Number of rows examined.
const ROWS: usize = 400;
/// Least part of the cells that begin with a number with decimals in a column of measured values without a unit.
const MEASURED: f64 = 0.5;

/// Whether a warning is about a skipped column that may be the channel wanted.
pub(in crate::recording) fn is_about_one(warning: &Warning) -> bool {
    let codes = [WarningCode::CellsWithUnits, WarningCode::TextsInChannel];
    codes.map(WarningCode::name).contains(&warning.code)
}

/// Warnings about columns of channels that were skipped: those with a unit after the first number, and those of texts
/// whose heading has a unit or whose texts contain measured values. `first` is the first row.
pub fn warnings(
    head: &Head,
    table: &Table,
    first: usize,
    header: &Header,
    kinds: &[ColumnKind],
) -> Vec<Warning> {
    let cells = table.dialect.cells(&head.lines[first].text);
    // Of a table with very many columns, rows are split once.
    let rows = match kinds.contains(&ColumnKind::Nothing) {
        true => first_rows(head, table, first),
        false => Vec::new(),
    };
    let fields = header.fields.iter().zip(kinds).enumerate();
    let skipped = |(place, (field, kind)): (usize, (&Field, &ColumnKind))| {
        let column = SkippedColumn {
            head,
            table,
            first,
            place,
            field,
        };
        let with_unit = cells.get(place).and_then(|cell| column.with_unit(cell));
        match kind {
            ColumnKind::Nothing => with_unit.or_else(|| column.with_texts(&rows)),
            _ => with_unit,
        }
    };
    fields.filter_map(skipped).collect()
}

/// The first rows, with their lines.
fn first_rows(head: &Head, table: &Table, first: usize) -> Vec<(usize, Vec<String>)> {
    let lines = head.lines.iter().enumerate().skip(first);
    let rows = lines.filter(|(_, line)| !is_skipped(&line.text)).take(ROWS);
    rows.map(|(at, line)| (at, table.dialect.cells(&line.text)))
        .collect()
}

/// A column of a table.
struct SkippedColumn<'a> {
    head: &'a Head,
    table: &'a Table,
    first: usize,
    place: usize,
    field: &'a Field,
}

impl SkippedColumn<'_> {
    fn with_unit(&self, cell: &str) -> Option<Warning> {
        let unit = unit_of_cell(cell, self.table.dialect.decimal)?;
        Some(WarningCode::CellsWithUnits.warning(format!(
            "line {}: column {} (\"{}\") reads \"{cell}\": only plain numbers are read, so the column was \
             skipped; remove the units from its cells, convert all of them to one unit, and put that in the \
             heading: \"{} [{unit}]\"",
            self.head.number(self.first),
            self.place + 1,
            self.field.heading,
            self.field.name
        )))
    }

    fn with_texts(&self, rows: &[(usize, Vec<String>)]) -> Option<Warning> {
        let decimal = self.table.dialect.decimal;
        let cells = rows.iter();
        let cells = cells.filter_map(|(at, row)| Some((*at, row.get(self.place)?.as_str())));
        let cells: Vec<(usize, &str)> = cells.filter(|(_, cell)| !cell.is_empty()).collect();
        let is_text = |(_, cell): &&(usize, &str)| Cell::read(cell, decimal) == Cell::Text;
        let (line, cell) = cells.iter().find(is_text)?;
        let measured = cells.iter().filter(|(_, cell)| is_measured(cell, decimal));
        let is_measured = measured.count() as f64 > MEASURED * cells.len() as f64;
        let has_unit = self.field.unit.is_some() && !self.field.has_time_unit();
        (has_unit || is_measured).then(|| {
            WarningCode::TextsInChannel.warning(format!(
                "line {}: column {} (\"{}\") reads \"{}\", expected a number{}: so do most of its first cells, and \
                 the column was skipped. Write plain numbers there, and leave the cells without a value empty or \
                 remove their rows",
                self.head.number(*line),
                self.place + 1,
                self.field.heading,
                shortened(cell),
                other_mark(cell, decimal)
            ))
        })
    }
}

/// Whether a cell begins with a number with decimals, perhaps behind the mark of a spreadsheet: `9.8712 OK`, `'9.8712`.
fn is_measured(cell: &str, decimal: u8) -> bool {
    let number = cell.trim_start_matches(['\'', '=', '<', '>', '~']);
    let word = number.split_whitespace().next().unwrap_or_default();
    word.contains(char::from(decimal)) && matches!(Cell::read(word, decimal), Cell::Number(_))
}
