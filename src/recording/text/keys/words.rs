//! Words that keys are told by.

use super::Topic;

/// Keys that are about something exactly, in lower case without brackets.
const EXACT: [(&str, Topic); 95] = [
    ("x zero", Topic::Start),
    ("x at 0%", Topic::Start),
    ("x interval", Topic::Interval),
    ("x resolution", Topic::Interval),
    ("x unit", Topic::AxisUnit),
    ("x size", Topic::Count),
    ("nr of points", Topic::Count),
    ("開始時刻", Topic::Start),
    ("日付", Topic::Date),
    ("日時", Topic::Date),
    ("時刻", Topic::Date),
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
    ("x-delta", Topic::Interval),
    ("xdelta", Topic::Interval),
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
const WITHIN: [(&str, Topic); 80] = [
    ("測定間隔", Topic::Interval),
    ("サンプリング周期", Topic::Interval),
    ("サンプリング間隔", Topic::Interval),
    ("サンプリング時間", Topic::Interval),
    ("測定点数", Topic::Count),
    ("データ数", Topic::Count),
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
    ("sec/sample", Topic::Interval),
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

/// Whether a key that can be about the rate is more often about the signal.
#[must_use]
pub fn is_vague(key: &str) -> bool {
    const WORDS: [&str; 4] = ["frequency", "period", "resolution", "step"];
    WORDS.contains(&without_brackets(&key.to_lowercase()))
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
