//! What a column's heading says: its name and its unit.

use torqcomp_model::Unit;

use crate::unit::{NamedUnit, inside_brackets};

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Heading as it stands in the file, or `column N` if there is none.
    pub heading: String,
    /// The heading without its unit.
    pub name: String,
    /// The unit, if the file gives one.
    pub unit: Option<NamedUnit>,
}

/// Units that a heading may end in after an underscore: as understood, and other ways to write them.
/// Only these: `motor_in` is not a motor in inches, `position_nm` not a torque.
const SUFFIXES: [&[&str]; 31] = [
    &["s", "sec"],
    &["ms"],
    &["us"],
    &["ns"],
    &["V", "volt", "volts"],
    &["mV"],
    &["uV"],
    &["kV"],
    &["mA"],
    &["N"],
    &["kN"],
    &["mN"],
    &["lbf"],
    &["N m", "Nm", "N_m", "n_m"],
    &["mN m", "mNm", "mN_m"],
    &["kN m", "kNm", "kN_m"],
    &["ft lbf", "ft_lbf", "lbf_ft"],
    &["in lbf", "in_lbf", "lbf_in"],
    &["mm"],
    &["um"],
    &["m/s^2", "m_s2"],
    &["m/s", "m_s"],
    &["Hz"],
    &["kHz"],
    &["rpm"],
    &["rad"],
    &["rad/s", "rad_s"],
    &["deg"],
    &["degC"],
    &["degF"],
    &["ustrain"],
];

/// Headings that stand for time, in lower case.
const TIME_NAMES: [&str; 10] = [
    "t",
    "time",
    "zeit",
    "timestamp",
    "time stamp",
    "elapsed time",
    "elapsed",
    "seconds",
    "secs",
    "rel_time",
];

impl Column {
    /// Reads a heading; `units_row` is the cell below it, if the table has a row of units.
    #[must_use]
    pub fn read(heading: &str, units_row: Option<&str>) -> Self {
        let heading = heading.trim();
        let (name, unit) = split(heading);
        let below = units_row.and_then(NamedUnit::parse);
        Self {
            heading: heading.to_owned(),
            name: if unit.is_some() { name } else { heading }.to_owned(),
            unit: unit.or(below),
        }
    }

    /// The column at a place (from 0) of a table without headings.
    #[must_use]
    pub fn unnamed(place: usize) -> Self {
        let name = format!("column {}", place + 1);
        Self {
            heading: name.clone(),
            name,
            unit: None,
        }
    }

    /// Whether the column holds time, by its name or its unit.
    #[must_use]
    pub fn is_time(&self) -> bool {
        match &self.unit {
            Some(unit) => unit.is_time(),
            None => self.is_named_time(),
        }
    }

    /// Whether the column's name stands for time.
    #[must_use]
    pub fn is_named_time(&self) -> bool {
        TIME_NAMES.contains(&self.name.to_lowercase().as_str())
    }

    /// Whether `wanted` names this column: by its heading or by its name without the unit.
    #[must_use]
    pub fn is_called(&self, wanted: &str) -> bool {
        self.heading == wanted || self.name == wanted
    }
}

/// Name and unit of a heading: `Force (N)`, `Torque [N m]`, `U / mV`, `bridge_V`.
fn split(heading: &str) -> (&str, Option<NamedUnit>) {
    if let Some((name, inside)) = inside_brackets(heading)
        && let Some(unit) = NamedUnit::parse(inside)
    {
        return (name, Some(unit));
    }
    if let Some((name, unit)) = heading.split_once(" / ")
        && let Some(unit) = NamedUnit::parse(unit)
    {
        return (name.trim(), Some(unit));
    }
    // The longest suffix wins: `accel_m_s` does not end in seconds.
    let ending = SUFFIXES
        .iter()
        .flat_map(|ways| ways.iter().map(|way| (*way, ways[0])))
        .filter_map(|(way, meaning)| {
            let name = heading.strip_suffix(way)?.strip_suffix('_')?;
            (!name.is_empty()).then_some((way.len(), name, meaning))
        })
        .max_by_key(|(length, ..)| *length);
    if let Some((_, name, meaning)) = ending
        && let Ok(unit) = Unit::parse(meaning)
    {
        let text = meaning.to_owned();
        return (name, Some(NamedUnit { text, unit }));
    }
    if let Some((name, unit)) = suffixed(heading) {
        return (name, NamedUnit::parse(unit));
    }
    (heading, None)
}

/// A unit of one letter after an underscore, where the name says that it is meant: `position_m` and
/// `motor_current_A`, but not `arm_m` and `phase_A`.
fn suffixed(text: &str) -> Option<(&str, &'static str)> {
    const WORDS: [(&str, &str, &[&str]); 4] = [
        (
            "_m",
            "m",
            &[
                "position",
                "displacement",
                "distance",
                "length",
                "height",
                "stroke",
                "weg",
            ],
        ),
        ("_A", "A", &["current", "strom"]),
        ("_K", "K", &["temperature", "temperatur"]),
        ("_C", "degC", &["temperature", "temperatur"]),
    ];
    let lower = text.to_lowercase();
    WORDS.iter().find_map(|(suffix, unit, words)| {
        let name = text.strip_suffix(suffix)?;
        words
            .iter()
            .any(|word| lower.contains(word))
            .then_some((name, *unit))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(heading: &str) -> (String, Option<String>) {
        let column = Column::read(heading, None);
        (column.name, column.unit.map(|u| u.text))
    }

    #[test]
    fn headings_as_recorders_write_them() {
        for (heading, name, unit) in [
            ("bridge_V", "bridge", Some("V")),
            ("Torque [N m]", "Torque", Some("N m")),
            ("Force (N)", "Force", Some("N")),
            ("Time(s)", "Time", Some("s")),
            ("time_s", "time", Some("s")),
            ("torque_n_m", "torque", Some("N m")),
            ("torque_ft_lbf", "torque", Some("ft lbf")),
            ("v1_in_V", "v1_in", Some("V")),
            ("U / mV", "U", Some("mV")),
            ("strain [µm/m]", "strain", Some("µm/m")),
            ("motor_in", "motor_in", None),
            ("position_nm", "position_nm", None),
            ("phase_A", "phase_A", None),
            ("accel_m_s2", "accel", Some("m/s^2")),
            ("hit_1", "hit_1", None),
            ("arm_m", "arm_m", None),
            ("measured_position_m", "measured_position", Some("m")),
            ("motor_current_A", "motor_current", Some("A")),
            ("Low G Accel", "Low G Accel", None),
            (
                "163.05 NAIO-03 ch1 torq.(P:00A305h)",
                "163.05 NAIO-03 ch1 torq.(P:00A305h)",
                None,
            ),
            ("Voltage (unscaled)", "Voltage (unscaled)", None),
        ] {
            assert_eq!(
                read(heading),
                (name.to_owned(), unit.map(str::to_owned)),
                "{heading}"
            );
        }
    }

    #[test]
    fn every_suffix_is_a_unit() {
        for ways in SUFFIXES {
            assert!(Unit::parse(ways[0]).is_ok(), "{}", ways[0]);
        }
    }

    #[test]
    fn units_row_fills_in() {
        let column = Column::read("Force", Some(" (kN) "));
        assert_eq!(column.unit.unwrap().text, "kN");
        let column = Column::read("SG_300_a", Some("Voltage (unscaled)"));
        assert_eq!(column.unit, None);
    }

    #[test]
    fn time_is_told_by_name_or_unit() {
        for heading in ["time_s", "Time", "t", "Zeit [ms]", "X (s)", "Time [s]"] {
            assert!(Column::read(heading, None).is_time(), "{heading}");
        }
        for heading in ["temperature", "tension_N", "time_V"] {
            assert!(!Column::read(heading, None).is_time(), "{heading}");
        }
        assert!(Column::read("Time", Some("Sec")).is_time());
    }
}
