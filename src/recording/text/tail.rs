//! Rows of a long table after those that are kept: read, added to the statistics and dropped.

use torqcomp_dsp::quality::sums::SampleSums;

use super::axes::Role;
use super::rows::{LineNotes, RowPlan, Rows};
use super::sparse;
use super::table::Layout;
use crate::failure::Failure;
use crate::recording::{AllSamples, Channel};

/// Statistics of all rows of a table of which only the first are kept.
pub struct Tail {
    /// Rows of a piece.
    rows: Rows,
    /// Number of rows before the piece.
    before: usize,
    notes: LineNotes,
    columns: Vec<ColumnSums>,
}

/// Statistics of a column.
#[derive(Debug, Clone, Copy, Default)]
struct ColumnSums {
    sums: SampleSums,
    /// Whether it is slower than the rows, so that its empty cells are not samples.
    is_slow: bool,
    /// Number of rows up to the last with a value.
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
    /// Statistics starting with the rows that are kept.
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

    /// Notes about the lines.
    pub fn notes(&self) -> &LineNotes {
        &self.notes
    }

    /// Reads the lines of a piece; returns the number of bytes consumed.
    ///
    /// # Errors
    /// Rows of very different lengths.
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

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.before
    }

    /// Last value of a column.
    pub fn last(&self, place: usize) -> Option<f64> {
        self.columns[place].last
    }

    /// Statistics of all samples of each channel of the kept rows.
    pub fn of_channels(&self, layout: &Layout, kept: &[Channel]) -> Vec<Option<AllSamples>> {
        let roles = layout.axes.roles.iter().enumerate();
        let places = roles.filter_map(|(place, role)| match role {
            Role::Channel(rule) => Some((place, *rule)),
            _ => None,
        });
        let of = |((place, rule), channel): ((usize, usize), &Channel)| {
            let sums = self.columns[place].sums;
            let stamps = layout.axes.rules[rule].stamps.as_ref();
            let stamps = stamps.filter(|rule| rule.is_of_one_cell() && rule.period_s.is_none());
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
