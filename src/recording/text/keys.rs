//! What the lines above a table say, as keys with values: rate, start, date, number of samples.

use super::cell::Cell;
use super::clock::Clock;
use super::units;
use crate::io::csv::{Delimiter, Dialect};

/// A line with a key and values.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Number of the line in the file.
    pub line: usize,
    /// The key, without colon, equals sign and quotes.
    pub key: String,
    /// Cells after it, as many as there are, empty ones too.
    pub values: Vec<String>,
}

/// What a key is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topic {
    /// Samples a second.
    Rate,
    /// Time between samples.
    Interval,
    /// Time of the first sample.
    Start,
    /// Date or time of day of the record.
    Date,
    /// Number of samples.
    Count,
    /// Unit of the channels.
    Unit,
    /// Unit of the horizontal axis.
    AxisUnit,
    /// Names of the channels.
    Name,
}

/// Keys that are about something exactly, in lower case without brackets.
const EXACT: [(&str, Topic); 82] = [
    ("horizontalleft", Topic::Start),
    ("horizontalresolutionpp", Topic::Interval),
    ("horz_units", Topic::AxisUnit),
    ("vert_units", Topic::Unit),
    ("signal", Topic::Name),
    ("vertical unit(s)", Topic::Unit),
    ("channel", Topic::Name),
    ("channeltitle", Topic::Name),
    ("unitname", Topic::Unit),
    ("y-axis unit", Topic::Unit),
    ("x-axis unit", Topic::AxisUnit),
    ("x-axis first", Topic::Start),
    ("rate", Topic::Rate),
    ("fs", Topic::Rate),
    ("f_s", Topic::Rate),
    ("sr", Topic::Rate),
    ("fa", Topic::Rate),
    ("frequency", Topic::Rate),
    ("clock", Topic::Rate),
    ("sampling", Topic::Rate),
    ("dt", Topic::Interval),
    ("delta", Topic::Interval),
    ("δt", Topic::Interval),
    ("increment", Topic::Interval),
    ("interval", Topic::Interval),
    ("intervall", Topic::Interval),
    ("period", Topic::Interval),
    ("resolution", Topic::Interval),
    ("step", Topic::Interval),
    ("schrittweite", Topic::Interval),
    ("tick", Topic::Interval),
    ("start", Topic::Start),
    ("x0", Topic::Start),
    ("t0", Topic::Start),
    ("xzero", Topic::Start),
    ("xorg", Topic::Start),
    ("xorigin", Topic::Start),
    ("x origin", Topic::Start),
    ("xstart", Topic::Start),
    ("x start", Topic::Start),
    ("hoffset", Topic::Start),
    ("start offset", Topic::Start),
    ("first sample", Topic::Start),
    ("start time", Topic::Start),
    ("starttime", Topic::Start),
    ("time of first sample", Topic::Start),
    ("date", Topic::Date),
    ("datum", Topic::Date),
    ("time", Topic::Date),
    ("zeit", Topic::Date),
    ("uhrzeit", Topic::Date),
    ("timestamp", Topic::Date),
    ("samples", Topic::Count),
    ("points", Topic::Count),
    ("size", Topic::Count),
    ("blocksize", Topic::Count),
    ("npoints", Topic::Count),
    ("length", Topic::Count),
    ("npts", Topic::Count),
    ("anzahl", Topic::Count),
    ("unit", Topic::Unit),
    ("units", Topic::Unit),
    ("einheit", Topic::Unit),
    ("einheiten", Topic::Unit),
    ("vunit", Topic::Unit),
    ("yunit", Topic::Unit),
    ("yunits", Topic::Unit),
    ("y unit", Topic::Unit),
    ("y_unit_label", Topic::Unit),
    ("vertical units", Topic::Unit),
    ("vertical unit", Topic::Unit),
    ("hunit", Topic::AxisUnit),
    ("xunit", Topic::AxisUnit),
    ("xunits", Topic::AxisUnit),
    ("horizontal units", Topic::AxisUnit),
    ("horizontal unit", Topic::AxisUnit),
    ("x_unit_label", Topic::AxisUnit),
    ("name", Topic::Name),
    ("names", Topic::Name),
    ("tracename", Topic::Name),
    ("source", Topic::Name),
    ("kanal", Topic::Name),
];

/// Words within keys, in the order in which they are looked for.
const WITHIN: [(&str, Topic); 73] = [
    ("axis delta", Topic::Interval),
    ("sample rate", Topic::Rate),
    ("samplerate", Topic::Rate),
    ("sample_rate", Topic::Rate),
    ("sampling rate", Topic::Rate),
    ("samplingrate", Topic::Rate),
    ("sampling_rate", Topic::Rate),
    ("sampling frequency", Topic::Rate),
    ("sample frequency", Topic::Rate),
    ("samplefrequency", Topic::Rate),
    ("sample freq", Topic::Rate),
    ("sampling freq", Topic::Rate),
    ("samples per second", Topic::Rate),
    ("samples/s", Topic::Rate),
    ("abtastrate", Topic::Rate),
    ("abtastfrequenz", Topic::Rate),
    ("messrate", Topic::Rate),
    ("meßrate", Topic::Rate),
    ("messfrequenz", Topic::Rate),
    ("aufzeichnungsrate", Topic::Rate),
    ("scan rate", Topic::Rate),
    ("scanrate", Topic::Rate),
    ("acquisition rate", Topic::Rate),
    ("acq rate", Topic::Rate),
    ("data rate", Topic::Rate),
    ("log rate", Topic::Rate),
    ("logging rate", Topic::Rate),
    ("recording rate", Topic::Rate),
    ("sample interval", Topic::Interval),
    ("sampleinterval", Topic::Interval),
    ("sample_interval", Topic::Interval),
    ("sampling interval", Topic::Interval),
    ("sampling time interval", Topic::Interval),
    ("sampling period", Topic::Interval),
    ("sample period", Topic::Interval),
    ("sampleperiod", Topic::Interval),
    ("sampling time", Topic::Interval),
    ("sample time", Topic::Interval),
    ("sampletime", Topic::Interval),
    ("abtastzeit", Topic::Interval),
    ("abtastintervall", Topic::Interval),
    ("abtastperiode", Topic::Interval),
    ("messintervall", Topic::Interval),
    ("time interval", Topic::Interval),
    ("time increment", Topic::Interval),
    ("time resolution", Topic::Interval),
    ("time step", Topic::Interval),
    ("timestep", Topic::Interval),
    ("timebase interval", Topic::Interval),
    ("zeitschritt", Topic::Interval),
    ("zeitintervall", Topic::Interval),
    ("zeitinkrement", Topic::Interval),
    ("delta t", Topic::Interval),
    ("delta_t", Topic::Interval),
    ("deltat", Topic::Interval),
    ("delta x", Topic::Interval),
    ("delta_x", Topic::Interval),
    ("delta(second)", Topic::Interval),
    ("hresolution", Topic::Interval),
    ("horizontal interval", Topic::Interval),
    ("x increment", Topic::Interval),
    ("xinc", Topic::Interval),
    ("x_inc", Topic::Interval),
    ("tinc", Topic::Interval),
    ("record length", Topic::Count),
    ("recordlength", Topic::Count),
    ("memory length", Topic::Count),
    ("data points", Topic::Count),
    ("number of sampl", Topic::Count),
    ("number of points", Topic::Count),
    ("sample count", Topic::Count),
    ("number of data", Topic::Count),
    ("anzahl der messwerte", Topic::Count),
];

/// Words that make a key be about something else: the highest rate of a device, the rate of a filter.
const NOT: [&str; 9] = [
    "max",
    "min",
    "trigger",
    "filter",
    "video",
    "cutoff",
    "limit",
    "display",
    "vertical scale",
];

impl Entry {
    /// What its key is about.
    #[must_use]
    pub fn topic(&self) -> Option<Topic> {
        topic(&self.key)
    }

    /// Its first value that says anything.
    #[must_use]
    pub fn value(&self) -> Option<&str> {
        self.values
            .iter()
            .map(String::as_str)
            .find(|v| !v.is_empty())
    }
}

/// What a key is about.
#[must_use]
pub fn topic(key: &str) -> Option<Topic> {
    let whole = key.to_lowercase();
    let bare = without_brackets(&whole);
    let exact = EXACT
        .iter()
        .find(|(word, _)| *word == bare || *word == whole);
    if let Some((_, topic)) = exact {
        return Some(*topic);
    }
    if NOT.iter().any(|word| whole.contains(word)) || whole.chars().count() > 60 {
        return None;
    }
    let within = WITHIN.iter().find(|(word, _)| whole.contains(word));
    within.map(|(_, topic)| *topic)
}

fn without_brackets(key: &str) -> &str {
    let end = key.find(['(', '[', '{']).unwrap_or(key.len());
    if end == 0 { key } else { key[..end].trim() }
}

/// The entries of a line: one for its key and values, or one for each cell `key = value`.
#[must_use]
pub fn entries(line: usize, text: &str, dialect: Dialect) -> Vec<Entry> {
    let text = text
        .trim()
        .trim_start_matches(['#', '%', '!', '*', ';', '/'])
        .trim();
    // `Abtastrate = 2,5 kHz` is one value, whatever the table's mark.
    if let Some(entry) = one_cell(line, text).filter(is_quantity) {
        return vec![entry];
    }
    let cells = split(text, dialect);
    // `CH1V,CH2V,t0 =-5e-05, tInc = 1e-09,`: cells of their own.
    let assignments: Vec<Entry> = cells
        .iter()
        .filter_map(|cell| {
            let (key, value) = cell.split_once('=').or_else(|| cell.split_once(": "))?;
            entry(line, key, vec![value.trim().to_owned()])
        })
        .collect();
    if assignments
        .iter()
        .filter(|entry| entry.value().is_some())
        .count()
        > 0
        && (assignments.len() > 1
            || cells.iter().filter(|c| !c.is_empty()).count() == 1
            || !cells[0].contains(['=', ':']))
    {
        return assignments;
    }
    match cells.split_first() {
        Some((key, values)) if values.iter().any(|value| !value.is_empty()) => {
            entry(line, key, values.to_vec()).into_iter().collect()
        }
        _ => one_cell(line, text).into_iter().collect(),
    }
}

/// Whether the value is a number with or without a unit, and nothing else.
fn is_quantity(entry: &Entry) -> bool {
    let Some(text) = entry.value() else {
        return false;
    };
    let is_unit = |c: char| c.is_alphabetic() || matches!(c, '/' | '%' | ' ' | '°' | '²');
    text.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+')
        && quantity(text, b'.').is_some_and(|(_, unit)| unit.chars().all(is_unit))
}

/// `Sampling Frequency - 5000`, `Date: 1.2.2024`, `T0 = 5`.
fn one_cell(line: usize, text: &str) -> Option<Entry> {
    let marks = ["=", ":", " - ", "\t"];
    let (key, value) = marks.iter().find_map(|mark| {
        let (key, value) = text.split_once(mark)?;
        // A path is no key: C:\data\test.txt.
        let is_path = *mark == ":" && (value.starts_with('\\') || value.starts_with('/'));
        (!is_path && !value.trim().is_empty()).then_some((key, value))
    })?;
    entry(
        line,
        key,
        vec![
            value
                .trim()
                .trim_end_matches([':', ';', ','])
                .trim()
                .to_owned(),
        ],
    )
}

fn entry(line: usize, key: &str, values: Vec<String>) -> Option<Entry> {
    let key = key
        .trim()
        .trim_matches('"')
        .trim()
        .trim_end_matches([':', '=', ' '])
        .trim();
    let has_letters = key.chars().any(char::is_alphabetic);
    (has_letters && key.chars().count() <= 80).then(|| Entry {
        line,
        key: key.to_owned(),
        values: values
            .iter()
            .map(|value| {
                value
                    .trim()
                    .trim_matches('"')
                    .trim_start_matches(':')
                    .trim()
                    .to_owned()
            })
            .collect(),
    })
}

/// Cells of a line above a table: its marks may differ from those of the table.
fn split(text: &str, dialect: Dialect) -> Vec<String> {
    let table = match dialect.delimiter {
        Delimiter::Byte(byte) => Some(byte),
        Delimiter::Spaces | Delimiter::None => None,
    };
    let marks = [table, Some(b'\t'), Some(b';'), Some(b',')];
    for mark in marks.into_iter().flatten() {
        let is_decimal = table.is_none() && dialect.decimal == mark;
        if text.contains(char::from(mark)) && !is_decimal {
            let delimiter = Delimiter::Byte(mark);
            return Dialect {
                delimiter,
                ..dialect
            }
            .cells(text);
        }
    }
    vec![text.to_owned()]
}

/// A number with a unit: `1.00E+09 Sa/s`, `20ms`, `1,000 Hz`.
#[must_use]
pub fn quantity(text: &str, decimal: u8) -> Option<(f64, String)> {
    let text = text.trim().trim_matches('"').trim();
    let end = text
        .char_indices()
        .find(|(place, c)| {
            let is_exponent = matches!(c, 'e' | 'E')
                && text[place + 1..]
                    .starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+');
            !(c.is_ascii_digit() || matches!(c, '.' | ',' | '-' | '+' | '\'') || is_exponent)
        })
        .map_or(text.len(), |(place, _)| place);
    let number = text[..end].trim();
    let other = if decimal == b'.' { b',' } else { b'.' };
    let value = [decimal, other]
        .into_iter()
        .find_map(|mark| match Cell::read(number, mark) {
            Cell::Number(value) | Cell::Grouped(value) => Some(value),
            _ => None,
        })?;
    Some((value, text[end..].trim().to_owned()))
}

/// Rates and how many Hz they are.
const RATES: [(&str, f64); 21] = [
    ("hz", 1.0),
    ("khz", 1e3),
    ("mhz", 1e6),
    ("ghz", 1e9),
    ("s/s", 1.0),
    ("sa/s", 1.0),
    ("ks/s", 1e3),
    ("ksa/s", 1e3),
    ("ms/s", 1e6),
    ("msa/s", 1e6),
    ("gs/s", 1e9),
    ("gsa/s", 1e9),
    ("1/s", 1.0),
    ("/s", 1.0),
    ("sps", 1.0),
    ("ksps", 1e3),
    ("msps", 1e6),
    ("samples/s", 1.0),
    ("samples/sec", 1.0),
    ("samples per second", 1.0),
    ("samples/second", 1.0),
];

/// Hertz of a rate or an interval, whichever the unit says; `default_unit` where it says nothing.
fn hertz(value: f64, unit: &str, is_interval: bool) -> Option<f64> {
    let lower = unit
        .trim_end_matches(['.', ':', ';', ','])
        .trim()
        .to_lowercase();
    let rate = RATES.iter().find(|(word, _)| *word == lower);
    if let Some((_, factor)) = rate {
        return Some(value * factor).filter(|hz| *hz > 0.0);
    }
    let seconds = match lower.as_str() {
        "" if is_interval => 1.0,
        "" => return Some(value).filter(|hz| *hz > 0.0),
        "ps" => 1e-12,
        "ns" => 1e-9,
        "us" | "\u{b5}s" | "\u{3bc}s" => 1e-6,
        "ms" => 1e-3,
        "s" => 1.0,
        _ => {
            let unit = units::read(unit)?;
            units::is_time(&unit).then(|| unit.unit.factor())?
        }
    };
    Some(1.0 / (value * seconds)).filter(|hz| hz.is_finite() && *hz > 0.0)
}

/// Rate in Hz that an entry gives for a place among its values (the first that is filled without).
#[must_use]
pub fn rate_hz(entry: &Entry, place: Option<usize>, decimal: u8) -> Option<f64> {
    let is_interval = match entry.topic()? {
        Topic::Rate => false,
        Topic::Interval => true,
        _ => return None,
    };
    let at = match place {
        Some(place) => place,
        None => entry.values.iter().position(|value| !value.is_empty())?,
    };
    let (value, own) = quantity(entry.values.get(at)?, decimal)?;
    let in_key = in_brackets(&entry.key).unwrap_or_default();
    // Sample Interval,4e-10,s
    let next = entry
        .values
        .get(at + 1)
        .filter(|v| quantity(v, decimal).is_none());
    let unit = [Some(own.as_str()), Some(in_key), next.map(String::as_str)]
        .into_iter()
        .flatten()
        .find(|unit| !unit.is_empty() && hertz(1.0, unit, is_interval).is_some())
        .unwrap_or_default();
    if unit.is_empty() && !own.is_empty() {
        return None;
    }
    let hz = hertz(value, unit, is_interval)?;
    // A shorter decimal where the reciprocal of an interval is one but for rounding.
    Some(crate::io::csv::without_rounding(hz)).filter(|hz| hz.is_finite())
}

/// Seconds that an entry gives.
#[must_use]
pub fn seconds(entry: &Entry, place: Option<usize>, decimal: u8) -> Option<f64> {
    let text = match place {
        Some(place) => entry.values.get(place)?.as_str(),
        None => entry.value()?,
    };
    let (value, own) = quantity(text, decimal)?;
    let unit = if own.is_empty() {
        in_brackets(&entry.key).unwrap_or_default()
    } else {
        &own
    };
    match unit {
        "" => Some(value),
        unit => {
            let unit = units::read(unit).filter(units::is_time)?;
            Some(value * unit.unit.factor())
        }
    }
}

fn in_brackets(text: &str) -> Option<&str> {
    [('(', ')'), ('[', ']')]
        .into_iter()
        .find_map(|(open, close)| {
            let start = text.find(open)?;
            let length = text[start..].find(close)?;
            Some(text[start + 1..start + length].trim())
        })
}

/// Date and time of the record as the entries give them.
#[must_use]
pub fn date_text(entries: &[Entry]) -> Option<String> {
    let (mut date, mut time) = (None, None);
    for entry in entries {
        let about = entry.key.to_lowercase();
        let is_date = entry.topic() == Some(Topic::Date)
            || ["date", "time", "datum", "zeit", "start", "t0"]
                .iter()
                .any(|w| about.contains(w));
        if !is_date {
            continue;
        }
        let joined = entry
            .values
            .iter()
            .filter(|v| !v.is_empty())
            .cloned()
            .collect::<Vec<_>>();
        for text in joined.iter().cloned().chain([joined.join(" ")]) {
            match Clock::parse(&text) {
                Some(Clock {
                    day: Some(_),
                    nanoseconds: Some(_),
                }) => return Some(text),
                Some(Clock { day: Some(_), .. }) => date = date.or(Some(text)),
                Some(Clock {
                    nanoseconds: Some(_),
                    ..
                }) => time = time.or(Some(text)),
                _ => {}
            }
        }
    }
    match (date, time) {
        (Some(date), Some(time)) => Some(format!("{date} {time}")),
        (date, time) => date.or(time),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMMA: Dialect = Dialect {
        delimiter: Delimiter::Byte(b','),
        decimal: b'.',
    };

    fn hz(text: &str) -> Option<f64> {
        entries(1, text, COMMA)
            .iter()
            .find_map(|entry| rate_hz(entry, None, b'.'))
    }

    #[test]
    fn rates_and_intervals() {
        for (text, value) in [
            ("Sample rate: 1000 Hz", 1000.0),
            ("# Sample rate: 800000Hz", 8e5),
            ("Abtastrate = 2,5 kHz", 2500.0),
            ("Sampling Frequency - 5000", 5000.0),
            ("\"Sampling Frequency (Hz)=\",500000000,", 5e8),
            ("Sampling time interval(ms),0.5", 2000.0),
            ("Sample Interval,4e-07,s", 2.5e6),
            ("Delta t\t0.001", 1000.0),
            ("CH1V,CH2V,t0 =-5e-05, tInc = 1e-09,", 1e9),
            ("Sampling rate [Hz]:\t5000.000000", 5000.0),
            ("dt=20 ms", 50.0),
            ("HResolution,1.00E-05", 1e5),
            ("Sample Rate,1.00GSa/s", 1e9),
            ("XInc:,5.0E-11", 2e10),
            ("Resolution:1e-10:", 1e10),
        ] {
            let found = hz(text).expect(text);
            assert!((found / value - 1.0).abs() < 1e-12, "{text}: {found}");
        }
        for text in [
            "Max Sample Rate: 5 Hz",
            "Trigger rate,5",
            "Model,DS1052E",
            "Sample rate: auto",
        ] {
            assert_eq!(hz(text), None, "{text}");
        }
    }

    #[test]
    fn dates() {
        let all = |lines: &[&str]| -> Vec<Entry> {
            lines
                .iter()
                .flat_map(|line| entries(1, line, COMMA))
                .collect()
        };
        assert_eq!(
            date_text(&all(&["Date,2013/02/19", "Time,09:51:39.197"])).unwrap(),
            "2013/02/19 09:51:39.197"
        );
        assert_eq!(
            date_text(&all(&["T0 = 05.05.2014 15:24:43"])).unwrap(),
            "05.05.2014 15:24:43"
        );
        assert_eq!(
            date_text(&all(&["Timestamp,2020-03-16 17:04:51"])).unwrap(),
            "2020-03-16 17:04:51"
        );
    }
}
