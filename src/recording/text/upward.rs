//! Rows above those by which a table was found: a single text cell neither begins nor ends a table.

use super::cell::Cell;
use super::dialect::is_skipped;
use super::head::{Head, Table};

/// Relation of a line above a table to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Above {
    /// A row like those of the table.
    Row,
    /// A row with texts instead of numbers: an overload, a lost connection.
    WithTexts,
    /// Texts only, one for each column.
    Headings,
    /// Anything else.
    Other,
}

/// Index of the first row, searched upwards from the one by which the table was found: over rows in which some cells
/// contain texts, up to a row without texts, or to the headings.
pub(super) fn first_row(head: &Head, table: &Table) -> usize {
    let cells = |line: usize| -> Vec<Cell> {
        let mut cells: Vec<Cell> = table
            .dialect
            .cells(&head.lines[line].text)
            .iter()
            .map(|cell| Cell::read(cell, table.dialect.decimal))
            .collect();
        let filled = cells.iter().rposition(|cell| *cell != Cell::Empty);
        cells.truncate(filled.map_or(0, |place| place + 1));
        cells
    };
    let below = cells(table.first);
    let (mut first, mut topmost) = (table.first, table.first);
    let lines = (0..table.first).rev();
    for line in lines.filter(|line| !is_skipped(&head.lines[*line].text)) {
        match above(&cells(line), &below) {
            Above::Row => first = line,
            Above::WithTexts => {}
            Above::Headings => return topmost,
            Above::Other => break,
        }
        topmost = line;
    }
    first
}

fn above(cells: &[Cell], below: &[Cell]) -> Above {
    let is_lost = |cell: &Cell| matches!(cell, Cell::Text | Cell::NonFinite);
    let is_same_kind = |a: Cell, b: Cell| {
        a.is_number() && b.is_number() || matches!((a, b), (Cell::Clock(_), Cell::Clock(_)))
    };
    match (cells, below) {
        _ if cells.len() != below.len() => Above::Other,
        ([Cell::NonFinite], _) => Above::WithTexts,
        ([first, ..], [begins, ..]) if is_same_kind(*first, *begins) => {
            match cells.iter().any(is_lost) {
                true => Above::WithTexts,
                false => Above::Row,
            }
        }
        _ if cells.len() > 1 && cells.iter().all(is_lost) => Above::Headings,
        _ => Above::Other,
    }
}
