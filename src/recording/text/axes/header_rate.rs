//! The sampling rate that is given above a table.

use super::{SAME, Sources};
use crate::print::short;
use crate::recording::text::keys::{self, HeaderEntry, Topic};

/// Intervals from which on a number without a unit may be in milliseconds.
const LONG_S: f64 = 0.1;

impl Sources<'_> {
    /// Header rate for a column (or for all), and the words that give it.
    pub(super) fn header_rate(&self, place: Option<usize>) -> Option<(String, f64)> {
        // The frequency of a signal may precede the rate.
        let is_vague = |entry: &&HeaderEntry| keys::is_vague(&entry.key);
        let clear = self.entries.iter().filter(|entry| !is_vague(entry));
        clear
            .chain(self.entries.iter().filter(is_vague))
            .find_map(|entry| {
                let filled = entry.values.iter().filter(|v| !v.is_empty()).count();
                let own = place
                    .and_then(|place| place.checked_sub(1))
                    .filter(|_| filled > 1)
                    .and_then(|value| keys::rate_hz(entry, Some(value), self.decimal));
                let hz = own.or_else(|| keys::rate_hz(entry, None, self.decimal))?;
                Some((entry.key.clone(), hz))
            })
    }

    /// Why that rate may be another than the one of the samples, if nothing but the header gives it.
    pub(super) fn doubt_of_header(&self, words: &str, hz: f64) -> Option<String> {
        let taken = format!("\"{words}\" above the table was taken for the sampling rate");
        if keys::topic(words) == Some(Topic::Rate) && keys::is_vague(words) {
            return Some(format!("{taken}, but may be about the signal"));
        }
        let mut split = self.entries.iter().filter(|e| e.is_number_split);
        if let Some(entry) = split.find(|entry| entry.key == words) {
            return Some(format!(
                "{taken}, {} Hz, but \"{}\" in line {} may be one number",
                short(hz),
                entry.values.join(","),
                entry.line
            ));
        }
        let clear = self.entries.iter().filter(|e| !keys::is_vague(&e.key));
        let mut rates = clear.filter_map(|e| Some((e, keys::rate_hz(e, None, self.decimal)?)));
        if let Some((entry, other)) = rates.clone().find(|(_, r)| (r - hz).abs() > SAME * hz) {
            return Some(format!(
                "{taken}, {} Hz, but \"{}\" in line {} says {} Hz",
                short(hz),
                entry.key,
                entry.line,
                short(other)
            ));
        }
        if keys::is_of_others(words) {
            return Some(format!(
                "{taken}, but may be the rate of all channels together, or before some samples are left out"
            ));
        }
        let mut thinned = self.entries.iter().filter(|e| keys::is_thinning(&e.key));
        let thinned = thinned.find_map(|entry| {
            let (count, _) = keys::quantity(entry.value()?, self.decimal)?;
            (count > 1.0).then_some((entry, count))
        });
        if let Some((entry, count)) = thinned {
            return Some(format!(
                "{taken}, but \"{}\" in line {} is {}",
                entry.key,
                entry.line,
                short(count)
            ));
        }
        let bare = rates.find(|(e, _)| e.key == words && e.topic() == Some(Topic::Interval));
        let (entry, _) =
            bare.filter(|(e, _)| LONG_S * hz <= 1.0 && !keys::has_unit(e, self.decimal))?;
        Some(format!(
            "\"{}\" above the table has no unit and was taken for {} s",
            entry.key,
            short(1.0 / hz)
        ))
    }
}
