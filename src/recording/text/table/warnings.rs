//! Warnings about the reading of a table.

use super::Layout;
use crate::print::plural;
use crate::recording::text::keys::{HeaderEntry, Topic, quantity};
use crate::recording::text::rows::LineNotes;
use crate::recording::text::vocabulary::has;
use crate::warning::{Warning, WarningCode};

impl Layout {
    /// Warnings about its lines and assumptions; `rows` is their number.
    pub fn warnings(&self, notes: &LineNotes, rows: usize) -> Vec<Warning> {
        let mut warnings: Vec<Warning> =
            of_lines(notes, notes.zeros + self.zeros_above, self.line + rows);
        warnings.extend(self.assumptions());
        warnings.extend(self.unassigned_headings());
        warnings.extend(self.axes.warnings.iter().cloned());
        warnings.extend(self.count_differs(rows));
        warnings.extend(self.unapplied_factor());
        warnings
    }

    fn assumptions(&self) -> Vec<Warning> {
        let rules = self.axes.rules.iter();
        let mut said: Vec<&str> = rules.filter_map(|rule| rule.assumed()).collect();
        said.dedup();
        let confirm = "confirm it with --time-column and --time-unit, or give --rate HZ";
        said.into_iter()
            .map(|text| WarningCode::TimeAssumed.warning(format!("{text}; {confirm}")))
            .collect()
    }

    /// A warning if the line above the rows cannot name the columns.
    fn unassigned_headings(&self) -> Option<Warning> {
        let line = self.header.unassigned?;
        let columns = plural(self.header.fields.len(), "column");
        let message = format!(
            "line {line} has more words than the {columns} below it, so they have no names; write headings without spaces, \
             their units as in \"Torque [Nm]\", or separate all cells by tabs or commas"
        );
        Some(WarningCode::UnassignedHeadings.warning(message))
    }

    /// A warning if a line above whole numbers gives a factor for them.
    fn unapplied_factor(&self) -> Option<Warning> {
        let decimal = self.plan.dialect.decimal;
        let is_scale = |text: &String| {
            quantity(text, decimal).is_some_and(|(factor, _)| factor != 1.0 && factor != 0.0)
        };
        let is_factor = |entry: &&HeaderEntry| {
            let letters = entry
                .key
                .to_lowercase()
                .replace(|c: char| !c.is_alphabetic(), "");
            has("factors", &letters) && entry.values.iter().any(is_scale)
        };
        let entry = self.header.entries.iter().find(is_factor)?;
        let are_whole = self.channel_places().any(|place| {
            let values = &self.first_rows.columns[place].values;
            !values.is_empty() && values.iter().all(|value| value.fract() == 0.0)
        });
        are_whole.then(|| {
            WarningCode::ScaleInHeading.warning(format!(
                "line {} gives a factor, \"{}\" {}, which was not applied to the whole numbers below it; if it should be, \
                 scale the column and remove that line",
                entry.line,
                entry.key,
                entry.values.join(", ")
            ))
        })
    }

    /// A warning if the number of samples in the header differs from the number of rows.
    fn count_differs(&self, rows: usize) -> Option<Warning> {
        let mut entries = self.header.entries.iter();
        let entry = entries.find(|entry| entry.topic() == Some(Topic::Count))?;
        let (said, _) = quantity(entry.value()?, self.plan.dialect.decimal)?;
        let is_count = said.fract() == 0.0 && said >= 2.0;
        (is_count && said != rows as f64).then(|| {
            WarningCode::SampleCount.warning(format!(
                "the header gives \"{}\" {said}, but there are {rows} rows",
                entry.key
            ))
        })
    }
}

fn of_lines(notes: &LineNotes, zeros: usize, end: usize) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if zeros > 0 {
        warnings.push(WarningCode::ZeroBytes.warning(format!(
            "{} in the text skipped",
            plural(zeros, "zero byte")
        )));
    }
    // A last word such as EOF, after all rows, is not a fault.
    let is_footer = |line: usize, text: &str| {
        notes.odd_count == 1 && line >= end && !text.chars().any(|c| c.is_ascii_digit())
    };
    let odd = notes.odd.as_ref();
    if let Some((line, text)) = odd.filter(|(line, text)| !is_footer(*line, text)) {
        warnings.push(WarningCode::LinesSkipped.warning(format!(
            "{} between the rows skipped, not rows of numbers; the first is line {line}: \"{text}\"",
            plural(notes.odd_count, "line")
        )));
    }
    if notes.moved > 0 {
        warnings.push(WarningCode::ItemsMove.warning(format!(
            "in {} the items of a list are in a different order from the first; they were tracked by their names",
            plural(notes.moved, "row")
        )));
    }
    if let Some(line) = notes.too_wide {
        warnings.push(WarningCode::ExtraCells.warning(format!(
            "line {line} has more cells than there are columns; the extra cells were skipped"
        )));
    }
    warnings
}
