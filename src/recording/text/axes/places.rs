//! Which columns hold time, and which only count.

use super::stamps::seconds_of_step;
use super::{Sources, is_counting};
use crate::failure::Failure;
use crate::io::csv::time_column;
use crate::recording::text::header::Field;
use crate::recording::text::units;
use crate::recording::typical_step;

/// Fewest rows of a first column without a name that rises steadily for it to be taken for time.
const STEADY_ROWS: usize = 8;

/// Columns of time, and what was taken for granted about them.
pub(super) struct TimePlaces {
    pub(super) times: Vec<usize>,
    pub(super) assumed: Option<String>,
}

impl TimePlaces {
    fn sure(times: Vec<usize>) -> Self {
        Self {
            times,
            assumed: None,
        }
    }
}

impl Sources<'_> {
    /// The columns of time: the one the user names, those named as time, the one with a unit of time,
    /// or a first column that can be nothing else.
    pub(super) fn time_places(&self, used: &[usize]) -> Result<TimePlaces, Failure> {
        if self.options.time_column.is_some() {
            let columns: Vec<crate::io::csv::Column> = self
                .fields
                .iter()
                .map(|field| crate::io::csv::Column {
                    heading: field.heading.clone(),
                    name: field.name.clone(),
                    unit: field.unit.clone(),
                })
                .collect();
            let place = time_column(&columns, self.options)?;
            return Ok(TimePlaces::sure(place.into_iter().collect()));
        }
        let field = |place: usize| &self.fields[place];
        let named: Vec<usize> = used
            .iter()
            .copied()
            .filter(|place| {
                field(*place).is_label || field(*place).is_named_time() || self.is_clock(*place)
            })
            .collect();
        if !named.is_empty() {
            return Ok(TimePlaces::sure(named));
        }
        let by_unit: Vec<usize> = used
            .iter()
            .copied()
            .filter(|p| field(*p).has_time_unit())
            .collect();
        match (by_unit.as_slice(), used.first()) {
            ([first, ..], Some(first_used)) if first == first_used => {
                return Ok(TimePlaces::sure(vec![*first]));
            }
            ([one], _) => return Ok(TimePlaces::sure(vec![*one])),
            _ => {}
        }
        Ok(self.unnamed_time(used))
    }

    /// A first column called X, or one without a heading whose values rise steadily.
    fn unnamed_time(&self, used: &[usize]) -> TimePlaces {
        let Some(&first) = used.first().filter(|_| used.len() > 1) else {
            return TimePlaces::sure(Vec::new());
        };
        let values = &self.columns[first].values;
        let field = &self.fields[first];
        if units::is_axis_name(&field.name) && field.unit.is_none() && !is_counting(values) {
            return TimePlaces::sure(vec![first]);
        }
        if used.iter().any(|place| !self.is_unnamed(*place)) {
            return TimePlaces::sure(Vec::new());
        }
        // A first column may count the samples, and the second be the time.
        let second = used.get(1).copied().filter(|_| is_counting(values));
        if let Some(second) = second.filter(|second| self.is_of_header_rate(*second)) {
            return TimePlaces::sure(vec![second]);
        }
        let steady = values.len() >= STEADY_ROWS
            && values.windows(2).all(|pair| pair[1] > pair[0])
            && typical_step(values).is_some()
            && !is_counting(values);
        if !steady {
            return TimePlaces::sure(Vec::new());
        }
        let assumed = format!(
            "column {} has no heading but rises steadily: it was taken for the time",
            first + 1
        );
        // Each channel may have the same time before it.
        let is_same = |place: &usize| self.columns[*place].values == *values;
        TimePlaces {
            times: used.iter().copied().filter(is_same).collect(),
            assumed: Some(assumed).filter(|_| !self.is_of_header_rate(first)),
        }
    }

    fn is_unnamed(&self, place: usize) -> bool {
        self.fields[place].heading == Field::unnamed(place).heading
    }

    /// Whether the steps of a column are those of the rate in the head, in seconds or parts of them.
    fn is_of_header_rate(&self, place: usize) -> bool {
        let step = typical_step(&self.columns[place].values);
        match (step, self.header_rate(None)) {
            (Some(step), Some((_, hz))) => seconds_of_step(step, hz).is_some(),
            _ => false,
        }
    }

    pub(super) fn is_clock(&self, place: usize) -> bool {
        self.columns[place].first_clock.is_some()
    }

    /// Whether a column only counts the samples.
    pub(super) fn is_index(&self, place: usize, used: &[usize]) -> bool {
        let field = &self.fields[place];
        let is_first = used.first() == Some(&place);
        // `NO.` may stand in the row of units.
        let is_numbered = is_first && field.unit_text.as_deref().is_some_and(units::is_index_name);
        let is_named = units::is_index_name(&field.name) || field.is_label || is_numbered;
        // Without a heading it counts where the others have one, or where the head gives the rate.
        let may_count = || {
            units::is_axis_name(&field.name)
                || self.is_unnamed(place)
                    && (used.iter().any(|other| !self.is_unnamed(*other))
                        || self.header_rate(None).is_some())
        };
        is_counting(&self.columns[place].values)
            && (field.unit.is_none() || self.is_unnamed(place))
            && (is_named || is_first && may_count())
            && used.len() > 1
    }
}
