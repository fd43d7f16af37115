//! Several clocks in one table: each channel has the one beside it, or the user is asked.

use super::groups::Group;
use super::stamps::{TIME_FACTORS, rises};
use super::{AxisRule, SAME, Sources};
use crate::failure::{ErrorCode, Failure};
use crate::recording::text::units;
use crate::recording::typical_step;

impl Sources<'_> {
    /// Further columns of time: each directly before its channel, and named after it or running otherwise than the
    /// first one.
    pub(super) fn own_times(&self, times: &[usize], used: &[usize]) -> Vec<usize> {
        let Some(first) = used.first().filter(|first| times.contains(first)) else {
            return Vec::new();
        };
        let is_channel = |place: &usize| !times.contains(place) && !self.can_be_time(*place);
        let is_own = |trio: &[usize]| {
            let [before, place, next] = [trio[0], trio[1], trio[2]];
            let is_between = is_channel(&before) && is_channel(&next);
            let mut channels = used.iter().filter(|other| is_channel(other));
            let mut is_of_other = || channels.any(|other| self.is_named_after(place, *other));
            is_between
                && !times.contains(&place)
                && self.runs_like_time(place)
                && (self.is_named_after(place, next)
                    || !is_of_other() && self.is_other_clock(place, *first))
        };
        let trios = used.windows(3).filter(|trio| is_own(trio));
        trios.map(|trio| trio[1]).collect()
    }

    /// Asks which clock applies if a column in a group of channels runs like time, but at another rate than theirs.
    ///
    /// # Errors
    /// If there is one, and neither a time column nor the rate is given.
    pub(super) fn refuse_two_clocks(&self, group: &Group, rule: &AxisRule) -> Result<(), Failure> {
        let is_given = self.reading.time_column.is_some() || self.reading.rate_hz.is_some();
        let Some(rule) = rule.stamps.as_ref().filter(|_| !is_given) else {
            return Ok(());
        };
        let stamps = rule.stamps(self.columns);
        let is_used =
            |place: usize| place == rule.place || rule.parts.is_some_and(|p| p.place == place);
        let differs = |place: usize| {
            let own = self.own_seconds(place);
            let factor = own.or_else(|| {
                self.repeats(place, &[rule.place])
                    .then_some(rule.seconds_per_unit)
            });
            factor.is_some_and(|factor| rates_differ(&stamps, &self.scaled(place, factor)))
        };
        let mut places = group.times.iter().chain(&group.channels).copied();
        let other =
            places.find(|place| !is_used(*place) && self.runs_like_time(*place) && differs(*place));
        let Some(other) = other else {
            return Ok(());
        };
        Err(ErrorCode::TimeUnknown.failed(format_args!(
            "\"{}\" and \"{}\" both run like time, at different rates, and their places do not show which channels \
             each belongs to; give the time of the channel with --time-column",
            rule.heading, self.fields[other].heading
        )))
    }

    /// Whether a column of numbers can be time by its name or unit, and has the steps of time.
    fn runs_like_time(&self, place: usize) -> bool {
        let values = &self.columns[place].values;
        self.can_be_time(place)
            && values.len() > 2
            && rises(values)
            && typical_step(values).is_some()
    }

    fn can_be_time(&self, place: usize) -> bool {
        let field = &self.fields[place];
        let is_numbered_axis = || {
            let stem = field.name.trim_end_matches(|c: char| c.is_ascii_digit());
            field.unit.is_none() && units::is_axis_name(stem)
        };
        let can_be = field.has_time_unit()
            || field.unit.is_none() && units::has_time_word(&field.name)
            || is_numbered_axis();
        can_be && !field.is_label && !self.is_clock(place)
    }

    /// Whether the name of a column of time begins like that of a channel: `Torque_Time` and `Torque`, `A_Time` and
    /// `A_Torque`.
    fn is_named_after(&self, place: usize, channel: usize) -> bool {
        let words = |place: usize| -> Vec<String> {
            let name = self.fields[place].name.to_lowercase();
            let words = name.split(|c: char| !c.is_alphanumeric());
            words.filter(|w| !w.is_empty()).map(str::to_owned).collect()
        };
        let mut own = words(place);
        own.retain(|word| !units::is_time_name(word) && !units::is_axis_name(word));
        place != channel && !own.is_empty() && words(channel).starts_with(&own)
    }

    /// Whether a column of time, fine enough for its rows, has another rate or start than another one.
    fn is_other_clock(&self, place: usize, first: usize) -> bool {
        let pairs = self.columns[place].values.windows(2);
        // Hours of operation stay the same for many rows.
        if 2 * pairs.filter(|pair| pair[0] == pair[1]).count() > self.columns[place].values.len() {
            return false;
        }
        let of_first = match self.is_clock(first) {
            true => Some(1.0),
            false => self.own_seconds(first),
        };
        let known = self.own_seconds(place).zip(of_first);
        let stamps = self.scaled(first, known.map_or(1.0, |(_, first)| first));
        let Some((factor, _)) = known else {
            let differs = |factor| rates_differ(&stamps, &self.scaled(place, factor));
            return TIME_FACTORS
                .iter()
                .all(|factor| differs(*factor) && differs(1.0 / factor));
        };
        let own = self.scaled(place, factor);
        let step = typical_step(&own).unwrap_or(f64::INFINITY);
        let of_first = self.origin(first) * known.map_or(1.0, |(_, first)| first);
        let origins = self.origin(place) * factor - of_first;
        rates_differ(&stamps, &own) || (own[0] - stamps[0] + origins).abs() > step / 2.0
    }

    /// Seconds per unit of a column by its heading.
    pub(super) fn own_seconds(&self, place: usize) -> Option<f64> {
        let field = &self.fields[place];
        let unit = field.unit.as_ref().filter(|unit| unit.is_time());
        units::scaled_time(&field.heading).or(unit.map(|unit| unit.unit.factor()))
    }

    fn scaled(&self, place: usize, factor: f64) -> Vec<f64> {
        let values = self.columns[place].values.iter();
        values.map(|value| value * factor).collect()
    }
}

/// Whether two columns of time run at different rates, beyond their rounding, by their usual steps and as a whole.
fn rates_differ(one: &[f64], other: &[f64]) -> bool {
    let steps = [one, other].map(|stamps| typical_step(stamps).unwrap_or(0.0));
    let coarse = steps[0].max(steps[1]);
    let rows = one.iter().zip(other);
    let mut known = rows.filter(|(a, b)| a.is_finite() && b.is_finite());
    let (Some(start), Some(end)) = (known.next(), known.next_back()) else {
        return false;
    };
    let lengths = [end.0 - start.0, end.1 - start.1];
    let differs = |pair: [f64; 2], allowed: f64| {
        (pair[0] - pair[1]).abs() > SAME * pair[0].max(pair[1]) + allowed
    };
    differs(steps, 0.0) && differs(lengths, coarse)
}
