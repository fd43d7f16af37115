//! The rows of a long table behind those that are kept: read, summed up and forgotten.

use torqcomp_dsp::quality::sums::SampleSums;

use super::axes::Role;
use super::rows::{LineNotes, RowPlan, Rows};
use super::sparse;
use super::table::Layout;
use crate::failure::Failure;
use crate::recording::{AllSamples, Channel};

/// What all rows of a table come to, of which only the first are kept.
pub struct Tail {
    /// Those of a piece.
    rows: Rows,
    /// Rows before the piece.
    before: usize,
    notes: LineNotes,
    columns: Vec<ColumnSums>,
}

/// What the values of a column come to.
#[derive(Debug, Clone, Copy, Default)]
struct ColumnSums {
    sums: SampleSums,
    /// Whether it is slower than the rows: its empty cells are no samples.
    is_slow: bool,
    /// Rows up to the last that had a value.
    filled: usize,
    first: Option<f64>,
    last: Option<f64>,
}

impl ColumnSums {
    /// Adds the values of rows that follow `before` others.
    fn add(&mut self, values: &[f64], before: usize) {
        if values.is_empty() {
            return;
        }
        if !self.is_slow {
            (self.filled..before).for_each(|_| self.sums.add(f64::NAN));
        }
        let is_slow = self.is_slow;
        let samples = values.iter().filter(|value| !is_slow || value.is_finite());
        samples.for_each(|value| self.sums.add(*value));
        self.filled = before + values.len();
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        self.first = self.first.or_else(|| finite().next());
        self.last = finite().next_back().or(self.last);
    }
}

impl Tail {
    /// What follows rows that are kept.
    pub fn behind(kept: &Rows, layout: &Layout) -> Self {
        let columns = kept.columns.iter().map(|column| {
            let mut sums = ColumnSums {
                is_slow: sparse::is_slow(column),
                ..ColumnSums::default()
            };
            sums.add(&column.values, 0);
            sums
        });
        let mut rows = Rows::default();
        rows.begin(kept.line, layout.plan.kinds.len());
        Self {
            columns: columns.collect(),
            rows,
            before: kept.count,
            notes: LineNotes::default(),
        }
    }

    /// Number of the next line.
    pub fn line(&self) -> usize {
        self.rows.line
    }

    /// What should be known of the lines.
    pub fn notes(&self) -> &LineNotes {
        &self.notes
    }

    /// Reads the lines of a piece; returns the bytes read.
    ///
    /// # Errors
    /// Rows of too different lengths.
    pub fn read(&mut self, text: &[u8], plan: &RowPlan) -> Result<usize, Failure> {
        let line = self.rows.line;
        self.rows.begin(line, plan.kinds.len());
        let end = self.rows.read(text, plan)?;
        for (sums, column) in self.columns.iter_mut().zip(&self.rows.columns) {
            sums.add(&column.values, self.before);
        }
        self.before += self.rows.count;
        self.notes.join(&self.rows.notes, 0);
        Ok(end)
    }

    /// What all samples of each channel of the kept rows come to.
    pub fn of_channels(&self, layout: &Layout, kept: &[Channel]) -> Vec<Option<AllSamples>> {
        let roles = layout.axes.roles.iter().enumerate();
        let places = roles.filter_map(|(place, role)| match role {
            Role::Channel(rule) => Some((place, *rule)),
            _ => None,
        });
        let of = |((place, rule), channel): ((usize, usize), &Channel)| {
            let sums = self.columns[place].sums;
            let stamps = layout.axes.rules[rule].stamps.as_ref();
            let stamps = stamps.filter(|rule| rule.is_of_one_cell() && !rule.is_time_of_day);
            let by_stamps = stamps.and_then(|rule| {
                let ends = &self.columns[rule.place];
                Some((ends.last? - ends.first?) * rule.seconds_per_unit)
            });
            let by_rate = || Some((sums.samples.checked_sub(1)?) as f64 / channel.axis.rate_hz?);
            Some(AllSamples {
                duration_s: by_stamps.or_else(by_rate),
                sums,
            })
        };
        places.zip(kept).map(of).collect()
    }
}
