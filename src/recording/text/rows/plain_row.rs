//! Single-pass parsing of a row of plain numbers.

use torqcomp_decimal::{Span, number};

use super::{ColumnKind, RowPlan, Rows, line_end};
use crate::recording::text::clock::Clock;
use crate::recording::text::dialect::Delimiter;

/// A parsed cell: its value, if any, and its end.
type PlainCell = (Option<f64>, usize);

impl Rows {
    /// Parses a row of plain numbers, empty cells, dates and texts, in quotes or not; returns the
    /// start of the next line, or `None` if it needs careful parsing.
    #[inline]
    pub(super) fn plain_row(&mut self, text: &[u8], at: usize, plan: &RowPlan) -> Option<usize> {
        let row = self.count;
        let before = self.stamp_text.len();
        let read = self.plain_cells(text, at, plan);
        if read.is_none() {
            // Undone: the careful parser reads the whole line again.
            for column in &mut self.columns {
                column.values.truncate(row);
            }
            self.stamp_text.truncate(before);
            return None;
        }
        self.note_break(self.line);
        self.count += 1;
        read
    }

    #[inline]
    fn plain_cells(&mut self, text: &[u8], start: usize, plan: &RowPlan) -> Option<usize> {
        // Names need careful parsing.
        if !plan.items.is_empty() {
            return None;
        }
        // A remark begins like a text.
        let begins_with_text = plan.kinds.first() == Some(&ColumnKind::Nothing);
        if begins_with_text && matches!(text.get(start), Some(b'#' | b'%' | b'!' | b'/')) {
            return None;
        }
        let (mut at, mut numbers) = (start, 0);
        for (place, kind) in plan.kinds.iter().enumerate() {
            if place > 0 {
                at = plan.next_cell(text, at)?;
            }
            at = plan.skip_blanks(text, at);
            let is_copied = plan.keeps_stamp_text && plan.stamps == Some(place);
            let is_quoted = plan.is_quoted(text, at);
            at += usize::from(is_quoted);
            let (value, end) = match is_quoted {
                true => plan.quoted_cell(text, at, *kind, is_copied)?,
                false => plan.cell(text, at, *kind, is_copied)?,
            };
            if is_copied {
                self.stamp_text.push(Span::new(at, end - at));
            }
            if let Some(value) = value {
                self.push(place, value);
                numbers += 1;
            }
            at = plan.cell_end(text, end + usize::from(is_quoted))?;
        }
        if numbers == 0 {
            return None;
        }
        plan.row_end(text, at)
    }
}

impl RowPlan {
    #[inline]
    fn cell(&self, text: &[u8], at: usize, kind: ColumnKind, is_copied: bool) -> Option<PlainCell> {
        let decimal = self.dialect.decimal;
        if matches!(kind, ColumnKind::Numbers | ColumnKind::Offset(_)) {
            let number = match kind {
                ColumnKind::Offset(origin) => number::read_after(text, at, decimal, origin),
                _ if is_copied => number::read_nearly(text, at, decimal),
                _ => number::read(text, at, decimal),
            };
            return match number {
                Some((value, end)) => Some((Some(value), end)),
                None => Some((None, at)),
            };
        }
        let end = self.text_end(text, at)?;
        Some((Self::of_text(&text[at..end], kind)?, end))
    }

    /// Whether the cell at `at` is in quotes, which only separated cells can be.
    #[inline]
    fn is_quoted(&self, text: &[u8], at: usize) -> bool {
        matches!(self.dialect.delimiter, Delimiter::Byte(_)) && text.get(at) == Some(&b'"')
    }

    /// A cell whose text begins at `at`, after a quotation mark, up to the next one in the line.
    #[inline]
    fn quoted_cell(
        &self,
        text: &[u8],
        at: usize,
        kind: ColumnKind,
        is_copied: bool,
    ) -> Option<PlainCell> {
        if matches!(kind, ColumnKind::Numbers | ColumnKind::Offset(_)) {
            let (value, end) = self.cell(text, at, kind, is_copied)?;
            return (text.get(end) == Some(&b'"')).then_some((value, end));
        }
        let end = at + memchr::memchr2(b'"', b'\n', &text[at..])?;
        let value = Self::of_text(&text[at..end], kind)?;
        (text[end] == b'"').then_some((value, end))
    }

    /// Value of a date or text without quotes, if it has one.
    #[inline]
    fn of_text(cell: &[u8], kind: ColumnKind) -> Option<Option<f64>> {
        if cell.is_empty() || kind == ColumnKind::Nothing {
            return Some(None);
        }
        let cell = std::str::from_utf8(cell).ok()?.trim();
        let value = match kind {
            ColumnKind::Clock(first) => Clock::parse(cell)?.seconds_after(first),
            ColumnKind::Numbers | ColumnKind::Offset(_) | ColumnKind::Nothing => return None,
        };
        Some(Some(value))
    }

    /// End of a cell without quotes.
    #[inline]
    fn text_end(&self, text: &[u8], at: usize) -> Option<usize> {
        let rest = &text[at..];
        let found = match self.dialect.delimiter {
            Delimiter::Byte(mark) => memchr::memchr3(mark, b'\n', b'"', rest),
            Delimiter::Spaces => memchr::memchr3(b' ', b'\t', b'\n', rest),
            Delimiter::None => memchr::memchr2(b'\n', b'"', rest),
        };
        let mut end = found.map_or(text.len(), |place| at + place);
        if text.get(end) == Some(&b'"') {
            return None;
        }
        while end > at && text[end - 1] == b'\r' {
            end -= 1;
        }
        Some(end)
    }

    /// Start of the text of a cell.
    #[inline]
    fn skip_blanks(&self, text: &[u8], mut at: usize) -> usize {
        let is_spaces = self.dialect.delimiter == Delimiter::Spaces;
        while at < text.len() && (text[at] == b' ' || is_spaces && text[at] == b'\t') {
            at += 1;
        }
        at
    }

    /// Position of the separator or line end after a cell parsed up to `at`.
    #[inline]
    fn cell_end(&self, text: &[u8], at: usize) -> Option<usize> {
        let at = match self.dialect.delimiter {
            Delimiter::Spaces => at,
            Delimiter::Byte(_) | Delimiter::None => self.skip_blanks(text, at),
        };
        match (text.get(at), self.dialect.delimiter) {
            (None | Some(b'\n' | b'\r'), _) => Some(at),
            (Some(byte), Delimiter::Byte(mark)) if *byte == mark => Some(at),
            (Some(b' ' | b'\t'), Delimiter::Spaces) => Some(at),
            _ => None,
        }
    }

    /// Start of the next cell, from the end of the previous one; cells beyond the end of a row are
    /// empty.
    #[inline]
    fn next_cell(&self, text: &[u8], at: usize) -> Option<usize> {
        match text.get(at) {
            None | Some(b'\n' | b'\r') => Some(at),
            Some(_) if self.dialect.delimiter == Delimiter::Spaces => Some(at),
            Some(_) => Some(at + 1),
        }
    }

    /// Start of the next line, from the end of the last wanted cell. After the last column only empty
    /// cells are allowed.
    #[inline]
    pub(in crate::recording::text) fn row_end(&self, text: &[u8], at: usize) -> Option<usize> {
        match text.get(at) {
            None => Some(at),
            Some(b'\n') => Some(at + 1),
            Some(b'\r') if text.get(at + 1) == Some(&b'\n') => Some(at + 2),
            Some(byte) => {
                let is_blank = |byte: &u8| {
                    matches!(byte, b' ' | b'\t' | b'\r' | b'\n')
                        || self.dialect.delimiter == Delimiter::Byte(*byte)
                };
                let end = line_end(text, at);
                let is_last = self.kinds.len() == self.width;
                let good = is_blank(byte) && (!is_last || text[at..end].iter().all(is_blank));
                good.then_some(end)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::blocks::TableEnd;
    use super::*;
    use crate::recording::text::dialect::Dialect;

    /// Careful parsing takes a hundred times as long.
    #[test]
    fn quoted_numbers_need_no_careful_parsing() {
        let dialect = Dialect {
            delimiter: Delimiter::Byte(b','),
            decimal: b'.',
        };
        let plan = RowPlan {
            dialect,
            kinds: vec![
                ColumnKind::Numbers,
                ColumnKind::Nothing,
                ColumnKind::Numbers,
            ],
            width: 3,
            stamps: Some(0),
            keeps_stamp_text: true,
            end: TableEnd::of_marks(&[], dialect),
            items: Vec::new(),
        };
        let read = |text: &str| {
            let mut rows = Rows::default();
            rows.begin(1, 3);
            let end = rows.plain_row(text.as_bytes(), 0, &plan);
            let values = rows.columns.iter().flat_map(|column| column.values.clone());
            end.map(|end| (end, values.collect::<Vec<f64>>(), rows.stamp_text.clone()))
        };
        let text = "\"0.25\",\"run, 2\",-1.5\r\n";
        let found = (text.len(), vec![0.25, -1.5], vec![Span::new(1, 4)]);
        assert_eq!(read(text), Some(found));
        for text in [
            "\"0.25\",\"a \"\"b\"\"\",1\n",
            "\"1,234.5\",,1\n",
            "\"0.25,x,1\n",
        ] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
