//! Detection of time columns and index columns.

use super::stamps::seconds_of_step;
use super::{Sources, is_counting};
use crate::failure::Failure;
use crate::recording::choice::{Label, choose};
use crate::recording::text::clock::EPOCH_S;
use crate::recording::text::header::Field;
use crate::recording::text::rows::ColumnKind;
use crate::recording::text::units;
use crate::recording::{falls, typical_step};

/// Minimum number of steadily rising rows for an unnamed first column to be time.
const STEADY_ROWS: usize = 8;

/// Time columns, and assumptions about them.
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
    /// The time columns: the one named by the user, those named like time, the one with a unit of
    /// time, or a first column that can be nothing else.
    pub(super) fn time_places(&self, used: &[usize]) -> Result<TimePlaces, Failure> {
        if let Some(wanted) = &self.reading.time_column {
            let place = self.given_time(wanted)?;
            let parts = self.parts_of(place).map(|parts| parts.place);
            let mut times: Vec<usize> = [place].into_iter().chain(parts).collect();
            times.sort_unstable();
            return Ok(TimePlaces::sure(times));
        }
        let field = |place: usize| &self.fields[place];
        let named: Vec<usize> = used
            .iter()
            .copied()
            .filter(|place| {
                field(*place).is_label
                    || field(*place).is_named_time()
                    || self.is_clock(*place)
                    || self.is_after_t(*place, used)
            })
            .collect();
        let rising = self.told_by_values(&named, used);
        if !rising.is_empty() {
            return Ok(TimePlaces::sure(rising));
        }
        // Rows in reverse order.
        let mut reversed = named.into_iter();
        if let Some(place) = reversed.find(|place| falls(&self.columns[*place].values)) {
            return Ok(TimePlaces::sure(vec![place]));
        }
        let by_unit: Vec<usize> = used
            .iter()
            .copied()
            .filter(|p| field(*p).has_time_unit() && mostly_rises(&self.columns[*p].values))
            .collect();
        match (by_unit.as_slice(), used.first()) {
            ([first, ..], Some(first_used)) if first == first_used => {
                return Ok(TimePlaces::sure(vec![*first]));
            }
            ([one], _) => return Ok(TimePlaces::sure(vec![*one])),
            _ => {}
        }
        let axis = self.unnamed_time(used);
        if axis.times.is_empty() {
            return Ok(TimePlaces::sure(self.weakly_named(used)));
        }
        Ok(axis)
    }

    /// The column named by the user, also by its number among all columns.
    fn given_time(&self, wanted: &str) -> Result<usize, Failure> {
        let label = |field| Field::label(field);
        let labels: Vec<Label> = self.fields.iter().map(label).collect();
        choose(&labels, Some(wanted), "--time-column")
    }

    /// Whether a column is called `t2` where the first is `t`.
    fn is_after_t(&self, place: usize, used: &[usize]) -> bool {
        let field = &self.fields[place];
        let is_first_t = || {
            used.first()
                .is_some_and(|first| self.fields[*first].name == "t")
        };
        units::is_weak_time_name(&field.name)
            && field.name.starts_with('t')
            && field.unit.is_none()
            && is_first_t()
    }

    /// Among the columns named like time, those whose values rise like time, and of these the
    /// different formats of the first one's time and its repetitions before other channels.
    fn told_by_values(&self, named: &[usize], used: &[usize]) -> Vec<usize> {
        let mut times: Vec<usize> = Vec::new();
        let mut first_block = 0;
        for place in named.iter().copied() {
            let before = used.iter().rev().find(|p| **p < place).copied();
            let before = before.filter(|before| times.last() == Some(before));
            let is_time = self.fields[place].is_label
                || self.is_clock(place)
                || mostly_rises(&self.columns[place].values)
                || before.is_some_and(|before| self.is_part(place, before));
            let fits =
                before.is_some() || times.is_empty() || self.repeats(place, &times[..first_block]);
            if is_time && fits {
                times.push(place);
                if before.is_some() && first_block + 1 == times.len() || times.len() == 1 {
                    first_block = times.len();
                }
            }
        }
        times
    }

    /// Whether a time column is named like one of the first: by the same word, or both are dates.
    pub(super) fn repeats(&self, place: usize, first: &[usize]) -> bool {
        let stem = |place: usize| units::time_stem(&self.fields[place].name);
        first.iter().any(|other| {
            self.fields[place].name == self.fields[*other].name
                || self.fields[place].is_label && self.fields[*other].is_label
                || self.is_clock(place) && self.is_clock(*other)
                || stem(place).is_some() && stem(place) == stem(*other)
        })
    }

    /// Whether a falling column contains the fractional seconds of the preceding column.
    fn is_part(&self, place: usize, whole: usize) -> bool {
        let whole = &self.columns[whole];
        let are_whole = || whole.values.iter().all(|value| value.fract() == 0.0);
        let (parts, origin) = (&self.columns[place].values, self.origin(place));
        let is_part = |part: &f64| origin + part >= 0.0 && part.fract() == 0.0;
        are_whole() && parts.iter().all(is_part)
    }

    /// A first column named like time or temperature, if no other is time and it always rises, and
    /// similar columns before further channels.
    fn weakly_named(&self, used: &[usize]) -> Vec<usize> {
        let is_weak = |place: usize| {
            let field = &self.fields[place];
            units::is_weak_time_name(&field.name) && field.unit.is_none()
        };
        let rises = |place: usize| {
            let values = &self.columns[place].values;
            values.len() > 2 && values.windows(2).all(|pair| pair[1] > pair[0])
        };
        let is_time = |place: usize| is_weak(place) && rises(place);
        let counts = |place: &usize| self.is_index(*place, used);
        match used {
            [first, ..] if is_time(*first) => {}
            // After an index column, T is a temperature, but t1 a time.
            [index, first, ..]
                if counts(index)
                    && is_time(*first)
                    && self.fields[*first].name.starts_with('t') =>
            {
                return vec![*first];
            }
            _ => return Vec::new(),
        }
        let stands_alone = |rank: usize| rank == 0 || !is_weak(used[rank - 1]);
        (0..used.len())
            .filter(|rank| is_time(used[*rank]) && stands_alone(*rank))
            .map(|rank| used[rank])
            .collect()
    }

    /// A first column called X, or one without a heading whose values rise steadily.
    fn unnamed_time(&self, used: &[usize]) -> TimePlaces {
        let Some(&first) = used.first().filter(|_| used.len() > 1) else {
            return TimePlaces::sure(Vec::new());
        };
        let values = &self.columns[first].values;
        if used.starts_with(&[0, 1]) && self.parts_of(0).is_some() {
            return TimePlaces::sure(vec![0, 1]);
        }
        let field = &self.fields[first];
        let is_axis = units::is_axis_name(&field.name) && field.unit.is_none();
        if is_axis && !is_counting(values) && mostly_rises(values) {
            return TimePlaces::sure(vec![first]);
        }
        if used.iter().any(|place| !self.is_unnamed(*place)) {
            return TimePlaces::sure(Vec::new());
        }
        // A first column may be an index, and the second the time.
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
            "column {} has no heading but rises steadily: it was assumed to be the time",
            first + 1
        );
        // Each channel may be preceded by the same time.
        let is_same = |place: &usize| self.columns[*place].values == *values;
        TimePlaces {
            times: used.iter().copied().filter(is_same).collect(),
            assumed: Some(assumed).filter(|_| !self.is_of_header_rate(first)),
        }
    }

    fn is_unnamed(&self, place: usize) -> bool {
        self.fields[place].heading == Field::unnamed(place).heading
    }

    /// Whether the steps of a column match the header rate, in seconds or fractions of them.
    fn is_of_header_rate(&self, place: usize) -> bool {
        let step = typical_step(&self.columns[place].values);
        match (step, self.header_rate(None)) {
            (Some(step), Some((_, hz))) => seconds_of_step(step, hz).is_some(),
            _ => false,
        }
    }

    /// Seconds per unit of the first two columns of a table without headings that begins with the whole seconds since
    /// 1970 and their nanoseconds, as written by `ros2 topic echo --csv`.
    pub(super) fn stamp_without_heading(&self, place: usize) -> Option<f64> {
        let (seconds, nanoseconds) = (self.columns.first()?, self.columns.get(1)?);
        let is_epoch = EPOCH_S.contains(&(self.origin(0) + seconds.values.first()?));
        let origin = self.origin(1);
        let are_nanoseconds = nanoseconds.values.iter().any(|part| origin + part >= 1e6);
        let is_stamp = is_epoch && are_nanoseconds && self.is_unnamed(0) && self.is_unnamed(1);
        [1.0, 1e-9].get(place).copied().filter(|_| is_stamp)
    }

    pub(super) fn is_clock(&self, place: usize) -> bool {
        matches!(self.kinds[place], ColumnKind::Clock(_))
    }

    /// Whether a first column without a heading, among others with one, contains rising integers: the row labels of a
    /// data frame from which some rows were removed.
    pub(super) fn is_row_label(&self, place: usize, used: &[usize]) -> bool {
        let values = &self.columns[place].values;
        let name = &self.fields[place].name;
        used.first() == Some(&place)
            && (self.is_unnamed(place) || name.starts_with("Unnamed: "))
            && used.iter().any(|other| !self.is_unnamed(*other))
            && values.windows(2).all(|pair| pair[1] > pair[0])
            && values.iter().all(|value| value.fract() == 0.0)
    }

    /// Whether a column only counts the samples.
    pub(super) fn is_index(&self, place: usize, used: &[usize]) -> bool {
        let field = &self.fields[place];
        let is_first = used.first() == Some(&place);
        // `NO.` may be in the row of units.
        let is_numbered = is_first && field.unit_text.as_deref().is_some_and(units::is_index_name);
        let is_named = units::is_index_name(&field.name) || field.is_label || is_numbered;
        // Without a heading it is an index if the others have one, or if the header gives the rate.
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

/// Whether values rise or stay like stamps: all but one in ten steps, or all but one. A clock that was
/// occasionally set back or restarted is still a clock.
fn mostly_rises(values: &[f64]) -> bool {
    let falls = values.windows(2).fold(0_usize, |falls, pair| {
        falls + usize::from(pair[1] < pair[0])
    });
    falls <= 1 || 10 * falls < values.len()
}
