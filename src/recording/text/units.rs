//! Units and headings as written by recorders, in English, German and some other languages.

use torqcomp_model::{RatioOf, Unit};

use crate::unit::{NamedUnit, factor};

pub use super::axis_names::{
    has_time_word, is_axis_name, is_index_name, is_time_name, is_weak_time_name, spaced, time_stem,
};
use super::heading::split;
use super::vocabulary::{has, meaning};

/// Parses a unit, in brackets or not.
pub fn read(text: &str) -> Option<NamedUnit> {
    let text = unbracketed(text);
    if says_none(text) || text.chars().count() > 24 {
        return None;
    }
    if let Some(unit) = NamedUnit::parse(text) {
        return Some(unit);
    }
    // V (Voltage)
    if let Some((symbol, _)) = text
        .strip_suffix(')')
        .and_then(|text| text.split_once(" ("))
        && let Some(unit) = NamedUnit::parse(symbol)
    {
        return Some(unit);
    }
    let lower = text.to_lowercase();
    // NM, Nm and N.m are torque; nm is a length.
    let known = meaning("units", &lower).filter(|_| lower != "nm" || text.starts_with('N'));
    let meaning = known.or_else(|| meaning("units by case", text))?;
    Some(NamedUnit {
        text: text.to_owned(),
        unit: Unit::parse(meaning).ok()?,
    })
}

/// Whether a text in place of a unit means none.
fn says_none(text: &str) -> bool {
    text.is_empty() || has("no units", &text.to_lowercase()) || is_clock_format(text)
}

/// Whether a text in place of a unit is the format of a date or a time of day: `TT.MM.JJJJ`, `hh:mm:ss.fff`, `mm:ss.0`.
pub fn is_clock_format(text: &str) -> bool {
    let is_mark = |c: char| matches!(c, '.' | ':' | '-' | '/' | ',' | ' ');
    let parts = || text.split(is_mark).filter(|part| !part.is_empty());
    let is_part = |part: &str| {
        let part = part.to_ascii_lowercase();
        let mut letters = part.chars();
        let first = letters.next();
        first.is_some_and(|first| "dtmyjahsf0".contains(first) && letters.all(|c| c == first))
    };
    // m/s is a unit.
    parts().filter(|part| part.len() > 1).count() > 1 && parts().all(is_part)
}

/// A unit as written, if the cell contains one at all.
pub fn as_written(text: &str) -> Option<String> {
    let text = unbracketed(text);
    (!says_none(text) && text.chars().count() <= 40).then(|| text.to_owned())
}

/// Without the brackets around the whole.
fn unbracketed(text: &str) -> &str {
    let text = text.trim().trim_matches('"').trim();
    for (open, close) in [('(', ')'), ('[', ']'), ('{', '}'), ('<', '>')] {
        if let Some(inside) = text.strip_prefix(open).and_then(|t| t.strip_suffix(close)) {
            return inside.trim();
        }
    }
    text
}

/// Whether a text is wholly in brackets.
pub fn is_bracketed(text: &str) -> bool {
    let text = text.trim();
    text.len() > 2 && unbracketed(text).len() < text.len() && !text.starts_with('"')
}

/// Content of a heading.
#[derive(Debug, Clone, PartialEq)]
pub struct Heading {
    /// The name without the unit.
    pub name: String,
    /// The unit, if known.
    pub unit: Option<NamedUnit>,
    /// The unit as written.
    pub unit_text: Option<String>,
}

/// Parses a heading: the formats of [`split`], and `C1 in V`, `U/V`, `Kraft, N`, `Torque Nm`, a
/// unit in brackets before other words, unknown units in square brackets.
pub fn heading(text: &str) -> Heading {
    // "Zeit" t / s
    let unquoted = text.replace('"', "");
    let text = unquoted.trim();
    // In magnitude_V/(N m), the bracket is a part of the unit.
    if let (name, Some(unit)) = split(text)
        && !name.ends_with('/')
    {
        return Heading::new(name.to_owned(), Some(unit), None);
    }
    if let Some((name, inside)) = bracket(text) {
        let is_seconds = inside == "S" && is_time_name(&name);
        let known = read(if is_seconds { "s" } else { inside });
        let unknown = as_written(inside).filter(|_| known.is_none());
        if known.is_some() || unknown.is_some() {
            return Heading::new(name, known, unknown);
        }
        return Heading::new(name, None, None);
    }
    // CH1V, as written by Rigol.
    if let Some((name, unit)) = text.split_at_checked(text.len().saturating_sub(1))
        && matches!(unit, "V" | "A")
        && name
            .strip_prefix("CH")
            .is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    {
        return Heading::new(name.to_owned(), read(unit), None);
    }
    // Temp, °C (LGR S/N: 1, SEN S/N: 2)
    if let Some((front, _)) = text
        .strip_suffix(')')
        .and_then(|text| text.split_once(" ("))
        && let Some((name, unit)) = front.rsplit_once(", ")
        && let Some(unit) = read(unit)
    {
        return Heading::new(name.trim().to_owned(), Some(unit), None);
    }
    // Vitesse tr/min, Torque Nm
    if let Some((name, word)) = text.rsplit_once(' ')
        && (is_speed(word) || has("units after names", word) && can_end_before_unit(name))
        && ![" in", " en", " em", " /", ","]
            .iter()
            .any(|mark| name.ends_with(mark))
        && let Some(unit) = read(word)
    {
        return Heading::new(name.trim().to_owned(), Some(unit), None);
    }
    if let Some((name, unit)) = ratio(text) {
        return Heading::new(name.to_owned(), Some(unit), None);
    }
    for mark in BEFORE_UNITS.into_iter().chain([" / ", "/", ", ", ";"]) {
        if let Some((name, unit)) = text.rsplit_once(mark)
            && read(text).is_none()
            && !name.trim().is_empty()
            && let Some(unit) = read(unit)
        {
            return Heading::new(name.trim().to_owned(), Some(unit), None);
        }
    }
    if let Some(unit) = text.strip_prefix("in ").and_then(read) {
        let name = if unit.is_time() { "time" } else { text };
        return Heading::new(name.to_owned(), Some(unit), None);
    }
    Heading::new(text.to_owned(), time_word(text), None)
}

/// Words between a name and its unit.
const BEFORE_UNITS: [&str; 3] = [" in ", " en ", " em "];

/// Name and unit of a heading that ends in a ratio of voltages or lengths, in a voltage per load, or in a speed or an
/// acceleration, whose slash does not separate a name from a unit: `bridge mV/V`, `eps_µm/m`, `H_V/Nm`, `vel_mm/s`.
fn ratio(text: &str) -> Option<(&str, NamedUnit)> {
    let above = text.rfind('/')?;
    let start = text[..above].trim_end().rfind([' ', '_', ',', ';', ':'])?;
    let unit = read(&text[start + 1..])?;
    let of_motion = ["m/s", "m/s^2", "rad/s", "rad/s^2"].map(Unit::parse);
    let mut of_motion = of_motion.iter().flatten().map(Unit::dimension);
    let is_motion = of_motion.any(|dimension| dimension == unit.unit.dimension());
    let name = text[..start].trim_end_matches([' ', '_', ',', ';', ':']);
    // n_1/min is a speed, but U_1/mV a voltage and t_1/s a time.
    let is_counted = text[start + 1..].starts_with(|c: char| c.is_ascii_digit());
    let is_rate = is_speed(&text[start + 1..]) && !is_time_name(name);
    let is_ratio = matches!(
        unit.unit.ratio_of(),
        Some(RatioOf::Voltages | RatioOf::Lengths)
    ) || is_motion && !is_counted
        || is_rate
        || is_voltage_per_load(name, &text[start + 1..above], &text[above + 1..]);
    let mut words = BEFORE_UNITS.iter().map(|word| word.trim_end());
    let name = words
        .find_map(|word| name.strip_suffix(word))
        .unwrap_or(name);
    (is_ratio && !name.is_empty() && !name.ends_with('/')).then(|| (name.trim(), unit))
}

/// Whether a name is followed by a voltage per force or torque; but `F_V/N` is a force named F_V.
fn is_voltage_per_load(name: &str, above: &str, below: &str) -> bool {
    let is = |text: &str, same: &[&str]| {
        let mut same = same.iter().filter_map(|unit| Unit::parse(unit).ok());
        let unit = read(text);
        unit.is_some_and(|unit| same.any(|same| same.dimension() == unit.unit.dimension()))
    };
    !matches!(name, "F" | "M" | "T") && is(above, &["V"]) && is(below, &["N", "N m"])
}

/// Whether a unit can follow a text: not after a number (`lowpass 100 Hz`, `M/10^-3 Nm`) nor a word that requires more
/// (`mV per Nm`).
fn can_end_before_unit(name: &str) -> bool {
    let last = name.rsplit([' ', '/']).next().unwrap_or_default();
    let number = last.trim_start_matches(['x', '×', '*']);
    let is_number = number.starts_with(|c: char| c.is_ascii_digit());
    let is_open = !last.ends_with(char::is_alphanumeric);
    !is_number && !is_open && !["per", "pro", "at", "bei", "par"].contains(&last)
}

/// Whether a word is a speed, so that its slash does not separate a name from a unit.
fn is_speed(word: &str) -> bool {
    has("speeds", &word.to_lowercase())
}

/// The unit of time within a name of time: `millis`, `Time ms`, `elapsed seconds`.
fn time_word(text: &str) -> Option<NamedUnit> {
    let lower = spaced(text).to_lowercase();
    let mut words = lower
        .rsplit(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty());
    let known = |word: &str| meaning("time units", word);
    let last = words.next()?;
    // ms_since_boot; but whole seconds may be counted, as in second_run.
    let before = || words.filter_map(known).find(|unit| unit.len() == 2);
    let unit = known(last).or_else(before)?;
    let meaning = Unit::parse(unit).ok().filter(|_| is_time_name(text))?;
    Some(NamedUnit {
        text: unit.to_owned(),
        unit: meaning,
    })
}

impl Heading {
    fn new(name: String, unit: Option<NamedUnit>, unknown: Option<String>) -> Self {
        Self {
            // "U_k" U_k
            name: match name.split_once(' ') {
                Some((first, second)) if first == second => first.to_owned(),
                _ => name,
            },
            unit_text: unit.as_ref().map(|unit| unit.text.clone()).or(unknown),
            unit,
        }
    }
}

/// The heading without a bracket that contains a unit, and its content. Square brackets contain
/// units, round ones only known units or non-words.
fn bracket(text: &str) -> Option<(String, &str)> {
    for (open, close) in [('[', ']'), ('(', ')')] {
        for (start, _) in text.match_indices(open) {
            let Some(length) = text[start..].find(close) else {
                continue;
            };
            let inside = text[start + 1..start + length].trim();
            if ratio(text).is_some() && text[..start].ends_with('/') {
                continue;
            }
            let is_at_end = start + length + 1 == text.len();
            let odd = |c: char| matches!(c, '{' | '}' | '(' | '!' | '?' | '$' | ',' | ';' | ':');
            let looks_like_unit = open == '['
                && is_at_end
                && inside.parse::<f64>().is_err()
                && inside.chars().count() <= 16
                && !inside.contains(odd)
                || read(inside).is_some()
                || inside == "S"
                || has("other units", inside)
                || inside.len() <= 8 && inside.contains(['/', '%', '°', '²', '^', 'µ']);
            if looks_like_unit && !inside.is_empty() {
                let rest = [text[..start].trim(), text[start + length + 1..].trim()];
                let name = rest.join(" ").trim().trim_end_matches('/').to_owned();
                return Some((
                    if name.is_empty() {
                        text.to_owned()
                    } else {
                        name
                    },
                    inside,
                ));
            }
        }
    }
    None
}

/// Seconds per unit of time with a factor in a heading: 0.01 for `Zeit [1/100 s]`, `Zeit in 1/100 s`, `Zeit x10ms` and
/// `Time (s) x1e-2`. Not for `Time [s] x 1000`, whose numbers may be milliseconds as well.
pub fn scaled_time(heading: &str) -> Option<f64> {
    let mut parts = heading.split(['[', '(', ']', ')']).skip(1);
    let (inside, behind) = (parts.next(), parts.next());
    let word = || {
        let mut words = heading.split_whitespace();
        words.find(|word| word.starts_with(['x', '×']) && word.len() > 1)
    };
    let named = || {
        let mut marks = BEFORE_UNITS.into_iter().chain(["/"]);
        marks.find_map(|mark| Some(heading.split_once(mark)?.1))
    };
    let unit_of = |text: &str| {
        read(text)
            .filter(NamedUnit::is_time)
            .map(|unit| unit.unit.factor())
    };
    if let Some((factor, unit)) = inside.or_else(word).or_else(named).and_then(factor) {
        return Some(factor * unit_of(unit)?);
    }
    let behind = behind?.trim();
    if !behind.starts_with(['x', '×', '*']) {
        return None;
    }
    let (factor, rest) = factor(behind)?;
    (rest.is_empty() && factor < 1.0).then_some(factor * unit_of(inside?)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> (String, Option<String>, bool) {
        let heading = heading(text);
        (heading.name, heading.unit_text, heading.unit.is_some())
    }

    #[test]
    fn factors_of_units_of_time() {
        for (heading, seconds) in [
            ("Zeit [1/100 s]", 0.01),
            ("Zeit x10ms", 0.01),
            ("Time (50 us)", 50e-6),
            ("Time (1e-3 s)", 1e-3),
            ("Time (x1e-3 s)", 1e-3),
            ("Time (10^-3 s)", 1e-3),
            ("Time (1/20000 s)", 5e-5),
            ("Time (0.1 ms)", 1e-4),
            ("Time (s) x1e-3", 1e-3),
            ("Zeit in 1/1000 s", 1e-3),
            ("t/10^-3 s", 1e-3),
        ] {
            let found = scaled_time(heading).unwrap_or_else(|| panic!("{heading}"));
            assert!((found / seconds - 1.0).abs() < 1e-12, "{heading}: {found}");
        }
        for heading in [
            "Time (s)",
            "time_ms",
            "Time [1/s]",
            "t (run 2)",
            "Time (s) x",
            "Zeit [s] 2",
            "Time (s) x 1000",
            "Time in s",
            "t / s",
        ] {
            assert_eq!(scaled_time(heading), None, "{heading}");
        }
    }

    #[test]
    fn ratios_and_rates_after_a_name() {
        for (text, name, unit) in [
            ("H_V/Nm", "H", "V/Nm"),
            ("magnitude_V/(N m)", "magnitude", "V/(N m)"),
            ("U_mV/N", "U", "mV/N"),
            ("F_V/N", "F_V", "N"),
            ("M/(N m)", "M", "N m"),
            ("speed_1/s", "speed", "1/s"),
            ("t_1/s", "t_1", "s"),
        ] {
            let unit = Some(unit.to_owned());
            assert_eq!(told(text), (name.to_owned(), unit, true), "{text}");
        }
    }

    #[test]
    fn formats_of_clocks_are_no_units() {
        for text in [
            "TT.MM.JJJJ",
            "hh:mm:ss",
            "h:mm:ss",
            "HH:MM:SS.000",
            "mm:ss.0",
            "yyyy-MM-dd hh:mm:ss,fff",
        ] {
            assert!(is_clock_format(text), "{text}");
        }
        for text in ["m/s", "mm/s", "mm", "s", "h:m", "1/min", "Nm", "m.m", ""] {
            assert!(!is_clock_format(text), "{text}");
        }
    }

    #[test]
    fn headings() {
        for (text, name, unit, known) in [
            ("C1 in V", "C1", Some("V"), true),
            ("in s", "time", Some("s"), true),
            ("U/V", "U", Some("V"), true),
            ("\"Zeit\" t / s", "Zeit t", Some("s"), true),
            ("Kraft, N", "Kraft", Some("N"), true),
            (
                "Channel 2;Group 1;°C",
                "Channel 2;Group 1",
                Some("°C"),
                true,
            ),
            ("Temp, °C (S/N: 1, S/N: 2)", "Temp", Some("°C"), true),
            ("Time (s) Run #1", "Time Run #1", Some("s"), true),
            ("Flow [l/min]", "Flow", Some("l/min"), false),
            ("Force (Trigger)", "Force (Trigger)", None, false),
            ("ch1 torq.(P:00A305h)", "ch1 torq.(P:00A305h)", None, false),
            ("Drehzahl [U/min]", "Drehzahl", Some("U/min"), true),
            ("time_s", "time", Some("s"), true),
            ("m/s", "m/s", None, false),
            ("Vitesse en tr/min", "Vitesse", Some("tr/min"), true),
            ("Couple en N.m", "Couple", Some("N.m"), true),
            ("Torque Nm", "Torque", Some("Nm"), true),
            ("Force N", "Force N", None, false),
            ("Lowpass 100 Hz", "Lowpass 100 Hz", None, false),
            ("M/10^-3 Nm", "M/10^-3 Nm", None, false),
            ("M/x0.1 Nm", "M/x0.1 Nm", None, false),
            ("Gain mV per Nm", "Gain mV per Nm", None, false),
            ("Температура, С", "Температура, С", None, false),
            ("Voltage in", "Voltage in", None, false),
            ("Time s", "Time s", Some("s"), true),
            ("Момент, Н·м", "Момент", Some("Н·м"), true),
            ("Temps en s", "Temps", Some("s"), true),
            ("Velocidade em 1/min", "Velocidade", Some("1/min"), true),
            ("Speed r/min", "Speed", Some("r/min"), true),
            ("n / r/min", "n", Some("r/min"), true),
            ("Weg s/mm", "Weg s", Some("mm"), true),
            ("acc_m/s2", "acc", Some("m/s2"), true),
            ("acc m/s2", "acc", Some("m/s2"), true),
            ("vel_mm/s", "vel", Some("mm/s"), true),
            ("vel_mm_s", "vel", Some("mm/s"), true),
            ("omega_deg/s", "omega", Some("deg/s"), true),
            ("n_1/min", "n", Some("1/min"), true),
            ("U_1/mV", "U_1", Some("mV"), true),
            ("F_N/kN", "F_N", Some("kN"), true),
            ("bridge mV/V", "bridge", Some("mV/V"), true),
            ("bridge_mV/V", "bridge", Some("mV/V"), true),
            ("bridge_mv_v", "bridge", Some("mV/V"), true),
            ("Bridge output in mV/V", "Bridge output", Some("mV/V"), true),
            ("S1, uV/V", "S1", Some("uV/V"), true),
            ("bridge [mV/V]", "bridge", Some("mV/V"), true),
            ("eps_µm/m", "eps", Some("µm/m"), true),
            ("U / mV/V", "U", Some("mV/V"), true),
            ("Torque [blorps]", "Torque", Some("blorps"), false),
        ] {
            let want = (name.to_owned(), unit.map(str::to_owned), known);
            assert_eq!(told(text), want, "{text}");
        }
    }

    #[test]
    fn units_of_time_with_a_factor() {
        assert_eq!(scaled_time("Zeit [1/100 s]"), Some(0.01));
        assert_eq!(scaled_time("Zeit x10ms"), Some(0.01));
        assert_eq!(scaled_time("Zeit (2 min)"), Some(120.0));
        for text in ["Zeit [s]", "Time", "Time (1)", "Zeit [1/0 s]", "Zeit x10"] {
            assert_eq!(scaled_time(text), None, "{text}");
        }
        for text in ["ms_since_boot", "millis()", "TimeMs", "timeMillis"] {
            let unit = heading(text).unit.expect(text);
            assert_eq!(unit.unit.factor(), 1e-3, "{text}");
        }
    }
}
