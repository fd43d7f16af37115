//! Names of columns with time, the horizontal axis, or the sample number.

use super::vocabulary::has;

/// Whether a name means time, or the axis that is time in a recorder's export.
pub fn is_time_name(name: &str) -> bool {
    // Us and Ms are a voltage and a torque.
    if is_weak_time_name(name) || matches!(name.trim(), "Us" | "Ms") {
        return false;
    }
    let lower = spaced(name).to_lowercase();
    let words: Vec<&str> = lower
        .split(|c: char| !c.is_alphanumeric() && c != '%')
        .filter(|word| !word.is_empty())
        .collect();
    let is = |word: &str| {
        let stem = word
            .trim_start_matches('%')
            .trim_end_matches(|c: char| c.is_ascii_digit());
        let is_compound = (stem.ends_with("zeit") || stem.ends_with("time"))
            && !["lifetime", "risetime", "deadtime", "totzeit", "overtime"].contains(&stem);
        // t5 next to other words is not time.
        let is_known = has("time", stem) && (stem != "t" || word == "t");
        is_known || is_compound
    };
    match words.as_slice() {
        [] => false,
        [one] => is(one),
        // header.stamp.nanosec, /joint_states/header/stamp
        [.., "stamp", last] if is(last) => true,
        [.., "header", "stamp"] => true,
        // "elapsed time", "rel_time", "time stamp", "Date/Time", "Time 1 - default sample rate".
        [first, .., last] => {
            let first_is = is(first) && *first != "t" && *first != "second";
            first_is && !["constant", "delay", "konstante"].contains(last)
                || has("before time", first) && is(last)
        }
    }
}

/// A name with a space inserted before a unit of time joined to time: `TimeMs`, `timeMillis`.
pub fn spaced(name: &str) -> String {
    const UNITS: [&str; 9] = [
        "Ms", "MS", "Us", "US", "Ns", "Millis", "Micros", "Sec", "Seconds",
    ];
    let name = name.trim();
    let parts = UNITS.iter().find_map(|unit| {
        let front = name.strip_suffix(unit)?;
        let is_time = ["time", "zeit", "timestamp"].contains(&front.to_lowercase().as_str());
        is_time.then(|| format!("{front} {unit}"))
    });
    parts.unwrap_or_else(|| name.to_owned())
}

/// Whether a name means time or a temperature or torque, like `T`, `T1` and `t2`: position and values
/// must decide.
pub fn is_weak_time_name(name: &str) -> bool {
    let name = name.trim();
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    stem == "T" || stem == "t" && stem.len() < name.len()
}

/// The word in a name that means time, in lower case and without digits, common to time columns that
/// belong together, like `Time1` and `Time2`.
pub fn time_stem(name: &str) -> Option<String> {
    let is_word = |c: char| c.is_alphanumeric() || c == '%';
    let lower = name.to_lowercase();
    let stem = |word: &str| {
        word.trim_start_matches('%')
            .trim_end_matches(|c: char| c.is_ascii_digit())
            .to_owned()
    };
    lower
        .split(|c: char| !is_word(c))
        .filter(|word| !word.is_empty())
        .find(|word| is_time_name(word) || is_weak_time_name(word))
        .map(stem)
}

/// Whether a word of a name means time: `Torque_Time`, `torque.time`, `t_Torque`.
pub fn has_time_word(name: &str) -> bool {
    let mut words = name.split(|c: char| !c.is_alphanumeric());
    words.any(is_time_name)
}

/// Whether a name means the horizontal axis, which is time unless the file says otherwise.
pub fn is_axis_name(name: &str) -> bool {
    has("axis", name.trim().to_lowercase().as_str())
}

/// Whether a name means a sample index.
pub fn is_index_name(name: &str) -> bool {
    let name = name.trim().trim_matches('"').to_lowercase();
    // Nummer n, Index i
    let with_symbol = name
        .strip_suffix(['n', 'i'])
        .and_then(|name| name.strip_suffix(' '));
    has("index", &name) || with_symbol.is_some_and(|name| has("index", name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_time() {
        for name in [
            "t",
            "Time",
            "Zeit",
            "Elapsed Time",
            "Time Stamp",
            "Zeit  1 - Standardmessrate",
            "TIMESTAMP",
            "Date/Time",
            "Time1",
            "rel_time",
            "%time",
            "Uhrzeit",
            "Time 1",
            "TimeMs",
            "ms_since_boot",
            "millis()",
            "stamp",
            "header.stamp",
            "/joint_states/header/stamp",
            "header.stamp.nanosec",
            "nsecs",
        ] {
            assert!(is_time_name(name), "{name}");
        }
        for name in [
            "temperature",
            "Torque",
            "Timer setting",
            "t_ambient",
            "Time constant",
            "X",
            "T",
            "T5",
            "t1",
            "T5 ambient",
            "Us",
        ] {
            assert!(!is_time_name(name), "{name}");
        }
    }
}
