//! Columns of counts and of sources, which show that rows are missing or belong to several signals.

use torqcomp_decimal::digits;

use super::Sources;
use crate::print::{enumeration, short};
use crate::recording::text::units;
use crate::warning::{Warning, WarningCode};

/// Minimum number of rows.
const ROWS: usize = 40;
/// Maximum number of sources in turn.
const MOST_SOURCES: usize = 16;
/// Words in the heading of a column that names the source of a row.
const SOURCES: [&str; 8] = [
    "id", "joint", "axis", "sensor", "channel", "node", "address", "source",
];

/// A column that counts the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct RowCounter {
    pub(super) place: usize,
    heading: String,
    first: f64,
    /// The number before its first jump in the first rows.
    before_jump: Option<f64>,
}

impl RowCounter {
    /// A warning if it has counted more rows than there are, up to its number in the last one: a given rate hides that.
    pub(super) fn warning(&self, last: f64, rows: usize) -> Option<Warning> {
        let missing = last - self.first + 1.0 - rows as f64;
        let after = self
            .before_jump
            .map(|before| format!(", first after {}", short(before)));
        (missing >= 1.0).then(|| {
            WarningCode::CounterJumps.warning(format!(
                "\"{}\" counts from {} to {} in {rows} rows: it jumps{}, {} missing, and at a constant rate all that \
                 follows is too early; select a part without jumps with --range, or write the count divided by the rate \
                 into a column of time, and give --fill in place of --rate",
                self.heading,
                digits::text(self.first, 15),
                digits::text(last, 15),
                after.unwrap_or_default(),
                match missing as usize {
                    1 => "1 row is".to_owned(),
                    missing => format!("{missing} rows are"),
                },
            ))
        })
    }
}

impl Sources<'_> {
    /// The column that counts the rows, if no column gives the time: `times` are those that do.
    pub(super) fn row_counter(&self, used: &[usize], times: &[usize]) -> Option<RowCounter> {
        let place = *used.first().filter(|_| times.is_empty())?;
        let field = &self.fields[place];
        let is_named = units::is_index_name(&field.name) || units::is_axis_name(&field.name);
        let values = &self.columns[place].values;
        if !is_named || field.unit.is_some() || values.len() < ROWS || used.len() < 2 {
            return None;
        }
        let steps = || values.windows(2).map(|pair| pair[1] - pair[0]);
        let counts =
            values[0].fract() == 0.0 && steps().all(|step| step >= 1.0 && step.fract() == 0.0);
        let jumps = || values.iter().zip(steps()).filter(|(_, step)| *step > 1.0);
        (counts && 2 * jumps().count() < values.len()).then(|| RowCounter {
            place,
            heading: field.heading.clone(),
            first: values[0] + self.origin(place),
            before_jump: jumps().next().map(|(value, _)| value + self.origin(place)),
        })
    }

    /// A warning about a column that names the source of each row and cycles: every other column has the samples of several
    /// signals in turn.
    pub(super) fn sources_in_turn(&self, used: &[usize]) -> Option<Warning> {
        let (place, sources) = used
            .iter()
            .find_map(|place| Some((*place, self.cycle(*place)?)))?;
        let values: Vec<String> = sources.iter().map(|value| short(*value)).collect();
        Some(WarningCode::TwoSignals.warning(format!(
            "\"{}\" cycles through {} row by row: the rows belong to {} sources in turn, and every other column mixes \
             their signals; split the file by this column, and give the rows of one source",
            self.fields[place].heading,
            enumeration(&values, "and"),
            sources.len()
        )))
    }

    /// The different whole numbers through which a column cycles.
    fn cycle(&self, place: usize) -> Option<Vec<f64>> {
        let name = self.fields[place].name.to_lowercase();
        let mut words = name.split(|c: char| !c.is_alphanumeric());
        let is_source = words.any(|word| SOURCES.contains(&word));
        let values = &self.columns[place].values;
        if !is_source || values.len() < ROWS {
            return None;
        }
        let count = 1 + values[1..].iter().position(|value| *value == values[0])?;
        let sources = &values[..count];
        let is_whole = sources.iter().all(|value| value.fract() == 0.0);
        let are_different = (1..count).all(|k| !sources[..k].contains(&sources[k]));
        let cycles = values.iter().zip(&values[count..]).all(|(a, b)| a == b);
        let is_cycle = (2..=MOST_SOURCES).contains(&count) && is_whole && are_different && cycles;
        is_cycle.then(|| sources.to_vec())
    }
}
