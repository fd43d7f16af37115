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
    if let Some((name, unit)) = per(heading) {
        return (if unit.is_some() { name } else { heading }, unit);
    }
    if let Some((name, meaning)) = ending(heading).or_else(|| suffixed(heading))
        && let Ok(unit) = Unit::parse(meaning)
    {
        let text = meaning.to_owned();
        return (name, Some(NamedUnit { text, unit }));
    }
    (heading, None)
}

/// Name and unit of a heading with an underscore; the longest unit, since `accel_m_s` does not end in seconds.
fn ending(heading: &str) -> Option<(&str, &'static str)> {
    let before = |text: &str, unit: &str| Some(text.strip_suffix(unit)?.strip_suffix('_')?.len());
    // torque_N mm, torque_ft-lbf
    let plain = heading.rsplit_once('_').map(|(name, unit)| {
        let is_mark = |c: char| matches!(c, ' ' | '-' | '.' | '*' | '·' | '⋅');
        format!("{name}_{}", unit.replace(is_mark, ""))
    });
    let known = words("endings").iter().filter_map(|word| {
        let of_plain = || before(plain.as_deref()?, word.text);
        let end = before(heading, word.text).or_else(of_plain)?;
        (end > 0).then_some((word.text.len(), &heading[..end], word.meaning))
    });
    let (_, name, meaning) = known.max_by_key(|(length, ..)| *length)?;
    Some((name, meaning))
}

/// Name and unit of a heading that ends in a ratio in words: `bridge_uV_per_V`. Without a unit if the ratio is none, as in
/// `bridge_per_V`, whose last letters alone are not its unit.
fn per(heading: &str) -> Option<(&str, Option<NamedUnit>)> {
    let (front, below) = heading.rsplit_once("_per_")?;
    let (name, above) = front.rsplit_once('_').unwrap_or(("", front));
    let is_unit = Unit::parse(below).is_ok();
    let unit = NamedUnit::parse(&format!("{above}/{below}"));
    is_unit.then_some((name, unit.filter(|_| !name.is_empty())))
}

/// A unit after an underscore that is ambiguous, if the name confirms it: `position_m` and `motor_current_A`,
/// but not `arm_m` and `phase_A`.
fn suffixed(text: &str) -> Option<(&str, &'static str)> {
    let (name, letters) = text.rsplit_once('_')?;
    let lower = name.to_lowercase();
    let mut known = words("endings after words").iter();
    let found = known.find(|word| word.meaning == letters && lower.contains(word.text))?;
    let unit = match found.meaning {
        "C" => "degC",
        "nm" => "N m",
        letters => letters,
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
            ("torque_nm", "torque", Some("N m")),
            ("torque_N mm", "torque", Some("N mm")),
            ("torque_Nmm", "torque", Some("N mm")),
            ("torque_mNm", "torque", Some("mN m")),
            ("torque_mN m", "torque", Some("mN m")),
            ("torque_N·m", "torque", Some("N m")),
            ("torque_lbft", "torque", Some("ft lb")),
            ("torque_ft-lbs", "torque", Some("ft lb")),
            ("torque_ft_lb", "torque", Some("ft lb")),
            ("torque_ft-lbf", "torque", Some("ft lbf")),
            ("torque_oz_in", "torque", Some("in oz")),
            ("test_mass_g", "test_mass", Some("g")),
            ("accel_g", "accel_g", None),
            ("force_lb", "force", Some("lb")),
            ("wheel_lb", "wheel_lb", None),
            ("sensor_a", "sensor_a", None),
            ("motor_m", "motor_m", None),
            ("channel_n", "channel_n", None),
            ("motor_N.s", "motor_N.s", None),
            ("phase_A", "phase_A", None),
            ("accel_m_s2", "accel", Some("m/s^2")),
            ("angle_rev", "angle", Some("rev")),
            ("shaft_position_rev", "shaft_position", Some("rev")),
            ("firmware_rev", "firmware_rev", None),
            ("speed_rev_s", "speed", Some("rev/s")),
            ("speed_rev/min", "speed", Some("rev/min")),
            ("accel_rad_s2", "accel", Some("rad/s^2")),
            ("speed_deg_s", "speed", Some("deg/s")),
            ("hit_1", "hit_1", None),
            ("bridge_mV_per_V", "bridge", Some("mV/V")),
            ("bridge_uV_per_V", "bridge", Some("uV/V")),
            ("speed_rad_per_s", "speed", Some("rad/s")),
            ("samples_per_s", "samples_per_s", None),
            ("bridge_per_V", "bridge_per_V", None),
            ("pulses_per_rev", "pulses_per_rev", None),
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
