//! Units at the end of headings: `Force (N)`, `Torque [N m]`, `U / mV`, `bridge_V`.

use torqcomp_model::Unit;

use super::vocabulary::words;
use crate::unit::{NamedUnit, inside_brackets};

/// Name and unit of a heading: `Force (N)`, `Torque [N m]`, `U / mV`, `bridge_V`.
pub fn split(heading: &str) -> (&str, Option<NamedUnit>) {
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
    let ending = words("endings")
        .iter()
        .filter_map(|word| {
            let name = heading.strip_suffix(word.text)?.strip_suffix('_')?;
            (!name.is_empty()).then_some((word.text.len(), name, word.meaning))
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
    let (name, letter) = text.rsplit_once('_')?;
    let lower = text.to_lowercase();
    let mut known = words("endings after words").iter();
    let found = known.find(|word| word.meaning == letter && lower.contains(word.text))?;
    let unit = if found.meaning == "C" {
        "degC"
    } else {
        found.meaning
    };
    Some((name, unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(heading: &str) -> (String, Option<String>) {
        let (name, unit) = split(heading);
        (name.to_owned(), unit.map(|u| u.text))
    }

    #[test]
    fn headings_as_recorders_write_them() {
        for (heading, name, unit) in [
            ("bridge_V", "bridge", Some("V")),
            ("mass_kg", "mass", Some("kg")),
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
}
